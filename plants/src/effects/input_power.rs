//! An actuator whose output goes with a power of its command.

use crate::declare_effect;
use loopsight_core::{Effect, EffectMeta, Parameter, PlaceKind, Reading, Real};

/// Power law: what the actuator gives goes with a power of the command, with its sign.
///
/// ```text
/// u_effective = r sign(u) |u/r|^n
/// ```
///
/// | symbol | what | unit |
/// |---|---|---|
/// | `u` | the command | that of the channel |
/// | `n` | exponent: 2 for a fan, propeller or centrifugal pump whose speed follows the command; 1 does nothing | 1 |
/// | `r` | the command at which the actuator gives what the model says without the effect | that of the channel |
///
/// The plant's gain and `r` say one thing twice, so `r` is not estimated. A diagnosis takes about the root mean
/// square of the recording: gain and exponent hardly depend on each other then.
///
/// At `u = 0` the output is 0 whatever the exponent is. With `n < 1` the slope over `u` is infinite there; it is
/// taken for 0, so that a fit gets a number.
///
/// It acts last of all effects at an input, wherever it stands in the file: a fan's speed lags behind its command,
/// and its thrust is a power of the speed that it has come to. So `u` is what delay, lag, dead zone and offset leave.
///
/// Assumptions: the same in both directions; at once.
///
/// Two levels of one size (a PRBS) do not show it, and two levels of any size cannot tell it from
/// an offset with another gain.
///
/// Reference: I. J. Karassik, J. P. Messina, P. Cooper, C. C. Heald (2001), "Pump Handbook", 3rd edition,
/// McGraw-Hill: the affinity laws; J. G. Leishman (2006), "Principles of Helicopter Aerodynamics", 2nd edition,
/// Cambridge University Press, chapter 2: thrust goes with the square of the tip speed.
#[derive(Clone, Copy, Debug)]
pub struct InputPower;

impl Effect for InputPower {
    const META: EffectMeta = EffectMeta {
        id: "input_power",
        summary: "the actuator gives a power of its command: fans, propellers, pumps, valves",
        symptom: "the gain grows, or falls, with the size of the command: small commands give too little and large ones too much, or the reverse",
        remedy: "command the root of what is wanted, with its sign; a speed loop around the fan or pump, or a linear valve",
        equation: "u_effective = r sign(u) |u/r|^n",
        reference: "Karassik et al. (2001), Pump Handbook, 3rd ed. (affinity laws); Leishman (2006), Principles of Helicopter Aerodynamics, 2nd ed., chapter 2 (thrust and tip speed)",
        example: "[[effect]]\n[effect.input_power]\nat = [\"input.right\", \"input.left\"]\nexponent = 2.0\nreference = 9.0\n",
        places: &[PlaceKind::Input],
        parameters: &[
            Parameter::new("exponent", "n", "1", "exponent of the command; 1: none")
                .within(0.1, 10.0)
                .or(1.0)
                .nonlinear()
                .scaled(0.5)
                // The first hardly acts: what it promises is linear, either way.
                .starting_at(&[1.02, 0.5, 2.0, 3.0]),
            Parameter::new(
                "reference",
                "r",
                "channel",
                "the command at which the actuator gives what it does without the effect",
            )
            .above(0.0)
            .or(1.0)
            .nonlinear()
            .known(),
        ],
        before_input: true,
        acts_last: true,
        is_static: true,
        ..EffectMeta::PLAIN
    };

    fn contribution<S: Real>(at: &Reading<'_, S>, _z: &[S; 0], p: &[S; 2]) -> S {
        let [exponent, reference] = *p;
        let size = reference * (at.nominal.abs() / reference).powf(exponent);
        let effective = if at.nominal < S::zero() { -size } else { size };
        effective - at.nominal
    }
}

declare_effect!(InputPower, "input_power");

#[cfg(test)]
mod tests {
    use crate::effects::testing::*;

    use super::*;

    use loopsight_model::{Dual, derivative, variable};

    fn effective<S: Real>(u: S, exponent: S, reference: f64) -> S {
        let at = Reading {
            nominal: u,
            ..Reading::nothing()
        };
        u + InputPower::contribution(&at, &[], &[exponent, S::of(reference)])
    }

    #[test]
    fn goes_with_the_power_and_keeps_the_sign() {
        for (u, expected) in [
            (3.0, 1.5),
            (-3.0, -1.5),
            (6.0, 6.0),
            (-12.0, -24.0),
            (0.0, 0.0),
        ] {
            assert!((effective(u, 2.0, 6.0) - expected).abs() < 1e-12, "{u}");
        }
        for u in [-7.0, -0.2, 0.0, 4.0] {
            assert!((effective(u, 1.0, 3.0) - u).abs() < 1e-12, "1 does nothing");
        }
        assert_eq!(
            InputPower::contribution(&reading(&[]), &[], &[2.0, 6.0]),
            0.0
        );
    }

    /// By the exponent `u_effective ln|u/r|`, and nothing at 0; by the command finite at 0, too.
    #[test]
    fn has_derivatives_everywhere() {
        for n in [0.1, 0.5, 1.0, 2.0, 10.0] {
            for u in [-8.0, -3.0, -1e-300, 0.0, 1e-300, 2.0, 6.0] {
                let w = effective(variable(u, 0), variable(n, 1), 6.0);
                assert!(w.value().is_finite(), "{u}^{n}");
                assert!(derivative(&w, 0).is_finite() && derivative(&w, 1).is_finite());
                if u.abs() > 1.0 {
                    let expected = w.value() * (u.abs() / 6.0).ln();
                    assert!((derivative(&w, 1) - expected).abs() < 1e-9 * (1.0 + expected.abs()));
                }
            }
            let rest = effective(Dual::of(0.0), variable(n, 1), 6.0);
            assert_eq!((rest.value(), derivative(&rest, 1)), (0.0, 0.0));
        }
    }
}
