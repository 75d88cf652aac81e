//! Measurements of the signals of a model.

use std::sync::Arc;

use crate::simulate::StateObserver;

/// One uninterrupted run: what was applied and what was measured, in SI units.
///
/// Row `k` of `measured` was taken at `time[k]`; row `k` of `inputs` was applied from `time[k]` to
/// `time[k + 1]`, or, where the model's [`LogMap`](crate::log_map::LogMap) says first-order hold, on a straight line to row
/// `k + 1`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Run {
    /// Name, e.g. `slow-forward`; empty when the log holds one run only.
    pub name: String,
    /// Time stamps, s, strictly increasing; not necessarily equidistant.
    pub time: Vec<f64>,
    /// Inputs, row by row, in the order of the model's inputs.
    pub inputs: Vec<f64>,
    /// Measured signals, row by row, in the order of the model's measured signals; NaN: missing.
    pub measured: Vec<f64>,
    /// Number of inputs.
    pub n_inputs: usize,
    /// Number of measured signals.
    pub n_measured: usize,
    /// Holds free runs of a model to what was measured, where that model needs it.
    pub observer: Option<Arc<StateObserver>>,
}

impl Run {
    /// Number of samples.
    pub fn len(&self) -> usize {
        self.time.len()
    }

    /// True without any sample.
    pub fn is_empty(&self) -> bool {
        self.time.is_empty()
    }

    /// From the first to the last time stamp, s.
    pub fn duration(&self) -> f64 {
        match (self.time.first(), self.time.last()) {
            (Some(first), Some(last)) => last - first,
            _ => 0.0,
        }
    }

    /// Inputs applied from `time[k]` on.
    pub fn input(&self, k: usize) -> &[f64] {
        &self.inputs[k * self.n_inputs..(k + 1) * self.n_inputs]
    }

    /// What was measured at `time[k]`.
    pub fn sample(&self, k: usize) -> &[f64] {
        &self.measured[k * self.n_measured..(k + 1) * self.n_measured]
    }

    /// The samples `range`, as a run of their own.
    pub fn part(&self, range: std::ops::Range<usize>) -> Run {
        Run {
            name: self.name.clone(),
            time: self.time[range.clone()].to_vec(),
            inputs: self.inputs[range.start * self.n_inputs..range.end * self.n_inputs].to_vec(),
            measured: self.measured[range.start * self.n_measured..range.end * self.n_measured]
                .to_vec(),
            n_inputs: self.n_inputs,
            n_measured: self.n_measured,
            observer: self
                .observer
                .as_ref()
                .map(|observer| Arc::new(observer.part(range))),
        }
    }

    /// Median distance of the time stamps, s; NaN with fewer than two samples.
    pub fn median_period(&self) -> f64 {
        let mut steps: Vec<f64> = self.time.windows(2).map(|w| w[1] - w[0]).collect();
        if steps.is_empty() {
            return f64::NAN;
        }
        let middle = steps.len() / 2;
        *steps.select_nth_unstable_by(middle, f64::total_cmp).1
    }
}
