//! Inputs that run on straight lines between samples, for effects that look back.

use crate::registry::HostReal;
use loopsight_core::Place;

use super::Simulator;
use super::bound::Bounds;
use super::history::History;

impl<S: HostReal> Simulator<'_, S> {
    /// As [`Simulator::advance`], where the input at `until` is `next`: inputs with a first-order
    /// hold run straight there, the others stay constant.
    ///
    /// # Panics
    ///
    /// When there are fewer inputs, now or next, than the plant has.
    pub fn advance_between(&mut self, until: f64, input: &[f64], next: &[f64]) {
        let span = until - self.time;
        if span > 0.0 {
            for &i in &self.ramped {
                self.slopes[i] = (next[i] - input[i]) / span;
            }
        }
        self.advance(until, input);
        self.slopes.fill(0.0);
    }

    /// The inputs `elapsed` s after they were `input`.
    pub(super) fn apply(&mut self, input: &[f64], elapsed: f64) {
        let ramps = input.iter().zip(&self.slopes);
        for (held, (value, slope)) in self.scratch.held.iter_mut().zip(ramps) {
            *held = S::of(value + slope * elapsed);
        }
    }
}

/// Takes `inputs` on by `elapsed` s; what an effect with memory makes of one is constant over a step.
pub(super) fn ramped<S: HostReal>(inputs: &mut [S], bounds: &Bounds, slopes: &[f64], elapsed: f64) {
    for (i, (value, slope)) in inputs.iter_mut().zip(slopes).enumerate() {
        let made = |b: &super::bound::Bound| b.place == Place::Input(i);
        if *slope != 0.0 && !bounds.input_memory.iter().any(made) {
            *value += S::of(slope * elapsed);
        }
    }
}

/// Remembers the inputs that effects with memory look back on as their means over the step `h` from
/// `from` on, and leaves these means in `held`: a ramp becomes steps there. An effect that
/// knows its input ahead, where so many samples are `foreseen`, remembers it already.
pub(super) fn hold_means<S: HostReal>(
    bounds: &Bounds,
    histories: &mut [History<S>],
    held: &mut [S],
    slopes: &[f64],
    (from, h): (f64, f64),
    foreseen: usize,
) {
    for (i, (value, slope)) in held.iter_mut().zip(slopes).enumerate() {
        if *slope == 0.0 {
            continue;
        }
        let mean = *value + S::of(0.5 * slope * h);
        for bound in &bounds.input_memory {
            if let (Some(history), true) = (bound.history, bound.place == Place::Input(i)) {
                if !bound.knows_ahead(foreseen) {
                    histories[history].hold(from, mean);
                }
                *value = mean;
            }
        }
    }
}
