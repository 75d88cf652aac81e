//! Recursive estimators, one file each.
//!
//! An estimator is written once, generic over the scalar and the number of parameters: `Const<N>`
//! runs without an allocator, `Dyn` on a host runs the same code to the same digits. A program
//! that wants them in its TOML says `use loopsight_estimators as _;`.

#![cfg_attr(not(feature = "std"), no_std)]

mod estimate;
mod factor;
mod kalman;
mod lms;
mod rls;

pub use kalman::{Kalman, KalmanError, KalmanSettings};
pub use lms::{Lms, LmsError, LmsSettings};
pub use rls::{Forgetting, Rls, RlsError, RlsSettings};
