//! Quantities that follow from a plant's fitted parameters, with intervals propagated from theirs.

use std::collections::BTreeMap;

use loopsight_core::Real;
use loopsight_model::model::Model;
use loopsight_model::{DUAL_WIDTH, Dual, derivative, variable};
use nalgebra::DMatrix;

use crate::estimate::{Estimate, ParameterVerdict};

/// What a fit knows of its estimated parameters together.
#[derive(Clone, Debug)]
pub struct Known {
    /// Their indices.
    pub(crate) free: Vec<usize>,
    /// Their covariance, in the parameters' units; rows and columns as in `free`.
    pub(crate) covariance: DMatrix<f64>,
    /// Those that the data do not determine: what depends on them has no interval.
    pub(crate) undetermined: Vec<bool>,
    /// Quantile of the intervals, in standard errors.
    pub(crate) quantile: f64,
    /// See [`ParameterCriteria::not_pinned`](crate::criteria::ParameterCriteria::not_pinned).
    pub(crate) not_pinned: f64,
}

/// The quantities that the plant derives from its parameters, at the model's values.
///
/// The standard error is `√(gᵀ C g)` with the exact gradient `g` by the estimated parameters and their
/// covariance `C`: linear propagation. Without `known` there is none.
pub(crate) fn derived(model: &Model, known: Option<&Known>) -> BTreeMap<String, Estimate> {
    let values = model.values();
    let mut gradients: Vec<Vec<f64>> = Vec::new();
    let free = known.map_or(&[][..], |k| &k.free);
    for first in (0..free.len()).step_by(DUAL_WIDTH) {
        let seeded: Vec<Dual> = values
            .iter()
            .enumerate()
            .map(|(i, v)| match free.iter().position(|f| *f == i) {
                Some(k) if (first..first + DUAL_WIDTH).contains(&k) => variable(*v, k - first),
                _ => Dual::of(*v),
            })
            .collect();
        let pass = model.derived(&seeded);
        gradients.resize(pass.len(), Vec::new());
        for (gradient, (_, value)) in gradients.iter_mut().zip(&pass) {
            let last = (first + DUAL_WIDTH).min(free.len());
            gradient.extend((0..last - first).map(|k| derivative(value, k)));
        }
    }
    model
        .derived(&values)
        .into_iter()
        .enumerate()
        .filter(|(_, (_, value))| value.is_finite())
        .map(|(index, (meta, value))| {
            let gradient = gradients.get(index).map_or(&[][..], Vec::as_slice);
            (
                meta.id.to_owned(),
                estimate(meta.unit, value, gradient, known),
            )
        })
        .collect()
}

/// A quantity with its `gradient` by the estimated parameters.
pub(crate) fn estimate(
    unit: &str,
    value: f64,
    gradient: &[f64],
    known: Option<&Known>,
) -> Estimate {
    let mut estimate = Estimate {
        value,
        unit: unit.to_owned(),
        std_error: None,
        interval95: None,
        verdict: ParameterVerdict::Frozen,
    };
    let Some(known) = known else { return estimate };
    if gradient.iter().all(|g| *g == 0.0) {
        return estimate;
    }
    let undetermined = gradient
        .iter()
        .zip(&known.undetermined)
        .any(|(g, u)| *u && *g != 0.0);
    if undetermined {
        estimate.verdict = ParameterVerdict::Flat;
        return estimate;
    }
    let mut variance = 0.0;
    for (i, a) in gradient.iter().enumerate() {
        for (j, b) in gradient.iter().enumerate() {
            variance += a * b * known.covariance[(i, j)];
        }
    }
    let error = variance.max(0.0).sqrt();
    estimate.std_error = Some(error);
    let half = known.quantile * error;
    estimate.interval95 = Some([value - half, value + half]);
    estimate.verdict = if half > known.not_pinned * value.abs() {
        ParameterVerdict::NotPinned
    } else {
        ParameterVerdict::Good
    };
    estimate
}
