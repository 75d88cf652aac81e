//! A supply that is not stiff.

use crate::declare_effect;
use loopsight_core::{Effect, EffectMeta, Parameter, PlaceKind, Reading, Real, Role};

/// Battery sag: the supply falls with the current that all motors take, and every command with it.
///
/// ```text
/// u_effective = u s          s = 1 - resistance · max(0, Σ u (s u - e))
///                              = 1 - resistance · max(0, load)/(1 + resistance · stall)
/// ```
///
/// | symbol | what | unit |
/// |---|---|---|
/// | `u` | the command: a share of the supply, written as the voltage it would be nominally | that of the channel |
/// | `e` | back-emf | V |
/// | `load` | `Σ u (u - e)`: what the commands would draw from a stiff supply, times winding resistance | V² |
/// | `stall` | `Σ u²`: the same with the motors at rest | V² |
/// | `resistance` | share of the supply lost per V² of load: internal resistance of the battery over that of a winding and the square of the nominal supply | 1/V² |
///
/// A winding draws `(s u - e)/R` while its switch is closed, `u` over the supply of the time; the
/// lower supply lowers the current, which is the denominator.
///
/// Assumptions: equal windings; load at the nominal commands, before other effects on them; nothing
/// is fed back (the supply only falls); the battery has no memory (no diffusion, no state of
/// charge).
///
/// Reference: G. L. Plett (2015), "Battery Management Systems, Volume 1: Battery Modeling", Artech
/// House, chapter 2, equivalent series resistance; N. Mohan, T. M. Undeland, W. P. Robbins (2003),
/// "Power Electronics", 3rd edition, Wiley, section 7-7, mean input current of a full bridge.
#[derive(Clone, Copy, Debug)]
pub struct BatterySag;

impl Effect for BatterySag {
    const META: EffectMeta = EffectMeta {
        id: "battery_sag",
        summary: "the supply falls with the total current, and every command with it",
        symptom: "one motor alone is right, both together are short; the shortfall is worst when accelerating or reversing and vanishes at speed",
        remedy: "measure the supply and divide the command by it; a stronger or warmer battery, thicker cables",
        equation: "u_effective = u (1 - resistance max(0, load)/(1 + resistance stall)), load = sum of u (u - e), stall = sum of u^2",
        reference: "Plett (2015), Battery Management Systems, Volume 1, chapter 2 (equivalent series resistance); Mohan, Undeland, Robbins (2003), Power Electronics, 3rd ed., section 7-7",
        example: "[[effect]]\n[effect.battery_sag]\nat = [\"input.right\", \"input.left\"]\nresistance = 0.001\n",
        places: &[PlaceKind::Input],
        reads: &[Role::Load, Role::Stall],
        shared_only: true,
        parameters: &[Parameter::new(
            "resistance",
            "κ",
            "1/V^2",
            "share of the supply lost per square volt of load",
        )
        .within(0.0, 1.0)
        .or(0.0)
        .nonlinear()
        .scaled(0.001)],
        before_input: true,
        ..EffectMeta::PLAIN
    };

    fn contribution<S: Real>(at: &Reading<'_, S>, _z: &[S; 0], p: &[S; 1]) -> S {
        let load = at.get(Role::Load);
        if load > S::zero() {
            -at.nominal * p[0] * load / (S::one() + p[0] * at.get(Role::Stall))
        } else {
            S::zero()
        }
    }
}

declare_effect!(BatterySag, "battery_sag");

#[cfg(test)]
mod tests {
    use crate::effects::testing::*;

    use super::*;

    /// Two motors at 8 V with 3 V and -2 V of back-emf: what is left solves the circuit.
    #[test]
    fn all_commands_fall_with_the_load() {
        let (u, e, k) = (8.0, [3.0, -2.0], 0.002);
        let load: f64 = e.iter().map(|e| u * (u - e)).sum();
        let at = Reading {
            nominal: u,
            ..reading(&[(Role::Load, load), (Role::Stall, 2.0 * u * u)])
        };
        let w: f64 = BatterySag::contribution(&at, &[], &[k]);
        let s = (u + w) / u;
        let drawn: f64 = e.iter().map(|e| u * (s * u - e)).sum();
        assert!((s - (1.0 - k * drawn)).abs() < 1e-12);
    }

    #[test]
    fn braking_motors_do_not_lift_it() {
        let at = Reading {
            nominal: 2.0,
            ..reading(&[(Role::Load, -10.0), (Role::Stall, 4.0)])
        };
        assert_eq!(BatterySag::contribution(&at, &[], &[0.025]), 0.0);
    }
}
