//! Series of numbers, for your own pictures.

use loopsight_diagnosis::Comparison;
use serde::Serialize;

/// What was measured and what the model says, sample by sample, of one signal of one run. All lists are
/// as long as `time_s`; `null` marks what is missing.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct Series {
    /// Whose predictions these are.
    pub of: SeriesOf,
    /// Name of the run; may be empty.
    pub run: String,
    /// Id of the signal.
    pub signal: String,
    /// Its unit.
    pub unit: String,
    /// Time stamps since the start of the run, s.
    pub time_s: Vec<f64>,
    /// What was measured.
    #[cfg_attr(feature = "schema", schemars(with = "Vec<Option<f64>>"))]
    pub measured: Vec<f64>,
    /// The free run of the model.
    #[cfg_attr(feature = "schema", schemars(with = "Vec<Option<f64>>"))]
    pub model: Vec<f64>,
    /// Measurement minus model.
    #[cfg_attr(feature = "schema", schemars(with = "Vec<Option<f64>>"))]
    pub residual: Vec<f64>,
    /// The model's prediction of each sample from the one before.
    #[cfg_attr(feature = "schema", schemars(with = "Vec<Option<f64>>"))]
    pub one_step: Vec<f64>,
}

/// Which model a series is of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum SeriesOf {
    /// The model as it was given.
    Model,
    /// The fitted model.
    Fitted,
    /// The model without further effects, its parameters fitted.
    Nominal,
    /// The model with what was found missing, fitted.
    Best,
}

pub(crate) fn series(of: SeriesOf, comparison: &Comparison) -> Vec<Series> {
    let mut all = Vec::new();
    for run in &comparison.runs {
        for signal in &run.signals {
            let pairs = signal.measured.iter().zip(&signal.free_run);
            all.push(Series {
                of,
                run: run.name.clone(),
                signal: signal.id.clone(),
                unit: signal.unit.clone(),
                time_s: run.time.clone(),
                measured: signal.measured.clone(),
                model: signal.free_run.clone(),
                residual: pairs.map(|(measured, model)| measured - model).collect(),
                one_step: signal.one_step.clone(),
            });
        }
    }
    all
}
