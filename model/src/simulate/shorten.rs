//! Steps that are short enough for what sticks.

use super::Simulator;
use super::stiff::{STABLE, Way};
use crate::registry::HostReal;

/// Share of the usual step below which none is shortened: friction that would need more has no sensible width.
const SHORTEST: f64 = 1.0 / 64.0;
/// What a width is multiplied by, so that its effect has no slope.
const WIDE: f64 = 1e9;

impl<S: HostReal> Simulator<'_, S> {
    /// Makes the longest step so short that it is stable where dry friction holds the machine at rest.
    ///
    /// There friction of `F` that is smoothed over `w` is a damper of `F/w`: it is the fastest that the machine knows,
    /// and a step that is too long for it makes the speed jump about zero within the width. The values hardly show it,
    /// but the derivatives by parameters grow without end.
    pub(super) fn shorten(&mut self) {
        // Steps longer than usual are those of a first look, which only finds the way.
        let coarse = self.model.max_step > self.model.usual_step();
        if self.model.step_given || coarse {
            return;
        }
        let widths: Vec<usize> = (0..self.model.parameters.len())
            .filter(|i| self.model.parameters[*i].declaration.is_width())
            .collect();
        if widths.is_empty() {
            return;
        }
        let at_rest = vec![0.0; self.slopes.len()];
        let sticking = self.length.longest * self.fastest(&at_rest, 0.0);
        self.way = Way::Explicit;
        if sticking <= STABLE {
            return;
        }
        let kept = self.values.clone();
        for i in widths {
            self.values[i] = self.values[i].times(S::of(WIDE));
        }
        let moving = self.length.longest * self.fastest(&at_rest, 0.0);
        self.values = kept;
        self.way = Way::Explicit;
        // What is too fast for the step without friction is no matter of friction.
        if moving <= STABLE {
            self.length.shorten((STABLE / sticking).max(SHORTEST));
        }
    }
}
