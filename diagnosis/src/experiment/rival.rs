//! How far a rival stays from the truth after it did its best.

use loopsight_core::model::{Model, pseudo_inverse};
use loopsight_core::run::Run;
use nalgebra::{DMatrix, DVector};

use crate::experiment::Drive;
use crate::prediction::{predict, residuals, sensitivities};

/// What separates two models under one drive, in units of the sensors' noise.
#[derive(Clone, Debug)]
pub(crate) struct Distance {
    /// Squared distance by sample, summed over the signals.
    pub(crate) by_sample: Vec<f64>,
    /// Their sum.
    pub(crate) total: f64,
}

impl Distance {
    fn of(weighted: &DVector<f64>, n_signals: usize) -> Self {
        let by_sample: Vec<f64> = weighted
            .as_slice()
            .chunks_exact(n_signals.max(1))
            .map(|row| row.iter().map(|v| v * v).sum())
            .collect();
        Self {
            total: by_sample.iter().sum(),
            by_sample,
        }
    }
}

/// The noise-free response of `model` to `drive`, from rest.
pub(crate) fn response(model: &Model, values: &[f64], drive: &Drive) -> Run {
    let mut run = Run {
        time: drive.time.clone(),
        inputs: drive.inputs.clone(),
        n_inputs: model.plant.inputs.len(),
        n_measured: model.measured.len(),
        ..Run::default()
    };
    run.measured = predict(model, values, &vec![0.0; model.n_states()], &run);
    run
}

/// Fits the free parameters of `model` to `truth` from `start` by Gauss–Newton (steps halved until
/// they help, kept within the declared ranges) and returns what is left.
///
/// ```text
/// r = (y - ŷ(θ))/σ     θ <- θ + (JᵀJ)⁻¹ Jᵀ r,     J = ∂ŷ/∂θ /σ exact (dual numbers)
/// ```
pub(crate) fn rival(
    model: &Model,
    start: &[f64],
    truth: &Run,
    noise: &[f64],
    iterations: usize,
) -> Distance {
    let free: Vec<usize> = (0..model.parameters.len())
        .filter(|i| model.parameters[*i].free)
        .collect();
    let x0 = vec![0.0; model.n_states()];
    let weighted = |predicted: &[f64]| weigh(residuals(predicted, truth), noise);
    let mut values = start.to_vec();
    let mut left = weighted(&predict(model, &values, &x0, truth));
    for _ in 0..iterations {
        let s = sensitivities(model, &values, &x0, truth, &free, &[]);
        let jacobian = scaled(model, &free, s.jacobian, noise);
        let gram = jacobian.tr_mul(&jacobian);
        let Some(inverse) = pseudo_inverse(&gram) else {
            break;
        };
        let step = inverse * jacobian.tr_mul(&left);
        let before = left.norm_squared();
        let mut taken = false;
        for halving in 0..5 {
            let share = 0.5f64.powi(halving);
            let mut tried = values.clone();
            for (k, i) in free.iter().enumerate() {
                let parameter = &model.parameters[*i];
                let change = share * step[k] * parameter.scale();
                tried[*i] = parameter.declaration.nearest(values[*i] + change);
            }
            let after = weighted(&predict(model, &tried, &x0, truth));
            if after.norm_squared() < before {
                values = tried;
                left = after;
                taken = true;
                break;
            }
        }
        if !taken || left.norm_squared() > 0.999 * before {
            break;
        }
    }
    Distance::of(&left, noise.len())
}

/// `(JᵀJ)` of the parameters `free` under `drive`, in units of their scales and of the noise.
pub(crate) fn information(
    model: &Model,
    values: &[f64],
    drive: &Drive,
    free: &[usize],
    noise: &[f64],
) -> DMatrix<f64> {
    let run = response(model, values, drive);
    let x0 = vec![0.0; model.n_states()];
    let s = sensitivities(model, values, &x0, &run, free, &[]);
    let jacobian = scaled(model, free, s.jacobian, noise);
    jacobian.tr_mul(&jacobian)
}

/// Standard errors from an information matrix; infinite where a parameter, or a combination it is
/// part of, has no influence.
pub(crate) fn standard_errors(information: &DMatrix<f64>) -> Vec<f64> {
    let n = information.nrows();
    if information.iter().any(|v| !v.is_finite()) {
        return vec![f64::INFINITY; n];
    }
    // To a unit diagonal first: what is small by its unit is not flat.
    let size: Vec<f64> = (0..n).map(|i| information[(i, i)].sqrt()).collect();
    let unit = DMatrix::from_fn(n, n, |i, j| {
        let product = size[i] * size[j];
        if product > 0.0 {
            information[(i, j)] / product
        } else {
            0.0
        }
    });
    let eigen = unit.symmetric_eigen();
    (0..n)
        .map(|i| {
            if size[i] == 0.0 {
                return f64::INFINITY;
            }
            let variance: f64 = (0..n)
                .map(|k| {
                    let part = eigen.eigenvectors[(i, k)].powi(2);
                    let value = eigen.eigenvalues[k];
                    if value > FLAT {
                        part / value
                    } else if part > 1e-6 {
                        f64::INFINITY
                    } else {
                        0.0
                    }
                })
                .sum();
            variance.sqrt() / size[i]
        })
        .collect()
}

/// Eigenvalue of the normalised information below which a combination is not determined.
const FLAT: f64 = 1e-10;

fn weigh(mut residual: DVector<f64>, noise: &[f64]) -> DVector<f64> {
    for (k, value) in residual.iter_mut().enumerate() {
        *value /= noise[k % noise.len()];
        // A rival that left the finite numbers explains nothing, but must not poison a sum.
        if !value.is_finite() {
            *value = 1e9;
        }
    }
    residual
}

/// In units of the noise per noticeable change.
fn scaled(
    model: &Model,
    free: &[usize],
    mut jacobian: DMatrix<f64>,
    noise: &[f64],
) -> DMatrix<f64> {
    for (column, i) in free.iter().enumerate() {
        let scale = model.parameters[*i].scale();
        for (row, value) in jacobian.column_mut(column).iter_mut().enumerate() {
            *value *= scale / noise[row % noise.len()];
        }
    }
    jacobian
}
