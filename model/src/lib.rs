//! Models and loops that are composed at run time, from TOML. Needs `std`.
//!
//! [`loopsight_core`] says what a plant, an effect, an estimator, a controller and a driver are. This crate
//! finds them by their ids, reads their tables, puts them together and runs them.
//!
//! # A model from TOML
//!
//! A plant is declared once and is then known to every file, listing and fit. A [`model::Model`] is a plant
//! with effects, sensors and values; a [`simulate::Simulator`] integrates it.
//!
//! ```
//! # use loopsight_core::{Channel, Parameter, Place, Plant, PlantMeta, Reads, Real, Role, Signal};
//! use loopsight_model::declare_plant;
//! use loopsight_model::model::Model;
//! use loopsight_model::simulate::Simulator;
//!
//! /// A flywheel that a torque turns: `ω' = (τ + w)/J`.
//! struct Flywheel;
//! # impl Plant for Flywheel {
//! #     const META: PlantMeta = PlantMeta {
//! #         id: "flywheel",
//! #         summary: "a wheel turned by a torque",
//! #         equation: "omega' = (torque + w)/J",
//! #         reference: "Newton (1687), second law",
//! #         assumptions: "a rigid wheel",
//! #         example: "[plant.flywheel]\nJ = 0.02\n",
//! #         states: &[Signal::new("speed", "omega", "rad/s", "speed of the wheel")],
//! #         inputs: &[Signal::new("torque", "tau", "N m", "torque at the wheel")],
//! #         outputs: &[],
//! #         integrals: &[],
//! #         channels: &[Channel {
//! #             id: "shaft",
//! #             place: Place::Effort(0),
//! #             unit: "N m",
//! #             equation: "tau -> tau + w",
//! #             reads: &[Reads(Role::Flow, "speed"), Reads(Role::Drive, "torque")],
//! #             side: 0,
//! #             size: 1.0,
//! #             doc: "torques at the wheel",
//! #         }],
//! #         parameters: &[Parameter::new("J", "J", "kg m^2", "inertia").above(0.0).nonlinear()],
//! #         parameterizations: &[],
//! #         controlled: &[0],
//! #     };
//! #     fn derivative<S: Real>(_x: &[S; 1], u: &[S; 1], w: &[S; 1], p: &[S; 1]) -> [S; 1] {
//! #         [(u[0] + w[0]) / p[0]]
//! #     }
//! #     fn output<S: Real>(_index: usize, _x: &[S; 1], _u: &[S; 1], _p: &[S; 1]) -> S {
//! #         S::zero()
//! #     }
//! # }
//! // The equations and the declaration of `Flywheel` are in the example of `loopsight_core::Plant`.
//! declare_plant!(Flywheel, "flywheel");
//!
//! let text = "[plant.flywheel]\nJ = 0.02\n";
//! let (model, _) = Model::from_toml("wheel.toml", text)?;
//! let mut simulator = Simulator::new(&model, &model.values());
//! simulator.advance(1.0, &[0.1]);
//! assert!((simulator.state()[0] - 5.0).abs() < 1e-9);
//!
//! let error = Model::from_toml("wheel.toml", "[plant.flywheel]\nJ = -1.0\n").unwrap_err();
//! assert!(error.to_string().contains("expected a number above 0 kg m^2"));
//! # Ok::<(), loopsight_model::model::ModelError>(())
//! ```
//!
//! # What is here
//!
//! | what | module |
//! |---|---|
//! | linked parts by id; the traits behind their tables | [`registry`], and [`declare_plant!`], [`declare_effect!`], [`declare_part!`] |
//! | TOML with the line and column of every mistake | [`config`] |
//! | a composed model; the columns of a log; how a number is measured | [`model`], [`log_map`], [`sensor`] |
//! | measurements, consistent by construction | [`run`] |
//! | simulation, with exact derivatives by [`Dual`] numbers | [`simulate`] |
//! | parts written as formulas in the model file | [`expression`] |
//! | regressions for recursive estimators, and learning from a running loop | [`regression`], [`identification`] |
//! | a model as a controller sees it, with its effects inverted and predicted over | [`affine`] |
//! | references and test signals | [`excitation`] |
//! | a loop from a file, with limits and a supervisor | [`loop_file`], [`limits`], [`supervisor`] |
//!
//! # Features
//!
//! None. A crate of parts that also builds without `std` makes this one an optional dependency.

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

pub use dual::{
    DUAL_WIDTH, Dual, DualOf, NARROW_WIDTH, NarrowDual, TINY_WIDTH, TinyDual, derivative, variable,
    variable_of,
};

#[doc(hidden)]
pub mod __private {
    pub use inventory;
    pub use loopsight_core;
    pub use serde;
    pub use typetag;
}
