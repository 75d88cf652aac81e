//! A first-order lag that a zero time constant switches off: shared by the effects on inputs and on
//! sensors.
//!
//! ```text
//! z' = (u - z)/max(T, T₀)          lagged = u + (z - u) · T/max(T, T₀)
//! ```
//!
//! `T₀` is the shortest time constant that the simulation follows ([`Reading::shortest`]): 4 ms, which integration steps of up
//! to 10 ms can follow, or the time between samples where that is shorter. Below it the time constant stays there, and
//! only the share `T/T₀` of the lag is used: the area that is missing after a step is that of the
//! lag in any case.

use loopsight_core::{Reading, Real};

/// What the lag of time constant `lag` adds to the signal `u`, with its state `z`.
pub(super) fn contribution<S: Real>(at: &Reading<'_, S>, u: S, z: S, lag: S) -> S {
    (z - u) * lag / lag.max(S::of(at.shortest))
}

/// The rate of its state.
pub(super) fn rate<S: Real>(at: &Reading<'_, S>, u: S, z: S, lag: S) -> S {
    (u - z) / lag.max(S::of(at.shortest))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What is left of a step of one, after `time`, and the area that was missing till then.
    fn step(lag: f64, time: f64, shortest: f64) -> (f64, f64) {
        let at = Reading {
            shortest,
            ..Reading::nothing()
        };
        let (mut z, mut area, h) = (0.0, 0.0, 1e-5);
        let n = (time / h).round() as usize;
        for _ in 0..n {
            area -= h * contribution(&at, 1.0, z, lag);
            z += h * rate(&at, 1.0, z, lag);
        }
        (-contribution(&at, 1.0, z, lag), area)
    }

    #[test]
    fn a_step_fades_with_the_time_constant() {
        assert!((step(0.03, 0.03, 0.004).0 - (-1.0f64).exp()).abs() < 1e-3);
        for lag in [0.0, 0.001, 0.004, 0.03] {
            assert!((step(lag, 0.5, 0.004).1 - lag).abs() < 1e-4, "{lag}");
        }
    }

    /// A lag of 2 ms is one where samples are half a millisecond apart, and one of 4 ms by halves where they are far apart.
    #[test]
    fn close_samples_show_a_short_lag() {
        let left = step(0.002, 0.004, 0.0005).0;
        assert!((left - (-2.0f64).exp()).abs() < 1e-3, "{left}");
        let by_halves = step(0.002, 0.004, 0.004).0;
        assert!(
            (by_halves - 0.5 * (-1.0f64).exp()).abs() < 1e-3,
            "{by_halves}"
        );
    }
}
