//! Parameter values that change while a simulation runs, and its state as a whole.

use crate::model::Model;
use crate::registry::HostReal;

use super::Simulator;

impl<S: HostReal> Simulator<'_, S> {
    /// Other parameter values from now on (as long as `model.parameters`); the state stays.
    pub fn set_values(&mut self, values: &[S]) {
        let model: &Model = &self.model;
        if values.len() == self.values.len() {
            self.values.copy_from_slice(values);
            let of_plant = &self.values[..model.n_plant_parameters];
            S::dynamics(model.dynamics).lower(model.set, of_plant, &mut self.p);
        }
    }

    /// Number of inputs.
    pub(crate) fn inputs(&self) -> usize {
        self.model.plant.inputs.len()
    }

    /// The extended state: the plant's, then those of the effects, then integrals of sensors.
    pub(crate) fn extended(&self) -> &[S] {
        &self.x
    }
}
