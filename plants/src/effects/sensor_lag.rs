//! A low-pass filter behind the sensor.

use loopsight_core::{Effect, EffectMeta, Parameter, PlaceKind, Reading, Real, declare_effect};

/// Sensor lag: the measurement follows the signal gradually.
///
/// ```text
/// z' = (y - z)/max(lag, T₀)          y_measured = y + (z - y) · lag/max(lag, T₀)          T₀ = 4 ms
/// ```
///
/// | symbol | what | unit |
/// |---|---|---|
/// | `y` | the signal | that of the channel |
/// | `lag` | time constant | s |
///
/// A first-order lag from 4 ms upwards. Below that its time constant stays at 4 ms, which
/// integration steps of up to 10 ms can follow, and only the share `lag/T₀` of it is used: the
/// area that is missing after a step is that of the lag in any case, and a lag of zero changes
/// nothing.
///
/// Assumptions: linear: an analogue or digital low-pass filter of first order; at the start of a
/// run it has settled.
///
/// A lag of the input and one of all sensors look alike on a plant that does not change with time.
///
/// Reference: J. Fraden (2010), "Handbook of Modern Sensors", 4th edition, Springer, chapter 2,
/// dynamic characteristics (first order).
#[derive(Clone, Copy, Debug)]
pub struct SensorLag;

impl Effect<1, 1> for SensorLag {
    const META: EffectMeta = EffectMeta {
        id: "sensor_lag",
        summary: "the measurement follows the signal gradually, like through a low-pass filter",
        symptom: "the measured curve is a rounded and late copy of the model; the residual is proportional to the rate of the signal",
        remedy: "a faster filter in the sensor; filter the reference alike before comparing",
        equation: "z' = (y - z)/lag; y_measured = z",
        reference: "Fraden (2010), Handbook of Modern Sensors, 4th ed., chapter 2 (dynamic characteristics)",
        example: "[[effect]]\n[effect.sensor_lag]\nat = [\"sensor.linear_velocity\", \"sensor.angular_velocity\"]\nlag = 0.03\n",
        places: &[PlaceKind::Output],
        parameters: &[Parameter::new("lag", "T", "s", "time constant")
            .within(0.0, 2.0)
            .or(0.0)
            .nonlinear()
            .scaled(0.02)],
        states: 1,
        ..EffectMeta::PLAIN
    };

    fn contribution<S: Real>(at: &Reading<'_, S>, z: &[S; 1], p: &[S; 1]) -> S {
        (z[0] - at.nominal) * p[0] / p[0].larger(S::of(SHORTEST))
    }

    fn state_derivative<S: Real>(at: &Reading<'_, S>, z: &[S; 1], p: &[S; 1]) -> [S; 1] {
        [(at.nominal - z[0]) / p[0].larger(S::of(SHORTEST))]
    }

    fn initial_state<S: Real>(at: &Reading<'_, S>, _p: &[S; 1]) -> [S; 1] {
        [at.nominal]
    }
}

declare_effect!(SensorLag, "sensor_lag", <1, 1>);

/// Time constant below which a share of the lag stands for a shorter one, s.
const SHORTEST: f64 = 0.004;

#[cfg(test)]
mod tests {
    use crate::effects::testing::*;

    use super::*;

    /// What is left of a step of one, after `time`, and the area that was missing till then.
    fn step(lag: f64, time: f64) -> (f64, f64) {
        let at = Reading {
            nominal: 1.0,
            ..reading(&[])
        };
        let (mut z, mut area, h) = ([0.0], 0.0, 1e-5);
        let n = (time / h).round() as usize;
        for _ in 0..n {
            area -= h * SensorLag::contribution(&at, &z, &[lag]);
            z[0] += h * SensorLag::state_derivative(&at, &z, &[lag])[0];
        }
        (-SensorLag::contribution(&at, &z, &[lag]), area)
    }

    #[test]
    fn a_step_fades_with_the_time_constant() {
        assert!((step(0.03, 0.03).0 - (-1.0f64).exp()).abs() < 1e-3);
        for lag in [0.0, 0.001, 0.004, 0.03] {
            assert!((step(lag, 0.5).1 - lag).abs() < 1e-4, "{lag}");
        }
    }
}
