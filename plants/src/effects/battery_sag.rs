//! A supply that is not stiff.

use loopsight_core::{
    Effect, EffectMeta, Parameter, PlaceKind, Reading, Real, Role, declare_effect,
};

/// Battery sag: the supply falls with the current that all motors take, and every command with it.
///
/// ```text
/// u_effective = u / (1 + resistance · load)
/// ```
///
/// | symbol | what | unit |
/// |---|---|---|
/// | `u` | the command: a fraction of the supply, written as the voltage it would be nominally | that of the channel |
/// | `load` | sum of the magnitudes of the voltages over all windings, proportional to the currents | V |
/// | `resistance` | share of the supply lost per volt of load: internal resistance of the battery over that of a winding, over the nominal supply | 1/V |
///
/// Assumptions: the load is taken at the nominal commands, and the division stands for the
/// feedback that a lower supply lowers the currents (to first order it is `u - resistance · load ·
/// u`); the supply feels the motor currents themselves, not their duty cycle; the battery has no
/// memory (no diffusion, no state of charge).
///
/// Reference: G. L. Plett (2015), "Battery Management Systems, Volume 1: Battery Modeling", Artech
/// House, chapter 2, equivalent series resistance.
#[derive(Clone, Copy, Debug)]
pub struct BatterySag;

impl Effect<1, 0> for BatterySag {
    const META: EffectMeta = EffectMeta {
        id: "battery_sag",
        summary: "the supply falls with the total current, and every command with it",
        symptom: "one motor alone is right, both together are short; the shortfall is worst when accelerating or reversing and vanishes at speed",
        remedy: "measure the supply and divide the command by it; a stronger or warmer battery, thicker cables",
        equation: "u_effective = u / (1 + resistance load)",
        reference: "Plett (2015), Battery Management Systems, Volume 1, chapter 2 (equivalent series resistance)",
        example: "[[effect]]\n[effect.battery_sag]\nat = [\"input.right\", \"input.left\"]\nresistance = 0.01\n",
        places: &[PlaceKind::Input],
        reads: &[Role::Load],
        shared_only: true,
        parameters: &[Parameter::new(
            "resistance",
            "κ",
            "1/V",
            "share of the supply lost per volt of load",
        )
        .within(0.0, 1.0)
        .or(0.0)
        .scaled(0.01)],
        ..EffectMeta::PLAIN
    };

    fn contribution<S: Real>(at: &Reading<'_, S>, _z: &[S; 0], p: &[S; 1]) -> S {
        let loss = p[0] * at.get(Role::Load);
        -at.nominal * loss / (S::one() + loss)
    }
}

declare_effect!(BatterySag, "battery_sag", <1, 0>);

#[cfg(test)]
mod tests {
    use crate::effects::testing::*;

    use super::*;

    #[test]
    fn all_commands_fall_with_the_load() {
        let at = Reading {
            nominal: 8.0,
            ..reading(&[(Role::Load, 10.0)])
        };
        let w: f64 = BatterySag::contribution(&at, &[], &[0.025]);
        assert!((8.0 + w - 8.0 / 1.25).abs() < 1e-12);
        let at = Reading {
            nominal: 8.0,
            ..reading(&[])
        };
        assert_eq!(BatterySag::contribution(&at, &[], &[0.025]), 0.0);
    }
}
