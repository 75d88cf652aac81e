//! Results in words: the sentences and plain-text tables that the pages, the command line and the key `summary`
//! of JSON answers share.
//!
//! Each topic has a `summary`, a list of sentences that can stand anywhere, and a `text`, what a terminal
//! shows: the summary with tables. Everything is plain text in SI units; the pages turn `-15.1 m/s^2` into
//! `−15.1 m/s²` themselves.
//!
//! ```
//! use loopsight_diagnosis::{Comparison, SignalScore};
//! use loopsight_report::words;
//!
//! let speed = SignalScore {
//!     id: "speed".into(),
//!     unit: "m/s".into(),
//!     rmse: 0.013,
//!     nrmse: 0.079,
//!     fit_percent: 92.1,
//!     one_step_nrmse: 0.011,
//! };
//! let comparison = Comparison {
//!     nrmse: 0.079,
//!     fit_percent: 92.1,
//!     signals: vec![speed],
//!     faults: vec![],
//!     observer: None,
//!     where_it_fails: vec![],
//!     runs: vec![],
//! };
//! assert_eq!(
//!     words::comparison::summary(&comparison),
//!     [
//!         "Free run: error 7.90 % of the standard deviation, fit 92.10 %.",
//!         "The error of speed is 0.013 m/s rms.",
//!     ]
//! );
//! ```
//!
//! | module | of what |
//! |---|---|
//! | [`comparison`] | a model compared with a log |
//! | [`fit`] | parameters found from a log |
//! | [`diagnosis`] | what a model lacks |
//! | [`early`] | what is known before a diagnosis ends |
//! | [`improvement`] | a model with what it lacked |
//! | [`inventory`] | what is in a log |
//! | [`plan`] | an experiment |
//! | [`run`] | a loop at work |
//!
//! What a statement is about (where a model fails, why an experiment is advised, how a force looks) is found
//! and said in `loopsight_diagnosis`; here it gets its place among the others.

mod advice;
pub mod comparison;
pub mod diagnosis;
pub mod early;
mod faults;
pub mod feedforward;
pub mod fit;
mod force;
pub mod improvement;
pub mod inventory;
mod moved;
mod number;
mod place;
pub mod plan;
pub mod run;
mod table;

pub use advice::{AdvisedRecording, recordings};
pub use diagnosis::Said;
pub use faults::{fault, faults, severity};
pub(crate) use force::fitted;
pub use number::{ASTRAY, error, hundredths, number, percent, quantity, rounded, with_error};
pub(crate) use number::{exponent, significant};
pub use place::{enumerated, place, place_in_table, place_to_type, what_it_is};
pub use table::{columns, table};
