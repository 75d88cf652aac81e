//! Models that are composed at run time: the registry of parts, their TOML, the composed
//! [`model::Model`], its simulation, its regressions, and the loops that use it.
//!
//! What a plant, an effect, an estimator, a controller and a driver are is said in
//! [`loopsight_core`].

pub mod affine;
mod attach;
pub mod config;
mod configured;
mod declare;
mod dual;
pub mod excitation;
pub mod expression;
pub mod identification;
pub mod limits;
pub mod log_map;
pub mod loop_file;
pub mod model;
mod observe;
mod pseudo_inverse;
pub mod registry;
pub mod regression;
pub mod run;
pub mod sensor;
pub mod simulate;
pub mod supervisor;
mod values;

pub use dual::{DUAL_WIDTH, Dual, derivative, variable};

#[doc(hidden)]
pub mod __private {
    pub use inventory;
    pub use loopsight_core;
    pub use serde;
    pub use typetag;
}
