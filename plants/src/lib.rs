//! Plants, one file each, and the physical effects that can be added to them in [`effects`].
//!
//! A plant or an effect declared here is known everywhere (TOML, listings, fits, reports) without
//! anything else being touched. A program that wants them says `use loopsight_plants as _;`.

#![cfg_attr(not(feature = "std"), no_std)]

mod cart_pole;
mod dc_axis;
mod ddmr;
pub mod effects;

pub use cart_pole::CartPole;
pub use dc_axis::DcAxis;
pub use ddmr::Ddmr;
