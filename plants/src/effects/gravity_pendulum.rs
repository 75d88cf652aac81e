//! An arm in gravity.

use crate::declare_effect;
use loopsight_core::{Effect, EffectMeta, Parameter, PlaceKind, Reading, Real, Role};

/// Gravity on an arm: a moment that is a sine of the angle.
///
/// ```text
/// w = cosine · cos(angle) + sine · sin(angle)
/// ```
///
/// | symbol | what | unit |
/// |---|---|---|
/// | `angle` | angle of the shaft, zero at the start of the log or where the encoder has it | rad |
/// | `cosine` | effort at angle zero | that of the channel, e.g. V |
/// | `sine` | effort at angle π/2 | that of the channel |
///
/// An arm that is level at angle zero and rises with it has `cosine = -m g l` (in the unit of the
/// channel) and `sine = 0`; one that hangs there has `cosine = 0`, `sine = -m g l`. With two
/// components the zero of the encoder does not matter.
///
/// Assumptions: a rigid arm on a horizontal axis; a gear between shaft and arm is not seen (the
/// angle is that of the shaft that carries the arm).
///
/// Reference: M. W. Spong, S. Hutchinson, M. Vidyasagar (2006), "Robot Modeling and Control",
/// Wiley, chapter 7, the single link.
#[derive(Clone, Copy, Debug)]
pub struct GravityPendulum;

impl Effect for GravityPendulum {
    const META: EffectMeta = EffectMeta {
        id: "gravity_pendulum",
        summary: "gravity on an arm or an unbalanced wheel: a sine of the angle",
        symptom: "the arm is slower going up than coming down and does not stay where it is left; the residual is a sine over the angle, once per turn",
        remedy: "feed the moment forward with the angle; balance the arm",
        equation: "w = cosine cos(angle) + sine sin(angle)",
        reference: "Spong, Hutchinson, Vidyasagar (2006), Robot Modeling and Control, chapter 7 (single link)",
        example: "[[effect]]\n[effect.gravity_pendulum]\nat = [\"shaft\"]\ncosine = -1.4\n",
        places: &[PlaceKind::Effort],
        reads: &[Role::Shaft],
        yields_to: &[Role::Gravity],
        parameters: &[
            Parameter::new("cosine", "a", "channel", "effort at angle zero")
                .or(0.0)
                .scaled(0.3),
            Parameter::new("sine", "b", "channel", "effort at angle π/2")
                .or(0.0)
                .scaled(0.3),
        ],
        rarity: 2,
        ..EffectMeta::PLAIN
    };

    fn contribution<S: Real>(at: &Reading<'_, S>, _z: &[S; 0], p: &[S; 2]) -> S {
        let angle = at.get(Role::Shaft);
        let (sin, cos) = angle.sin_cos();
        p[0] * cos + p[1] * sin
    }
}

declare_effect!(GravityPendulum, "gravity_pendulum");

#[cfg(test)]
mod tests {
    use crate::effects::testing::*;

    use super::*;

    #[test]
    fn is_full_when_level_and_nothing_upright() {
        let w = |angle| {
            GravityPendulum::contribution(&reading(&[(Role::Shaft, angle)]), &[], &[-1.4f64, 0.0])
        };
        assert_eq!(w(0.0), -1.4);
        assert!(w(std::f64::consts::FRAC_PI_2).abs() < 1e-15);
    }
}
