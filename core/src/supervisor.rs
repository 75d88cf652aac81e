//! The supervisor: falls back to the last good model, then stops, and says why.

mod models;
#[cfg(test)]
mod tests;
mod watch;

use crate::{AffineModel, Observation, Observer, Real};
pub use watch::{Supervisor, Thresholds};

/// What a supervisor did.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Action {
    /// The controller got the last good model back; what is learned is not handed over for now.
    FellBack,
    /// What is learned is handed over again.
    Resumed,
    /// The loop was stopped safely.
    Stopped,
}

/// Why a supervisor acted; indices are those of the loop's measured signals, of
/// regressions, or of shafts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cause {
    /// The learned model predicts worse than the last good one; value and limit: times as bad.
    Worse(usize),
    /// No model predicts what is measured; value and limit: innovation, times as large as usual.
    Innovation(usize),
    /// A signal is too far from its reference; value and limit: in the signal's unit.
    Tracking(usize),
    /// A shaft, or a signal with a sensor of its own, keeps its speed although it should not; value and
    /// limit: s.
    Frozen(usize),
    /// A measured signal left its range; value: in its unit, limit: the end of the range.
    Range(usize),
    /// No fresh sample; value and limit: s.
    Stale,
    /// The models were left too often; value and limit: times.
    Relapse,
    /// Nothing was wrong for long enough; value and limit: s.
    Calm,
}

/// Something a supervisor did, with the number that crossed its limit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Event<S> {
    /// What was done.
    pub action: Action,
    /// Why.
    pub cause: Cause,
    /// The number that said so.
    pub value: S,
    /// What it is compared with.
    pub limit: S,
}

/// Watches over a loop once per tick, between the observer and the controller.
pub trait Supervise<S: Real> {
    /// Judges what was seen, hands (or does not hand) what `observer` learned to `model`, and says
    /// what it did; the loop stops on [`Action::Stopped`]. `reference` is what the controlled
    /// signals should be now.
    fn judge(
        &mut self,
        seen: &Observation<'_, S>,
        reference: &[S],
        observer: &mut dyn Observer<S>,
        model: &mut dyn AffineModel<S>,
    ) -> Option<Event<S>>;

    /// True while the controller has the last good model instead of the learned one.
    fn fallen(&self) -> bool {
        false
    }
}

/// Nobody watches: what is learned is handed over.
impl<S: Real> Supervise<S> for () {
    fn judge(
        &mut self,
        _: &Observation<'_, S>,
        _: &[S],
        observer: &mut dyn Observer<S>,
        model: &mut dyn AffineModel<S>,
    ) -> Option<Event<S>> {
        observer.teach(model);
        None
    }
}

impl<S: Real, W: Supervise<S>> Supervise<S> for Option<W> {
    fn judge(
        &mut self,
        seen: &Observation<'_, S>,
        reference: &[S],
        observer: &mut dyn Observer<S>,
        model: &mut dyn AffineModel<S>,
    ) -> Option<Event<S>> {
        match self {
            Some(supervisor) => supervisor.judge(seen, reference, observer, model),
            None => ().judge(seen, reference, observer, model),
        }
    }

    fn fallen(&self) -> bool {
        self.as_ref().is_some_and(Supervise::fallen)
    }
}
