//! Plants, and the physical effects that a plain model of them may lack.
//!
//! A **plant** is a machine: its states, inputs and parameters as data, and its equations. An **effect** is
//! physics that is added at a channel of a plant: friction at a wheel, a delay at an input, a lag at a sensor.
//! Each is one file. It begins with the equation, the symbols with their units, the assumptions and the
//! source.
//!
//! | plant | what |
//! |---|---|
//! | [`Ddmr`] | a differential-drive robot with two motors |
//! | [`DcAxis`] | a DC motor with a load, turning or on a slide |
//! | [`Arm`] | a joint that lifts a load |
//! | [`ServoAxis`] | a slide, seen through its position control |
//! | [`Oscillator`] | a mass on a spring |
//! | [`TankPair`] | two tanks, one emptying into the other |
//! | [`CartPole`] | a pole on a cart |
//! | [`FlexibleJoint`] | a motor and a load with a spring between them |
//! | [`TorqueAxis`] | a joint driven by a torque or a current |
//! | [`Thermal`] | a heater and the body that it warms |
//! | [`RotaryPendulum`] | a pendulum at the end of an arm that turns |
//! | [`PropellerPendulum`] | a pendulum that a fan lifts |
//!
//! The effects are in [`effects`].
//!
//! The equations are generic over the scalar. The same lines run on a microcontroller in `f32`, in a
//! simulation in `f64`, and in a fit with exact derivatives. Here a robot with dry friction drives for a second:
//!
//! ```
//! use loopsight_core::{Effect, Plant, Reading, Role, rk4_step};
//! use loopsight_plants::Ddmr;
//! use loopsight_plants::effects::CoulombFriction;
//!
//! // K_A … K_F, half track and wheel radius, as `Ddmr::META` declares them.
//! let p = [-15.146, 0.005, 0.136, -9.573, -3.945, 0.656, 0.131, 0.05];
//! let volts = [6.0, 5.0];
//! let mut x = [0.0f64; 6];
//! for _ in 0..400 {
//!     rk4_step(&mut x, 0.0025, |x| {
//!         let friction = |wheel: usize| {
//!             let speed = Ddmr::output(wheel, x, &volts, &p);
//!             let at = Reading::nothing().with(Role::Flow, &speed);
//!             CoulombFriction::contribution(&at, &[], &[0.9, 0.3])
//!         };
//!         let w = [friction(0), friction(1), 0.0, 0.0];
//!         Ddmr::derivative(x, &volts, &w, &p)
//!     });
//! }
//! let [speed, yaw_rate, ..] = x;
//! assert!((speed - 0.083).abs() < 1e-3 && yaw_rate > 0.06);
//! ```
//!
//! | feature | what it adds |
//! |---|---|
//! | `std` (default) | each part is in the registry of `loopsight-model`: it has a table in TOML, and listings, fits, diagnoses and pages know it |
//!
//! Without `std` nothing here allocates. A program that wants the parts in its TOML says
//! `use loopsight_plants as _;`, unless it depends on the crate `loopsight`, which does.

#![cfg_attr(not(feature = "std"), no_std)]

mod arm;
mod cart_pole;
mod dc_axis;
mod ddmr;
pub mod effects;
mod flexible_joint;
mod motor;
mod oscillator;
mod places;
mod propeller_pendulum;
mod rotary_pendulum;
mod servo_axis;
mod tank_pair;
mod thermal;
mod torque_axis;

#[cfg(not(feature = "std"))]
use loopsight_core::{declare_effect, declare_plant};
#[cfg(feature = "std")]
use loopsight_model::{declare_effect, declare_plant};

pub use arm::Arm;
pub use cart_pole::CartPole;
pub use dc_axis::DcAxis;
pub use ddmr::Ddmr;
pub use flexible_joint::FlexibleJoint;
pub use oscillator::Oscillator;
pub use propeller_pendulum::PropellerPendulum;
pub use rotary_pendulum::RotaryPendulum;
pub use servo_axis::ServoAxis;
pub use tank_pair::TankPair;
pub use thermal::Thermal;
pub use torque_axis::TorqueAxis;
