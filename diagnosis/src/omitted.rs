//! What a log's clock leaves open in the parameters.
//!
//! No model of a machine is exact, and what every model leaves out is what is faster than the log: windings, filters,
//! the instant within a period at which an input acted. Such a thing moves the whole response by a little time `δ`.
//! It is too little to be found as an effect, but a long log determines parameters so sharply that it is many of
//! their standard errors.

use nalgebra::{DMatrix, DVector};

use crate::criteria::ParameterCriteria;
use crate::noise;
use crate::prediction::predict_with;
use crate::problem::Problem;
use crate::progress::Cancelled;

/// Standard errors beyond which a shift counts: `√2`, from where a model with it predicts better (H. Akaike, 1974, "A new
/// look at the statistical model identification").
const EARNED: f64 = std::f64::consts::SQRT_2;

/// A shift of the response in time, in periods of the log, as it stands in a linearised fit.
pub(crate) struct Shift {
    /// Change of the unknowns with it.
    along: DVector<f64>,
    /// Its size, periods.
    size: f64,
}

/// The size of a shift that was found with a standard error, where a clock is `known` to so much. None where it is
/// chance.
fn allowed(found: f64, error: f64, known: f64) -> Option<f64> {
    let tells = error < known;
    if tells && found.abs() <= EARNED * error {
        return None;
    }
    Some(if tells { found.abs() } else { known })
}

impl Shift {
    /// That of a fit by its sums alone: those of the unknowns, and as the last row and column those of `d`.
    ///
    /// `meat` is the covariance of `(J, d)ᵀ r`. For the rest see [`Problem::shift`].
    pub(crate) fn of_sums(
        gram: &DMatrix<f64>,
        right: &DVector<f64>,
        meat: &DMatrix<f64>,
        inverse: &DMatrix<f64>,
        criteria: &ParameterCriteria,
    ) -> Option<Self> {
        let n = inverse.ncols();
        let along = -(inverse * gram.view((0, n), (n, 1)).column(0));
        let beside = along.clone().push(1.0);
        let (whole, left) = (gram[(n, n)], (gram * &beside).dot(&beside));
        if !(whole > 0.0 && whole.is_finite() && along.iter().all(|v| v.is_finite())) {
            return None;
        }
        let size = if left > criteria.flat * whole {
            let error = (meat * &beside).dot(&beside).max(0.0).sqrt() / left;
            allowed(right.dot(&beside) / left, error, criteria.clock)?
        } else {
            criteria.clock
        };
        Some(Self { along, size })
    }

    /// Adds what it leaves open to the covariance of the unknowns.
    pub(crate) fn widen(&self, covariance: &mut DMatrix<f64>) {
        *covariance += &self.along * self.along.transpose() * self.size.powi(2);
    }
}

impl Problem<'_> {
    /// How the unknowns would change with a shift of the response in time, and how large a shift the log allows.
    ///
    /// With the residual `r` and its Jacobian `J` at the solution, and `d = ∂r/∂δ = ŷ'·T` for a shift in periods `T`
    /// of the log, a small shift changes the unknowns by
    ///
    /// ```text
    /// ∂θ/∂δ = -(JᵀJ)⁻¹ Jᵀ d
    /// ```
    ///
    /// What is left of `d` beside the parameters, `e = d - J (JᵀJ)⁻¹ Jᵀ d`, tells the shift itself: `δ = -eᵀr/eᵀe`, with
    /// the standard error `s` of coloured noise. A `δ` beyond `√2` of these is an error of the model, and moves the
    /// parameters by that much; a smaller one is chance. Where a log cannot tell it better than its clock is
    /// known, that is what it may be: a delay among the parameters leaves nothing of `d`. (The bias of an omitted
    /// regressor: H. Theil, 1957, "Specification errors and the estimation of economic relationships".)
    pub(crate) fn shift(
        &self,
        at: &DVector<f64>,
        residual: &DVector<f64>,
        jacobian: &DMatrix<f64>,
        inverse: &DMatrix<f64>,
    ) -> Result<Option<Shift>, Cancelled> {
        let criteria = &self.work.criteria().parameters;
        let direction = self.shifted(at)?;
        let along = -(inverse * jacobian.tr_mul(&direction));
        let beside = &direction + jacobian * &along;
        let (whole, left) = (direction.norm_squared(), beside.norm_squared());
        if !(whole > 0.0 && whole.is_finite() && along.iter().all(|v| v.is_finite())) {
            return Ok(None);
        }
        // Rounding errors are all that is left of a direction within those of the parameters.
        let size = if left > criteria.flat * whole {
            let found = beside.dot(residual) / left;
            let column = DMatrix::from_column_slice(beside.len(), 1, beside.as_slice());
            let inverse = DMatrix::from_element(1, 1, 1.0 / left);
            let blocks = self.blocks(residual, &column);
            let n_signals = self.model.measured.len();
            let variance = noise::covariance(&blocks, n_signals, &inverse, 1, &self.work)?[(0, 0)];
            allowed(found, variance.max(0.0).sqrt(), criteria.clock)
        } else {
            Some(criteria.clock)
        };
        Ok(size.map(|size| Shift { along, size }))
    }

    /// The change of the residuals with a shift of one period.
    fn shifted(&self, at: &DVector<f64>) -> Result<DVector<f64>, Cancelled> {
        let (values, states) = self.unpack(at);
        let n = self.model.measured.len();
        let rows: usize = self.runs.iter().map(|run| run.len() * n).sum();
        let mut direction = DMatrix::zeros(rows, 1);
        let mut first_row = 0;
        for (index, (run, x0)) in self.runs.iter().zip(&states).enumerate() {
            let positions = self.positions.as_ref();
            let x0 = x0.as_slice();
            let predicted = predict_with(positions, self.model, &values, x0, run, &self.work)?;
            let time = run.time();
            let period = run.median_period();
            // The response before the run is not known: its first sample does not move.
            for k in 1..run.len() {
                let (before, after) = (k - 1, (k + 1).min(run.len() - 1));
                let span = time[after] - time[before];
                for signal in 0..n {
                    let row = k * n + signal;
                    if !run.measured()[row].is_finite() || span <= 0.0 {
                        continue;
                    }
                    let change = predicted[after * n + signal] - predicted[before * n + signal];
                    direction[(first_row + row, 0)] =
                        change / span * period * self.weight(index, row);
                }
            }
            self.filter_jacobian(index, first_row, run.len() * n, &mut direction);
            first_row += run.len() * n;
        }
        Ok(direction.column(0).into_owned())
    }
}
