//! What [`Session::simulate`](crate::Session::simulate) answers.

use std::path::PathBuf;

use loopsight_model::run::Run;
use serde::Serialize;

use super::Answer;
use crate::log::Log;

/// What a simulated robot did.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct SimulateAnswer {
    /// `loopsight/simulate/1`.
    #[cfg_attr(feature = "schema", schemars(extend("const" = "loopsight/simulate/1")))]
    pub schema: &'static str,
    /// Samples of the log.
    pub samples: usize,
    /// From the first sample to the last, s.
    pub duration_s: f64,
    /// Columns of the log.
    pub columns: Vec<String>,
    /// What it comes to, in a sentence.
    pub summary: String,
    #[serde(skip)]
    #[cfg_attr(feature = "schema", schemars(skip))]
    log: Log,
    #[serde(skip)]
    #[cfg_attr(feature = "schema", schemars(skip))]
    reads: Vec<PathBuf>,
}

impl Answer for SimulateAnswer {
    const SCHEMA: &'static str = "loopsight/simulate/1";
}

impl SimulateAnswer {
    pub(crate) fn new(run: &Run, log: Log, reads: Vec<PathBuf>) -> Self {
        let (samples, duration_s) = (run.len(), run.duration());
        Self {
            schema: Self::SCHEMA,
            samples,
            duration_s,
            columns: log.columns(),
            summary: format!("{samples} samples over {duration_s} s"),
            log,
            reads,
        }
    }

    /// The files that the experiment names and that were read: none of them is the place for the log.
    pub fn reads(&self) -> &[PathBuf] {
        &self.reads
    }

    /// The log of the robot.
    pub fn log(&self) -> &Log {
        &self.log
    }
}
