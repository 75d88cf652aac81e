//! The delay of a plant, found from step responses.

use crate::model::{MeasuredSignal, Model};
use crate::sensor::Sensor;
use crate::simulate::Simulator;
use loopsight_core::Place;

/// Length of the step responses, s.
const TRIAL: f64 = 2.0;

/// How late delays, lags and sensors make the plant seem: the time by which the areas under the step
/// responses, with them (`late`) and without, differ.
pub(super) fn lateness(whole: &Model, late: &Model, period: f64) -> f64 {
    let values = whole.values();
    let plant = whole.keeping(|_| false, Vec::new());
    let mut worst = 0.0f64;
    for input in 0..whole.plant.inputs.len() {
        let mut u = vec![0.0; whole.plant.inputs.len()];
        let mut with = Simulator::new(late, &values);
        let mut without = Simulator::new(&plant, &values);
        with.reset(&vec![0.0; whole.n_states()], &u);
        u[input] = 1.0;
        let mut seen = vec![0.0; late.measured.len()];
        let mut areas = vec![0.0; seen.len()];
        let mut ends = vec![0.0; seen.len()];
        for k in 1..=(TRIAL / period).ceil().max(1.0) as usize {
            let until = k as f64 * period;
            with.advance(until, &u);
            without.advance(until, &u);
            with.measure(&mut seen);
            let signals = without.signals();
            for (i, measured) in late.measured.iter().enumerate() {
                ends[i] = signals[measured.index];
                areas[i] += period * (ends[i] - seen[i]);
            }
        }
        for (i, measured) in late.measured.iter().enumerate() {
            let of = areas[i] / ends[i];
            if whole.plant.controlled.contains(&measured.index) && of.is_finite() {
                worst = worst.max(of.min(TRIAL));
            }
        }
    }
    // Not minus zero.
    worst + 0.0
}

/// The controlled states, measured as they are.
pub(super) fn exact(model: &Model) -> Vec<MeasuredSignal> {
    let measured = |index: &usize| MeasuredSignal {
        index: *index,
        signal: &model.plant.states[*index],
        sensor: Sensor::Instantaneous,
    };
    model.plant.controlled.iter().map(measured).collect()
}

impl Model {
    /// What a unit of disturbance at the rate of each controlled state does to it within `span` s, at
    /// rest.
    pub(super) fn disturbed(&self, span: f64) -> Vec<f64> {
        let plant = self.keeping(|_| false, Vec::new());
        let values = self.values();
        let mut moved = vec![0.0; self.n_states()];
        let rest = vec![0.0; self.plant.inputs.len()];
        for &i in self.plant.controlled {
            let mut simulator = Simulator::new(&plant, &values);
            simulator.advance(span, &rest);
            let alone = simulator.state()[i];
            simulator.reset(&vec![0.0; moved.len()], &rest);
            simulator.push(Place::Rate(i), 1.0);
            simulator.advance(span, &rest);
            moved[i] = simulator.state()[i] - alone;
        }
        moved
    }
}
