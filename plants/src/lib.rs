//! Plants, one file each, and the physical effects that can be added to them in [`effects`].
//!
//! A plant or an effect declared here is known everywhere (TOML, listings, fits, reports) without
//! anything else being touched. A program that wants them says `use loopsight_plants as _;`.

#![cfg_attr(not(feature = "std"), no_std)]

mod arm;
mod cart_pole;
mod dc_axis;
mod ddmr;
pub mod effects;
mod motor;
mod oscillator;
mod servo_axis;
mod tank_pair;

#[cfg(not(feature = "std"))]
use loopsight_core::{declare_effect, declare_plant};
#[cfg(feature = "std")]
use loopsight_model::{declare_effect, declare_plant};

pub use arm::Arm;
pub use cart_pole::CartPole;
pub use dc_axis::DcAxis;
pub use ddmr::Ddmr;
pub use oscillator::Oscillator;
pub use servo_axis::ServoAxis;
pub use tank_pair::TankPair;
