//! The solution of a least-squares problem: Levenberg–Marquardt within bounds.

use std::rc::Rc;

use nalgebra::DVector;

use crate::error::FitError;
use crate::levenberg_marquardt::{LeastSquares, minimise};
use crate::linearised::Linearised;
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
    /// Of a short fit, the root of the cost that it must come below to be worth going on with.
    pub(crate) worth: Option<f64>,
}

impl Effort {
    /// Until changes are far below the standard errors.
    pub(crate) const FULL: Self = Self {
        iterations: 100,
        tolerance: 1e-9,
        worth: None,
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
        let borrowed = Borrowed(self, effort);
        let (solution, settled) = minimise(&borrowed, start, effort)?;
        if solution.iter().any(|v| !v.is_finite()) {
            return Err(FitError::Solver(
                "the parameters became infinite".to_owned(),
            ));
        }
        Ok((solution, settled))
    }
}

/// The problem as the solver sees it.
struct Borrowed<'p, 'a>(&'p Problem<'a>, Effort);

impl LeastSquares for Borrowed<'_, '_> {
    type Error = Cancelled;

    fn residual(&self, scaled: &DVector<f64>) -> Result<DVector<f64>, Cancelled> {
        self.0.residual_vector(scaled)
    }

    /// One simulation gives both the prediction and its derivatives.
    fn linearise(&self, scaled: &DVector<f64>) -> Result<Rc<Linearised>, Cancelled> {
        let linear = self.0.linearise(scaled)?;
        let done = self.0.evaluations.get() + 1;
        self.0.evaluations.set(done);
        let error = Some(linear.residual.norm());
        let total = self.1.iterations.max(done);
        self.0.work.tell_error(Stage::Fitting, done, total, error);
        Ok(linear)
    }

    fn bounds(&self) -> (&DVector<f64>, &DVector<f64>) {
        (&self.0.lower, &self.0.upper)
    }
}
