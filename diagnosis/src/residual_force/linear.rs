//! A step of the simulation as a linear function of the state and of forces.

use loopsight_core::{Place, Real};
use loopsight_model::model::Model;
use loopsight_model::run::Run;
use loopsight_model::simulate::Simulator;
use loopsight_model::{DUAL_WIDTH, Dual, derivative, variable};
use nalgebra::DMatrix;

/// A model's step from a corrected state, with derivatives by the state and the forces.
pub(super) struct Linear<'m> {
    places: Vec<Place>,
    simulators: Vec<Simulator<'m, Dual>>,
    measured: usize,
}

impl<'m> Linear<'m> {
    pub(super) fn new(
        model: &'m Model,
        values: &[f64],
        places: Vec<Place>,
        x0: &[f64],
        input: &[f64],
    ) -> Self {
        let dual = |from: &[f64]| from.iter().map(|v| Dual::of(*v)).collect::<Vec<_>>();
        let columns = x0.len() + places.len();
        let simulators = (0..columns.div_ceil(DUAL_WIDTH))
            .map(|_| {
                let mut simulator = Simulator::new(model, &dual(values));
                simulator.reset(&dual(x0), input);
                simulator
            })
            .collect();
        Self {
            places,
            simulators,
            measured: model.measured.len(),
        }
    }

    /// `[A B]` of the interval that ends with sample `k`. Rows: states, then measured signals; columns: states, then forces.
    pub(super) fn step(&mut self, x: &[f64], run: &Run, k: usize) -> DMatrix<f64> {
        let (until, input) = (run.time()[k] - run.time()[0], run.input(k - 1));
        let nx = x.len();
        let columns = nx + self.places.len();
        let mut jacobian = DMatrix::zeros(nx + self.measured, columns);
        let mut outputs = vec![Dual::of(0.0); self.measured];
        for (batch, simulator) in self.simulators.iter_mut().enumerate() {
            let first = batch * DUAL_WIDTH;
            let last = (first + DUAL_WIDTH).min(columns);
            let seed = |value: f64, column: usize| {
                if (first..last).contains(&column) {
                    variable(value, column - first)
                } else {
                    Dual::of(value)
                }
            };
            for (i, (to, value)) in simulator.state_mut().iter_mut().zip(x).enumerate() {
                *to = seed(*value, i);
            }
            for (i, place) in self.places.iter().enumerate() {
                simulator.push(*place, seed(0.0, nx + i));
            }
            simulator.foresee(run, k);
            simulator.advance(until, input);
            simulator.measure(&mut outputs);
            for column in first..last {
                for (row, value) in simulator.state().iter().chain(&outputs).enumerate() {
                    jacobian[(row, column)] = derivative(value, column - first);
                }
            }
        }
        jacobian
    }
}
