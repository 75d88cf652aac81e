//! Controllers, one file each.
//!
//! A controller is written once, generic over the scalar and the number of channels: `Const<N>`
//! runs without an allocator, `Dyn` serves the TOML on a host with the same code. A program that
//! wants them in its TOML says `use loopsight_controllers as _;`.

#![cfg_attr(not(feature = "std"), no_std)]

mod feedback_linearizing_pi;
mod pi_response;
mod sampled_pi;
mod solve;

pub use feedback_linearizing_pi::{DesignError, FeedbackLinearizingPi};
#[cfg(feature = "std")]
pub use feedback_linearizing_pi::{FeedbackLinearizingPiSettings, PerChannel};
pub use pi_response::{PiResponse, Rule, SETTLED, gains, overshoot, settling_time};
pub use sampled_pi::SampledPi;
pub use solve::{Singular, solve};
