//! A force that never changes.

use crate::declare_effect;
use loopsight_core::{Effect, EffectMeta, Parameter, PlaceKind, Reading, Real};

/// A constant force: gravity on a lift, a counterweight, a spring of constant force.
///
/// ```text
/// w = force
/// ```
///
/// | symbol | what | unit |
/// |---|---|---|
/// | `force` | the effort, always the same | that of the channel |
///
/// Assumptions: independent of speed, position and time. On a shaft that one input drives it
/// cannot be told from an offset of that input.
///
/// Reference: A. Janot, M. Gautier, M. Brunot (2019), "Data set and reference models of EMPS",
/// Workshop on Nonlinear System Identification Benchmarks (the offset of the friction model).
#[derive(Clone, Copy, Debug)]
pub struct ConstantForce;

impl Effect for ConstantForce {
    const META: EffectMeta = EffectMeta {
        id: "constant_force",
        summary: "a force that is always the same, e.g. gravity on a lift",
        symptom: "the residual drifts the same way whatever the direction and speed; with no command the axis moves, or moves by itself more easily one way",
        remedy: "add its negative to the command; balance it by a counterweight",
        equation: "w = force",
        reference: "Janot, Gautier, Brunot (2019), Data set and reference models of EMPS (offset)",
        example: "[[effect]]\n[effect.constant_force]\nat = [\"shaft\"]\nforce = -0.7\n",
        places: &[PlaceKind::Effort],
        parameters: &[
            Parameter::new("force", "F", "channel", "the effort, always the same")
                .or(0.0)
                .scaled(0.3),
        ],
        rarity: 2,
        ..EffectMeta::PLAIN
    };

    fn contribution<S: Real>(_at: &Reading<'_, S>, _z: &[S; 0], p: &[S; 1]) -> S {
        p[0]
    }
}

declare_effect!(ConstantForce, "constant_force");

#[cfg(test)]
mod tests {
    use crate::effects::testing::*;

    use super::*;

    #[test]
    fn does_not_depend_on_anything() {
        assert_eq!(
            ConstantForce::contribution(&reading(&[]), &[], &[-0.7]),
            -0.7
        );
    }
}
