//! Fitting a model's parameters to measurements.

use std::collections::BTreeMap;

use loopsight_model::model::Model;
use loopsight_model::run::Run;
use loopsight_recordings::Fault;
use serde::Serialize;

use crate::compare::{CompareError, Comparison, compare};
use crate::regression::Scheme;

/// How parameters are found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// Recursive least squares on a regression (the paper's way).
    Rls,
    /// Least squares on the error of the free run.
    OutputError,
}

/// Settings of a fit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FitSettings {
    /// How.
    pub method: Method,
    /// The regression of [`Method::Rls`], and of the starting point of [`Method::OutputError`].
    pub scheme: Scheme,
    /// Most iterations of [`Method::OutputError`].
    pub max_iterations: u64,
}

impl Default for FitSettings {
    fn default() -> Self {
        Self {
            method: Method::OutputError,
            scheme: Scheme::Integrated,
            max_iterations: 100,
        }
    }
}

/// What a fit says of one parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// Pinned by the data.
    Good,
    /// Not estimated: held at the value of the file.
    Held,
    /// Has no influence on what is measured in this recording.
    Dead,
    /// Only a combination with other parameters is determined.
    Flat,
    /// The interval is wider than the value.
    NotPinned,
    /// Rests on the end of its admissible range.
    AtBound,
}

impl Verdict {
    /// In words.
    pub fn text(self) -> &'static str {
        match self {
            Verdict::Good => "pinned by the data",
            Verdict::Held => "held at the file's value",
            Verdict::Dead => "no influence on what is measured here",
            Verdict::Flat => "only a combination with other parameters is determined",
            Verdict::NotPinned => "interval wider than the value",
            Verdict::AtBound => "at the end of its range",
        }
    }
}

/// One estimated parameter.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Estimate {
    /// The value.
    pub value: f64,
    /// Its unit.
    pub unit: String,
    /// Standard error, in that unit; `null` where the data say nothing.
    pub std_error: Option<f64>,
    /// Interval that holds the true value with 95 % confidence.
    pub interval95: Option<[f64; 2]>,
    /// What the data say of it.
    pub verdict: Verdict,
}

/// The result of a fit.
#[derive(Clone, Debug, Serialize)]
pub struct Fit {
    /// The fitted model held against the recording it was fitted to (or the test recording).
    #[serde(flatten)]
    pub comparison: Comparison,
    /// The parameters by name.
    pub parameters: BTreeMap<String, Estimate>,
    /// What follows from the plant's parameters, by name: see [`loopsight_core::Derived`].
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub derived: BTreeMap<String, Estimate>,
    /// How they were found.
    pub method: Method,
    /// Free-run error before the fit; absent where the file gave no values.
    pub nrmse_before: Option<f64>,
    /// Free-run error on the recording it was fitted to.
    pub nrmse_fit: f64,
    /// Iterations (output error) or samples (recursive least squares).
    pub iterations: u64,
    /// Combinations of parameters that the data do not determine, in words.
    pub flat: Vec<String>,
    /// The fitted model.
    #[serde(skip)]
    pub model: Model,
    /// Convergence of the estimate over the samples, for recursive least squares: name, then
    /// (time, value).
    #[serde(skip)]
    pub history: Vec<(String, Vec<(f64, f64)>)>,
}

/// Why a fit failed.
#[derive(Debug, thiserror::Error)]
pub enum FitError {
    /// See [`CompareError`].
    #[error(transparent)]
    Compare(#[from] CompareError),
    /// Nothing to estimate.
    #[error("no parameter of the model is free: name some under `free` in [fit]")]
    NothingFree,
    /// Fewer samples than parameters.
    #[error("{samples} samples cannot determine {parameters} parameters")]
    TooFewSamples {
        /// Usable samples.
        samples: usize,
        /// Free parameters.
        parameters: usize,
    },
    /// Known parameters without a value.
    #[error("the model gives no value for {}, and a fit does not estimate it: write it into the file, or name it under `free` in [fit]", .0.join(", "))]
    Unknown(Vec<String>),
    /// A parameter that the regression cannot estimate.
    #[error(
        "`{parameter}` enters the equations non-linearly: recursive least squares cannot estimate it; use --method output-error, or name it under `fixed` in [fit]"
    )]
    NotLinear {
        /// Its name.
        parameter: String,
    },
    /// The plant offers no regression.
    #[error(
        "the plant `{0}` declares no controlled states, so there is no regression for recursive least squares; use --method output-error"
    )]
    NoRegression(String),
    /// The solver gave up.
    #[error("the solver gave up: {0}")]
    Solver(String),
    /// The estimator's table is wrong.
    #[error(transparent)]
    Build(#[from] loopsight_model::registry::BuildError),
    /// The estimator is not linked.
    #[error("no estimator `{0}` is linked into this program")]
    NoEstimator(String),
}

/// Fits the free parameters of `model` to `runs`; the comparison is on `test` where given.
///
/// `progress` is called with the iteration and the present error (0 to 1 where it is a share).
pub fn fit(
    model: &Model,
    runs: &[Run],
    test: Option<&[Run]>,
    faults: &[Fault],
    settings: &FitSettings,
    progress: &(dyn Fn(u64, f64) + Sync),
) -> Result<Fit, FitError> {
    if model.measured.is_empty() {
        return Err(CompareError::NothingMeasured.into());
    }
    if !model.parameters.iter().any(|p| p.free) {
        return Err(FitError::NothingFree);
    }
    let unknown: Vec<String> = model
        .parameters
        .iter()
        .filter(|p| !p.free && p.value.is_none())
        .map(|p| p.name.clone())
        .collect();
    if !unknown.is_empty() {
        return Err(FitError::Unknown(unknown));
    }
    let samples: usize = runs.iter().map(Run::len).sum();
    let free = model.parameters.iter().filter(|p| p.free).count();
    if samples * model.measured.len() <= free {
        return Err(FitError::TooFewSamples {
            samples,
            parameters: free,
        });
    }
    let before = compare(model, runs, &[]).ok().map(|c| c.nrmse);
    let mut result = match settings.method {
        Method::Rls => crate::rls::fit(model, runs, settings, progress)?,
        Method::OutputError => crate::output_error::fit(model, runs, settings, progress)?,
    };
    result.nrmse_before = before;
    let on_fit = compare(&result.model, runs, faults)?;
    result.nrmse_fit = on_fit.nrmse;
    result.comparison = match test {
        Some(test) => compare(&result.model, test, faults)?,
        None => on_fit,
    };
    Ok(result)
}
