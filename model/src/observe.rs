//! The plant's state from what is measured.

use nalgebra::{DMatrix, DVector};

use crate::model::Model;
use crate::pseudo_inverse::pseudo_inverse;
use crate::registry::HostReal;
use crate::{DUAL_WIDTH, Dual, derivative, variable};
use loopsight_core::Real;

/// The `i`-th coordinate of a place away from the origin, none like another.
fn away(i: usize) -> f64 {
    0.5 + 0.1 * (i as f64 + 1.0).sqrt()
}

impl Model {
    /// Sensitivity of the measured signals to the plant state (measured × states) at `x`, and
    /// their values there.
    pub fn measurement_jacobian(&self, values: &[f64], x: &[f64]) -> (DMatrix<f64>, DVector<f64>) {
        let (nx, nu) = (self.n_states(), self.plant.inputs.len());
        let mut jacobian = DMatrix::zeros(self.measured.len(), nx);
        let mut value = DVector::zeros(self.measured.len());
        let p: Vec<Dual> = self.lower(&values.iter().map(|v| Dual::of(*v)).collect::<Vec<_>>());
        let u = vec![Dual::of(0.0); nu];
        let mut y = vec![Dual::of(0.0); self.n_signals()];
        for first in (0..nx).step_by(DUAL_WIDTH) {
            let last = (first + DUAL_WIDTH).min(nx);
            let seeded: Vec<Dual> = (0..nx)
                .map(|i| {
                    if (first..last).contains(&i) {
                        variable(x[i], i - first)
                    } else {
                        Dual::of(x[i])
                    }
                })
                .collect();
            self.signals_at(&p, &seeded, &u, &mut y);
            for (row, m) in self.measured.iter().enumerate() {
                value[row] = y[m.index].value();
                for column in first..last {
                    jacobian[(row, column)] = derivative(&y[m.index], column - first);
                }
            }
        }
        (jacobian, value)
    }

    /// Plant states that what is measured depends on, by way of however many other states: those whose
    /// initial values show in a run. A position that is measured shows its velocity, a temperature the
    /// heater behind it.
    ///
    /// What depends on what is read off the derivatives at the origin and at a place away from it, where
    /// `speed·abs(speed)` has one, too.
    pub fn seen_states(&self, values: &[f64]) -> Vec<usize> {
        let nx = self.n_states();
        let mut seen = vec![false; nx];
        let mut by_rate = vec![vec![false; nx]; nx];
        for x in [vec![0.0; nx], (0..nx).map(away).collect()] {
            let (of_state, _) = self.measurement_jacobian(values, &x);
            let rates = self.rate_jacobian(values, &x);
            for i in 0..nx {
                seen[i] |= of_state.column(i).iter().any(|v| *v != 0.0);
                for (row, of_row) in by_rate.iter_mut().enumerate() {
                    of_row[i] |= rates[(row, i)] != 0.0;
                }
            }
        }
        // A chain of states is no longer than there are states.
        for _ in 0..nx {
            for i in 0..nx {
                seen[i] |= (0..nx).any(|row| seen[row] && by_rate[row][i]);
            }
        }
        (0..nx).filter(|i| seen[*i]).collect()
    }

    /// Rates of the states at the state `x` with the inputs `u` and the efforts `w`, without effects; of other
    /// lengths than the plant's they are zero.
    pub fn rates_at(&self, values: &[f64], x: &[f64], u: &[f64], w: &[f64]) -> Vec<f64> {
        let mut rates = vec![0.0; x.len()];
        let p = self.lower(values);
        f64::dynamics(self.dynamics).derivative(x, u, w, &p, &mut rates);
        rates
    }

    /// Sensitivity of the states' rates to the states at `x`, without inputs and efforts.
    fn rate_jacobian(&self, values: &[f64], x: &[f64]) -> DMatrix<f64> {
        let (nx, nu) = (self.n_states(), self.plant.inputs.len());
        let p: Vec<Dual> = self.lower(&values.iter().map(|v| Dual::of(*v)).collect::<Vec<_>>());
        let (u, w) = (
            vec![Dual::of(0.0); nu],
            vec![Dual::of(0.0); self.n_efforts()],
        );
        let mut rates = DMatrix::zeros(nx, nx);
        for column in 0..nx {
            let mut seeded: Vec<Dual> = x.iter().map(|v| Dual::of(*v)).collect();
            seeded[column] = variable(x[column], 0);
            let mut dx = vec![Dual::of(0.0); nx];
            Dual::dynamics(self.dynamics).derivative(&seeded, &u, &w, &p, &mut dx);
            for (row, rate) in dx.iter().enumerate() {
                rates[(row, column)] = derivative(rate, 0);
            }
        }
        rates
    }

    /// The state of least norm that explains the measurement `y` (NaN entries are left out):
    /// one Gauss–Newton step from the origin, exact where the outputs are linear in the state.
    pub fn state_from(&self, values: &[f64], y: &[f64]) -> Vec<f64> {
        let nx = self.n_states();
        let (mut jacobian, at_zero) = self.measurement_jacobian(values, &vec![0.0; nx]);
        let mut difference = DVector::zeros(y.len());
        for (i, value) in y.iter().enumerate() {
            if value.is_finite() {
                difference[i] = value - at_zero[i];
            } else {
                jacobian.row_mut(i).fill(0.0);
            }
        }
        pseudo_inverse(&jacobian).map_or_else(
            || vec![0.0; nx],
            |inverse| (inverse * difference).iter().copied().collect(),
        )
    }
}
