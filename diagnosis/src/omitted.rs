//! What a model leaves out, and what that leaves open in the parameters.
//!
//! No model of a machine is exact. It leaves out what is faster than the log: windings, filters, the instant within a
//! period at which an input acted. Such a thing moves the whole response by a little time `δ`. And it smooths the sign
//! of dry friction over a small speed, for the sake of the integrator. Both are too little to be found as an effect,
//! but a long log determines parameters so sharply that they are many of their standard errors.

use nalgebra::{DMatrix, DVector};

use crate::noise::{self, Arma};
use crate::problem::Problem;
use crate::progress::Cancelled;

/// Standard errors beyond which an omission counts: `√2`, from where a model with it predicts better (H. Akaike, 1974,
/// "A new look at the statistical model identification").
const EARNED: f64 = std::f64::consts::SQRT_2;
/// What a width is divided by to see what it does. That goes half of the way to a sharp sign, so the change is doubled.
pub(crate) const SHARPER: f64 = 2.0;

/// Something that a model leaves out.
pub(crate) struct Omission {
    /// The change of the residuals with it.
    direction: DVector<f64>,
    /// The size that it may have where the log cannot tell it better.
    known: f64,
}

/// What it does to a fit.
pub(crate) struct Omitted {
    /// Change of the unknowns with it.
    along: DVector<f64>,
    /// Its size.
    size: f64,
}

/// The size of what was found with a standard error, where it is `known` to so much. None where it is chance.
fn allowed(found: f64, error: f64, known: f64) -> Option<f64> {
    let tells = error < known;
    if tells && found.abs() <= EARNED * error {
        return None;
    }
    Some(if tells { found.abs() } else { known })
}

impl Omitted {
    /// That of a fit by its sums alone: those of the unknowns, and as the row and column `extra` those of `d`.
    ///
    /// `meat` is the covariance of the products of all rows with `r`. A direction of which less than `flat` is left
    /// beside the parameters is none. For the rest see [`Problem::omitted`].
    pub(crate) fn of_sums(
        (gram, right, meat): (&DMatrix<f64>, &DVector<f64>, &DMatrix<f64>),
        inverse: &DMatrix<f64>,
        extra: usize,
        known: f64,
        flat: f64,
    ) -> Option<Self> {
        let n = inverse.ncols();
        let along = -(inverse * gram.view((0, extra), (n, 1)).column(0));
        let mut beside = along.clone().resize_vertically(gram.nrows(), 0.0);
        beside[extra] = 1.0;
        let (whole, left) = (gram[(extra, extra)], (gram * &beside).dot(&beside));
        if !(whole > 0.0 && whole.is_finite() && along.iter().all(|v| v.is_finite())) {
            return None;
        }
        let size = if left > flat * whole {
            let error = (meat * &beside).dot(&beside).max(0.0).sqrt() / left;
            allowed(right.dot(&beside) / left, error, known)?
        } else {
            known
        };
        Some(Self { along, size })
    }

    /// Adds what it leaves open to the covariance of the unknowns.
    pub(crate) fn widen(&self, covariance: &mut DMatrix<f64>) {
        *covariance += &self.along * self.along.transpose() * self.size.powi(2);
    }
}

impl Problem<'_> {
    /// How the unknowns would change with what the model leaves out, and how much of it the log allows.
    ///
    /// With the residual `r`, the models of its `noise`, and its Jacobian `J` at the solution, and the change `d = ∂r/∂δ` of
    /// the residuals with what is left out, a small `δ` changes the unknowns by
    ///
    /// ```text
    /// ∂θ/∂δ = -(JᵀJ)⁻¹ Jᵀ d
    /// ```
    ///
    /// What is left of `d` beside the parameters, `e = d - J (JᵀJ)⁻¹ Jᵀ d`, tells `δ` itself: `δ = -eᵀr/eᵀe`, with the
    /// standard error `s` of coloured noise. A `δ` beyond `√2` of these is an error of the model, and moves the parameters
    /// by that much; a smaller one is chance. Where a log cannot tell it better than it is known beforehand, that is what
    /// it may be: a delay among the parameters leaves nothing of a shift in time. (The bias of an omitted regressor: H.
    /// Theil, 1957, "Specification errors and the estimation of economic relationships".)
    pub(crate) fn omitted(
        &self,
        omission: &Omission,
        (residual, noise): (&DVector<f64>, &[Arma]),
        jacobian: &DMatrix<f64>,
        inverse: &DMatrix<f64>,
    ) -> Result<Option<Omitted>, Cancelled> {
        let Omission { direction, known } = omission;
        let along = -(inverse * jacobian.tr_mul(direction));
        let beside = direction + jacobian * &along;
        let (whole, left) = (direction.norm_squared(), beside.norm_squared());
        if !(whole > 0.0 && whole.is_finite() && along.iter().all(|v| v.is_finite())) {
            return Ok(None);
        }
        // Rounding errors are all that is left of a direction within those of the parameters.
        let size = if left > self.work.criteria().parameters.flat * whole {
            let found = beside.dot(residual) / left;
            let column = DMatrix::from_column_slice(beside.len(), 1, beside.as_slice());
            let inverse = DMatrix::from_element(1, 1, 1.0 / left);
            let blocks = self.blocks(residual, &column);
            let variance = noise::covariance(&blocks, noise, &inverse, 1, &self.work)?[(0, 0)];
            allowed(found, variance.max(0.0).sqrt(), *known)
        } else {
            Some(*known)
        };
        Ok(size.map(|size| Omitted { along, size }))
    }

    /// What the model leaves out at a solution: `δ` is a shift of the response in periods of the log, and the share of
    /// its way that the smoothing of signs goes to none.
    pub(crate) fn omissions(&self, at: &DVector<f64>) -> Result<Vec<Omission>, Cancelled> {
        let (values, states) = self.unpack(at);
        let predicted = self.free_runs(&values, &states)?;
        let sharper = self.sharper(&values);
        let sharp = sharper.map(|values| self.free_runs(&values, &states));
        let sharp = sharp.transpose()?;
        let n = self.model.measured.len();
        let rows: usize = self.runs.iter().map(|run| run.len() * n).sum();
        // The columns are that of the shift and that of the sharp signs.
        let columns = 1 + usize::from(sharp.is_some());
        let mut directions = DMatrix::zeros(rows, columns);
        let mut first_row = 0;
        for (index, (run, predicted)) in self.runs.iter().zip(&predicted).enumerate() {
            let sharp = sharp.as_ref().map(|sharp| &sharp[index]);
            let time = run.time();
            let period = run.median_period();
            for k in 0..run.len() {
                // The response before the run is not known: its first sample does not move.
                let (before, after) = (k.saturating_sub(1), (k + 1).min(run.len() - 1));
                let span = time[after] - time[before];
                for signal in 0..n {
                    let row = k * n + signal;
                    if !run.measured()[row].is_finite() {
                        continue;
                    }
                    let weight = self.weight(index, row);
                    let to = first_row + row;
                    if k > 0 && span > 0.0 {
                        let change = predicted[after * n + signal] - predicted[before * n + signal];
                        directions[(to, 0)] = change / span * period * weight;
                    }
                    if let Some(sharp) = sharp {
                        directions[(to, 1)] = SHARPER * (predicted[row] - sharp[row]) * weight;
                    }
                }
            }
            self.filter_jacobian(index, first_row, run.len() * n, &mut directions);
            first_row += run.len() * n;
        }
        let known = [self.work.criteria().parameters.clock, 1.0];
        let columns = directions.column_iter().zip(known);
        let omissions = columns.map(|(direction, known)| Omission {
            direction: direction.into_owned(),
            known,
        });
        Ok(omissions.collect())
    }

    /// The parameter `values` with all signs half as smooth, but for those whose width is estimated; none where the model
    /// smooths no other.
    pub(crate) fn sharper(&self, values: &[f64]) -> Option<Vec<f64>> {
        let parameters = self.model.parameters.iter();
        let mut sharper = values.to_vec();
        let mut any = false;
        for (value, parameter) in sharper.iter_mut().zip(parameters) {
            if parameter.declaration.is_width() && !parameter.free {
                any = true;
                *value /= SHARPER;
            }
        }
        any.then_some(sharper)
    }
}
