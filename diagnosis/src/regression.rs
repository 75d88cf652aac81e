//! Regressions over whole recordings.

use loopsight_model::log_map::Hold;
use loopsight_model::model::{Model, pseudo_inverse};
pub(crate) use loopsight_model::regression::Regression;
use loopsight_model::regression::Scheme;
use loopsight_model::run::Run;
use nalgebra::{DMatrix, DVector};

use crate::error::FitError;
use crate::progress::{Cancelled, Work};
use crate::speeds::Speeds;

/// Calls `each(row, time, φ, y)` for every regression that the samples of `runs` give, read as `speeds` say.
///
/// A sample less than `span` s after the last one used is skipped, and its inputs are averaged into the next: a
/// difference over a longer time has less noise.
pub(crate) fn for_each_row(
    regression: &mut Regression,
    speeds: &Speeds<'_>,
    runs: &[Run],
    span: f64,
    work: &Work<'_>,
    mut each: impl FnMut(usize, f64, &[f64], f64),
) -> Result<(), Cancelled> {
    let mut offset = 0.0;
    for run in runs {
        regression.restart();
        let mut input = vec![0.0; run.n_inputs()];
        let mut last = 0;
        let mut read = Vec::new();
        for k in 0..run.len() {
            work.go_on()?;
            if k > 0 && run.time()[k] - run.time()[last] < span {
                continue;
            }
            // The mean of what was applied since the last sample used.
            input.fill(0.0);
            let elapsed = run.time()[k] - run.time()[last];
            for i in last..k {
                let share = (run.time()[i + 1] - run.time()[i]) / elapsed;
                let ends = run.input(i).iter().zip(run.input(i + 1));
                for (index, (mean, (value, next))) in input.iter_mut().zip(ends).enumerate() {
                    *mean += share
                        * match regression.hold(index) {
                            Hold::ZeroOrder => *value,
                            Hold::FirstOrder => 0.5 * (value + next),
                        };
                }
            }
            speeds.read(run, last, k, &mut read);
            last = k;
            if regression.push(run.time()[k], &read, &input) {
                for row in 0..regression.len() {
                    let (phi, y) = regression.row(row);
                    each(row, offset + run.time()[k], phi, y);
                }
            }
        }
        offset += run.duration();
    }
    Ok(())
}

/// Ordinary least squares over all samples: a starting point for a fit that needs one.
///
/// Parameters that are free but enter non-linearly, and those that move the rate of no state that is measured, keep the model's
/// value, or have the typical size of their declaration. Values that the samples do not determine are those of least norm. For `span` see
/// [`for_each_row`]. What differs from run to run has one value for all of them.
pub(crate) fn batch(
    model: &Model,
    runs: &[Run],
    scheme: Scheme,
    span: f64,
    work: &Work<'_>,
) -> Result<Vec<f64>, FitError> {
    let mut linear = model.shared().into_owned();
    for parameter in &mut linear.parameters {
        if parameter.free && !parameter.declaration.linear {
            let size = parameter.declaration.nearest(parameter.scale());
            parameter.value = parameter.value.or(Some(size));
            parameter.free = false;
        }
    }
    let speeds = Speeds::of(&linear);
    let mut regression = Regression::new(&speeds.model, scheme)?;
    let mut grams: Vec<(DMatrix<f64>, DVector<f64>)> = (0..regression.len())
        .map(|row| {
            let n = regression.parameters(row).len();
            (DMatrix::zeros(n, n), DVector::zeros(n))
        })
        .collect();
    for_each_row(
        &mut regression,
        &speeds,
        runs,
        span,
        work,
        |row, _, phi, y| {
            let (gram, right) = &mut grams[row];
            for (i, a) in phi.iter().enumerate() {
                right[i] += a * y;
                for (j, b) in phi.iter().enumerate() {
                    gram[(i, j)] += a * b;
                }
            }
        },
    )?;
    let mut values: Vec<f64> = (linear.parameters.iter().zip(0..))
        .map(|(p, index)| {
            let known = p.value.or(linear.tie(index).map(|_| 0.0));
            known.unwrap_or_else(|| p.declaration.nearest(p.scale()))
        })
        .collect();
    // A parameter that is tied to another one's row is in both. The row that determines it better counts.
    let mut told = vec![0.0; values.len()];
    for (row, (gram, right)) in grams.iter().enumerate() {
        if let Some(inverse) = pseudo_inverse(gram) {
            let theta = inverse * right;
            for (k, j) in regression.parameters(row).iter().enumerate() {
                if gram[(k, k)] >= told[*j] {
                    told[*j] = gram[(k, k)];
                    values[*j] = theta[k];
                }
            }
        }
    }
    Ok(values)
}
