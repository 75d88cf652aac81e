//! How far a rival model stays from the true one after it was fitted to it.

use loopsight_model::model::{Model, pseudo_inverse};
use loopsight_model::run::{Rows, Run};
use loopsight_model::sensor::Sensor;
use nalgebra::{DMatrix, DVector};

use crate::experiment::Drive;
use crate::noise::Arma;
use crate::prediction::{predict, residuals};
use crate::progress::{Cancelled, Work};
use crate::sensitivities::{By, sensitivities};

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
pub(crate) fn response(
    model: &Model,
    values: &[f64],
    drive: &Drive,
    work: &Work<'_>,
) -> Result<Run, Cancelled> {
    // The instants of a drive increase, and it has one row of inputs for each: there is such a run.
    let inputs = Rows::new(model.plant.inputs.len(), drive.inputs.clone());
    let width = model.measured.len();
    let measured = Rows::new(width, vec![f64::NAN; width * drive.time.len()]);
    let run = Run::new("", drive.time.clone(), inputs, measured).unwrap_or_default();
    let predicted = predict(model, values, &vec![0.0; model.n_states()], &run, work)?;
    Ok(run.with_measured(predicted).unwrap_or_default())
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
    work: &Work<'_>,
) -> Result<Distance, Cancelled> {
    let free: Vec<usize> = (0..model.parameters.len())
        .filter(|i| model.parameters[*i].free)
        .collect();
    let x0 = vec![0.0; model.n_states()];
    let weighted = |predicted: &[f64]| weigh(residuals(predicted, truth), noise);
    let mut values = start.to_vec();
    let mut left = weighted(&predict(model, &values, &x0, truth, work)?);
    let by = By {
        parameters: &free,
        states: &[],
    };
    for _ in 0..iterations {
        let s = sensitivities(None, model, &values, &x0, truth, by, work)?;
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
            let after = weighted(&predict(model, &tried, &x0, truth, work)?);
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
    Ok(Distance::of(&left, noise.len()))
}

/// What a recording says about parameters, in units of their scales and of the noise.
pub(crate) struct Information {
    /// `JᵀJ`.
    gram: DMatrix<f64>,
    /// `Jᵀ cov(e) J`.
    meat: DMatrix<f64>,
}

/// What `drive` says about the parameters `free`.
///
/// Noise is white but for encoders: their rounding is differenced, `e(k) = q(k) - q(k-1)`, and so
/// nearly absent from slow motion.
pub(crate) fn information(
    model: &Model,
    values: &[f64],
    drive: &Drive,
    free: &[usize],
    noise: &[f64],
    work: &Work<'_>,
) -> Result<Information, Cancelled> {
    let run = response(model, values, drive, work)?;
    let x0 = vec![0.0; model.n_states()];
    let by = By {
        parameters: free,
        states: &[],
    };
    let s = sensitivities(None, model, values, &x0, &run, by, work)?;
    let jacobian = scaled(model, free, s.jacobian, noise);
    let mut coloured = jacobian.clone();
    let n = noise.len();
    for mut column in coloured.column_iter_mut() {
        for (signal, measured) in model.measured.iter().enumerate() {
            if matches!(measured.sensor, Sensor::EncoderCounts(_)) {
                let mut own: Vec<f64> = column.iter().skip(signal).step_by(n).copied().collect();
                DIFFERENCED.transpose(&mut own);
                for (k, value) in own.into_iter().enumerate() {
                    column[k * n + signal] = value * DIFFERENCED.variance.sqrt();
                }
            }
        }
    }
    Ok(Information {
        gram: jacobian.tr_mul(&jacobian),
        meat: coloured.tr_mul(&coloured),
    })
}

/// Differenced rounding of unit variance.
const DIFFERENCED: Arma = Arma {
    a: 0.0,
    c: -1.0,
    variance: 0.5,
};

/// Standard errors of a least-squares fit, `(JᵀJ)⁻¹ Jᵀ cov(e) J (JᵀJ)⁻¹`; infinite where a
/// parameter, or a combination it is part of, has no influence.
pub(crate) fn standard_errors(information: &Information, flat: f64) -> Vec<f64> {
    let least = flat;
    let Information { gram, meat } = information;
    let n = gram.nrows();
    if gram.iter().chain(meat).any(|v| !v.is_finite()) {
        return vec![f64::INFINITY; n];
    }
    // To a unit diagonal first: what is small by its unit is not flat.
    let size: Vec<f64> = (0..n).map(|i| gram[(i, i)].sqrt()).collect();
    let unit = |of: &DMatrix<f64>| {
        DMatrix::from_fn(n, n, |i, j| {
            let product = size[i] * size[j];
            if product > 0.0 {
                of[(i, j)] / product
            } else {
                0.0
            }
        })
    };
    let eigen = unit(gram).symmetric_eigen();
    let inverted = eigen
        .eigenvalues
        .map(|v| if v > least { 1.0 / v } else { 0.0 });
    let vectors = &eigen.eigenvectors;
    let inverse = vectors * DMatrix::from_diagonal(&inverted) * vectors.transpose();
    let covariance = &inverse * unit(meat) * &inverse;
    (0..n)
        .map(|i| {
            let flat = (0..n).any(|k| inverted[k] == 0.0 && vectors[(i, k)].powi(2) > 1e-6);
            if size[i] == 0.0 || flat {
                f64::INFINITY
            } else {
                covariance[(i, i)].max(0.0).sqrt() / size[i]
            }
        })
        .collect()
}

fn weigh(mut residual: DVector<f64>, noise: &[f64]) -> DVector<f64> {
    for (k, value) in residual.iter_mut().enumerate() {
        *value /= noise[k % noise.len()];
        // A rival that diverged explains nothing, but must not make a sum infinite.
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
