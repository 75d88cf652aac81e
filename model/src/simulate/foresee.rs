//! What effects see of inputs before their time.

use crate::log_map::Hold;
use crate::model::Model;
use crate::registry::HostReal;
use crate::run::Run;
use loopsight_core::Place;

use super::Simulator;
use super::history::{Between, CAPACITY, History};

/// The history of an input for an effect that looks ahead: a staircase, or straight lines.
pub(super) fn history<S: HostReal>(model: &Model, place: Place) -> History<S> {
    History::ahead(match place {
        Place::Input(i) if model.hold(i) == Hold::FirstOrder => Between::Smooth,
        _ => Between::Held,
    })
}

impl<S: HostReal> Simulator<'_, S> {
    /// Integrates to the `k`-th sample of `run`, whose first sample it [began](Simulator::reset) with. Effects that look
    /// ahead see the inputs after it.
    ///
    /// # Panics
    ///
    /// When `k` is 0 or no sample of the run, or the run has fewer inputs than the plant.
    pub fn advance_to(&mut self, run: &Run, k: usize) {
        self.foresee(run, k);
        let until = run.time()[k] - run.time()[0];
        self.advance_between(until, run.input(k - 1), run.input(k));
    }

    /// Makes the inputs of `run` known to effects that look ahead, as far as they see from its `k`-th sample. Without
    /// it their newest input holds.
    ///
    /// # Panics
    ///
    /// When `k` is no sample of the run, or the run has fewer inputs than the plant.
    pub fn foresee(&mut self, run: &Run, k: usize) {
        let bounds = self.bounds.input_memory.iter();
        let horizon = bounds.map(|b| b.ahead).fold(0.0, f64::max);
        if horizon == 0.0 {
            return;
        }
        let (time, start) = (run.time(), run.time()[0]);
        // Never so far that the present is forgotten.
        let last = run.len().min(k + CAPACITY / 2);
        let mut next = self.foreseen.max(1);
        while next < last && time[next] <= time[k] + horizon {
            for bound in &self.bounds.input_memory {
                if let (Some(history), Place::Input(i), true) =
                    (bound.history, bound.place, bound.ahead > 0.0)
                {
                    let value = S::of(run.input(next)[i]);
                    let history = &mut self.histories[history];
                    if self.model.hold(i) == Hold::FirstOrder {
                        history.run_to(time[next] - start, value);
                    } else {
                        history.hold(time[next] - start, value);
                    }
                }
            }
            next += 1;
        }
        self.foreseen = next;
    }
}
