//! A composed model as a velocity controller sees it.

use crate::controller::AffineModel;
use crate::model::Model;
use crate::registry::HostReal;

/// A model as a velocity controller sees it: `dy/dt = f(y) + G(y) u` in the controlled states,
/// found by probing the plant at zero and at unit inputs.
#[derive(Clone)]
pub struct Affine {
    model: Model,
    values: Vec<f64>,
    /// `values` changed since `p` was made from them.
    learned: bool,
    p: Vec<f64>,
    x: Vec<f64>,
    u: Vec<f64>,
    w: Vec<f64>,
    dx: Vec<f64>,
}

impl Model {
    /// The control-affine view with the model's present values; `None` where the plant declares
    /// no controlled states.
    pub fn affine(&self) -> Option<Affine> {
        if self.plant.controlled.is_empty() {
            return None;
        }
        let values = self.values();
        Some(Affine {
            p: self.lower(&values),
            values,
            learned: false,
            x: vec![0.0; self.n_states()],
            u: vec![0.0; self.plant.inputs.len()],
            w: vec![0.0; self.n_efforts()],
            dx: vec![0.0; self.n_states()],
            model: self.clone(),
        })
    }
}

impl AffineModel<f64> for Affine {
    fn size(&self) -> usize {
        self.model.plant.controlled.len()
    }

    fn evaluate(&mut self, y: &[f64], drift: &mut [f64], input_matrix: &mut [f64]) {
        let controlled = self.model.plant.controlled;
        let dynamics = f64::dynamics(self.model.dynamics);
        let n = controlled.len();
        if y.len() != n || drift.len() != n || input_matrix.len() != n * n {
            return;
        }
        if self.learned {
            let plant = &self.values[..self.model.n_plant_parameters];
            dynamics.lower(self.model.set, plant, &mut self.p);
            self.learned = false;
        }
        for (state, value) in controlled.iter().zip(y) {
            self.x[*state] = *value;
        }
        self.u.fill(0.0);
        dynamics.derivative(&self.x, &self.u, &self.w, &self.p, &mut self.dx);
        for (row, state) in controlled.iter().enumerate() {
            drift[row] = self.dx[*state];
        }
        for column in 0..n {
            self.u.fill(0.0);
            self.u[column] = 1.0;
            dynamics.derivative(&self.x, &self.u, &self.w, &self.p, &mut self.dx);
            for (row, state) in controlled.iter().enumerate() {
                input_matrix[row * n + column] = self.dx[*state] - drift[row];
            }
        }
    }

    /// What is not finite, or no parameter of the model, is ignored.
    fn learn(&mut self, parameter: usize, value: f64) {
        if let Some(known) = self.values.get_mut(parameter)
            && value.is_finite()
            && *known != value
        {
            *known = value;
            self.learned = true;
        }
    }
}
