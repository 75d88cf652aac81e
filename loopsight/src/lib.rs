//! Adaptive control you can see into: compare a model with measurements, fit it, find out which
//! physical effect it lacks, add that, and run the control loop that uses it.
//!
//! # The workflow
//!
//! A [`Model`] is a plant with effects and sensors, made of TOML. A [`Log`] is what was applied to a machine
//! and what was measured. A [`Session`] owns both, and answers.
//!
//! **Compare.** How far is the model from the machine, and where does it fail?
//!
//! ```
//! use loopsight::{CompareOptions, Log, Model, Session};
//!
//! # let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../examples/hidden-effect/oscillator_coulomb_friction");
//! # let file = |name: &str| format!("{folder}/{name}");
//! let session = Session::new(Model::from_file(file("model.toml"))?, Log::read(file("mixed.csv"))?)?;
//! let compared = session.compare(&CompareOptions::default())?;
//! println!("{}", compared.summary);
//! # Ok::<(), loopsight::Error>(())
//! ```
//!
//! **Fit.** The parameters, with intervals of 95 %: [`Session::fit`].
//!
//! **Diagnose.** Which effect is missing? Every effect of the library is tried at every channel, and judged on
//! validation data. **Improve** adds what is missing and refits, until nothing more is.
//!
//! ```
//! use loopsight::{DiagnoseOptions, ImproveOptions, Log, Model, Session};
//!
//! # let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../examples/hidden-effect/oscillator_coulomb_friction");
//! # let file = |name: &str| format!("{folder}/{name}");
//! let session = Session::new(Model::from_file(file("model.toml"))?, Log::read(file("mixed.csv"))?)?;
//! let found = session.diagnose(&DiagnoseOptions::default())?;
//! assert_eq!(found.missing.map(|m| m.effect).as_deref(), Some("coulomb_friction"));
//!
//! let improved = session.improve(&ImproveOptions::default())?;
//! let better = improved.model().map(|model| model.to_toml()); // comments kept, values fitted
//! # assert!(better.is_some_and(|text| text.contains("coulomb_friction")));
//! # Ok::<(), loopsight::Error>(())
//! ```
//!
//! **Ask for more data** where a log cannot tell: [`Session::experiment`] plans the inputs that would.
//! **Run** the loop with the better model: [`Session::run`]. [`Session::simulate`] makes the log of a simulated robot.
//!
//! # Without files
//!
//! Models of text and logs of arrays work as well: [`Model::from_toml`], [`Log::in_memory`],
//! [`Log::from_bytes`].
//!
//! # Answers
//!
//! Each answer ([`answers`]) has numbers, a [`summary`](answers::DiagnoseAnswer::summary) in words, most a
//! page with pictures (`page`), and serialises to exactly what the command prints with `--json`
//! ([`Answer::to_json`]). Its key `schema` names a JSON Schema that is published under `docs/schema/`.
//!
//! # Long work
//!
//! Options take a callback for progress and a token that cancels: [`DiagnoseOptions::progress`],
//! [`DiagnoseOptions::cancel`]. Work that is cancelled answers with what it has found.
//!
//! # Parts of one's own
//!
//! [`parts`] has what a plant or an effect is written with; [`list`](list()) and [`explain`](explain()) show
//! all that is known. The programs in `examples/` go from three lines to an effect of one's own.
//!
//! # Features
//!
//! | feature | by default | what it adds |
//! |---|---|---|
//! | `cli` | yes | the command: the binary `loopsight`, and `cli::run()` for crates with parts of their own |
//! | `serial` | with `cli` | robots at the end of a serial line: `Session::send`, the driver `serial`, the controller `aboard` |
//! | `all-formats` | no | logs in HDF5, MATLAB v7.3, Parquet, Arrow and SQLite, beside those that are always read |
//! | `schema` | no | the module `schema`: JSON Schemas of the answers |
//!
//! `default-features = false` leaves a library without terminals and serial ports.

mod about;
mod add;
pub mod answers;
mod bounded;
#[cfg(feature = "cli")]
mod bringup;
mod check;
#[cfg(feature = "cli")]
pub mod cli;
mod columns;
mod compare;
mod convert;
mod diagnose;
mod error;
mod experiment;
mod explain;
mod files;
mod fit;
mod improve;
mod inspect;
mod list;
mod log;
mod model;
mod pace;
pub mod parts;
mod run;
#[cfg(feature = "cli")]
mod scaffold;
#[cfg(feature = "schema")]
pub mod schema;
#[cfg(feature = "serial")]
mod send;
mod session;
mod simulate;
mod stamps;
mod watch;
mod words;

use loopsight_controllers as _;
use loopsight_drivers as _;
use loopsight_estimators as _;
use loopsight_plants as _;

pub use add::AddOptions;
pub use answers::Answer;
pub use check::check;
pub use compare::CompareOptions;
pub use diagnose::DiagnoseOptions;
pub use error::{Error, ErrorKind, Result};
pub use experiment::{Ask, ExperimentOptions};
pub use explain::explain;
pub use fit::{FitOptions, Method, Scheme};
pub use improve::ImproveOptions;
pub use inspect::{InspectOptions, inspect, inspect_file};
pub use list::{ListOptions, PartRole, effects_for, list};
pub use log::{Log, LogBuilder};
pub use loopsight_recordings::output::Written;
pub use loopsight_report::PAGE_STYLE;
pub use model::{Model, ModelValue};
pub use run::{ControlledNow, InputNow, LogTo, Loop, ParameterNow, RunOptions, RunView};
#[cfg(feature = "serial")]
pub use send::SendOptions;
pub use session::Session;
pub use simulate::{Experiment, SimulateOptions};
pub use watch::{CancelToken, Early, Finding, Fitted, Progress, Promised, Stage, Watch};
