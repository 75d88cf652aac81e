//! A spring.

use crate::declare_effect;
use loopsight_core::{Effect, EffectMeta, Parameter, PlaceKind, Reading, Real, Role};

/// A spring: a force towards rest, proportional to the way from it.
///
/// ```text
/// w = -stiffness · (position - rest)
/// ```
///
/// | symbol | what | unit |
/// |---|---|---|
/// | `position` | integral of the flow at the channel, zero at the start of the log or where the sensor has it | that of the position, e.g. rad |
/// | `stiffness` | force per way | that of the channel over that of the position |
/// | `rest` | position without force | that of the position |
///
/// Assumptions: no hysteresis, no stop at the end of the travel; it pulls towards rest (a force that
/// pushes away from it is a weight above its pivot, `gravity_pendulum`, not a spring). `rest` is not estimated unless
/// the file frees it: the position of most logs begins at rest; a constant force beside the spring
/// moves it.
///
/// Reference: R. Hooke (1678), "De Potentia Restitutiva".
#[derive(Clone, Copy, Debug)]
pub struct LinearStiffness;

impl Effect for LinearStiffness {
    const META: EffectMeta = EffectMeta {
        id: "linear_stiffness",
        summary: "a spring: pulls back in proportion to the way from rest",
        symptom: "the residual grows with the distance from rest and pulls towards it; with no command the axis returns",
        remedy: "feed the spring force forward with the position; free what is tied: a cable, a hose, a belt",
        equation: "w = -stiffness (position - rest)",
        reference: "Hooke (1678), De Potentia Restitutiva",
        example: "[[effect]]\n[effect.linear_stiffness]\nat = [\"shaft\"]\nstiffness = 0.4\n",
        places: &[PlaceKind::Effort],
        reads: &[Role::Position],
        parameters: &[
            Parameter::new("stiffness", "k", "channel/position", "force per way")
                .within(0.0, f64::INFINITY)
                .or(0.0)
                .scaled(0.05),
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
        -stiffness * way
    }
}

declare_effect!(LinearStiffness, "linear_stiffness");

#[cfg(test)]
mod tests {
    use crate::effects::testing::*;

    use super::*;

    #[test]
    fn pulls_towards_rest() {
        let w = |position| {
            LinearStiffness::contribution(&reading(&[(Role::Position, position)]), &[], &[0.5, 1.0])
        };
        assert_eq!(w(3.0), -1.0);
        assert_eq!(w(-1.0), 1.0);
    }
}
