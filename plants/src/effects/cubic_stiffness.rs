//! A spring that hardens.

use crate::declare_effect;
use loopsight_core::{Effect, EffectMeta, Parameter, PlaceKind, Reading, Real, Role};

/// A spring that hardens: a force towards rest that grows with the cube of the way from it.
///
/// ```text
/// w = -stiffness · (position - rest)³
/// ```
///
/// | symbol | what | unit |
/// |---|---|---|
/// | `position` | integral of the flow at the channel, zero at the start of the log or where the sensor has it | that of the position, e.g. rad |
/// | `stiffness` | force per cubed way | that of the channel over that of the position cubed |
/// | `rest` | position without force | that of the position |
///
/// Assumptions: no hysteresis, no linear part (add `linear_stiffness` for that). `rest` is not
/// estimated unless the file frees it: the position of most logs begins at rest.
///
/// Reference: G. Duffing (1918), "Erzwungene Schwingungen bei veränderlicher Eigenfrequenz",
/// Vieweg.
#[derive(Clone, Copy, Debug)]
pub struct CubicStiffness;

impl Effect for CubicStiffness {
    const META: EffectMeta = EffectMeta {
        id: "cubic_stiffness",
        summary: "a spring that hardens: pulls back with the cube of the way from rest",
        symptom: "the model is right near rest and too free far from it; the residual over the position is flat in the middle and steep at the ends",
        remedy: "feed the force forward with the position; keep away from the ends of the travel",
        equation: "w = -stiffness (position - rest)^3",
        reference: "Duffing (1918), Erzwungene Schwingungen bei veränderlicher Eigenfrequenz",
        example: "[[effect]]\n[effect.cubic_stiffness]\nat = [\"shaft\"]\nstiffness = 0.02\n",
        places: &[PlaceKind::Effort],
        reads: &[Role::Position],
        parameters: &[
            Parameter::new(
                "stiffness",
                "k_3",
                "channel/position^3",
                "force per cubed way",
            )
            .or(0.0)
            .scaled(0.005),
            Parameter::new("rest", "x_0", "position", "position without force")
                .or(0.0)
                .known()
                .nonlinear(),
        ],
        rarity: 2,
        ..EffectMeta::PLAIN
    };

    fn contribution<S: Real>(at: &Reading<'_, S>, _z: &[S; 0], p: &[S; 2]) -> S {
        let [stiffness, rest] = *p;
        let way = at.get(Role::Position) - rest;
        -stiffness * way * way * way
    }
}

declare_effect!(CubicStiffness, "cubic_stiffness");

#[cfg(test)]
mod tests {
    use crate::effects::testing::*;

    use super::*;

    #[test]
    fn pulls_towards_rest() {
        let w = |position| {
            CubicStiffness::contribution(&reading(&[(Role::Position, position)]), &[], &[0.5, 1.0])
        };
        assert_eq!(w(3.0), -4.0);
        assert_eq!(w(-1.0), 4.0);
    }
}
