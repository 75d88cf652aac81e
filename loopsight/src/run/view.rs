//! What can be seen of a loop while it runs.

use loopsight_core::TickRecord;

use super::recorder::Recorder;

/// A loop at one tick, for whoever shows it: see [`RunOptions::on_tick`](super::RunOptions::on_tick).
#[derive(Clone, Copy)]
pub struct RunView<'r> {
    step: &'r TickRecord<'r, f64>,
    recorder: &'r Recorder,
    duration_s: Option<f64>,
}

impl std::fmt::Debug for RunView<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("RunView")
            .field("time_s", &self.time_s())
            .finish_non_exhaustive()
    }
}

/// A controlled signal at one tick.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct ControlledNow<'r> {
    /// The signal.
    pub id: &'r str,
    /// Its unit.
    pub unit: &'r str,
    /// What it is.
    pub measured: f64,
    /// What it should be.
    pub reference: f64,
    /// Root mean square of the error so far; `NaN` of nothing.
    pub rms_error: f64,
}

/// An input at one tick.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct InputNow<'r> {
    /// The signal.
    pub id: &'r str,
    /// Its unit.
    pub unit: &'r str,
    /// What was applied.
    pub applied: f64,
}

/// A parameter that is learned, at one tick.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct ParameterNow<'r> {
    /// Its name.
    pub name: &'r str,
    /// Its unit.
    pub unit: &'r str,
    /// The estimate.
    pub value: f64,
    /// Its standard deviation; `None` before the first lesson.
    pub std: Option<f64>,
}

impl<'r> RunView<'r> {
    pub(super) fn new(
        step: &'r TickRecord<'r, f64>,
        recorder: &'r Recorder,
        duration_s: Option<f64>,
    ) -> Self {
        Self {
            step,
            recorder,
            duration_s,
        }
    }

    /// Time since the start, s.
    pub fn time_s(&self) -> f64 {
        self.step.tick.time
    }

    /// How long it is to run, s; `None`: until it is stopped.
    pub fn duration_s(&self) -> Option<f64> {
        self.duration_s
    }

    /// The controlled signals.
    pub fn controlled(&self) -> impl Iterator<Item = ControlledNow<'r>> {
        let (step, recorder) = (self.step, self.recorder);
        let traces = recorder.record.controlled.iter().enumerate();
        traces.map(move |(i, trace)| ControlledNow {
            id: &trace.id,
            unit: &trace.unit,
            measured: step.measured[i],
            reference: step.reference[i],
            rms_error: recorder.errors[i].rms().unwrap_or(f64::NAN),
        })
    }

    /// The inputs.
    pub fn inputs(&self) -> impl Iterator<Item = InputNow<'r>> {
        let step = self.step;
        let traces = self.recorder.record.inputs.iter().enumerate();
        traces.map(move |(i, trace)| InputNow {
            id: &trace.id,
            unit: &trace.unit,
            applied: step.applied[i],
        })
    }

    /// The parameters that are learned.
    pub fn parameters(&self) -> impl Iterator<Item = ParameterNow<'r>> {
        let recorder = self.recorder;
        let traces = recorder.record.parameters.iter().enumerate();
        traces.map(move |(i, trace)| ParameterNow {
            name: &trace.name,
            unit: &trace.unit,
            value: recorder.estimates[i],
            std: Some(recorder.deviations[i]).filter(|s| s.is_finite()),
        })
    }

    /// Whether an input is saturated.
    pub fn saturated(&self) -> bool {
        self.step.outcome.saturated
    }

    /// Whether the controller has the last good model instead of the learned one.
    pub fn fallen_back(&self) -> bool {
        self.step.fallen
    }

    /// Share of the ticks so far that were saturated.
    pub fn saturated_share(&self) -> f64 {
        self.share(self.recorder.saturated)
    }

    /// Share of the ticks so far whose sample was stale.
    pub fn stale_share(&self) -> f64 {
        self.share(self.recorder.stale)
    }

    /// Root mean square of how far the periods were off, s; `None` in simulated time.
    pub fn jitter_s(&self) -> Option<f64> {
        self.recorder.record.timing.map(|timing| timing.jitter_s)
    }

    /// What happened last, and when, s.
    pub fn last_event(&self) -> Option<(f64, &'r str)> {
        let (time, what) = self.recorder.record.events.last()?;
        Some((*time, what))
    }

    fn share(&self, ticks: usize) -> f64 {
        ticks as f64 / self.recorder.record.ticks().max(1) as f64
    }
}
