//! What the tests of effects share.

use loopsight_core::{Past, Reading, Role};

/// A reading at rest, with the signals that are given, which live on to the end of the test.
pub(super) fn reading(roles: &[(Role, f64)]) -> Reading<'static, f64> {
    let signals: &'static [(Role, f64)] = roles.to_vec().leak();
    let at = Reading::nothing();
    (signals.iter()).fold(at, |at, (role, value)| at.with(*role, value))
}

/// A signal that is the time.
pub(super) struct Ramp;

impl Past<f64> for Ramp {
    fn mean(&self, from: f64, to: f64) -> f64 {
        0.5 * (from + to)
    }
}
