//! The second pass of a fit, where residuals are those of rounded counts.

use nalgebra::{DMatrix, DVector};

use crate::noise;
use crate::problem::Problem;
use crate::progress::Cancelled;

impl Problem<'_> {
    /// Begins the second pass if the residuals at `solution` are those of rounded counts; returns its start.
    pub(crate) fn whiten(
        &mut self,
        solution: &DVector<f64>,
    ) -> Result<Option<DVector<f64>>, Cancelled> {
        let linear = self.linearise(solution)?;
        let residual = &linear.residual;
        let blocks = self.blocks(residual, &linear.jacobian);
        let criteria = &self.work.criteria().parameters;
        let n_signals = self.weights.len();
        let rounding: Vec<f64> = (noise::models(&blocks, n_signals, &self.work)?.iter())
            .map(|model| {
                let rounded = model.c < criteria.rounded && model.a.abs() < criteria.rounded_slow;
                if rounded { model.c } else { 0.0 }
            })
            .collect();
        if rounding.iter().all(|c| *c == 0.0) {
            return Ok(None);
        }
        self.rounding = rounding;
        self.forget();
        let more = self.runs.len() * n_signals;
        // `ε` is in units of the residuals of the first pass, so that all unknowns are of order one.
        let scale = residual.norm() / (residual.len() as f64).sqrt();
        self.scales.extend(std::iter::repeat_n(scale, more));
        self.lower = self
            .lower
            .clone()
            .resize_vertically(self.scales.len(), f64::NEG_INFINITY);
        self.upper = self
            .upper
            .clone()
            .resize_vertically(self.scales.len(), f64::INFINITY);
        let start = solution.clone();
        Ok(Some(start.resize_vertically(self.scales.len(), 0.0)))
    }

    /// First of the unknowns `ε` before the runs.
    fn first_before(&self) -> usize {
        self.free.len() + self.runs.len() * self.visible.len()
    }

    /// In the second pass, turns the weighted residuals of one run into `ε`.
    pub(crate) fn filter(&self, run: usize, residual: &mut [f64], scaled: &DVector<f64>) {
        let n_signals = self.weights.len();
        for (signal, c) in self.rounding.iter().enumerate() {
            if *c == 0.0 {
                continue;
            }
            let unknown = self.first_before() + run * n_signals + signal;
            let mut before = scaled[unknown] * self.scales[unknown];
            for value in residual.iter_mut().skip(signal).step_by(n_signals) {
                *value -= c * before;
                before = *value;
            }
        }
    }

    /// As [`Problem::filter`] for the rows of the Jacobian that belong to one run.
    pub(crate) fn filter_jacobian(
        &self,
        run: usize,
        first_row: usize,
        rows: usize,
        jacobian: &mut DMatrix<f64>,
    ) {
        let n_signals = self.weights.len();
        for (signal, c) in self.rounding.iter().enumerate() {
            if *c == 0.0 {
                continue;
            }
            let unknown = self.first_before() + run * n_signals + signal;
            for column in 0..jacobian.ncols() {
                let mut before = if column == unknown {
                    self.scales[unknown]
                } else {
                    0.0
                };
                for row in (first_row + signal..first_row + rows).step_by(n_signals) {
                    let value = &mut jacobian[(row, column)];
                    *value -= c * before;
                    before = *value;
                }
            }
        }
    }
}
