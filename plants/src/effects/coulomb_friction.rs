//! Dry friction.

use crate::declare_effect;
use loopsight_core::{Effect, EffectMeta, Parameter, PlaceKind, Reading, Real, Role};

/// Coulomb friction: a force of constant size against the motion.
///
/// ```text
/// w = -level · tanh(flow / width)
/// ```
///
/// | symbol | what | unit |
/// |---|---|---|
/// | `flow` | speed conjugate to the effort at the channel | that of the flow, e.g. rad/s |
/// | `level` | size of the friction | that of the channel, e.g. V |
/// | `width` | speed below which the sign is smoothed | that of the flow |
///
/// On a channel about the vertical of a vehicle this is `scrub_friction`.
///
/// The smoothing stands for the sign function, which no integrator with fixed steps can follow;
/// `width` belongs well below the speeds of interest and is not estimated. Where a model file has none,
/// a fit takes a narrower one for a machine whose speeds are small. At rest the model creeps instead of
/// sticking.
///
/// Reference: C. A. Coulomb (1785), "Théorie des machines simples"; regularisation as in
/// H. Olsson et al. (1998), "Friction models and friction compensation", European Journal of
/// Control 4, 176–195, section 2.
#[derive(Clone, Copy, Debug)]
pub struct CoulombFriction;

impl Effect for CoulombFriction {
    const META: EffectMeta = EffectMeta {
        id: "coulomb_friction",
        summary: "constant force opposing the motion",
        symptom: "the model starts too early and stops too late; the residual jumps when the direction changes and has the size of a constant force whose sign is that of the speed",
        remedy: "add the level to the command in the direction of motion; grease or align the bearings",
        equation: "w = -level tanh(flow/width)",
        reference: "Coulomb (1785); smoothing: Olsson et al. (1998), European Journal of Control 4, 176-195",
        example: "[[effect]]\n[effect.coulomb_friction]\nat = [\"wheel.right\", \"wheel.left\"]\nlevel = 0.9\n",
        places: &[PlaceKind::Effort],
        reads: &[Role::Flow],
        yields_to: &[Role::Yaw, Role::Head],
        parameters: &[
            Parameter::new("level", "c", "channel", "size of the friction")
                .within(0.0, f64::INFINITY)
                .or(0.0)
                .scaled(0.3),
            Parameter::new(
                "width",
                "s",
                "flow",
                "speed below which the sign is smoothed",
            )
            .above(0.0)
            .or(0.1)
            .known()
            .nonlinear()
            .scaled(0.1),
        ],
        rarity: 0,
        ..EffectMeta::PLAIN
    };

    fn contribution<S: Real>(at: &Reading<'_, S>, _z: &[S; 0], p: &[S; 2]) -> S {
        let [level, width] = *p;
        -level * (at.get(Role::Flow) / width).tanh()
    }
}

declare_effect!(CoulombFriction, "coulomb_friction");

#[cfg(test)]
mod tests {
    use crate::effects::testing::*;

    use super::*;

    #[test]
    fn opposes_the_motion_with_its_level() {
        for (flow, expected) in [(5.0, -0.9), (-5.0, 0.9), (0.0, 0.0)] {
            let at = reading(&[(Role::Flow, flow)]);
            let w: f64 = CoulombFriction::contribution(&at, &[], &[0.9, 0.1]);
            assert!((w - expected).abs() < 1e-12, "{flow}: {w}");
        }
    }
}
