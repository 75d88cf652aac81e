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
    let of = |seeded: &[Dual]| -> Vec<Dual> {
        let derived = model.derived(seeded).into_iter();
        derived.map(|(_, value)| value).collect()
    };
    let found = with_gradients(model, known, of).into_iter();
    let metas = model.derived(&model.values()).into_iter();
    metas
        .zip(found)
        .filter(|(_, (value, _))| value.is_finite())
        .map(|((meta, _), (value, gradient))| {
            let estimate = estimate(meta.unit, value, &gradient, known);
            (meta.id.to_owned(), estimate)
        })
        .collect()
}

/// Quantities `of` the parameters at the model's values, each with its gradient by the estimated ones.
pub(crate) fn with_gradients(
    model: &Model,
    known: Option<&Known>,
    of: impl Fn(&[Dual]) -> Vec<Dual>,
) -> Vec<(f64, Vec<f64>)> {
    let values = model.values();
    let free = known.map_or(&[][..], |known| &known.free);
    let mut found = Vec::new();
    // At least once, for the values.
    for first in (0..free.len().max(1)).step_by(DUAL_WIDTH) {
        let of_pass = &free[first..(first + DUAL_WIDTH).min(free.len())];
        let mut seeded: Vec<Dual> = values.iter().map(|value| Dual::of(*value)).collect();
        for (k, index) in of_pass.iter().enumerate() {
            seeded[*index] = variable(values[*index], k);
        }
        let pass = of(&seeded);
        found.resize_with(pass.len(), || (0.0, Vec::new()));
        for ((value, gradient), quantity) in found.iter_mut().zip(&pass) {
            *value = quantity.value();
            gradient.extend((0..of_pass.len()).map(|k| derivative(quantity, k)));
        }
    }
    found
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
