//! The vocabulary of loopsight: what a plant, an effect, an estimator, a controller and a driver
//! are, how they are integrated in time, and the tick of the loop that runs them.
//!
//! Two views of one component live here:
//!
//! * the **static view** ([`Plant`], [`Effect`]): what an author writes once, generic over the
//!   scalar ([`Real`]), with fixed sizes, without `std` and without an allocator;
//! * the **dynamic view** ([`Dynamics`], [`Physics`]): the same mathematics behind slices, object
//!   safe, made from the static view by [`declare_plant!`] and [`declare_effect!`].
//!
//! With the feature `std` the registry (typetag), the TOML composition ([`config`]), the composed
//! [`model::Model`] and its simulation are added. Without it nothing here allocates.

#![cfg_attr(not(feature = "std"), no_std)]

mod channel;
mod clock;
mod controller;
mod derived;
mod driver;
#[cfg(feature = "std")]
mod dual;
mod effect;
mod estimator;
mod integrator;
pub mod learning;
pub mod limits;
mod parameter;
mod plant;
mod real;
mod signal;
pub mod supervisor;
mod tanh;
mod tick;
pub mod unit;

#[cfg(feature = "std")]
mod affine;
#[cfg(feature = "std")]
mod attach;
#[cfg(feature = "std")]
pub mod config;
#[cfg(feature = "std")]
mod configured;
#[cfg(feature = "std")]
pub mod excitation;
#[cfg(feature = "std")]
pub mod expression;
#[cfg(feature = "std")]
pub mod identification;
#[cfg(feature = "std")]
pub mod loop_file;
#[cfg(feature = "std")]
pub mod model;
#[cfg(feature = "std")]
mod observe;
#[cfg(feature = "std")]
pub mod registry;
#[cfg(feature = "std")]
pub mod regression;
#[cfg(feature = "std")]
pub mod run;
#[cfg(feature = "std")]
pub mod sensor;
#[cfg(feature = "std")]
pub mod simulate;

pub use channel::{Channel, Place, PlaceKind, Reads, Role};
#[cfg(feature = "std")]
pub use clock::SystemClock;
pub use clock::{Clock, SimulatedClock};
pub use controller::{AffineModel, Command, ControlError, Controller, Quantity};
pub use derived::Derived;
pub use driver::{Driver, DriverError, DriverFault, Sample};
#[cfg(feature = "std")]
pub use dual::{DUAL_WIDTH, Dual, derivative, variable};
pub use effect::{Effect, EffectMeta, NoPast, Past, Physics, Reading};
pub use estimator::{Estimator, Innovation};
pub use integrator::{Rk4, rk4_step, substeps};
pub use limits::Limits;
pub use parameter::Parameter;
#[doc(hidden)]
pub use plant::check_sizes as plant_check;
pub use plant::{ControlAffine, Dynamics, MAX_STEP_S, Parameterization, Plant, PlantMeta};
pub use real::Real;
pub use signal::Signal;
pub use tick::{Loop, Observation, Observer, Step, Tick, TickError};

#[doc(hidden)]
pub mod __private {
    #[cfg(feature = "std")]
    pub use inventory;
    #[cfg(feature = "std")]
    pub use serde;
    #[cfg(feature = "std")]
    pub use typetag;
}
