//! Dry friction with a state.

use crate::declare_effect;
use loopsight_core::{Effect, EffectMeta, Parameter, PlaceKind, Reading, Real, Role};

/// How long the bristles take to turn round where the motion is fast, s: what nothing that is sampled shows, and long enough
/// to be followed by steps of [`EffectMeta::max_step_s`].
const QUICKEST: f64 = 1e-3;

/// Friction of bristles that bend before they slide, after Canudas de Wit and others (LuGre): it builds up over a way, is
/// higher at breakaway than in motion, and lags behind the speed.
///
/// ```text
/// w  = -level (z + damping z')
/// z' = (flow - |flow| z/h) / (way + |flow| · 1 ms)        h = 1 + excess · exp(-(flow/speed)²)
/// ```
///
/// | symbol | what | unit |
/// |---|---|---|
/// | `flow` | speed conjugate to the effort at the channel | that of the flow, e.g. rad/s |
/// | `z` | how far the bristles are bent, of how far they bend in slow motion without excess | 1 |
/// | `level` | friction in motion | that of the channel, e.g. V |
/// | `excess` | what breakaway takes beyond it, of it | 1 |
/// | `speed` | Stribeck speed: where the excess has fallen to 1/e | that of the flow |
/// | `way` | way on which the bristles bend: with their first stiffness, the level is reached on it | that of the position |
/// | `damping` | time by which the bristles resist being bent faster | s |
///
/// Olsson and others write `F = σ₀ z + σ₁ z'`, `z' = v - σ₀ |v| z/g(v)`, `g(v) = F_C + (F_S - F_C) exp(-(v/v_S)²)`, with `z` as
/// a way. So
///
/// ```text
/// F_C = level      F_S = (1 + excess) level      v_S = speed      σ₀ = level/way      σ₁ = damping · level/way
/// ```
///
/// and `σ₂` is the plant's own damping or `viscous_friction`. The millisecond in the denominator is no part of their
/// model: it keeps the rate bounded where the motion is so fast that the way is gone through in less.
///
/// Where the way is short for what a log shows, it is `stribeck_friction`; where there is no excess, it is the friction of
/// Dahl (1968), which is `hysteresis` with `back = onward`; with neither it is `coulomb_friction`.
///
/// `excess` and `speed` are its fuller form: without them it has two numbers, as many as a log of a seal or a bearing that
/// slides evenly shows. A fit estimates them where the model file gives them.
///
/// Assumptions: the bristles are not bent at the start of a run. `damping` is not estimated unless the file frees it: it acts
/// in the first milliseconds of a motion.
///
/// References: C. Canudas de Wit, H. Olsson, K. J. Åström, P. Lischinsky (1995), "A new model for control of systems with
/// friction", IEEE Transactions on Automatic Control 40(3), 419–425, equations (3) to (6); H. Olsson et al. (1998), "Friction
/// models and friction compensation", European Journal of Control 4, 176–195, section 3; P. Dahl (1968), "A solid friction
/// model", Aerospace Corporation TOR-0158.
#[derive(Clone, Copy, Debug)]
pub struct LugreFriction;

impl Effect for LugreFriction {
    const META: EffectMeta = EffectMeta {
        id: "lugre_friction",
        summary: "friction of bristles that bend before they slide (LuGre)",
        symptom: "after each turn of the motion the residual follows the way, like a spring's, until it has the size of friction; it is higher where the motion breaks away, and lags behind the speed",
        remedy: "feed the friction forward with the model's state, not with the sign of the speed; approach a position from one side; a stiffer seal or bearing",
        equation: "w = -level (z + damping z'); z' = (flow - |flow| z/h)/(way + |flow| 1 ms), h = 1 + excess exp(-(flow/speed)^2)",
        reference: "Canudas de Wit, Olsson, Åström, Lischinsky (1995), IEEE Transactions on Automatic Control 40(3), 419-425, equations (3) to (6); Olsson et al. (1998), European Journal of Control 4, 176-195, section 3; Dahl (1968), Aerospace Corporation TOR-0158",
        example: "[[effect]]\n[effect.lugre_friction]\nat = [\"shaft\"]\nlevel = 0.8\nexcess = 0.5\nspeed = 1.0\nway = 0.1\n",
        places: &[PlaceKind::Effort],
        reads: &[Role::Flow],
        yields_to: &[Role::Head],
        simpler: &["coulomb_friction", "scrub_friction", "stribeck_friction"],
        parameters: &[
            Parameter::new("level", "c", "channel", "friction in motion")
                .within(0.0, f64::INFINITY)
                .or(0.0)
                .scaled(0.3),
            Parameter::new(
                "excess",
                "e",
                "1",
                "what breakaway takes beyond the friction in motion, as a share of it; a fit needs a first value of it",
            )
            .within(0.0, 20.0)
            .or(0.0)
            .nonlinear()
            .further()
            .starting_at(&[0.5]),
            Parameter::new(
                "speed",
                "v_s",
                "flow",
                "speed at which the excess has fallen to 1/e; a fit needs a first value of it",
            )
            .above(0.0)
            .or(1.0)
            .nonlinear()
            .further()
            .starting_at(&[1.0]),
            Parameter::new("way", "z_0", "position", "way on which the bristles bend")
                .above(0.0)
                .or(0.01)
                .nonlinear()
                .scaled(0.01)
                .vanishing()
                .starting_at(&[0.03]),
            Parameter::new(
                "damping",
                "τ_b",
                "s",
                "time by which the bristles resist being bent faster",
            )
            .within(0.0, f64::INFINITY)
            .or(0.0)
            .nonlinear()
            .scaled(1e-3)
            .known(),
        ],
        states: 1,
        rarity: 2,
        max_step_s: 0.0025,
        ..EffectMeta::PLAIN
    };

    fn contribution<S: Real>(at: &Reading<'_, S>, z: &[S; 1], p: &[S; 5]) -> S {
        let [level, .., damping] = *p;
        let [rate] = Self::state_derivative(at, z, p);
        -level * (z[0] + damping * rate)
    }

    fn state_derivative<S: Real>(at: &Reading<'_, S>, z: &[S; 1], p: &[S; 5]) -> [S; 1] {
        let [_, excess, speed, way, _] = *p;
        let flow = at.get(Role::Flow);
        let ratio = flow / speed;
        let bends_to = S::one() + excess * (-ratio * ratio).exp();
        let size = flow.abs();
        [(flow - size * z[0] / bends_to) / (way + size * S::of(QUICKEST))]
    }
}

declare_effect!(LugreFriction, "lugre_friction");

#[cfg(test)]
mod tests {
    use crate::effects::testing::*;

    use super::*;

    /// `z` after a way at one speed, in small steps.
    fn bent(p: &[f64; 5], from: f64, flow: f64, way: f64) -> f64 {
        const STEPS: usize = 20_000;
        let h = way / flow.abs() / STEPS as f64;
        let rate =
            |z: f64| LugreFriction::state_derivative(&reading(&[(Role::Flow, flow)]), &[z], p)[0];
        (0..STEPS).fold(from, |z, _| z + h * rate(z + 0.5 * h * rate(z)))
    }

    /// In slow motion at one speed `z = s h (1 - e^(-x/(way h)))`, and after a turn back from there.
    #[test]
    fn bends_along_the_way_as_its_equation_says() {
        let p = [0.8, 0.5, 1.0, 0.1, 0.0];
        let flow = 1e-6f64;
        let full = 1.5;
        let up = full * (1.0 - (-0.05 / (0.1 * full)).exp());
        let found = bent(&p, 0.0, flow, 0.05);
        assert!((found - up).abs() < 1e-4, "{found} {up}");
        let back = -full + (up + full) * (-0.03 / (0.1 * full)).exp();
        let found = bent(&p, up, -flow, 0.03);
        assert!((found - back).abs() < 1e-4, "{found} {back}");
    }

    /// Where it slides on, it is stribeck friction: level times `1 + excess e^(-(v/v_s)²)`, against the motion.
    #[test]
    fn slides_at_the_level_of_stribeck_friction() {
        let p = [0.8, 0.5, 1.0, 0.01, 0.0];
        for flow in [-4.0f64, -0.7, 0.2, 9.0] {
            let z = bent(&p, 0.0, flow, 1.0);
            let w: f64 = LugreFriction::contribution(&reading(&[(Role::Flow, flow)]), &[z], &p);
            let level = 0.8 * (1.0 + 0.5 * (-flow * flow).exp());
            assert!((w + flow.signum() * level).abs() < 1e-6, "{flow}: {w}");
        }
    }

    /// Olsson's form, at random states and slow speeds, where the millisecond does not matter.
    #[test]
    fn is_the_model_of_lund_and_grenoble() {
        let (level, excess, speed, way, damping) = (1.2, 0.4, 2e-3f64, 0.05, 0.02);
        let (s0, s1) = (level / way, damping * level / way);
        let p = [level, excess, speed, way, damping];
        for (bend, v) in [(0.01, 1e-3), (0.03, -2e-3), (-0.06, 3e-3), (-0.01, -1e-4)] {
            let g = level + level * excess * (-(v / speed).powi(2)).exp();
            let rate = v - s0 * f64::abs(v) * bend / g;
            let theirs = s0 * bend + s1 * rate;
            let at = reading(&[(Role::Flow, v)]);
            let ours: f64 = -LugreFriction::contribution(&at, &[bend / way], &p);
            assert!((ours - theirs).abs() < 1e-4 * level, "{ours} {theirs}");
        }
    }

    /// A log without motion has no friction, and no number that is none.
    #[test]
    fn at_rest_nothing_changes() {
        let at = reading(&[(Role::Flow, 0.0)]);
        let p = [0.0, 0.0, 1.0, 0.01, 0.0];
        assert_eq!(LugreFriction::state_derivative(&at, &[0.3], &p), [0.0]);
        assert_eq!(LugreFriction::contribution(&at, &[0.0], &p), 0.0);
    }
}
