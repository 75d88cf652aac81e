//! An actuator at its limit.

use crate::declare_effect;
use loopsight_core::{Effect, EffectMeta, Parameter, PlaceKind, Reading, Real};

/// Saturation: the actuator gives no more than a limit, below the nominal one.
///
/// ```text
/// u_effective = -limit … u … limit
/// ```
///
/// | symbol | what | unit |
/// |---|---|---|
/// | `u` | the command | that of the channel |
/// | `limit` | the most the actuator gives | that of the channel |
///
/// Assumptions: the same in both directions, sharp. A limit above the largest command of the log
/// has no influence, and the log says nothing of it; the neutral value is far above any.
///
/// Reference: T. Hu, Z. Lin (2001), "Control Systems with Actuator Saturation", Birkhäuser,
/// chapter 1.
#[derive(Clone, Copy, Debug)]
pub struct InputSaturation;

impl Effect for InputSaturation {
    const META: EffectMeta = EffectMeta {
        id: "input_saturation",
        summary: "the actuator gives no more than a limit",
        symptom: "small commands are right, large ones all give the same; the residual appears only above a certain command",
        remedy: "tell the controller the limit, so that it does not wind up; a higher supply or current limit",
        equation: "u_effective = clamp(u, -limit, limit)",
        reference: "Hu, Lin (2001), Control Systems with Actuator Saturation, chapter 1",
        example: "[[effect]]\n[effect.input_saturation]\nat = [\"input.right\", \"input.left\"]\nlimit = 6.0\n",
        places: &[PlaceKind::Input],
        parameters: &[
            Parameter::new("limit", "u_max", "channel", "the most the actuator gives")
                .above(0.0)
                .or(1000.0)
                .nonlinear()
                .starting_at(&[1.5, 3.0, 5.0, 8.0, 12.0, 20.0]),
        ],
        before_input: true,
        is_static: true,
        ..EffectMeta::PLAIN
    };

    fn contribution<S: Real>(at: &Reading<'_, S>, _z: &[S; 0], p: &[S; 1]) -> S {
        at.nominal.clamp(-p[0], p[0]) - at.nominal
    }
}

declare_effect!(InputSaturation, "input_saturation");

#[cfg(test)]
mod tests {
    use crate::effects::testing::*;

    use super::*;

    #[test]
    fn gives_no_more_than_the_limit() {
        for (u, expected) in [(3.0, 3.0), (9.0, 6.0), (-9.0, -6.0)] {
            let at = Reading {
                nominal: u,
                ..reading(&[])
            };
            let effective: f64 = u + InputSaturation::contribution(&at, &[], &[6.0]);
            assert_eq!(effective, expected);
        }
    }
}
