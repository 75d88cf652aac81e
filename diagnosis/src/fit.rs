//! Fitting a model's parameters to measurements.

use loopsight_model::model::Model;
use loopsight_model::run::Run;

use crate::compare::{compare_paced, free_run_error};
use crate::error::{CompareError, FitError};
use crate::fitted::Fit;
use crate::measurements::Measurements;
use crate::output_error::Unaided;
use crate::pace::Paced;
use crate::progress::{Cancelled, Work};
use crate::settings::{FitSettings, Method};
use crate::{output_error, rls};

/// Fits the free parameters of `model` to the runs; the comparison is on the test runs where given.
///
/// A fit that is cancelled returns the best values it has found (`Fit::cancelled`).
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
    let paced = Paced::of(model, measurements.runs, work);
    let work = paced.work(work);
    fit_for(&paced.model, measurements, settings, Unaided::Sought, &work)
}

/// As [`fit`], where it may be known whether the model needs an observer.
pub(crate) fn fit_for(
    model: &Model,
    measurements: &Measurements<'_>,
    settings: &FitSettings,
    unaided: Unaided,
    work: &Work<'_>,
) -> Result<Fit, FitError> {
    let runs = measurements.runs;
    check(model, runs)?;
    measurements.check(model)?;
    let fitted_to = Measurements {
        test: None,
        ..*measurements
    };
    let (before, result) = rayon::join(
        || free_run_error(model, &fitted_to, &work.silently()),
        || match settings.method {
            Method::Rls => rls::fit(model, runs, settings, work),
            Method::OutputError => output_error::fit(model, runs, settings, unaided, work),
        },
    );
    let before = match before {
        Ok(error) => Some(error),
        Err(CompareError::Cancelled(cancelled)) => return Err(cancelled.into()),
        Err(_) => None,
    };
    let mut result = result?;
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

/// Compares a fitted model with the recording it was fitted to, and with the one it is judged on.
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
        compare_paced(&result.model, &on, &work.silently())
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
    if !model.parameters.iter().any(|p| p.free || p.per_run) {
        return Err(FitError::NothingFree);
    }
    let unknown: Vec<String> = model
        .parameters
        .iter()
        .enumerate()
        .filter(|(i, p)| !p.free && !p.per_run && p.value.is_none() && model.tie(*i).is_none())
        .map(|(_, p)| p.name.clone())
        .collect();
    if !unknown.is_empty() {
        return Err(FitError::Unknown(unknown));
    }
    let samples: usize = runs.iter().map(Run::len).sum();
    let free = model.parameters.iter().filter(|p| p.free).count();
    let free = free + runs.len() * model.per_run().count();
    if samples * model.measured.len() <= free {
        return Err(FitError::TooFewSamples {
            samples,
            parameters: free,
        });
    }
    Ok(())
}
