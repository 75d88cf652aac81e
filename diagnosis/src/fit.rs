//! Fitting a model's parameters to measurements.

use std::collections::BTreeMap;

use loopsight_model::model::Model;
use loopsight_model::run::Run;
use serde::Serialize;

use crate::compare::{Comparison, compare};
use crate::derived::derived;
use crate::error::{CompareError, FitError};
use crate::measurements::Measurements;
use crate::progress::{Cancelled, Work};
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
    /// The fit was cancelled before it could say.
    Unfinished,
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
            Verdict::Unfinished => "the fit was cancelled",
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
    /// The work was cancelled: these are the best values found until then. Errors of values and errors by
    /// signal are missing where there was no time for them.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub cancelled: bool,
    /// The fitted model.
    #[serde(skip)]
    pub model: Model,
    /// Convergence of the estimate over the samples, for recursive least squares: name, then
    /// (time, value).
    #[serde(skip)]
    pub history: Vec<(String, Vec<(f64, f64)>)>,
}

impl Fit {
    /// What is left of a fit that was cancelled: the values of `model`, which leave an error of `nrmse`.
    pub(crate) fn cancelled(model: Model, method: Method, nrmse: f64, iterations: u64) -> Self {
        let parameters = model.parameters.iter().filter_map(|parameter| {
            let estimate = Estimate {
                value: parameter.value?,
                unit: parameter.unit.clone(),
                std_error: None,
                interval95: None,
                verdict: if parameter.free {
                    Verdict::Unfinished
                } else {
                    Verdict::Held
                },
            };
            Some((parameter.name.clone(), estimate))
        });
        Self {
            comparison: Comparison::of_error(nrmse),
            parameters: parameters.collect(),
            derived: derived(&model, None),
            method,
            nrmse_before: None,
            nrmse_fit: nrmse,
            iterations,
            flat: Vec::new(),
            cancelled: true,
            model,
            history: Vec::new(),
        }
    }
}

/// Fits the free parameters of `model` to the runs; the comparison is on the test runs where given.
///
/// A fit that is cancelled returns the best values it has found ([`Fit::cancelled`]).
///
/// # Errors
///
/// [`FitError`] when there is nothing to fit or to fit to, when the model cannot be simulated from any
/// starting point, and when the work was cancelled before the first simulation was done.
pub fn fit(
    model: &Model,
    measurements: &Measurements<'_>,
    settings: &FitSettings,
    work: &Work<'_>,
) -> Result<Fit, FitError> {
    let runs = measurements.runs;
    check(model, runs)?;
    let fitted_to = Measurements {
        test: None,
        ..*measurements
    };
    let before = match compare(model, &fitted_to, &work.silently()) {
        Ok(comparison) => Some(comparison.nrmse),
        Err(CompareError::Cancelled(cancelled)) => return Err(cancelled.into()),
        Err(_) => None,
    };
    let mut result = match settings.method {
        Method::Rls => crate::rls::fit(model, runs, settings, work)?,
        Method::OutputError => crate::output_error::fit(model, runs, settings, work)?,
    };
    result.nrmse_before = before;
    if result.cancelled {
        return Ok(result);
    }
    match compared(&mut result, measurements, work) {
        Err(CompareError::Cancelled(Cancelled)) => result.cancelled = true,
        done => done?,
    }
    Ok(result)
}

/// Compares a fitted model with what it was fitted to, and with what it is judged on.
fn compared(
    result: &mut Fit,
    measurements: &Measurements<'_>,
    work: &Work<'_>,
) -> Result<(), CompareError> {
    let on = |runs| {
        let on = Measurements {
            runs,
            ..*measurements
        };
        compare(&result.model, &on, &work.silently())
    };
    let on_fit = on(measurements.runs)?;
    let nrmse_fit = on_fit.nrmse;
    let comparison = match measurements.test {
        Some(test) => on(test),
        None => Ok(on_fit),
    };
    result.nrmse_fit = nrmse_fit;
    result.comparison = comparison?;
    Ok(())
}

/// Whether there is something to fit, and something to fit it to.
fn check(model: &Model, runs: &[Run]) -> Result<(), FitError> {
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
    Ok(())
}
