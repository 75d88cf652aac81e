//! A motor driver that lets go at command zero.

use crate::declare_effect;
use loopsight_core::{Effect, EffectMeta, Parameter, PlaceKind, Reading, Real, Role, Shows};

/// Coasting bridge: at command zero the motor is disconnected, so its back-emf drives no current and brakes nothing.
///
/// ```text
/// u_effective = u + share (e - u)        |u| <= zero
/// u_effective = u                        otherwise
/// ```
///
/// | symbol | what | unit |
/// |---|---|---|
/// | `u` | the command | that of the channel |
/// | `e` | voltage that all the damping of the plant at this speed is worth, `e = -K_A ω/K_C` of a `dc_axis` | that of the channel |
/// | `share` | what of that damping is electrical, so that it is gone without current: `K_T K_a/R_a` over `K_T K_a/R_a + f` | 1 |
/// | `zero` | command up to which the bridge is off | that of the channel |
///
/// A voltage of the size of the back-emf drives no current through the winding, as the open bridge does. What
/// remains of the damping is the friction of the bearings: `share` is 1 where there is none.
///
/// Assumptions: the current through the diodes ends at once; the back-emf stays below the supply, so that they do
/// not conduct again. A bridge that also coasts in the pauses of its pulses does not hold a speed in proportion to
/// its command: that is `pulse_coast`.
///
/// A log that is never at zero while the motor turns does not show it.
///
/// Reference: N. Mohan, T. M. Undeland, W. P. Robbins (2003), "Power Electronics", 3rd edition, Wiley, chapter 13
/// (DC motor drives, discontinuous current); R. Krishnan (2001), "Electric Motor Drives", Prentice Hall, chapter 4.
#[derive(Clone, Copy, Debug)]
pub struct BridgeCoast;

impl Effect for BridgeCoast {
    const META: EffectMeta = EffectMeta {
        id: "bridge_coast",
        summary: "at command zero the motor driver disconnects the motor, which coasts instead of braking",
        symptom: "with the command at zero the machine runs on much longer than the model, which is right while it is driven",
        remedy: "set the driver to brake at zero (both low-side switches closed); or command a voltage that is never quite zero; or let the controller brake with a command of the other sign",
        equation: "u_effective = u + share (e - u) where |u| <= zero, else u",
        reference: "Mohan, Undeland, Robbins (2003), Power Electronics, 3rd ed., chapter 13; Krishnan (2001), Electric Motor Drives, chapter 4",
        example: "[[effect]]\n[effect.bridge_coast]\nat = [\"input.right\", \"input.left\"]\nshare = 0.95\n",
        places: &[PlaceKind::Input],
        reads: &[Role::Drive, Role::Armature],
        parameters: &[
            Parameter::new(
                "share",
                "σ",
                "1",
                "what of the plant's damping is electrical; 0: the bridge brakes",
            )
            .within(0.0, 1.0)
            .or(0.0)
            .nonlinear()
            .scaled(0.3)
            .starting_at(&[0.9, 0.4]),
            Parameter::new(
                "zero",
                "u_0",
                "channel",
                "command up to which the bridge is off",
            )
            .within(0.0, f64::INFINITY)
            .or(1e-3)
            .nonlinear()
            .known(),
        ],
        before_input: true,
        shows: Shows::InputAtZero,
        ..EffectMeta::PLAIN
    };

    fn contribution<S: Real>(at: &Reading<'_, S>, _z: &[S; 0], p: &[S; 2]) -> S {
        if at.nominal.abs() > p[1] {
            return S::zero();
        }
        let back_emf = at.get(Role::Drive) - at.get(Role::Armature);
        p[0] * (back_emf - at.nominal)
    }
}

declare_effect!(BridgeCoast, "bridge_coast");

#[cfg(test)]
mod tests {
    use crate::effects::testing::*;

    use super::*;

    #[test]
    fn off_it_leaves_the_back_emf_and_driven_nothing() {
        let effective = |u: f64, share: f64| {
            let emf = 4.0;
            let at = Reading {
                nominal: u,
                ..reading(&[(Role::Drive, u), (Role::Armature, u - emf)])
            };
            u + BridgeCoast::contribution(&at, &[], &[share, 1e-3])
        };
        assert_eq!(effective(0.0, 1.0), 4.0, "no voltage over the winding");
        assert_eq!(effective(0.0, 0.75), 3.0);
        assert_eq!(effective(0.0, 0.0), 0.0, "it brakes");
        for u in [-3.0, 0.01, 6.0] {
            assert_eq!(effective(u, 1.0), u);
        }
    }
}
