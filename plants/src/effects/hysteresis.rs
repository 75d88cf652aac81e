//! A spring whose force depends on the way it came.

use crate::declare_effect;
use loopsight_core::{Effect, EffectMeta, Parameter, PlaceKind, Reading, Real, Role};

/// Hysteresis: a spring that gives way one way and pulls back another, so that each turn closes a loop that takes energy.
///
/// ```text
/// w  = -stiffness · z
/// z' = flow (1 - onward |z|)       where the motion goes on, z · flow > 0
/// z' = flow (1 + back |z|)         where it comes back
/// ```
///
/// | symbol | what | unit |
/// |---|---|---|
/// | `flow` | speed at the channel | that of the flow, e.g. m/s |
/// | `z` | way of a spring of this stiffness that would pull as hard | that of the position, e.g. m |
/// | `stiffness` | force per way, where `z` is zero | that of the channel over that of the position |
/// | `onward` | share of the stiffness lost per `z` going on. `1/onward` is the way at which it slides; below zero it stiffens | one over the position, e.g. 1/m |
/// | `back` | share of the stiffness gained per `z` coming back | one over the position |
/// | `exponent` | with another than 1, `\|onward z\|` and `\|back z\|` are taken to this power: how sharply it gives way | 1 |
///
/// This is the model of Bouc and Wen. Noël and Schoukens write a force `z̃ = stiffness z` with
/// `z̃' = α v - β (γ |v| |z̃|^(ν-1) z̃ + δ v |z̃|^ν)`. With `ν = 1`
///
/// ```text
/// stiffness = α        onward = β (γ + δ)        back = β (γ - δ)
/// ```
///
/// so that three numbers are left of their four: `β` and the size of `γ` and `δ` say one thing twice, and no log tells
/// them apart. Theirs are `5·10⁴ N/m`, `-300 1/m` and `1900 1/m`. With another `ν` the powers of `onward` and `back` are
/// `β α^(ν-1) (γ ± δ)`, with their signs.
///
/// What a turn takes is positive while `onward + back` is. With `back = -onward` nothing is lost, and what is left is
/// a spring that hardens or softens. With `back = onward` it is the friction of Dahl (1968), whose level is
/// `stiffness/onward`.
///
/// Assumptions: it does not depend on how fast the way is gone, only on the way; no fatigue. `z` is zero at the start
/// of a run. A vehicle has no such place: what rolls on has nothing to come back to. `exponent` is not estimated unless the
/// file frees it: logs seldom show it. An oscillator's own spring is told from `stiffness` only where the loop is open
/// enough to be seen.
///
/// References: R. Bouc (1967), "Forced vibration of mechanical systems with hysteresis", Proceedings of the Fourth
/// Conference on Nonlinear Oscillation, Prague, 315; Y.-K. Wen (1976), "Method for random vibration of hysteretic
/// systems", Journal of the Engineering Mechanics Division 102(2), 249–263, equation (2); J.-P. Noël, M. Schoukens
/// (2016), "Hysteretic benchmark with a dynamic nonlinearity", Workshop on Nonlinear System Identification Benchmarks,
/// Brussels, section 2; P. Dahl (1968), "A solid friction model", Aerospace Corporation TOR-0158.
#[derive(Clone, Copy, Debug)]
pub struct Hysteresis;

impl Effect for Hysteresis {
    const META: EffectMeta = EffectMeta {
        id: "hysteresis",
        summary: "a spring whose force depends on the way it came (Bouc-Wen)",
        symptom: "the residual over the position is a loop, not a line: at one position it has one value going up and another coming down, however slowly",
        remedy: "reach a position always from the same side; feed the force forward with the model's loop; a sensor behind the joint, or another material for it",
        equation: "w = -stiffness z; z' = flow (1 - onward |z|) where z flow > 0, else flow (1 + back |z|)",
        reference: "Bouc (1967), Fourth Conference on Nonlinear Oscillation, Prague, 315; Wen (1976), J. Engineering Mechanics Division 102(2), 249-263; Noël, Schoukens (2016), Workshop on Nonlinear System Identification Benchmarks, section 2",
        example: "[[effect]]\n[effect.hysteresis]\nat = [\"shaft\"]\nstiffness = 2.0\nonward = 4.0\nback = 1.0\n",
        places: &[PlaceKind::Effort],
        reads: &[Role::Flow, Role::Position],
        // What rolls on its way has nothing to come back to: its friction is dry.
        yields_to: &[Role::Heading],
        // With neither loss nor gain it is one.
        simpler: &["linear_stiffness"],
        parameters: &[
            Parameter::new(
                "stiffness",
                "k_h",
                "channel/position",
                "force per way where the spring is free",
            )
            .within(0.0, f64::INFINITY)
            .or(0.0)
            .scaled(0.05),
            Parameter::new(
                "onward",
                "a",
                "1/position",
                "share of the stiffness lost per way going on; below zero it stiffens",
            )
            .or(1.0)
            .nonlinear()
            .starting_at(&[-0.3, 0.7, 3.0]),
            Parameter::new(
                "back",
                "b",
                "1/position",
                "share of the stiffness gained per way coming back",
            )
            .within(0.0, f64::INFINITY)
            .or(1.0)
            .nonlinear()
            .starting_at(&[0.7, 3.0]),
            Parameter::new("exponent", "ν", "1", "how sharply it gives way")
                .within(0.5, 20.0)
                .or(1.0)
                .nonlinear()
                .known(),
        ],
        states: 1,
        rarity: 2,
        max_step_s: 0.001,
        ..EffectMeta::PLAIN
    };

    fn contribution<S: Real>(_at: &Reading<'_, S>, z: &[S; 1], p: &[S; 4]) -> S {
        -p[0] * z[0]
    }

    fn state_derivative<S: Real>(at: &Reading<'_, S>, z: &[S; 1], p: &[S; 4]) -> [S; 1] {
        let [_, onward, back, exponent] = *p;
        let flow = at.get(Role::Flow);
        let goes_on = z[0] * flow > S::zero();
        let bend = if goes_on { onward } else { -back } * z[0].abs();
        let power = bend.abs().powf(exponent);
        let lost = if bend < S::zero() { -power } else { power };
        [flow * (S::one() - lost)]
    }
}

declare_effect!(Hysteresis, "hysteresis");

#[cfg(test)]
mod tests {
    use crate::effects::testing::*;

    use super::*;

    /// `z` along positions, in small steps of the way.
    fn along(p: &[f64; 4], positions: &[f64]) -> Vec<f64> {
        const STEPS: usize = 20_000;
        let (mut z, mut at) = ([0.0], 0.0);
        positions
            .iter()
            .map(|to| {
                let speed = to - at;
                let h = 1.0 / STEPS as f64;
                for _ in 0..STEPS {
                    let rate = |z: f64| {
                        let now = reading(&[(Role::Flow, speed), (Role::Position, at)]);
                        Hysteresis::state_derivative(&now, &[z], p)[0]
                    };
                    let middle = z[0] + 0.5 * h * rate(z[0]);
                    z[0] += h * rate(middle);
                }
                at = *to;
                z[0]
            })
            .collect()
    }

    /// Going on, `z = (1 - e^(-a x))/a`, which ends at `1/a`; coming back from `z₀`, `z = (z₀ + 1/b) e^(-b x) - 1/b` down
    /// to zero, and on the other side as before.
    #[test]
    fn the_loop_is_that_of_its_equation() {
        let (onward, back) = (2.0f64, 0.5f64);
        let p = [3.0, onward, back, 1.0];
        let found = along(&p, &[0.8, 0.5, 9.0, -9.0]);
        let up = (1.0 - (-onward * 0.8).exp()) / onward;
        assert!((found[0] - up).abs() < 1e-4, "{found:?}");
        // z' = -(1 + b z) per way.
        let down = (up + 1.0 / back) * (-back * 0.3).exp() - 1.0 / back;
        assert!((found[1] - down).abs() < 1e-4, "{found:?}");
        assert!((found[2] - 0.5).abs() < 1e-3 && (found[3] + 0.5).abs() < 1e-3);
        let force = Hysteresis::contribution(&reading(&[]), &[found[0]], &p);
        assert_eq!(force, -3.0 * found[0]);
    }

    /// Noël and Schoukens' form, at random states and speeds.
    #[test]
    fn is_the_model_of_bouc_and_wen() {
        let (alpha, beta) = (5e4, 1e3);
        for (gamma, delta, nu) in [(0.8f64, -1.1f64, 1.0), (0.6, 0.4, 1.0), (0.9, 0.2, 2.0)] {
            let scale = |sum: f64| -> f64 {
                let power = beta * f64::powf(alpha, nu - 1.0) * sum;
                power.signum() * power.abs().powf(1.0 / nu)
            };
            let p = [alpha, scale(gamma + delta), scale(gamma - delta), nu];
            for (z, v) in [(3e-4, 0.1), (3e-4, -0.2), (-5e-4, 0.3), (-1e-4, -0.1)] {
                let force: f64 = alpha * z;
                let theirs = alpha * v
                    - beta
                        * (gamma * f64::abs(v) * force.abs().powf(nu - 1.0) * force
                            + delta * v * force.abs().powf(nu));
                let at = reading(&[(Role::Flow, v)]);
                let ours = alpha * Hysteresis::state_derivative(&at, &[z], &p)[0];
                assert!(
                    (ours - theirs).abs() < 1e-9 * theirs.abs(),
                    "{ours} {theirs}"
                );
            }
        }
    }

    /// With `back = -onward` it is a spring: the way does not matter, and a turn takes nothing.
    #[test]
    fn a_loop_that_is_closed_is_a_spring() {
        let p = [1.0, -0.4, 0.4, 1.0];
        let found = along(&p, &[0.6, 1.2, 0.6, 0.0]);
        assert!(
            (found[0] - found[2]).abs() < 1e-4 && found[3].abs() < 1e-4,
            "{found:?}"
        );
    }
}
