//! The vocabulary of loopsight, and the tick of its control loop. No `std`, no allocator.
//!
//! Take this crate to write a plant or an effect, or to build firmware. To read models from TOML and to
//! simulate them take `loopsight-model`; to compare, fit, diagnose and run take `loopsight`.
//!
//! # What is here
//!
//! | what | types |
//! |---|---|
//! | quantities with units, declared once as constants | [`Signal`], [`Parameter`], [`Derived`], [`unit`](mod@unit) |
//! | where physics acts on a plant, and what can be read there | [`Channel`], [`Place`], [`Role`] |
//! | equations of motion, and physics that is added to them | [`Plant`], [`Effect`] |
//! | parts of a loop | [`Estimator`], [`Controller`], [`AffineModel`], [`Driver`], [`Clock`] |
//! | the tick: read, learn, supervise, control, limit, write | [`Loop`], [`Observer`], [`TickRecord`] |
//! | safe adaptation | [`learning`], [`limits`], [`supervisor`] |
//! | fourth-order Runge–Kutta with a fixed step | [`Rk4`], [`rk4_step`], [`substeps`] |
//!
//! # One source, every scalar
//!
//! Equations are generic over the scalar ([`Real`]). The same source runs as `f32` on a microcontroller, as
//! `f64` on a desk, and with dual numbers where a fit needs derivatives:
//!
//! ```
//! use loopsight_core::{
//!     Effect, EffectMeta, Parameter, PlaceKind, Reading, Real, Role, declare_effect,
//! };
//!
//! /// Drag of the air: `w = -c ω |ω|`.
//! struct Drag;
//!
//! impl Effect for Drag {
//!     const META: EffectMeta = EffectMeta {
//!         id: "drag",
//!         summary: "drag of the air at a shaft",
//!         equation: "w = -c omega |omega|",
//!         places: &[PlaceKind::Effort],
//!         reads: &[Role::Flow],
//!         parameters: &[Parameter::new("c", "c", "channel/flow^2", "drag per speed squared")],
//!         ..EffectMeta::PLAIN
//!     };
//!
//!     fn contribution<S: Real>(at: &Reading<'_, S>, _z: &[S; 0], p: &[S; 1]) -> S {
//!         let speed = at.get(Role::Flow);
//!         -p[0] * speed * speed.abs()
//!     }
//! }
//! declare_effect!(Drag, "drag");
//!
//! let at = Reading::nothing().with(Role::Flow, &3.0f32);
//! assert_eq!(Drag::contribution(&at, &[], &[0.5]), -4.5f32);
//! ```
//!
//! The traits an author implements ([`Plant`], [`Effect`]) have arrays of fixed sizes. The traits that a
//! program composes at run time ([`Dynamics`], [`Physics`]) have slices and are object-safe.
//! [`declare_plant!`] and [`declare_effect!`] make the second out of the first; the macros of the same
//! names in `loopsight-model` also enter the part in the registry.
//!
//! # Features
//!
//! | feature | what it adds |
//! |---|---|
//! | `std` (default) | [`SystemClock`], and the traits of a loop's parts for boxed parts |

#![cfg_attr(not(any(feature = "std", test)), no_std)]

mod array;
mod channel;
mod clock;
mod controller;
mod derived;
mod driver;
mod dynamics;
mod effect;
mod estimator;
mod exp;
mod integrator;
pub mod learning;
pub mod limits;
mod parameter;
mod physics;
mod plant;
mod real;
mod signal;
pub mod supervisor;
mod tanh;
mod tick;
mod tie;
pub mod unit;

pub use array::Array;
pub use channel::{Channel, Place, PlaceKind, Reads, Role};
#[cfg(feature = "std")]
pub use clock::SystemClock;
pub use clock::{Clock, SimulatedClock};
pub use controller::{AffineModel, Command, ControlError, Controller, Quantity};
pub use derived::Derived;
pub use driver::{Driver, DriverError, DriverFault, Sample};
pub use dynamics::{Act, Dynamics, Steps, Under};
#[doc(hidden)]
pub use dynamics::{steps_alone, steps_of, steps_under};
pub use effect::{Effect, EffectArrays, EffectMeta, NoPast, Past, Reading, SHORTEST_LAG_S, Shows};
pub use estimator::{Estimator, Innovation};
pub use integrator::{Bend, Rk4, rk4_step, substeps};
pub use limits::Limits;
pub use parameter::{End, Parameter};
pub use physics::{Now, Physics, Spot};
pub use plant::{ControlAffine, MAX_STEP_S, Parameterization, Plant, PlantArrays, PlantMeta};
pub use real::Real;
pub use signal::Signal;
pub use tick::{Loop, Observation, Observer, Tick, TickError, TickRecord};
pub use tie::{Tie, Unshown};

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
