//! What is added to a plant from outside, beside its effects.

use crate::model::Model;
use crate::registry::HostReal;
use loopsight_core::Place;

use super::Simulator;

/// What is added from outside, by place.
#[derive(Clone)]
pub(super) struct Pushed<S> {
    pub(super) efforts: Vec<S>,
    pub(super) inputs: Vec<S>,
    /// Empty until one is needed: the plant alone has a faster step.
    pub(super) rates: Vec<S>,
}

impl<S: HostReal> Pushed<S> {
    pub(super) fn nothing(model: &Model) -> Self {
        Self {
            efforts: vec![S::zero(); model.n_efforts()],
            inputs: vec![S::zero(); model.plant.inputs.len()],
            rates: Vec::new(),
        }
    }
}

impl<S: HostReal> Simulator<'_, S> {
    /// Adds `value` at `place` from now on, besides what the effects add there: an effort, an
    /// input or the rate of a state. A push is held until another one at the same place replaces
    /// it; it does not act on a sensor.
    ///
    /// With derivatives in `value`, a simulation tells how a force that no effect describes would
    /// show in what is measured.
    pub fn push(&mut self, place: Place, value: S) {
        let (list, index) = match place {
            Place::Effort(i) => (&mut self.pushed.efforts, i),
            Place::Input(i) => (&mut self.pushed.inputs, i),
            Place::Rate(i) => {
                if self.pushed.rates.is_empty() {
                    self.pushed.rates = vec![S::zero(); self.model.n_states()];
                }
                (&mut self.pushed.rates, i)
            }
            Place::Output(_) => return,
        };
        if let Some(to) = list.get_mut(index) {
            *to = value;
        }
    }
}
