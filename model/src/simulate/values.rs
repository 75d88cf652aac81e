//! What is changed from outside while a simulation runs, and its state as a whole.

use crate::model::Model;
use crate::registry::HostReal;
use loopsight_core::Place;

use super::Simulator;

impl<S: HostReal> Simulator<'_, S> {
    /// The same without the plant's [trail](loopsight_core::Dynamics::trail), where neither a sensor nor an effect reads
    /// it: those states stay as they are. What is measured has the same digits. The x and y of a robot in the plane take a
    /// sine and a cosine at every stage.
    #[must_use]
    pub fn without_trail(mut self) -> Self {
        let read = |i: &usize| {
            [&self.needed, &self.shown]
                .iter()
                .any(|n| n.states.contains(i))
        };
        let trail = S::dynamics(self.model.dynamics).trail();
        self.trail = trail.iter().any(read);
        self
    }

    /// Other parameter values from now on (as long as `model.parameters`); the state stays.
    pub fn set_values(&mut self, values: &[S]) {
        let model: &Model = &self.model;
        if values.len() == self.values.len() {
            self.values.copy_from_slice(values);
            self.fresh = false;
            model.lower_into(&self.values, &mut self.p);
        }
    }

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

    /// Number of inputs.
    pub(crate) fn inputs(&self) -> usize {
        self.model.plant.inputs.len()
    }

    /// The extended state: the plant's, then those of the effects, then integrals of sensors.
    pub(crate) fn extended(&self) -> &[S] {
        &self.x
    }
}
