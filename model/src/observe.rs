//! The plant's state from what is measured.

use nalgebra::{DMatrix, DVector};

use crate::model::Model;
use crate::pseudo_inverse::pseudo_inverse;
use crate::registry::HostReal;
use crate::{DUAL_WIDTH, Dual, derivative, variable};
use loopsight_core::Real;

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

    /// Plant states that a measured signal or its rate is a function of, near the origin: those whose
    /// initial values show at the beginning of a run. A position that is measured shows its
    /// velocity, too.
    pub fn seen_states(&self, values: &[f64]) -> Vec<usize> {
        let (nx, nu) = (self.n_states(), self.plant.inputs.len());
        let (of_state, _) = self.measurement_jacobian(values, &vec![0.0; nx]);
        let p: Vec<Dual> = self.lower(&values.iter().map(|v| Dual::of(*v)).collect::<Vec<_>>());
        let (u, w) = (
            vec![Dual::of(0.0); nu],
            vec![Dual::of(0.0); self.n_efforts()],
        );
        let mut rates = DMatrix::zeros(nx, nx);
        for column in 0..nx {
            let mut x = vec![Dual::of(0.0); nx];
            x[column] = variable(0.0, 0);
            let mut dx = vec![Dual::of(0.0); nx];
            Dual::dynamics(self.dynamics).derivative(&x, &u, &w, &p, &mut dx);
            for (row, rate) in dx.iter().enumerate() {
                rates[(row, column)] = derivative(rate, 0);
            }
        }
        let of_rate = &of_state * rates;
        let shows = |m: &DMatrix<f64>, i: usize| m.column(i).iter().any(|v| *v != 0.0);
        (0..nx)
            .filter(|i| shows(&of_state, *i) || shows(&of_rate, *i))
            .collect()
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
