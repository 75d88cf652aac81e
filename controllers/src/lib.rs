//! Control laws: from a reference, a measurement and a model to a command.
//!
//! | law | what |
//! |---|---|
//! | [`FeedbackLinearizingPi`] | inverts the model, and puts a PI law around each integrator that is left |
//! | [`Pid`] | PID with two degrees of freedom and anti-windup |
//! | [`Trajectory`] | follows a path, around a velocity loop of any kind |
//! | [`Mrac`] | model reference adaptive control with leakage |
//!
//! Each implements [`loopsight_core::Controller`]. A law sees its plant as [`loopsight_core::AffineModel`],
//! `dy/dt = f(y) + G(y) u`, and knows no effect. Here a slide is brought to 0.2 m/s:
//!
//! ```
//! use loopsight_controllers::FeedbackLinearizingPi;
//! use loopsight_core::{AffineModel, Controller, Tick};
//! use nalgebra::Vector1;
//!
//! /// `v' = -3 v + 0.5 F`
//! struct Slide;
//!
//! impl AffineModel<f64> for Slide {
//!     fn size(&self) -> usize {
//!         1
//!     }
//!     fn evaluate(&mut self, y: &[f64], drift: &mut [f64], input_matrix: &mut [f64]) {
//!         drift[0] = -3.0 * y[0];
//!         input_matrix[0] = 0.5;
//!     }
//! }
//!
//! let (gain, integral, limit) = (Vector1::new(8.0), Vector1::new(16.0), Vector1::new(10.0));
//! let mut law = FeedbackLinearizingPi::<f64, _>::new(&gain, &integral, &limit, 0.01)?;
//! let (mut speed, mut force) = (0.0, [0.0]);
//! for index in 0..300 {
//!     let tick = Tick { index, time: 0.01 * index as f64, period: 0.01 };
//!     law.step(&tick, &[0.2], &[speed], &mut Slide, &mut force)?;
//!     speed += 0.01 * (-3.0 * speed + 0.5 * force[0]);
//! }
//! assert!((speed - 0.2).abs() < 1e-3);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! A law is generic over the scalar and the number of channels. `Const<N>` runs without an allocator, `Dyn` on a
//! host runs the same code to the same digits.
//!
//! | feature | what it adds |
//! |---|---|
//! | `std` (default) | tables in TOML, `[controller.pid]` and its like, and their lines in the registry of `loopsight-model` |
//!
//! Without `std` nothing here allocates. A program that wants the laws in its TOML says
//! `use loopsight_controllers as _;`, unless it depends on the crate `loopsight`, which does.

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
