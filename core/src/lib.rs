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
//! Nothing here allocates. The feature `std` adds the clock of a host and the traits of boxed parts;
//! what is chosen at run time (registry, TOML, the composed model) is the crate `loopsight-model`.

#![cfg_attr(not(any(feature = "std", test)), no_std)]

mod array;
mod channel;
mod clock;
mod controller;
mod derived;
mod driver;
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

pub use array::Array;
pub use channel::{Channel, Place, PlaceKind, Reads, Role};
#[cfg(feature = "std")]
pub use clock::SystemClock;
pub use clock::{Clock, SimulatedClock};
pub use controller::{AffineModel, Command, ControlError, Controller, Quantity};
pub use derived::Derived;
pub use driver::{Driver, DriverError, DriverFault, Sample};
pub use effect::{Effect, EffectArrays, EffectMeta, NoPast, Past, Physics, Reading};
pub use estimator::{Estimator, Innovation};
pub use integrator::{Rk4, rk4_step, substeps};
pub use limits::Limits;
pub use parameter::Parameter;
pub use plant::{
    ControlAffine, Dynamics, MAX_STEP_S, Parameterization, Plant, PlantArrays, PlantMeta,
};
pub use real::Real;
pub use signal::Signal;
pub use tick::{Loop, Observation, Observer, Tick, TickError, TickRecord};

/// What the macros need of this crate.
#[doc(hidden)]
pub mod __private {
    /// Two texts are the same, also in a constant.
    pub const fn same_text(one: &str, other: &str) -> bool {
        let (one, other) = (one.as_bytes(), other.as_bytes());
        let mut i = 0;
        while i < one.len() && i < other.len() && one[i] == other[i] {
            i += 1;
        }
        i == one.len() && i == other.len()
    }
}
