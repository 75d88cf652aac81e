//! The solution of a least-squares problem: Levenberg–Marquardt within bounds.

use basin::{
    BoundedLevenbergMarquardt, BoxBounds, ConstraintDescription, ConstraintSet,
    ConstraintSolveError, Constraints, Executor, Jacobian, Residual, Termination,
};
use nalgebra::{DMatrix, DVector};

use crate::error::FitError;
use crate::prediction::Solution;
use crate::problem::Problem;
use crate::progress::{Cancelled, Stage};

/// When a fit stops.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Effort {
    /// Most iterations.
    pub(crate) iterations: u64,
    /// Relative change of the cost below which it has converged.
    pub(crate) tolerance: f64,
}

impl Effort {
    /// Until changes are far below the standard errors.
    pub(crate) const FULL: Self = Self {
        iterations: 100,
        tolerance: 1e-9,
    };
}

impl Problem<'_> {
    /// Solves from `values` and `states`.
    pub(crate) fn solve_from(
        &mut self,
        values: &[f64],
        states: &[DVector<f64>],
        effort: Effort,
    ) -> Result<Solution, FitError> {
        let start = self.pack(values, states);
        let start = self.balance(start)?;
        self.finish(&start, effort)
    }

    /// Solves from scaled unknowns.
    pub(crate) fn finish(
        &self,
        start: &DVector<f64>,
        effort: Effort,
    ) -> Result<Solution, FitError> {
        Ok(self.solution(&self.solve(start, effort)?))
    }

    /// The scaled unknowns of least cost, from `start`.
    pub(crate) fn solve(
        &self,
        start: &DVector<f64>,
        effort: Effort,
    ) -> Result<DVector<f64>, FitError> {
        Ok(self.solve_and_tell(start, effort)?.0)
    }

    /// As [`Problem::solve`], and whether the cost stopped falling before the iterations ended.
    pub(crate) fn solve_and_tell(
        &self,
        start: &DVector<f64>,
        effort: Effort,
    ) -> Result<(DVector<f64>, bool), FitError> {
        let solver = BoundedLevenbergMarquardt::<DVector<f64>, DMatrix<f64>>::new()
            .with_absolute_scaled_gradient_tolerance(1e-14)
            .with_tau(1e-6)
            .with_relative_cost_change_tolerance(effort.tolerance)
            .with_relative_step_tolerance(1e-10);
        let result = Executor::from_start(Borrowed(self, effort), solver, start.clone())
            .max_iter(effort.iterations)
            .run();
        let result = match result {
            Ok(result) => result,
            Err(ConstraintSolveError::Evaluation(cancelled)) => return Err(cancelled.into()),
            Err(error) => return Err(FitError::Solver(error.to_string())),
        };
        let solution = result.param().clone();
        if solution.iter().any(|v| !v.is_finite()) {
            return Err(FitError::Solver(
                "the parameters became infinite".to_owned(),
            ));
        }
        let settled = !matches!(result.report.termination, Termination::Limit(_));
        Ok((solution, settled))
    }
}

/// The problem as the solver sees it.
struct Borrowed<'p, 'a>(&'p Problem<'a>, Effort);

impl Residual for Borrowed<'_, '_> {
    type Param = DVector<f64>;
    type Output = DVector<f64>;
    type Error = Cancelled;
    fn residual(&self, scaled: &DVector<f64>) -> Result<DVector<f64>, Cancelled> {
        self.0.residual_vector(scaled)
    }
}

impl Jacobian for Borrowed<'_, '_> {
    type Jacobian = DMatrix<f64>;
    fn jacobian(&self, scaled: &DVector<f64>) -> Result<DMatrix<f64>, Cancelled> {
        Ok(self.residual_and_jacobian(scaled)?.1)
    }
    /// One simulation gives both the prediction and its derivatives.
    fn residual_and_jacobian(
        &self,
        scaled: &DVector<f64>,
    ) -> Result<(DVector<f64>, DMatrix<f64>), Cancelled> {
        let (residual, jacobian) = self.0.linearise(scaled)?;
        let done = self.0.evaluations.get() + 1;
        self.0.evaluations.set(done);
        let error = Some(residual.norm());
        let total = self.1.iterations.max(done);
        self.0.work.tell_error(Stage::Fitting, done, total, error);
        Ok((residual, jacobian))
    }
}

impl Constraints for Borrowed<'_, '_> {
    type Set = ConstraintSet<BoxBounds<DVector<f64>>>;
    fn constraints(&self) -> <Self::Set as ConstraintDescription>::Borrowed<'_> {
        ConstraintSet::new().with_bounds(BoxBounds::new(Some(&self.0.lower), Some(&self.0.upper)))
    }
}
