//! Friction of turning on the spot.

use crate::declare_effect;
use loopsight_core::{Effect, EffectMeta, Parameter, PlaceKind, Reading, Real, Role};

/// Scrub: dry friction of tyres and castors that are dragged sideways when a vehicle turns.
///
/// ```text
/// w = -level · tanh(yaw / width)
/// ```
///
/// | symbol | what | unit |
/// |---|---|---|
/// | `yaw` | yaw rate of the vehicle | rad/s |
/// | `level` | yaw acceleration that the scrub takes | that of the channel, rad/s² |
/// | `width` | yaw rate below which the sign is smoothed | rad/s |
///
/// Assumptions: the moment does not depend on the forward speed. (It does: a wheel that rolls fast
/// is dragged sideways at a smaller slip angle, so the level is that of turning on the spot and of
/// slow arcs.) Attaches only to a channel about the vertical.
///
/// Reference: J. Y. Wong (2008), "Theory of Ground Vehicles", 4th edition, Wiley, section 6.1,
/// moment of turning resistance.
#[derive(Clone, Copy, Debug)]
pub struct ScrubFriction;

impl Effect for ScrubFriction {
    const META: EffectMeta = EffectMeta {
        id: "scrub_friction",
        summary: "dry friction about the vertical when a vehicle turns: tyres and castors dragged sideways",
        symptom: "straight runs are right, turns start too early and come out too fast; the residual of the yaw rate has a constant size and the sign of the yaw rate",
        remedy: "feed the turning moment forward with the sign of the yaw rate; narrower or harder tyres, a ball castor, less weight on the castor",
        equation: "w = -level tanh(yaw/width)",
        reference: "Wong (2008), Theory of Ground Vehicles, 4th ed., section 6.1",
        example: "[[effect]]\n[effect.scrub_friction]\nat = [\"body.yaw\"]\nlevel = 1.2\n",
        places: &[PlaceKind::Effort],
        reads: &[Role::Flow, Role::Yaw],
        parameters: &[
            Parameter::new(
                "level",
                "c",
                "channel",
                "yaw acceleration that the scrub takes",
            )
            .within(0.0, f64::INFINITY)
            .or(0.0)
            .scaled(0.3),
            Parameter::new(
                "width",
                "s",
                "flow",
                "yaw rate below which the sign is smoothed",
            )
            .above(0.0)
            .or(0.1)
            .known()
            .nonlinear()
            .scaled(0.1),
        ],
        ..EffectMeta::PLAIN
    };

    fn contribution<S: Real>(at: &Reading<'_, S>, _z: &[S; 0], p: &[S; 2]) -> S {
        let [level, width] = *p;
        -level * (at.get(Role::Yaw) / width).tanh()
    }
}

declare_effect!(ScrubFriction, "scrub_friction");

#[cfg(test)]
mod tests {
    use crate::effects::testing::*;

    use super::*;

    #[test]
    fn opposes_the_turn_only() {
        let w =
            |yaw| ScrubFriction::contribution(&reading(&[(Role::Yaw, yaw)]), &[], &[1.2f64, 0.04]);
        assert!((w(2.0) + 1.2).abs() < 1e-12 && (w(-2.0) - 1.2).abs() < 1e-12);
        assert_eq!(w(0.0), 0.0);
    }
}
