//! Friction that changes as time goes by.

use crate::declare_effect;
use loopsight_core::{Effect, EffectMeta, Parameter, PlaceKind, Reading, Real, Role, Shows};

/// Friction drift: viscous friction that changes with time alone.
///
/// ```text
/// w = -rate · t · flow
/// ```
///
/// | symbol | what | unit |
/// |---|---|---|
/// | `flow` | speed conjugate to the effort at the channel | that of the flow, e.g. rad/s |
/// | `rate` | growth of the friction per speed in a second; bearings whose grease warms up have a negative one | that of the channel over that of the flow and s |
/// | `t` | time since the start of the run | s |
///
/// The viscosity of a grease halves with every ten or twenty kelvin, so a machine that starts cold loses much of its
/// friction within minutes. One that runs dry gains some.
///
/// Assumptions: the recording is short against the warming, so that the change is straight; what changes goes with the speed
/// (in a log of one speed, dry friction that changes is the same); each run begins with the friction of the model. Where a
/// recording is several runs the last is not so, and a diagnosis does not try the effect.
///
/// In a running loop nothing compensates it: its time is that of a recording. Learn the damping there.
///
/// Reference: C. J. A. Roelands (1966), "Correlational Aspects of the Viscosity-Temperature-Pressure Relationship of
/// Lubricating Oils", Delft; L. Simoni, M. Beschi, G. Legnani, A. Visioli (2015), "Friction modeling with temperature
/// effects for industrial robot manipulators", IEEE/RSJ IROS, 3524–3529: viscous friction over temperature.
#[derive(Clone, Copy, Debug)]
pub struct FrictionDrift;

impl Effect for FrictionDrift {
    const META: EffectMeta = EffectMeta {
        id: "friction_drift",
        summary: "viscous friction that changes with time alone: bearings that warm up or run dry",
        symptom: "steady speeds at one level of the command rise, or fall, along the log, by the more the faster the machine runs; starting from rest is as it was",
        remedy: "let the machine run warm before identifying and before work that counts; look after bearings that run tighter with time; estimate the damping while running",
        equation: "w = -rate t flow",
        reference: "Roelands (1966), Correlational Aspects of the Viscosity-Temperature-Pressure Relationship of Lubricating Oils; Simoni et al. (2015), IEEE/RSJ IROS, 3524-3529",
        example: "[[effect]]\n[effect.friction_drift]\nat = [\"wheel.right\", \"wheel.left\"]\nrate = -0.001\n",
        places: &[PlaceKind::Effort],
        reads: &[Role::Flow],
        parameters: &[Parameter::new(
            "rate",
            "r",
            "channel/flow/s",
            "growth of the friction per speed in a second",
        )
        .or(0.0)
        .scaled(0.005)],
        shows: Shows::OneRun,
        rarity: 2,
        ..EffectMeta::PLAIN
    };

    fn contribution<S: Real>(at: &Reading<'_, S>, _z: &[S; 0], p: &[S; 1]) -> S {
        -p[0] * S::of(at.time) * at.get(Role::Flow)
    }
}

declare_effect!(FrictionDrift, "friction_drift");

#[cfg(test)]
mod tests {
    use crate::effects::testing::*;

    use super::*;

    #[test]
    fn a_bearing_that_runs_dry_takes_more_later() {
        let w = |time: f64| {
            let at = Reading {
                time,
                ..reading(&[(Role::Flow, 3.0)])
            };
            FrictionDrift::contribution(&at, &[], &[0.01])
        };
        assert_eq!(w(0.0), 0.0);
        assert!((w(20.0) + 0.6).abs() < 1e-12);
    }
}
