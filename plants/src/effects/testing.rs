//! What the tests of effects share.

use loopsight_core::{Dual, NoPast, Past, Reading, Real, Role};

/// A reading at rest, with the signals that are given.
pub(super) fn reading(roles: &[(Role, f64)]) -> Reading<'static, f64> {
    let mut at = Reading {
        time: 0.0,
        from: 0.0,
        to: 0.0,
        nominal: 0.0,
        side: 0.0,
        is_position: false,
        roles: [0.0; Role::COUNT],
        signals: &[],
        past: &NoPast,
    };
    for (role, value) in roles {
        at.roles[*role as usize] = *value;
    }
    at
}

/// A reading for a dual number with this nominal value.
pub(super) fn dual_reading(nominal: f64) -> Reading<'static, Dual> {
    Reading {
        time: 0.0,
        from: 0.0,
        to: 0.0,
        nominal: Dual::of(nominal),
        side: Dual::of(0.0),
        is_position: false,
        roles: [Dual::of(0.0); Role::COUNT],
        signals: &[],
        past: &NoPast,
    }
}

/// A signal that is the time.
pub(super) struct Ramp;

impl Past<f64> for Ramp {
    fn mean(&self, from: f64, to: f64) -> f64 {
        0.5 * (from + to)
    }
}
