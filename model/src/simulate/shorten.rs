//! Steps that are short enough for what sticks.

use super::Simulator;
use super::stiff::{FROM_REST, STABLE, Way};
use crate::registry::HostReal;

/// Share of the usual step below which none is shortened: friction that would need more has no sensible width.
const SHORTEST: f64 = 1.0 / 64.0;
/// What a width is multiplied by, so that its effect has no slope.
const WIDE: f64 = 1e9;
/// Widths beyond which a speed is so far from rest that nothing sticks: a sign that is a hyperbolic tangent has a slope of 8e-9
/// of that at rest there.
const FAR: f64 = 10.0;

impl<S: HostReal> Simulator<'_, S> {
    /// Makes the longest step so short that it is stable where dry friction holds the machine at rest, and lets none be longer
    /// than usual, or as long as the motion allows, that would not be stable.
    ///
    /// There friction of `F` that is smoothed over `w` is a damper of `F/w`: it is the fastest that the machine knows,
    /// and a step that is too long for it makes the speed jump about zero within the width. The values hardly show it,
    /// but the derivatives by parameters grow without end.
    pub(super) fn shorten(&mut self) {
        if self.model.step_given {
            return;
        }
        // Steps longer than usual are those of a first look, which only finds the way.
        let coarse = self.model.max_step > self.model.usual_step();
        let widths: Vec<usize> = (0..self.model.parameters.len())
            .filter(|i| self.model.parameters[*i].declaration.is_width())
            .collect();
        let as_usual = coarse || widths.is_empty() && !self.length.stretches();
        if as_usual && !self.model.by_motion {
            return;
        }
        let sticking = self.fastest_either_way(!widths.is_empty());
        let least = SHORTEST * self.model.usual_step();
        let stable = |rate: f64| (STABLE / rate).max(least);
        self.watched.stable = [stable(sticking); 2];
        if self.model.by_motion {
            self.watched.slow = self.slow(&widths);
        }
        let as_long = as_usual || self.length.longest * sticking <= STABLE;
        if as_long && self.watched.slow.is_empty() {
            return;
        }
        let moving = self.fastest_beyond(&widths);
        self.watched.stable[1] = stable(moving);
        if as_long {
            return;
        }
        // What is too fast for the usual step without friction is no matter of friction.
        let usual = self.length.usual;
        let friction = usual * moving <= STABLE;
        let shortest = if friction { SHORTEST * usual } else { usual };
        self.length.limit((STABLE / sticking).max(shortest));
    }

    /// The fastest rate at rest where signs have no slope, because their `widths` are so large, 1/s.
    fn fastest_beyond(&mut self, widths: &[usize]) -> f64 {
        let kept = self.values.clone();
        for i in widths {
            self.values[*i] = self.values[*i].times(S::of(WIDE));
        }
        let moving = self.fastest_at_rest();
        self.values = kept;
        moving
    }

    /// Speeds, as signals by index, and how fast each must be so that its sign has no slope; the `widths` are those of all signs.
    /// None where an effect has a sign of something else.
    fn slow(&self, widths: &[usize]) -> Vec<(usize, f64)> {
        let mut slow = Vec::new();
        for bound in self.bounds.all() {
            let own = widths.iter().filter(|i| bound.has(**i));
            let Some(widest) = own.map(|i| self.values[*i].value()).reduce(f64::max) else {
                continue;
            };
            let before = slow.len();
            slow.extend(bound.speeds().map(|speed| (speed, FAR * widest)));
            if slow.len() == before {
                return Vec::new();
            }
        }
        slow
    }

    /// The fastest rate at rest, 1/s, and where there are `signs` that when the machine hardly goes the other way: friction may hold it in
    /// one direction only. At rest rates are compared with those a little above it.
    fn fastest_either_way(&mut self, signs: bool) -> f64 {
        let at_rest = self.fastest_at_rest();
        if !signs {
            return at_rest;
        }
        let rest = self.x.clone();
        for x in &mut self.x {
            *x -= S::of(2.0 * FROM_REST);
        }
        let other = self.fastest_at_rest();
        self.x = rest;
        at_rest.max(other)
    }

    /// The fastest rate at rest, 1/s.
    fn fastest_at_rest(&mut self) -> f64 {
        let at_rest = vec![0.0; self.slopes.len()];
        let rate = self.fastest(&at_rest, 0.0);
        self.way = Way::Explicit;
        rate
    }
}
