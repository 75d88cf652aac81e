//! A threshold in the actuator.

use crate::declare_effect;
use loopsight_core::{Effect, EffectMeta, Parameter, PlaceKind, Reading, Real};

/// Dead zone: commands below a threshold do nothing, and larger ones are reduced by it.
///
/// ```text
/// u_effective = u - threshold · sign(u)    |u| > threshold
/// u_effective = 0                          otherwise
/// ```
///
/// | symbol | what | unit |
/// |---|---|---|
/// | `u` | the command | that of the channel |
/// | `threshold` | what is lost of it | that of the channel |
///
/// Assumptions: the same in both directions, slope one beyond the threshold, no hysteresis.
///
/// Two levels of command (a square wave, a PRBS) cannot tell it from a smaller gain.
///
/// Reference: G. Tao, P. V. Kokotović (1996), "Adaptive Control of Systems with Actuator and Sensor
/// Nonlinearities", Wiley, chapter 2, the dead-zone characteristic.
#[derive(Clone, Copy, Debug)]
pub struct DeadZone;

impl Effect for DeadZone {
    const META: EffectMeta = EffectMeta {
        id: "dead_zone",
        summary: "commands below a threshold do nothing, and larger ones are reduced by it",
        symptom: "small commands move the model but not the robot; larger ones are short by the same amount at every level, with the sign of the command",
        remedy: "add the threshold to the command, with its sign; a motor driver with a finer dead time or a higher PWM frequency",
        equation: "u_effective = u - threshold sign(u) where |u| > threshold, else 0",
        reference: "Tao, Kokotović (1996), Adaptive Control of Systems with Actuator and Sensor Nonlinearities, chapter 2",
        example: "[[effect]]\n[effect.dead_zone]\nat = [\"input.right\", \"input.left\"]\nthreshold = 0.8\n",
        places: &[PlaceKind::Input],
        parameters: &[
            Parameter::new("threshold", "u_0", "channel", "what is lost of the command")
                .within(0.0, f64::INFINITY)
                .or(0.0)
                .nonlinear()
                .scaled(0.3),
        ],
        before_input: true,
        is_static: true,
        ..EffectMeta::PLAIN
    };

    fn contribution<S: Real>(at: &Reading<'_, S>, _z: &[S; 0], p: &[S; 1]) -> S {
        // Written so that a threshold of zero has its derivative, -sign(u).
        -at.nominal.clamp(-p[0], p[0])
    }
}

declare_effect!(DeadZone, "dead_zone");

#[cfg(test)]
mod tests {
    use crate::effects::testing::*;

    use super::*;

    use loopsight_model::{Dual, derivative, variable};

    #[test]
    fn takes_the_threshold_and_no_more() {
        let effective = |u: f64| {
            let at = Reading {
                nominal: u,
                ..reading(&[])
            };
            u + DeadZone::contribution(&at, &[], &[0.8])
        };
        assert_eq!(effective(0.5), 0.0);
        assert_eq!(effective(-0.8), 0.0);
        assert!((effective(2.0) - 1.2).abs() < 1e-15 && (effective(-2.0) + 1.2).abs() < 1e-15);
    }

    #[test]
    fn a_fit_can_leave_a_threshold_of_zero() {
        for u in [3.0, -3.0] {
            let at = Reading {
                nominal: Dual::of(u),
                ..Reading::nothing()
            };
            let w = DeadZone::contribution(&at, &[], &[variable(0.0, 0)]);
            assert_eq!(w.value(), 0.0);
            assert_eq!(derivative(&w, 0), -f64::signum(u));
        }
    }
}
