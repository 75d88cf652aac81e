//! Drag of air or water.

use crate::declare_effect;
use loopsight_core::{Effect, EffectMeta, Parameter, PlaceKind, Reading, Real, Role};

/// Quadratic drag: a force against the motion that grows with the square of the speed.
///
/// ```text
/// w = -coefficient · flow · |flow|
/// ```
///
/// | symbol | what | unit |
/// |---|---|---|
/// | `flow` | speed conjugate to the effort at the channel | that of the flow, e.g. rad/s |
/// | `coefficient` | drag per squared speed | that of the channel over that of the flow squared |
///
/// Assumptions: a turbulent fluid at rest (no wind, no current), a constant drag coefficient.
///
/// Reference: J. Y. Wong (2008), "Theory of Ground Vehicles", 4th edition, Wiley, section 3.2,
/// aerodynamic resistance.
#[derive(Clone, Copy, Debug)]
pub struct QuadraticDrag;

impl Effect for QuadraticDrag {
    const META: EffectMeta = EffectMeta {
        id: "quadratic_drag",
        summary: "force against the motion that grows with the square of the speed",
        symptom: "the model is right at low speeds and too fast at high ones; the residual over the speed is a parabola with the sign of the speed",
        remedy: "feed the drag forward; limit the speed that is asked for; smooth the flow around fan, propeller or body",
        equation: "w = -coefficient flow |flow|",
        reference: "Wong (2008), Theory of Ground Vehicles, 4th ed., section 3.2",
        example: "[[effect]]\n[effect.quadratic_drag]\nat = [\"body.forward\"]\ncoefficient = 1.5\n",
        places: &[PlaceKind::Effort],
        reads: &[Role::Flow],
        parameters: &[Parameter::new(
            "coefficient",
            "c",
            "channel/flow^2",
            "drag per squared speed",
        )
        .within(0.0, f64::INFINITY)
        .or(0.0)
        .scaled(0.02)],
        rarity: 2,
        ..EffectMeta::PLAIN
    };

    fn contribution<S: Real>(at: &Reading<'_, S>, _z: &[S; 0], p: &[S; 1]) -> S {
        let flow = at.get(Role::Flow);
        -p[0] * flow * flow.abs()
    }
}

declare_effect!(QuadraticDrag, "quadratic_drag");

#[cfg(test)]
mod tests {
    use crate::effects::testing::*;

    use super::*;

    #[test]
    fn quadruples_with_twice_the_speed_and_opposes_it() {
        let w = |flow| QuadraticDrag::contribution(&reading(&[(Role::Flow, flow)]), &[], &[0.5f64]);
        assert_eq!(w(2.0), -2.0);
        assert_eq!(w(-4.0), 8.0);
    }
}
