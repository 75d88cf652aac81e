//! Controllers, one file each.
//!
//! A controller is written once, generic over the scalar and the number of channels: `Const<N>`
//! runs without an allocator, `Dyn` serves the TOML on a host with the same code. A program that
//! wants them in its TOML says `use loopsight_controllers as _;`.

#![cfg_attr(not(feature = "std"), no_std)]

#[cfg(feature = "std")]
mod at_rest;
mod clipped;
mod feedback_linearizing_pi;
mod mixing;
mod mrac;
#[cfg(feature = "std")]
mod per_channel;
mod pi_response;
mod pid;
mod sampled_pi;
mod solve;
mod trajectory;

#[cfg(feature = "std")]
pub use feedback_linearizing_pi::FeedbackLinearizingPiSettings;
pub use feedback_linearizing_pi::{DesignError, FeedbackLinearizingPi};
pub use mixing::Mixing;
#[cfg(feature = "std")]
pub use mrac::MracSettings;
pub use mrac::{Mrac, MracDesign};
#[cfg(feature = "std")]
pub use per_channel::PerChannel;
pub use pi_response::{PiResponse, Rule, SETTLED, gains, overshoot, settling_time};
#[cfg(feature = "std")]
pub use pid::PidSettings;
pub use pid::{Pid, PidGains};
pub use sampled_pi::SampledPi;
pub use solve::{Singular, solve};
#[cfg(feature = "std")]
pub use trajectory::TrajectorySettings;
pub use trajectory::{Goal, Path, Trajectory};
