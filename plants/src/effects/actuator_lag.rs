//! A low-pass filter before the actuator.

use crate::declare_effect;
use loopsight_core::{Effect, EffectMeta, Parameter, PlaceKind, Reading, Real};

use super::{LONGEST_S, first_order};

/// Actuator lag: the command takes effect gradually.
///
/// ```text
/// z' = (u - z)/max(lag, T₀)          u_effective = u + (z - u) · lag/max(lag, T₀)
/// ```
///
/// | symbol | what | unit |
/// |---|---|---|
/// | `u` | the command | that of the channel |
/// | `lag` | time constant | s |
///
/// `T₀` is 4 ms, which integration steps of up to 10 ms can follow, or the time between samples where that is shorter.
/// Below it the time constant stays at `T₀`, and only the share `lag/T₀` of it is used: the
/// area that is missing after a step is that of the lag in any case, and a lag of zero changes
/// nothing.
///
/// Assumptions: linear, the same at every level: the inductance of a winding (`L/R`), a low-pass
/// filter in the motor driver, a hydraulic valve; at the start of a run it has settled
/// to what was applied before (see `Simulator::reset`).
///
/// Reference: G. F. Franklin, J. D. Powell, A. Emami-Naeini (2002), "Feedback Control of Dynamic
/// Systems", 4th edition, Prentice Hall, chapter 2, the DC motor with the inductance of its
/// armature.
#[derive(Clone, Copy, Debug)]
pub struct ActuatorLag;

impl Effect for ActuatorLag {
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

declare_effect!(ActuatorLag, "actuator_lag");

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
        let z = ActuatorLag::initial_state(&at, &[0.03]);
        assert_eq!(ActuatorLag::contribution(&at, &z, &[0.03]), 0.0);
        assert_eq!(ActuatorLag::contribution(&at, &[0.5], &[0.03]), -1.5);
        assert_eq!(
            ActuatorLag::state_derivative(&at, &[0.5], &[0.03]),
            [1.5 / 0.03]
        );
    }
}
