//! Physical effects, one file each: what a model may be missing.

mod battery_sag;
mod centrifugal_offset;
mod constant_force;
mod coulomb_friction;
mod cubic_stiffness;
mod dead_zone;
mod directional_friction;
mod gain_asymmetry;
mod gravity_pendulum;
mod gravity_slope;
mod input_delay;
mod input_offset;
mod input_saturation;
mod linear_stiffness;
mod quadratic_drag;
mod scrub_friction;
mod sensor_delay;
mod sensor_offset;
mod sensor_scale;
mod stribeck_friction;
#[cfg(test)]
mod testing;
mod viscous_friction;
mod wheel_radius_mismatch;

pub use battery_sag::BatterySag;
pub use centrifugal_offset::CentrifugalOffset;
pub use constant_force::ConstantForce;
pub use coulomb_friction::CoulombFriction;
pub use cubic_stiffness::CubicStiffness;
pub use dead_zone::DeadZone;
pub use directional_friction::DirectionalFriction;
pub use gain_asymmetry::GainAsymmetry;
pub use gravity_pendulum::GravityPendulum;
pub use gravity_slope::GravitySlope;
pub use input_delay::InputDelay;
pub use input_offset::InputOffset;
pub use input_saturation::InputSaturation;
pub use linear_stiffness::LinearStiffness;
pub use quadratic_drag::QuadraticDrag;
pub use scrub_friction::ScrubFriction;
pub use sensor_delay::SensorDelay;
pub use sensor_offset::SensorOffset;
pub use sensor_scale::SensorScale;
pub use stribeck_friction::StribeckFriction;
pub use viscous_friction::ViscousFriction;
pub use wheel_radius_mismatch::WheelRadiusMismatch;
