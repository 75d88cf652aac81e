//! The free runs that a fit ended with, so that who judges it need not simulate them again.

use nalgebra::DVector;

use crate::prediction::Solution;
use crate::problem::Problem;

/// The free runs of a solution.
pub(crate) struct Kept {
    /// The root of its cost.
    error: f64,
    solution: Solution,
    predicted: Vec<Vec<f64>>,
}

impl Problem<'_> {
    /// Keeps the free runs of the solution of least error.
    pub(crate) fn keep_runs(
        &self,
        residual: &DVector<f64>,
        values: &[f64],
        states: &[DVector<f64>],
        predicted: Vec<Vec<f64>>,
    ) {
        let error = residual.norm();
        let mut kept = self.kept.borrow_mut();
        if error.is_finite() && kept.as_ref().is_none_or(|best| error < best.error) {
            let (values, states) = (values.to_vec(), states.to_vec());
            *kept = Some(Kept {
                error,
                solution: Solution { values, states },
                predicted,
            });
        }
    }

    /// The free runs of a solution, row by row; none where they were not kept, or positions are measured ones.
    pub(crate) fn runs_of(&self, solution: &Solution) -> Option<Vec<Vec<f64>>> {
        let kept = self.kept.take().filter(|_| self.positions.is_none())?;
        (kept.solution == *solution).then_some(kept.predicted)
    }
}
