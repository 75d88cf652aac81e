//! Friction that depends on the direction.

use crate::declare_effect;
use loopsight_core::{Effect, EffectMeta, Parameter, PlaceKind, Reading, Real, Role};

/// Friction that differs forwards and backwards.
///
/// ```text
/// flow > 0:  w = -level_forward · tanh(flow/width)  - viscous_forward · flow
/// flow < 0:  w = -level_backward · tanh(flow/width) - viscous_backward · flow
/// ```
///
/// | symbol | what | unit |
/// |---|---|---|
/// | `flow` | speed conjugate to the effort at the channel | that of the flow, e.g. rad/s |
/// | `level_*` | dry friction in that direction | that of the channel, e.g. V |
/// | `viscous_*` | friction per speed in that direction | that of the channel over that of the flow |
/// | `width` | speed below which the sign is smoothed | that of the flow |
///
/// Assumptions: the friction depends on the present direction only, not on how long it has lasted.
/// The contribution is continuous at rest, so that no force is left there.
///
/// Of the viscous parts a plant with a damping of its own sees the difference; the mean adds to its
/// damping and cannot be told from it.
///
/// Reference: B. Armstrong-Hélouvry (1991), "Control of Machines with Friction", Kluwer (friction
/// of an arm measured in both directions); A. Janot, M. Gautier, M. Brunot (2019), "Data set and
/// reference models of EMPS", Workshop on Nonlinear System Identification Benchmarks (Coulomb,
/// viscous and an offset that makes the two directions differ).
#[derive(Clone, Copy, Debug)]
pub struct DirectionalFriction;

impl Effect for DirectionalFriction {
    const META: EffectMeta = EffectMeta {
        id: "directional_friction",
        summary: "friction that differs forwards and backwards",
        symptom: "the residual has the sign of the speed and another size in either direction; with the same voltage the robot is faster one way than the other",
        remedy: "compensate with a level per direction; look for a worm gear, a preloaded bearing, a dragging cable or a castor",
        equation: "w = -level_d tanh(flow/width) - viscous_d flow, d = forward, backward by the sign of flow",
        reference: "Armstrong-Hélouvry (1991), Control of Machines with Friction; Janot, Gautier, Brunot (2019), Data set and reference models of EMPS",
        example: "[[effect]]\n[effect.directional_friction]\nat = [\"wheel.right\", \"wheel.left\"]\nlevel_forward = 0.6\nlevel_backward = 1.1\n",
        places: &[PlaceKind::Effort],
        reads: &[Role::Flow],
        yields_to: &[Role::Head],
        simpler: &["coulomb_friction", "scrub_friction", "viscous_friction"],
        parameters: &[
            Parameter::new("level_forward", "c_f", "channel", "dry friction forwards")
                .within(0.0, f64::INFINITY)
                .or(0.0)
                .scaled(0.3),
            Parameter::new("level_backward", "c_b", "channel", "dry friction backwards")
                .within(0.0, f64::INFINITY)
                .or(0.0)
                .scaled(0.3)
                .opposing("level_forward"),
            Parameter::new(
                "viscous_forward",
                "d_f",
                "channel/flow",
                "friction per speed forwards",
            )
            .or(0.0)
            .scaled(0.1),
            Parameter::new(
                "viscous_backward",
                "d_b",
                "channel/flow",
                "friction per speed backwards",
            )
            .or(0.0)
            .scaled(0.1)
            .opposing("viscous_forward"),
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
        ..EffectMeta::PLAIN
    };

    fn contribution<S: Real>(at: &Reading<'_, S>, _z: &[S; 0], p: &[S; 5]) -> S {
        let [
            level_forward,
            level_backward,
            viscous_forward,
            viscous_backward,
            width,
        ] = *p;
        let flow = at.get(Role::Flow);
        let (level, viscous) = if flow > S::zero() {
            (level_forward, viscous_forward)
        } else {
            (level_backward, viscous_backward)
        };
        -level * (flow / width).tanh() - viscous * flow
    }
}

declare_effect!(DirectionalFriction, "directional_friction");

#[cfg(test)]
mod tests {
    use crate::effects::testing::*;

    use super::*;

    #[test]
    fn each_direction_has_its_own() {
        let w = |flow| {
            DirectionalFriction::contribution(
                &reading(&[(Role::Flow, flow)]),
                &[],
                &[0.6, 1.1, 0.05, 0.2, 1e-2],
            )
        };
        assert!((w(4.0) + 0.8).abs() < 1e-12);
        assert!((w(-4.0) - 1.9).abs() < 1e-12);
        assert_eq!(w(0.0), 0.0);
    }
}
