//! Steps as long as the motion allows, for a search.

use super::Simulator;
use super::bound::Scene;
use super::stiff::Way;
use crate::registry::HostReal;
use loopsight_core::{Place, substeps};

/// How far the rates of the states may bend over a step that is kept.
///
/// With the rate `λ` they bend by `z²/4`, `z = h λ`, so here `z` is 0.2 at most, and a step is off by `z⁵/120`, three
/// millionths of what is left to go.
const BEND: f64 = 0.01;
/// Change of an input within an interval, relative to the input, that is none.
const SAME: f64 = 1e-6;

impl<S: HostReal> Simulator<'_, S> {
    /// Integrates over `span` with as few equal steps as the motion allows, and `most` where it allows none longer, or more where so
    /// few would not be stable. It uses values alone, so a simulation and its derivatives take the same steps.
    ///
    /// The stages of a step say whether it was short enough ([`Dynamics::steps`](loopsight_core::Dynamics::steps)), so one that
    /// was costs nothing beside itself. After one that was not, as many are made as its bend asks for. None is longer than what
    /// is stable, and that is little where a speed is so slow that dry friction may hold the machine: nothing bends there, and
    /// the derivatives would grow.
    pub(super) fn advance_by_motion(&mut self, input: &[f64], span: f64, most: usize) {
        // A late sensor needs points of its past, and the stages do not see an input change that comes late.
        if !self.bounds.output_memory.is_empty() || self.changes_late(span) {
            return self.integrate(input, span, most, true);
        }
        self.watched.now = true;
        self.watched.before.clone_from(&self.x);
        let [at_rest, beyond] = self.watched.stable;
        let sticking = substeps(span, at_rest);
        let mut sticks = self.may_stick();
        let least = if sticks {
            sticking
        } else {
            substeps(span, beyond)
        };
        let mut most = most.max(least);
        let mut steps = self.watched.steps.clamp(least, most);
        loop {
            self.watched.bend = 0.0;
            self.integrate(input, span, steps, true);
            if self.watched.bend <= BEND {
                break;
            }
            // One step from where it moves to where it sticks, or beyond, would make the derivatives grow as well.
            if !sticks && steps < sticking && self.comes_to_rest() {
                (sticks, steps, most) = (true, sticking, most.max(sticking));
                self.x.clone_from(&self.watched.before);
                continue;
            }
            if steps == most {
                break;
            }
            // Over a step of half the length rates bend by a quarter as much.
            let mut bend = self.watched.bend;
            while steps < most && bend > BEND {
                (steps, bend) = (2 * steps, 0.25 * bend);
            }
            steps = steps.min(most);
            self.x.clone_from(&self.watched.before);
        }
        self.watched.now = false;
        let longer = 4.0 * self.watched.bend <= BEND;
        self.watched.steps = if longer { (steps / 2).max(1) } else { steps };
    }

    /// Whether dry friction may hold some part of the machine: a speed is so slow that its sign has a slope, or it is not known
    /// which speeds have a sign.
    fn may_stick(&mut self) -> bool {
        if self.watched.slow.is_empty() {
            return true;
        }
        self.refresh();
        let watched = &mut self.watched;
        let signals = &self.scratch.signals;
        watched.speeds.clear();
        let speeds = watched.slow.iter();
        (watched.speeds).extend(speeds.map(|(speed, _)| signals[*speed].value()));
        let fast = |((_, far), speed): (&(usize, f64), &f64)| speed.abs() > *far;
        !watched.slow.iter().zip(&watched.speeds).all(fast)
    }

    /// Whether a speed that had no slope of a sign at the start of the interval has one now, or is the other way.
    fn comes_to_rest(&mut self) -> bool {
        self.refresh();
        let (watched, signals) = (&self.watched, &self.scratch.signals);
        (watched.slow.iter().zip(&watched.speeds)).any(|((speed, far), before)| {
            let now = signals[*speed].value();
            now.abs() <= *far || now * before < 0.0
        })
    }

    /// Whether an input that effects take from its past changes within the next `span`.
    fn changes_late(&self, span: f64) -> bool {
        self.bounds.input_memory.iter().any(|bound| {
            let (Some(history), Place::Input(i)) = (bound.history, bound.place) else {
                return false;
            };
            let over = |from: f64, to: f64| {
                let scene = Scene {
                    interval: (from, to),
                    time: from,
                    ..self.scene()
                };
                let held = self.scratch.held[i];
                (scene.contribution(bound, held, &self.histories[history]) + held).value()
            };
            let middle = self.time + 0.5 * span;
            let (first, last) = (over(self.time, middle), over(middle, self.time + span));
            (first - last).abs() > SAME * first.abs().max(last.abs())
        })
    }

    /// Whether steps are as long as the motion allows. What the file gives, or an effect asks for, holds.
    pub(super) fn goes_by_motion(&self) -> bool {
        self.model.by_motion && self.length.free && self.way == Way::Explicit
    }
}
