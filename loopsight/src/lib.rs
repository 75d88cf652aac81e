//! Adaptive control you can see into: the library, and the command built on it.

mod about;
mod add;
pub mod answers;
#[cfg(feature = "cli")]
mod bringup;
mod check;
#[cfg(feature = "cli")]
pub mod cli;
mod columns;
mod compare;
mod diagnose;
mod error;
mod experiment;
mod explain;
mod files;
mod fit;
mod improve;
mod list;
mod log;
mod model;
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
pub use list::{ListOptions, PartRole, list};
pub use log::{Log, LogBuilder};
pub use model::{Model, ModelValue};
pub use run::{ControlledNow, InputNow, LogTo, Loop, ParameterNow, RunOptions, RunView};
#[cfg(feature = "serial")]
pub use send::SendOptions;
pub use session::Session;
pub use simulate::{Experiment, SimulateOptions};
pub use watch::{CancelToken, Progress, Stage, Watch};
