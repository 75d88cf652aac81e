//! Friction of lubricated bearings.

use crate::declare_effect;
use loopsight_core::{Effect, EffectMeta, Parameter, PlaceKind, Reading, Real, Role};

/// Viscous friction: a force against the motion, proportional to the speed.
///
/// ```text
/// w = -coefficient · flow
/// ```
///
/// | symbol | what | unit |
/// |---|---|---|
/// | `flow` | speed conjugate to the effort at the channel | that of the flow, e.g. rad/s |
/// | `coefficient` | friction per speed | that of the channel over that of the flow, e.g. V/(rad/s) |
///
/// Assumptions: laminar lubrication; the same forwards and backwards.
///
/// Where the plant has a damping of its own that a fit estimates (`K_A` and `K_D` of a `ddmr` with
/// both wheels alike, `K_A` of a `dc_axis`) the two cannot be told apart: only their sum counts.
/// One wheel alone, or a plant whose damping is known, is another matter.
///
/// Reference: O. Reynolds (1886), Philosophical Transactions 177, 157–234; H. Olsson et al. (1998),
/// "Friction models and friction compensation", European Journal of Control 4, 176–195, section 2.
#[derive(Clone, Copy, Debug)]
pub struct ViscousFriction;

impl Effect for ViscousFriction {
    const META: EffectMeta = EffectMeta {
        id: "viscous_friction",
        summary: "force against the motion, proportional to the speed",
        symptom: "the measured speed settles below the model's, by the same percentage at every level; the residual is a straight line over the speed",
        remedy: "let the damping of the plant take it up in a fit; look for a bearing that runs tight if only one side shows it",
        equation: "w = -coefficient flow",
        reference: "Reynolds (1886), Philosophical Transactions 177, 157-234; Olsson et al. (1998), European Journal of Control 4, 176-195, section 2",
        example: "[[effect]]\n[effect.viscous_friction]\nat = [\"wheel.right\"]\ncoefficient = 0.2\n",
        places: &[PlaceKind::Effort],
        reads: &[Role::Flow],
        parameters: &[
            Parameter::new("coefficient", "d", "channel/flow", "friction per speed")
                .within(0.0, f64::INFINITY)
                .or(0.0)
                .scaled(0.1),
        ],
        ..EffectMeta::PLAIN
    };

    fn contribution<S: Real>(at: &Reading<'_, S>, _z: &[S; 0], p: &[S; 1]) -> S {
        -p[0] * at.get(Role::Flow)
    }
}

declare_effect!(ViscousFriction, "viscous_friction");

#[cfg(test)]
mod tests {
    use crate::effects::testing::*;

    use super::*;

    #[test]
    fn takes_power_out_of_the_motion() {
        for flow in [-3.0, 2.0] {
            let w = ViscousFriction::contribution(&reading(&[(Role::Flow, flow)]), &[], &[0.2]);
            assert!((w * flow + 0.2 * flow * flow).abs() < 1e-12);
        }
    }
}
