//! A first-order lag that a zero time constant switches off: shared by the effects on inputs and on
//! sensors.
//!
//! ```text
//! z' = (u - z)/max(T, T₀)          lagged = u + (z - u) · T/max(T, T₀)          T₀ = 4 ms
//! ```
//!
//! Below `T₀` the time constant stays there, which integration steps of up to 10 ms can follow, and
//! only the share `T/T₀` of the lag is used: the area that is missing after a step is that of the
//! lag in any case.

use loopsight_core::Real;

/// Time constant below which a share of the lag stands for a shorter one, s.
const SHORTEST: f64 = 0.004;

/// What the lag of time constant `lag` adds to the signal `u`, with its state `z`.
pub(super) fn contribution<S: Real>(u: S, z: S, lag: S) -> S {
    (z - u) * lag / lag.max(S::of(SHORTEST))
}

/// The rate of its state.
pub(super) fn rate<S: Real>(u: S, z: S, lag: S) -> S {
    (u - z) / lag.max(S::of(SHORTEST))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What is left of a step of one, after `time`, and the area that was missing till then.
    fn step(lag: f64, time: f64) -> (f64, f64) {
        let (mut z, mut area, h) = (0.0, 0.0, 1e-5);
        let n = (time / h).round() as usize;
        for _ in 0..n {
            area -= h * contribution(1.0, z, lag);
            z += h * rate(1.0, z, lag);
        }
        (-contribution(1.0, z, lag), area)
    }

    #[test]
    fn a_step_fades_with_the_time_constant() {
        assert!((step(0.03, 0.03).0 - (-1.0f64).exp()).abs() < 1e-3);
        for lag in [0.0, 0.001, 0.004, 0.03] {
            assert!((step(lag, 0.5).1 - lag).abs() < 1e-4, "{lag}");
        }
    }
}
