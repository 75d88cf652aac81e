//! A motor driver that lets go in the pauses of its pulses.

use crate::declare_effect;
use loopsight_core::{Effect, EffectMeta, Parameter, PlaceKind, Reading, Real, Role, Shows};

/// Coasting in the pauses: the driver switches the motor on for a share of the time and disconnects it for the rest, so
/// that its back-emf brakes in the pulses only.
///
/// ```text
/// u_effective = u + share (1 - |u|/r) e
/// ```
///
/// | symbol | what | unit |
/// |---|---|---|
/// | `u` | the command, as the mean of the pulses | that of the channel |
/// | `e` | voltage that all the damping of the plant at this speed is worth, `e = -K_A ω/K_C` of a `dc_axis` | that of the channel |
/// | `share` | what of that damping is electrical at the command `r`, hardly more than 1; 0: the driver brakes in the pauses | 1 |
/// | `r` | the command at which the plant's damping is what the model says without the effect | that of the channel |
///
/// With the supply `U` the pulses last the share `|u|/U` of the time. In them the winding has `±U - e`, in the pauses
/// no current flows, so the torque goes with `u - e |u|/U` instead of `u - e`. The plant's damping and `r` say one thing
/// twice, so `r` is not estimated. A diagnosis takes about the root mean square of the recording: what the model says
/// of small and large commands is right on average then. `r = U` makes it the damping of a motor that is always on.
///
/// Without friction any command above zero reaches the speed of the supply in the end, only more slowly. With dry
/// friction the steady speed is `(U - f U/|u|)/K`: steep at small commands, flat at large ones. A model that holds speed
/// and command in proportion takes this for little friction and a saturation.
///
/// Assumptions: the current ends soon after each pulse, as it does where a period of the pulses is long beside the time
/// constant `L/R` of the winding (an enable pin with pulses of 500 Hz, a single transistor with a diode). Where it runs on
/// for a while against the supply, most of it at low speed, that costs voltage as dry friction does, and less of it the
/// faster the motor turns: a `share` above 1.
///
/// A log whose commands all have one size does not show it.
///
/// Reference: N. Mohan, T. M. Undeland, W. P. Robbins (2003), "Power Electronics", 3rd edition, Wiley, chapters 7 and
/// 13 (discontinuous conduction, DC motor drives); R. Krishnan (2001), "Electric Motor Drives", Prentice Hall, chapter 4.
#[derive(Clone, Copy, Debug)]
pub struct PulseCoast;

impl Effect for PulseCoast {
    const META: EffectMeta = EffectMeta {
        id: "pulse_coast",
        summary: "in the pauses of its pulses the motor driver disconnects the motor, whose back-emf then brakes in the pulses only",
        symptom: "small commands give more speed than the model for what large ones give, and the machine answers more slowly to small ones",
        remedy: "let the driver brake in the pauses (slow decay, both low-side switches closed; pulses on the direction pins, not on the enable pin); or raise the frequency of the pulses until the current flows all the time; or close a speed loop with a gain that falls with the command",
        equation: "u_effective = u + share (1 - |u|/r) e",
        reference: "Mohan, Undeland, Robbins (2003), Power Electronics, 3rd ed., chapters 7 and 13; Krishnan (2001), Electric Motor Drives, chapter 4",
        example: "[[effect]]\n[effect.pulse_coast]\nat = [\"input.right\", \"input.left\"]\nshare = 0.9\nreference = 6.0\n",
        places: &[PlaceKind::Input],
        reads: &[Role::Drive, Role::Armature],
        parameters: &[
            Parameter::new(
                "share",
                "σ",
                "1",
                "what of the plant's damping is electrical at the reference; 0: the driver brakes in the pauses",
            )
            .within(0.0, 2.0)
            .or(0.0)
            .scaled(0.3)
            .starting_at(&[0.3, 0.9]),
            Parameter::new(
                "reference",
                "r",
                "channel",
                "the command at which the plant's damping is what it is without the effect",
            )
            .above(0.0)
            .or(1.0)
            .nonlinear()
            .known(),
        ],
        before_input: true,
        shows: Shows::InputSizes,
        rarity: 1,
        ..EffectMeta::PLAIN
    };

    fn contribution<S: Real>(at: &Reading<'_, S>, _z: &[S; 0], p: &[S; 2]) -> S {
        let [share, reference] = *p;
        let back_emf = at.get(Role::Drive) - at.get(Role::Armature);
        share * (S::one() - at.nominal.abs() / reference) * back_emf
    }
}

declare_effect!(PulseCoast, "pulse_coast");

#[cfg(test)]
mod tests {
    use crate::effects::testing::*;

    use super::*;

    fn effective(u: f64, emf: f64, share: f64) -> f64 {
        let at = Reading {
            nominal: u,
            ..reading(&[(Role::Drive, u), (Role::Armature, u - emf)])
        };
        u + PulseCoast::contribution(&at, &[], &[share, 6.0])
    }

    #[test]
    fn the_back_emf_brakes_in_the_pulses_only() {
        for emf in [-2.0, 3.0] {
            assert_eq!(effective(6.0, emf, 1.0), 6.0, "as in the model");
            assert_eq!(effective(0.0, emf, 1.0), emf, "no voltage over the winding");
            assert_eq!(effective(-3.0, emf, 1.0), -3.0 + 0.5 * emf);
            assert_eq!(effective(12.0, emf, 0.5), 12.0 - 0.5 * emf);
            assert_eq!(effective(-3.0, emf, 0.0), -3.0, "the driver brakes");
        }
    }

    /// At the speed where `u - friction` balances the pulses' share of the back-emf nothing is left to accelerate.
    #[test]
    fn with_friction_the_steady_speed_falls_short_of_proportion() {
        let (supply, friction) = (6.0, 1.5);
        for u in [2.0, 3.0, 6.0] {
            let emf = supply - friction * supply / u;
            let left = effective(u, emf, 1.0) - emf - friction;
            assert!(left.abs() < 1e-12, "{u} V: {left}");
        }
    }
}
