//! Recursive estimators: they learn the parameters of a linear regression from one sample after the other.
//!
//! ```text
//! y = φᵀθ + noise
//! ```
//!
//! | estimator | what | reach for it when |
//! |---|---|---|
//! | [`Rls`] | recursive least squares, with constant, variable or directional forgetting | parameters are constant or change slowly |
//! | [`Kalman`] | a Kalman filter for parameters that walk at random | parameters drift, each on its own |
//! | [`Lms`] | normalised least mean squares with leakage | every instruction counts |
//!
//! Each implements [`loopsight_core::Estimator`]. [`loopsight_core::learning::Guarded`] guards any of them with
//! scales, ranges, a dead zone, and freezing where nothing is excited. Here a gain and a damping are learned under
//! that guard:
//!
//! ```
//! use loopsight_core::learning::{Guarded, Guards, Range};
//! use loopsight_estimators::{Rls, RlsSettings};
//! use nalgebra::SVector;
//!
//! let rls = Rls::new(SVector::<f64, 2>::zeros(), &RlsSettings::default())?;
//! let ranges = [
//!     Range { low: -50.0, high: 0.0, scale: 1.0 }, // damping, 1/s
//!     Range { low: 0.01, high: 10.0, scale: 0.1 }, // gain
//! ];
//! let start = SVector::from([-5.0, 1.0]);
//! let mut learned = Guarded::new(rls, start, &ranges, Guards::default()).ok_or("unusable ranges")?;
//! let mut speed = 0.0;
//! for k in 0..500 {
//!     let input = if k % 50 < 25 { 6.0 } else { -6.0 };
//!     let rate = -12.0 * speed + 0.7 * input;
//!     learned.update(&[speed, input], rate, None);
//!     speed += 0.01 * rate;
//! }
//! assert!((learned.theta()[0] + 12.0).abs() < 1e-3);
//! assert!((learned.theta()[1] - 0.7).abs() < 1e-4);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! An estimator is generic over the scalar and the number of parameters. `Const<N>` runs without an allocator,
//! `Dyn` on a host runs the same code to the same digits.
//!
//! | feature | what it adds |
//! |---|---|
//! | `std` (default) | tables in TOML, `[estimator.rls]` and its like, and their lines in the registry of `loopsight-model` |
//!
//! Without `std` nothing here allocates. A program that wants the estimators in its TOML says
//! `use loopsight_estimators as _;`, unless it depends on the crate `loopsight`, which does.

#![cfg_attr(not(feature = "std"), no_std)]

mod estimate;
mod factor;
mod kalman;
mod lms;
mod rls;

pub use kalman::{Kalman, KalmanError, KalmanSettings};
pub use lms::{Lms, LmsError, LmsSettings};
pub use rls::{Forgetting, Rls, RlsError, RlsSettings};
