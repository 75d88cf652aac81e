//! What a linearised fit says: values, standard errors, intervals, verdicts.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ContinuousCDF, StudentsT};

use crate::compare::Comparison;
use crate::derived::{Known, derived};
use crate::estimate::{Estimate, ParameterVerdict};
use crate::fitted::Fit;
use crate::flatness::Flatness;
use crate::problem::Problem;
use crate::settings::Method;

impl Problem<'_> {
    /// The parameter values at a solution; those next to the end of their range are there.
    pub(crate) fn values_at(&self, solution: &DVector<f64>) -> Vec<f64> {
        let (mut values, _) = self.unpack(solution);
        for i in &self.free {
            // The solver stays strictly inside the range. A value next to the end means the end.
            let declaration = self.model.parameters[*i].declaration;
            for end in [declaration.bounds().0, declaration.bounds().1] {
                if (values[*i] - end).abs() < 1e-9 * self.model.parameters[*i].scale() {
                    values[*i] = end;
                }
            }
        }
        values
    }

    /// Half the width of an interval, in standard errors, where so many unknowns were estimated.
    pub(crate) fn quantile(&self, unknowns: usize) -> f64 {
        let wanted = self.work.criteria().parameters.quantile;
        StudentsT::new(0.0, 1.0, (self.samples - unknowns as f64).max(1.0))
            .map_or(1.96, |t| t.inverse_cdf(wanted))
    }

    /// The fit with these `values`, whose scaled unknowns have this `covariance`.
    pub(crate) fn fit_of(
        &self,
        values: &[f64],
        covariance: &DMatrix<f64>,
        flatness: Flatness,
    ) -> Fit {
        let criteria = &self.work.criteria().parameters;
        let quantile = self.quantile(covariance.ncols());
        let mut fitted = self.model.clone();
        fitted.set_values(values);
        let mut parameters = BTreeMap::new();
        for (index, parameter) in fitted.parameters.iter().enumerate() {
            let Some(value) = parameter.value else {
                continue;
            };
            let mut estimate = Estimate {
                value,
                unit: parameter.unit.clone(),
                std_error: None,
                interval95: None,
                verdict: ParameterVerdict::Frozen,
            };
            let gradient = fitted.tie_gradient(index);
            if !gradient.is_empty() {
                estimate.verdict = ParameterVerdict::Tied;
                let by = |i: usize| self.free.iter().position(|f| *f == i);
                let steps: Vec<(usize, f64)> = gradient
                    .into_iter()
                    .filter_map(|(i, slope)| by(i).map(|k| (k, slope * self.scales[k])))
                    .collect();
                let known = |k: usize| !flatness.dead[k] && !flatness.flat[k];
                let variance: f64 = steps
                    .iter()
                    .flat_map(|a| steps.iter().map(move |b| (a, b)))
                    .map(|((i, a), (j, b))| a * b * covariance[(*i, *j)])
                    .sum();
                if steps.iter().all(|(k, _)| known(*k)) && variance.is_finite() && !steps.is_empty()
                {
                    let error = variance.max(0.0).sqrt();
                    estimate.std_error = Some(error);
                    estimate.interval95 =
                        Some([value - quantile * error, value + quantile * error]);
                }
            }
            if let Some(k) = self.free.iter().position(|i| *i == index) {
                let error = covariance[(k, k)].max(0.0).sqrt() * self.scales[k];
                let known = error.is_finite() && !flatness.dead[k] && !flatness.flat[k];
                let (low, high) = parameter.declaration.bounds();
                if known {
                    estimate.std_error = Some(error);
                    // The interval ends where the admissible range ends.
                    estimate.interval95 = Some([
                        (value - quantile * error).max(low),
                        (value + quantile * error).min(high),
                    ]);
                }
                let margin = criteria.at_bound * parameter.scale();
                estimate.verdict = if flatness.dead[k] {
                    ParameterVerdict::Dead
                } else if flatness.flat[k] {
                    ParameterVerdict::Flat
                } else if value - low < margin || high - value < margin {
                    ParameterVerdict::AtBound
                } else if quantile * error > criteria.not_pinned * value.abs() {
                    ParameterVerdict::NotPinned
                } else {
                    ParameterVerdict::Good
                };
            }
            parameters.insert(parameter.name.clone(), estimate);
        }
        let n = self.free.len();
        let known = Known {
            free: self.free.clone(),
            covariance: DMatrix::from_fn(n, n, |i, j| {
                covariance[(i, j)] * self.scales[i] * self.scales[j]
            }),
            undetermined: (0..n)
                .map(|k| flatness.dead[k] || flatness.flat[k])
                .collect(),
            quantile,
            not_pinned: criteria.not_pinned,
        };
        let error = self.best().map_or(f64::NAN, |(error, _)| error);
        Fit {
            comparison: Comparison::of_error(error),
            parameters,
            derived: derived(&fitted, Some(&known)),
            method: Method::OutputError,
            nrmse_before: None,
            nrmse_fit: error,
            iterations: self.evaluations.get(),
            convergence: None,
            flat: flatness.words,
            cancelled: false,
            known: Some(known),
            model: fitted,
            history: Vec::new(),
        }
    }
}
