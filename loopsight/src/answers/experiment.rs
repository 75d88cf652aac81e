//! What [`Session::experiment`](crate::Session::experiment) answers.

use std::path::Path;

use loopsight_core::Signal;
use loopsight_diagnosis::{ExperimentLimits, Plan};
use loopsight_recordings::output::Written;
use loopsight_recordings::{header, write_csv};
use serde::Serialize;

use super::Answer;
use super::common::{EffectAt, all};
use super::mirror::Promise;
use crate::columns::rounded;
use crate::error::{Error, Result};
use crate::words;

/// An experiment, ready to be recorded.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct ExperimentAnswer {
    /// `loopsight/experiment/1`.
    #[cfg_attr(feature = "schema", schemars(extend("const" = "loopsight/experiment/1")))]
    pub schema: &'static str,
    /// What it is; empty when no inputs answer the question.
    pub experiment: String,
    /// How long it takes, s.
    pub duration_s: f64,
    /// How long it has to take, s; `null` when no length is enough.
    #[cfg_attr(feature = "schema", schemars(with = "Option<f64>"))]
    pub needed_s: f64,
    /// The effects it separates.
    pub separates: Vec<EffectAt>,
    /// The parameters it pins.
    pub pins: Vec<String>,
    /// Effects: their distance in standard deviations. Parameters: the value over the predicted standard error; a
    /// noticeable change takes the place of a smaller value.
    #[cfg_attr(feature = "schema", schemars(with = "Option<f64>"))]
    pub detectability: f64,
    /// What it promises.
    pub verdict: Promise,
    /// Why this one, in words.
    pub reason: String,
    /// What was looked at, best first.
    pub considered: Vec<ConsideredExperiment>,
    /// Largest magnitude of every input, in its SI unit.
    pub limit: f64,
    /// Sampling period, s.
    pub period_s: f64,
    /// The file that was written; `null` when none was.
    pub file: Option<String>,
    /// What it comes to, in a sentence.
    pub summary: String,
    #[serde(skip)]
    #[cfg_attr(feature = "schema", schemars(skip))]
    pub(crate) engine: Plan,
    #[serde(skip)]
    #[cfg_attr(feature = "schema", schemars(skip))]
    inputs: &'static [Signal],
}

/// An experiment that was looked at.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct ConsideredExperiment {
    /// What it is.
    pub experiment: String,
    /// As [`ExperimentAnswer::detectability`], for 20 s (or the duration asked for).
    #[cfg_attr(feature = "schema", schemars(with = "Option<f64>"))]
    pub detectability: f64,
}

impl From<&loopsight_diagnosis::Considered> for ConsideredExperiment {
    fn from(considered: &loopsight_diagnosis::Considered) -> Self {
        Self {
            experiment: considered.experiment.clone(),
            detectability: considered.detectability,
        }
    }
}

impl Answer for ExperimentAnswer {
    const SCHEMA: &'static str = "loopsight/experiment/1";
}

impl ExperimentAnswer {
    pub(crate) fn new(engine: Plan, limits: &ExperimentLimits, inputs: &'static [Signal]) -> Self {
        Self {
            schema: Self::SCHEMA,
            experiment: engine.experiment.clone(),
            duration_s: engine.duration_s,
            needed_s: engine.needed_s,
            separates: all(&engine.separates),
            pins: engine.pins.clone(),
            detectability: engine.detectability,
            verdict: engine.verdict.into(),
            reason: engine.reason.clone(),
            considered: all(&engine.considered),
            limit: limits.limit,
            period_s: limits.period,
            file: None,
            summary: words::plan(&engine),
            engine,
            inputs,
        }
    }

    /// Whether there is an experiment to record.
    pub fn answers(&self) -> bool {
        self.verdict != Promise::CannotBeSeparated
    }

    /// Number of samples of the plan.
    pub fn samples(&self) -> usize {
        self.engine.drive.time.len()
    }

    /// The inputs over time: for each input its id, its unit, and a value from each instant of
    /// [`ExperimentAnswer::time_s`] to the next.
    pub fn inputs(&self) -> Vec<(&'static str, &'static str, Vec<f64>)> {
        let rows = self
            .engine
            .drive
            .inputs
            .chunks_exact(self.inputs.len().max(1));
        let column = |i: usize| rows.clone().map(|row| row[i]).collect();
        let inputs = self.inputs.iter().enumerate();
        inputs.map(|(i, s)| (s.id, s.unit, column(i))).collect()
    }

    /// Instants of the inputs, s.
    pub fn time_s(&self) -> &[f64] {
        &self.engine.drive.time
    }

    /// Writes the inputs as CSV with the header of a log; a key `inputs_from` of an experiment file replays
    /// it.
    ///
    /// # Errors
    ///
    /// There is no plan, or the file cannot be written.
    pub fn save(&mut self, path: impl AsRef<Path>) -> Result<Written> {
        if !self.answers() {
            return Err(Error::request(
                "there is no plan to write: no inputs answer the question",
            ));
        }
        let path = path.as_ref();
        let name = path.display().to_string();
        let mut headers = vec!["time_s".to_owned()];
        headers.extend(self.inputs.iter().map(header));
        let drive = &self.engine.drive;
        let rows: Vec<f64> = drive
            .time
            .iter()
            .zip(drive.inputs.chunks_exact(self.inputs.len().max(1)))
            .flat_map(|(t, row)| std::iter::once(*t).chain(row.iter().copied()))
            .map(rounded)
            .collect();
        let written = write_csv(path, &headers, &rows);
        let written = written.map_err(|e| Error::in_log(&e, &name, None))?;
        self.file = Some(name);
        Ok(written)
    }
}
