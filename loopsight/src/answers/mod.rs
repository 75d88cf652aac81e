//! What the commands answer: one type per command, one file per type.
//!
//! Each type serialises to exactly what the command prints with `--json`. Its first key is `schema`, the
//! name and version of the contract that it keeps; the contracts themselves are JSON Schemas under
//! `docs/schema/`. Numbers are SI; one that is not finite (the error of a signal that never moves) is
//! `null` in JSON.

mod add;
mod check;
mod common;
mod compare;
mod convert;
mod diagnose;
mod experiment;
mod explain;
mod feedforward;
mod fit;
mod force;
mod improve;
mod inspect;
mod list;
mod mirror;
mod run;
mod run_parts;
#[cfg(feature = "serial")]
mod send;
mod series;
mod simulate;

pub use add::AddAnswer;
pub use check::{CheckAnswer, Checked, FileKind, Mistake};
pub use common::{
    Correction, EffectAt, Estimates, Failing, Level, LogFault, ModelErrors, ParameterEstimate,
    PerRun, Recommendation, RunEstimate, SignalError,
};
pub use compare::CompareAnswer;
pub use convert::ConvertAnswer;
pub use diagnose::{Candidate, DiagnoseAnswer, NotTried};
pub use experiment::{ConsideredExperiment, ExperimentAnswer};
pub use explain::{
    ExplainAnswer, Explained, ExplainedChannel, ExplainedDerived, ExplainedHome,
    ExplainedParameter, ExplainedSet, ExplainedSignal,
};
pub use feedforward::{Feedback, Feedforward};
pub use fit::FitAnswer;
pub use force::{ForceBin, ForceCurve, ForceDependence, MissingForce, WrittenForce};
pub use improve::{ImproveAnswer, ImproveStep, OpenChoice, Reported};
pub use inspect::{FittingPlant, InspectAnswer, InspectedChannel, MappedChannel};
pub use list::{ListAnswer, Listed};
pub use mirror::{Because, FaultKind, ParameterVerdict, Promise, Severity, Verdict};
pub use run::RunAnswer;
pub use run_parts::{
    ControlledSeries, Happened, InputSeries, LearnedParameter, Learning, LoopTiming,
    ParameterSeries, ReferenceStep, RunSeries, Spread, Tracking,
};
#[cfg(feature = "serial")]
pub use send::{SendAnswer, SentEffect, SentParameter};
pub use series::{Series, SeriesOf};
pub use simulate::SimulateAnswer;

use serde::Serialize;

use crate::error::{Error, Result};

/// An answer that can be handed on as JSON.
pub trait Answer: Serialize {
    /// Name and version of the contract: the value of the key `schema`.
    const SCHEMA: &'static str;

    /// What the command prints with `--json`.
    ///
    /// # Errors
    ///
    /// None is known: JSON can express everything in an answer.
    fn to_json(&self) -> Result<String> {
        serde_json::to_string_pretty(self).map_err(|error| Error::work(error.to_string()))
    }
}
