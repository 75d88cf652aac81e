//! Recursive least squares over a recording: the paper's identification.

use std::collections::BTreeMap;

use loopsight_core::Estimator;
use loopsight_model::model::Model;
use loopsight_model::registry::EstimatorPart;
use loopsight_model::run::Run;
use statrs::distribution::{ContinuousCDF, StudentsT};

use crate::compare::Comparison;
use crate::derived::derived;
use crate::error::FitError;
use crate::estimate::{Estimate, ParameterVerdict};
use crate::fitted::Fit;
use crate::progress::{Stage, Work};
use crate::regression::{Regression, for_each_row};
use crate::settings::{FitSettings, Method};
use crate::speeds::Speeds;

/// Samples of the estimate's history that are kept for pictures.
const HISTORY: usize = 2000;

/// Runs the estimator `rls`, one per controlled state, over all samples in order.
///
/// Standard errors are those of least squares with white residuals, `σ² P`; where the regressors
/// themselves are noisy (encoder counts) the estimate is biased, and the interval does not show it.
pub(crate) fn fit(
    model: &Model,
    runs: &[Run],
    settings: &FitSettings,
    work: &Work<'_>,
) -> Result<Fit, FitError> {
    if let Some(i) = model.per_run().next() {
        let parameter = model.parameters[i].name.clone();
        return Err(FitError::PerRun { parameter });
    }
    let criteria = &work.criteria().parameters;
    let speeds = Speeds::of(model);
    let mut regression = Regression::new(&speeds.model, settings.scheme)?;
    let mut estimators = Vec::new();
    for row in 0..regression.len() {
        estimators.push(estimator(regression.parameters(row).len())?);
    }
    let total: usize = runs.iter().map(Run::len).sum();
    let every = (total / HISTORY).max(1);
    let mut history: Vec<(String, Vec<(f64, f64)>)> = Vec::new();
    for row in 0..regression.len() {
        for j in regression.parameters(row) {
            history.push((model.parameters[*j].name.clone(), Vec::new()));
        }
    }
    let mut sums = vec![(0.0, 0.0); estimators.len()];
    let mut samples = 0u64;
    let offsets: Vec<usize> = (0..regression.len())
        .scan(0, |sum, row| {
            let first = *sum;
            *sum += regression.parameters(row).len();
            Some(first)
        })
        .collect();
    let done = for_each_row(
        &mut regression,
        &speeds,
        runs,
        0.0,
        work,
        |row, time, phi, y| {
            let innovation = estimators[row].update(phi, y);
            if !innovation.accepted {
                return;
            }
            // A-priori error over its relative variance: the residual sum of squares of the whole
            // regression, recursively (Åström, Wittenmark 2008, section 2.2).
            sums[row].0 += innovation.innovation.powi(2) / innovation.relative_variance;
            sums[row].1 += 1.0;
            if row == 0 {
                samples += 1;
                if samples.is_multiple_of(256) {
                    work.tell(Stage::Fitting, samples, total as u64);
                }
            }
            if samples.is_multiple_of(every as u64) {
                for (k, theta) in estimators[row].theta().iter().enumerate() {
                    history[offsets[row] + k].1.push((time, *theta));
                }
            }
        },
    );

    let mut values: Vec<f64> = model.values();
    let mut parameters = BTreeMap::new();
    let mut found = BTreeMap::new();
    for (row, estimator) in estimators.iter().enumerate() {
        let n = estimator.theta().len();
        let dof = (sums[row].1 - n as f64).max(1.0);
        let variance = sums[row].0 / dof;
        let quantile =
            StudentsT::new(0.0, 1.0, dof).map_or(1.96, |t| t.inverse_cdf(criteria.quantile));
        for (k, j) in regression.parameters(row).iter().enumerate() {
            let theta = estimator.theta()[k];
            let error = (variance * estimator.covariance(k, k)).max(0.0).sqrt();
            // A parameter that moves two rates is in both rows. The one that determines it better counts.
            let better = |(_, other, _): &(f64, f64, f64)| *other < error;
            if !found.get(j).is_some_and(better) {
                found.insert(*j, (theta, error, quantile));
            }
        }
    }
    for (index, parameter) in model.parameters.iter().enumerate() {
        let estimate = match found.get(&index) {
            Some(&(value, error, quantile)) => Estimate {
                value: parameter.declaration.nearest(value),
                unit: parameter.unit.clone(),
                std_error: Some(error),
                interval95: Some([value - quantile * error, value + quantile * error]),
                verdict: if !parameter.declaration.admits(value) {
                    ParameterVerdict::AtBound
                } else if quantile * error > criteria.not_pinned * value.abs() {
                    ParameterVerdict::NotPinned
                } else {
                    ParameterVerdict::Good
                },
            },
            None => Estimate {
                value: parameter.value.unwrap_or(0.0),
                unit: parameter.unit.clone(),
                std_error: None,
                interval95: None,
                verdict: if parameter.free {
                    ParameterVerdict::Dead
                } else {
                    ParameterVerdict::Frozen
                },
            },
        };
        if !values[index].is_finite() || found.contains_key(&index) {
            values[index] = estimate.value;
        }
        parameters.insert(parameter.name.clone(), estimate);
    }
    let mut fitted = model.clone();
    fitted.set_values(&values);
    Ok(Fit {
        comparison: Comparison::of_error(f64::NAN),
        parameters,
        per_run: BTreeMap::new(),
        derived: derived(&fitted, None),
        method: Method::Rls,
        nrmse_before: None,
        nrmse_fit: f64::NAN,
        iterations: samples,
        convergence: None,
        flat: Vec::new(),
        cancelled: done.is_err(),
        known: None,
        model: fitted,
        history,
    })
}

/// An `rls` with `n` parameters, starting from zero, by way of the registry.
fn estimator(n: usize) -> Result<Box<dyn Estimator<f64>>, FitError> {
    let source = "rls = { initial_covariance = 1e9 }";
    let part: Box<dyn EstimatorPart> = loopsight_model::config::TomlSource::parse("rls", source)
        .and_then(|s| s.read())
        .map_err(|_| FitError::NoEstimator("rls".to_owned()))?;
    Ok(part.build(&vec![0.0; n])?)
}
