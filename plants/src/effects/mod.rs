//! Physical effects, one file each: what a model may be missing.

mod coulomb_friction;
mod input_delay;

pub use coulomb_friction::CoulombFriction;
pub use input_delay::InputDelay;
