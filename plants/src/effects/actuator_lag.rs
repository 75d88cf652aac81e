//! A low-pass filter before the actuator.

use loopsight_core::{Effect, EffectMeta, Parameter, PlaceKind, Reading, Real, declare_effect};

/// Actuator lag: the command takes effect gradually.
///
/// ```text
/// z' = (u - z)/max(lag, T₀)          u_effective = u + (z - u) · lag/max(lag, T₀)          T₀ = 4 ms
/// ```
///
/// | symbol | what | unit |
/// |---|---|---|
/// | `u` | the command | that of the channel |
/// | `lag` | time constant | s |
///
/// A first-order lag from 4 ms upwards. Below that its time constant stays at 4 ms, which
/// integration steps of up to 10 ms can follow, and only the share `lag/T₀` of it is used: the
/// area that is missing after a step is that of the lag in any case, and a lag of zero changes
/// nothing.
///
/// Assumptions: linear, the same at every level: the inductance of a winding (`L/R`), a low-pass
/// filter in the motor driver, a hydraulic valve; at the start of a run it has settled.
///
/// Reference: G. F. Franklin, J. D. Powell, A. Emami-Naeini (2002), "Feedback Control of Dynamic
/// Systems", 4th edition, Prentice Hall, chapter 2, the DC motor with the inductance of its
/// armature.
#[derive(Clone, Copy, Debug)]
pub struct ActuatorLag;

impl Effect<1, 1> for ActuatorLag {
    const META: EffectMeta = EffectMeta {
        id: "actuator_lag",
        summary: "the command takes effect gradually, like through a low-pass filter",
        symptom: "after each step of the command the robot sets off more gently than the model; the residual is a pulse that fades, shorter than the motion itself",
        remedy: "a faster filter in the motor driver; lead compensation; treat it as a delay of the same size in a slow loop",
        equation: "z' = (u - z)/lag; u_effective = z",
        reference: "Franklin, Powell, Emami-Naeini (2002), Feedback Control of Dynamic Systems, 4th ed., chapter 2 (DC motor)",
        example: "[[effect]]\n[effect.actuator_lag]\nat = [\"input.right\", \"input.left\"]\nlag = 0.03\n",
        places: &[PlaceKind::Input],
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

declare_effect!(ActuatorLag, "actuator_lag", <1, 1>);

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
            area -= h * ActuatorLag::contribution(&at, &z, &[lag]);
            z[0] += h * ActuatorLag::state_derivative(&at, &z, &[lag])[0];
        }
        (-ActuatorLag::contribution(&at, &z, &[lag]), area)
    }

    #[test]
    fn a_step_fades_with_the_time_constant() {
        assert!((step(0.03, 0.03).0 - (-1.0f64).exp()).abs() < 1e-3);
        for lag in [0.0, 0.001, 0.004, 0.03] {
            assert!((step(lag, 0.5).1 - lag).abs() < 1e-4, "{lag}");
        }
    }
}
