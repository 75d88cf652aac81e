//! Regressions over whole recordings.

use loopsight_core::model::{Model, pseudo_inverse};
use loopsight_core::regression::RegressionError;
pub use loopsight_core::regression::{Regression, Scheme};
use loopsight_core::run::Run;
use nalgebra::{DMatrix, DVector};

use crate::fit::FitError;

impl From<RegressionError> for FitError {
    fn from(error: RegressionError) -> Self {
        match error {
            RegressionError::NoControlledStates(plant) => FitError::NoRegression(plant),
            RegressionError::NotLinear(parameter) => FitError::NotLinear { parameter },
            RegressionError::Unknown(parameter) => FitError::Unknown(vec![parameter]),
        }
    }
}

/// Calls `each(row, time, φ, y)` for every regression that the samples of `runs` give.
pub(crate) fn for_each_row(
    regression: &mut Regression,
    runs: &[Run],
    mut each: impl FnMut(usize, f64, &[f64], f64),
) {
    let mut offset = 0.0;
    for run in runs {
        regression.restart();
        for k in 0..run.len() {
            let input = run.input(k.saturating_sub(1));
            if regression.push(run.time[k], run.sample(k), input) {
                for row in 0..regression.len() {
                    let (phi, y) = regression.row(row);
                    each(row, offset + run.time[k], phi, y);
                }
            }
        }
        offset += run.duration();
    }
}

/// Ordinary least squares over all samples: a starting point for a fit that needs one.
///
/// Parameters that are free but enter non-linearly keep the model's value; values that the samples
/// do not determine are those of least norm.
pub(crate) fn batch(model: &Model, runs: &[Run], scheme: Scheme) -> Result<Vec<f64>, FitError> {
    let mut linear = model.clone();
    for parameter in &mut linear.parameters {
        if !parameter.declaration.linear && parameter.value.is_some() {
            parameter.free = false;
        }
    }
    let mut regression = Regression::new(&linear, scheme)?;
    let mut grams: Vec<(DMatrix<f64>, DVector<f64>)> = (0..regression.len())
        .map(|row| {
            let n = regression.parameters(row).len();
            (DMatrix::zeros(n, n), DVector::zeros(n))
        })
        .collect();
    for_each_row(&mut regression, runs, |row, _, phi, y| {
        let (gram, right) = &mut grams[row];
        for (i, a) in phi.iter().enumerate() {
            right[i] += a * y;
            for (j, b) in phi.iter().enumerate() {
                gram[(i, j)] += a * b;
            }
        }
    });
    let mut values: Vec<f64> = linear
        .parameters
        .iter()
        .map(|p| p.value.unwrap_or(0.0))
        .collect();
    for (row, (gram, right)) in grams.iter().enumerate() {
        if let Some(inverse) = pseudo_inverse(gram) {
            let theta = inverse * right;
            for (k, j) in regression.parameters(row).iter().enumerate() {
                values[*j] = theta[k];
            }
        }
    }
    Ok(values)
}
