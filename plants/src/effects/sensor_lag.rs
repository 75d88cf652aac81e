//! A low-pass filter behind the sensor.

use crate::declare_effect;
use loopsight_core::{Effect, EffectMeta, Parameter, PlaceKind, Reading, Real};

use super::{LONGEST_S, first_order};

/// Sensor lag: the measurement follows the signal gradually.
///
/// ```text
/// z' = (y - z)/max(lag, T₀)          y_measured = y + (z - y) · lag/max(lag, T₀)
/// ```
///
/// | symbol | what | unit |
/// |---|---|---|
/// | `y` | the signal | that of the channel |
/// | `lag` | time constant | s |
///
/// `T₀` is 4 ms, which integration steps of up to 10 ms can follow, or the time between samples where that is shorter.
/// Below it the time constant stays at `T₀`, and only the share `lag/T₀` of it is used: the
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

impl Effect for SensorLag {
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
            .within(0.0, LONGEST_S)
            .or(0.0)
            .nonlinear()
            .scaled(0.02)],
        states: 1,
        ..EffectMeta::PLAIN
    };

    fn contribution<S: Real>(at: &Reading<'_, S>, z: &[S; 1], p: &[S; 1]) -> S {
        first_order::contribution(at, at.nominal, z[0], p[0])
    }

    fn state_derivative<S: Real>(at: &Reading<'_, S>, z: &[S; 1], p: &[S; 1]) -> [S; 1] {
        [first_order::rate(at, at.nominal, z[0], p[0])]
    }

    fn initial_state<S: Real>(at: &Reading<'_, S>, _p: &[S; 1]) -> [S; 1] {
        [at.nominal]
    }
}

declare_effect!(SensorLag, "sensor_lag");

#[cfg(test)]
mod tests {
    use crate::effects::testing::*;

    use super::*;

    /// Settled at the start, and what is missing afterwards is the share not yet followed.
    #[test]
    fn starts_settled_and_follows() {
        let at = Reading {
            nominal: 2.0,
            ..reading(&[])
        };
        let z = SensorLag::initial_state(&at, &[0.03]);
        assert_eq!(SensorLag::contribution(&at, &z, &[0.03]), 0.0);
        assert_eq!(SensorLag::contribution(&at, &[0.5], &[0.03]), -1.5);
        assert_eq!(
            SensorLag::state_derivative(&at, &[0.5], &[0.03]),
            [1.5 / 0.03]
        );
    }
}
