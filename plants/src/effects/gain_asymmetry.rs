//! Motors that are not equal.

use crate::declare_effect;
use loopsight_core::{Effect, EffectMeta, Parameter, PlaceKind, Reading, Real};

/// Gain asymmetry: one motor is stronger than the other.
///
/// ```text
/// u_effective = u · (1 + side · difference)        side = +1 right, -1 left
/// ```
///
/// | symbol | what | unit |
/// |---|---|---|
/// | `u` | the command | that of the channel |
/// | `difference` | half the relative difference of the gains, right above left | 1 |
///
/// Assumptions: the mean gain is the plant's; only the drive differs, not the back-emf.
///
/// If only the speeds of the wheels are logged it cannot be told from wheels of different size.
///
/// Reference: T. G. Alves, W. F. Lages, R. V. B. Henriques (2018), IFAC PapersOnLine 51-15,
/// 437–442: what the assumption of equal motors in (11)–(16) leaves out.
#[derive(Clone, Copy, Debug)]
pub struct GainAsymmetry;

impl Effect for GainAsymmetry {
    const META: EffectMeta = EffectMeta {
        id: "gain_asymmetry",
        summary: "one motor is stronger than the other",
        symptom: "with equal voltages the robot veers to one side, forwards and backwards the more the faster; the residual of the yaw rate goes with the sum of the voltages",
        remedy: "scale the commands of the two sides apart; exchange the weaker motor or its brushes",
        equation: "u_effective = u (1 + side difference)",
        reference: "Alves, Lages, Henriques (2018), IFAC PapersOnLine 51-15, 437-442: beyond the equal motors of (11)-(16)",
        example: "[[effect]]\n[effect.gain_asymmetry]\nat = [\"input.right\", \"input.left\"]\ndifference = 0.03\n",
        places: &[PlaceKind::Input],
        sided: true,
        shared_only: true,
        parameters: &[Parameter::new(
            "difference",
            "δ",
            "1",
            "half the relative difference of the gains, right above left",
        )
        .within(-1.0, 1.0)
        .or(0.0)
        .scaled(0.02)],
        is_static: true,
        ..EffectMeta::PLAIN
    };

    fn contribution<S: Real>(at: &Reading<'_, S>, _z: &[S; 0], p: &[S; 1]) -> S {
        at.side * p[0] * at.nominal
    }
}

declare_effect!(GainAsymmetry, "gain_asymmetry");

#[cfg(test)]
mod tests {
    use crate::effects::testing::*;

    use super::*;

    #[test]
    fn what_one_side_gains_the_other_loses() {
        for (side, expected) in [(1.0, 0.3), (-1.0, -0.3)] {
            let at = Reading {
                nominal: 10.0,
                side,
                ..reading(&[])
            };
            let w: f64 = GainAsymmetry::contribution(&at, &[], &[0.03]);
            assert!((w - expected).abs() < 1e-15);
        }
    }
}
