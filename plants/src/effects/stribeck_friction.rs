//! Dry friction with a breakaway.

use crate::declare_effect;
use loopsight_core::{Effect, EffectMeta, Parameter, PlaceKind, Reading, Real, Role};

/// Stribeck friction: dry friction that is higher at breakaway than in motion.
///
/// ```text
/// w = -(level + extra · exp(-(flow/speed)²)) · tanh(flow / width)
/// ```
///
/// | symbol | what | unit |
/// |---|---|---|
/// | `flow` | speed conjugate to the effort at the channel | that of the flow, e.g. rad/s |
/// | `level` | friction in motion | that of the channel, e.g. V |
/// | `extra` | what breakaway takes beyond it | that of the channel |
/// | `speed` | Stribeck speed: where the extra friction has fallen to 1/e | that of the flow |
/// | `width` | speed below which the sign is smoothed | that of the flow |
///
/// Assumptions: the friction follows the speed at once (no frictional lag, no presliding); `width`
/// is well below `speed`. The exponent is that of a Gaussian.
///
/// Reference: B. Armstrong-Hélouvry, P. Dupont, C. Canudas de Wit (1994), "A survey of models,
/// analysis tools and compensation methods for the control of machines with friction", Automatica
/// 30(7), 1083–1138, section 2; H. Olsson et al. (1998), European Journal of Control 4, 176–195,
/// section 2.
#[derive(Clone, Copy, Debug)]
pub struct StribeckFriction;

impl Effect for StribeckFriction {
    const META: EffectMeta = EffectMeta {
        id: "stribeck_friction",
        summary: "dry friction that is higher at breakaway than in motion",
        symptom: "the measured motion starts later than the model's and then catches up with a jump; the residual peaks at low speeds and is smaller at high ones, with the sign of the speed",
        remedy: "give the command a short kick when the motion starts, and the sliding level afterwards; lubricate; avoid creeping speeds",
        equation: "w = -(level + extra exp(-(flow/speed)^2)) tanh(flow/width)",
        reference: "Armstrong-Hélouvry, Dupont, Canudas de Wit (1994), Automatica 30(7), 1083-1138, section 2; Olsson et al. (1998), European Journal of Control 4, 176-195, section 2",
        example: "[[effect]]\n[effect.stribeck_friction]\nat = [\"wheel.right\", \"wheel.left\"]\nlevel = 0.8\nextra = 0.5\nspeed = 0.6\n",
        places: &[PlaceKind::Effort],
        reads: &[Role::Flow],
        yields_to: &[Role::Head],
        simpler: &["coulomb_friction", "scrub_friction"],
        parameters: &[
            Parameter::new("level", "c", "channel", "friction in motion")
                .within(0.0, f64::INFINITY)
                .or(0.0)
                .scaled(0.3),
            Parameter::new(
                "extra",
                "c_s",
                "channel",
                "what breakaway takes beyond the friction in motion",
            )
            .within(0.0, f64::INFINITY)
            .or(0.0)
            .scaled(0.3),
            Parameter::new(
                "speed",
                "v_s",
                "flow",
                "speed at which the extra friction has fallen to 1/e",
            )
            .above(0.0)
            .or(1.0)
            .nonlinear()
            .starting_at(&[0.4, 1.0, 3.0]),
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

    fn contribution<S: Real>(at: &Reading<'_, S>, _z: &[S; 0], p: &[S; 4]) -> S {
        let [level, extra, speed, width] = *p;
        let flow = at.get(Role::Flow);
        let ratio = flow / speed;
        -(level + extra * (-ratio * ratio).exp()) * (flow / width).tanh()
    }
}

declare_effect!(StribeckFriction, "stribeck_friction");

#[cfg(test)]
mod tests {
    use crate::effects::testing::*;

    use super::*;

    #[test]
    fn falls_from_breakaway_to_the_sliding_level() {
        let w = |flow| {
            StribeckFriction::contribution(
                &reading(&[(Role::Flow, flow)]),
                &[],
                &[0.8, 0.5, 1.0, 1e-3],
            )
        };
        assert!((w(0.01) + 1.3).abs() < 1e-3);
        assert!((w(1.0) + 0.8 + 0.5 * (-1.0f64).exp()).abs() < 1e-12);
        assert!((w(-8.0) - 0.8).abs() < 1e-12);
        assert_eq!(w(0.0), 0.0);
    }
}
