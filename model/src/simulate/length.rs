//! How long the integration steps are.

use crate::model::{Attached, Model};
use loopsight_core::substeps;

/// How much longer than usual a step may be so that a sample that comes a little late takes no step more.
///
/// A step of Runge and Kutta's method is off by the fifth power of its length, so this makes three times as much of what
/// the usual one is off by. It is still a quarter below twice the length, with which candidates are looked at.
const STRETCH: f64 = 1.25;

/// Lengths of integration steps, s.
#[derive(Clone, Copy, Debug)]
pub(super) struct Length {
    /// Where the choice is free.
    pub(super) usual: f64,
    /// No step is longer.
    pub(super) longest: f64,
    /// Whether neither the file nor an effect says how long they may be.
    pub(super) free: bool,
}

impl Length {
    /// Those of a model. What its file gives, or one of its effects asks for, is never exceeded.
    pub(super) fn of(model: &Model) -> Self {
        let longest = model.step();
        let short = |e: &Attached| e.meta.max_step_s <= model.max_step;
        let asked = model.step_given || model.effects.iter().any(short);
        Self {
            usual: longest,
            longest: if asked { longest } else { STRETCH * longest },
            free: !asked,
        }
    }

    /// Whether a step may be longer than usual.
    pub(super) fn stretches(&self) -> bool {
        self.longest > self.usual
    }

    /// Makes none longer than `most`.
    pub(super) fn limit(&mut self, most: f64) {
        self.longest = most;
        self.usual = self.usual.min(most);
    }

    /// Number of equal steps that make up `span`: the nearest whole number of usual ones, of which none is longer than the
    /// longest.
    ///
    /// Time stamps of a logger scatter: with 4.99 to 5.01 ms between samples, steps of at most 2.5 ms would be two for one
    /// sample and three for the next.
    pub(super) fn steps(&self, span: f64) -> usize {
        if self.stretches() {
            let least = substeps(span, self.longest);
            substeps(span - 0.5 * self.usual, self.usual).max(least)
        } else {
            substeps(span, self.longest)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const USUAL: Length = Length {
        usual: 2.5e-3,
        longest: 3.125e-3,
        free: true,
    };

    #[test]
    fn samples_that_come_a_little_late_take_as_many_steps() {
        for (ms, steps) in [
            (0.4, 1),
            (2.5, 1),
            (3.1, 1),
            (3.2, 2),
            (4.9, 2),
            (5.1, 2),
            (6.2, 2),
            (6.3, 3),
            (20.0, 8),
            (21.0, 8),
            (21.5, 9),
        ] {
            assert_eq!(USUAL.steps(ms * 1e-3), steps, "{ms} ms");
        }
    }

    #[test]
    fn no_step_is_longer_than_the_longest() {
        let strict = Length {
            longest: 2.5e-3,
            ..USUAL
        };
        for i in 1..1000 {
            let span = f64::from(i) * 1.7e-4;
            for length in [USUAL, strict] {
                let steps = length.steps(span);
                assert!(span / steps as f64 <= length.longest * (1.0 + 1e-5));
                assert_eq!(strict.steps(span), substeps(span, 2.5e-3));
            }
        }
        let mut limited = USUAL;
        limited.limit(2.8e-3);
        assert!((limited.usual, limited.steps(3.1e-3), limited.steps(2.7e-3)) == (2.5e-3, 2, 1));
        limited.limit(1e-3);
        assert_eq!((limited.usual, limited.steps(1.1e-3)), (1e-3, 2));
        assert_eq!(USUAL.steps(f64::NAN), 1);
        assert_eq!(USUAL.steps(-1.0), 1);
    }
}
