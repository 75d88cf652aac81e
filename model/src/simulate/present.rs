//! What effects add at an instant, without a step.

use loopsight_core::{NoPast, Place};

use super::Simulator;
use crate::registry::HostReal;

impl<S: HostReal> Simulator<'_, S> {
    /// The plant's state, and behind it those of the effects, to be set.
    pub fn whole_state_mut(&mut self) -> &mut [S] {
        self.fresh = false;
        let n = self.model.n_states() + self.bounds.states;
        &mut self.x[..n]
    }

    /// The inputs at the end of the last step, as effects with a memory pass them on.
    pub fn passed_on(&self) -> &[S] {
        &self.scratch.held
    }

    /// Number of effects of the model.
    pub fn effects(&self) -> usize {
        self.model.effects.len()
    }

    /// Puts the plant into a state, with inputs as effects with a memory pass them on, at a time of the run (s). Effects keep
    /// their states.
    ///
    /// # Panics
    ///
    /// When there are more states or inputs than the plant has.
    pub fn stand(&mut self, time: f64, state: &[f64], inputs: &[f64]) {
        self.time = time;
        self.fresh = false;
        for (to, from) in self.x[..state.len()].iter_mut().zip(state) {
            *to = S::of(*from);
        }
        for (to, from) in self.scratch.held[..inputs.len()].iter_mut().zip(inputs) {
            *to = S::of(*from);
        }
    }

    /// The rates of the plant's states now, each in its unit per second. Effects with a memory have passed the inputs on already.
    pub fn rates(&mut self) -> &[S] {
        let memory = std::mem::take(&mut self.bounds.input_memory);
        let way = self.way;
        self.linearise(self.time);
        (self.way, self.bounds.input_memory) = (way, memory);
        &self.implicit.rates()[..self.model.n_states()]
    }

    /// What an effect of the model, by index, adds to efforts and to rates of states now: place by place.
    pub fn adds(&mut self, effect: usize, mut each: impl FnMut(Place, S)) {
        self.refresh();
        let scene = self.scene();
        let acting = self.bounds.efforts.iter().chain(&self.bounds.bodies);
        for bound in acting.filter(|bound| bound.effect == effect) {
            each(bound.place, scene.contribution(bound, S::zero(), &NoPast));
        }
    }
}
