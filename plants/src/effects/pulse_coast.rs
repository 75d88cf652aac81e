//! A motor driver that lets go in the pauses of its pulses.

use crate::declare_effect;
use loopsight_core::{Effect, EffectMeta, Parameter, PlaceKind, Reading, Real, Role, Shows};

/// Coasting in the pauses: the driver switches the motor on for a share of the time and disconnects it for the rest, so
/// that its back-emf brakes in the pulses only.
///
/// ```text
/// u_effective = u + e (1 - D) - run_on (r + e) ln(1 + (r - e)/(r + e) (1 - exp(-D/run_on)))
/// e = share · (voltage that the damping is worth)      D = u/r      (u > 0; mirrored for u < 0)
/// ```
///
/// | symbol | what | unit |
/// |---|---|---|
/// | `u` | the command, as the mean of the pulses | that of the channel |
/// | `e` | the back-emf: what is electrical of the voltage that all the damping of the plant at this speed is worth, which is `-K_A ω/K_C` of a `dc_axis` | that of the channel |
/// | `share` | what of that damping is electrical at the command `r`, hardly more than 1; 0: the driver brakes in the pauses | 1 |
/// | `run_on` | time constant of the winding over the period of the pulses, `L/(R T)` where `r` is the supply; 0: the current ends with the pulse | 1 |
/// | `r` | the command at which the plant's damping is what the model says without the effect | that of the channel |
///
/// With the supply `U` the pulses last the share `D = |u|/U` of the time. In them the winding has `±U - e`. In the pauses
/// the current runs on through the diodes against `U + e` until it ends, and nothing flows after that. A current that
/// began with `(U - e)(1 - exp(-D T R/L))/R` lasts `L/R ln(1 + (U - e)/(U + e) (1 - exp(-D T R/L)))`; the mean voltage over
/// the winding's resistance follows from `L di/dt = V - e - R i` over a whole period. It costs voltage as dry friction
/// does, `L/(R T) U ln 2` at standstill, and less the faster the motor turns.
///
/// The plant's damping, `run_on` and `r` say two things in three numbers, so `r` is not estimated. A diagnosis takes
/// about the root mean square of the recording: what the model says of small and large commands is right on average then.
/// `r = U` makes it the damping of a motor that is always on; with another `r` the damping is `r/U` of that, and `run_on` is
/// `U/r` of `L/(R T)`.
///
/// Without friction any command above zero reaches the speed of the supply in the end, only more slowly. With dry
/// friction `f` and a current that ends at once the steady speed is `(U - f U/|u|)/K`: steep at small commands, flat at
/// large ones. A model that holds speed and command in proportion takes this for little friction and a saturation.
///
/// Assumptions: the current ends in each pause, `|u|/U` below about `1 - L/(R T)`, as it does where a period of the pulses
/// is long beside the time constant `L/R` of the winding (an enable pin with pulses of 500 Hz, a single transistor with a
/// diode; `run_on` is at most 0.5); the speed hardly changes within a period. A back-emf above the supply brakes through
/// the diodes as if the bridge were on.
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
        equation: "u_effective = u + e (1 - D) - run_on (r + e) ln(1 + (r - e)/(r + e) (1 - exp(-D/run_on))), D = |u|/r, e = share · voltage of the damping, mirrored for u < 0",
        reference: "Mohan, Undeland, Robbins (2003), Power Electronics, 3rd ed., chapters 7 and 13; Krishnan (2001), Electric Motor Drives, chapter 4",
        example: "[[effect]]\n[effect.pulse_coast]\nat = [\"input.right\", \"input.left\"]\nshare = 0.9\nrun_on = 0.05\nreference = 6.0\n",
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
            .nonlinear()
            .scaled(0.3)
            .starting_at(&[0.3, 0.9]),
            Parameter::new(
                "run_on",
                "κ",
                "1",
                "how long the current runs on after a pulse: time constant of the winding over the period of the pulses",
            )
            .within(0.0, 0.5)
            .or(0.0)
            .nonlinear()
            .scaled(0.05)
            .starting_at(&[0.05]),
            Parameter::new(
                "reference",
                "r",
                "channel",
                "the command at which the plant's damping is what it is without the effect",
            )
            .above(0.0)
            .or(1.0)
            .nonlinear()
            .known()
            .bounding_channel(),
        ],
        before_input: true,
        shows: Shows::InputSizes,
        rarity: 1,
        ..EffectMeta::PLAIN
    };

    fn contribution<S: Real>(at: &Reading<'_, S>, _z: &[S; 0], p: &[S; 3]) -> S {
        let [share, run_on, reference] = *p;
        let back_emf = share * (at.get(Role::Drive) - at.get(Role::Armature));
        let on = at.nominal.abs() / reference;
        let carried = back_emf.clamp(-reference, reference) * (S::one() - on);
        let backward = at.nominal < S::zero();
        let along = if backward { -back_emf } else { back_emf };
        let runs_on = run_on * lasts(reference - along, reference + along, on, run_on);
        if backward {
            carried + runs_on
        } else {
            carried - runs_on
        }
    }
}

/// Voltage `against` the current that runs on after a pulse in which `with` drove it, times how long it lasts in time
/// constants of the winding.
fn lasts<S: Real>(with: S, against: S, on: S, run_on: S) -> S {
    // Else the diodes conduct all the time, or the current never flew with the pulse.
    if !(with > S::zero() && against > S::zero() && on > S::zero()) {
        return S::zero();
    }
    let reached = if run_on > S::zero() {
        S::one() - (-on / run_on).exp()
    } else {
        S::one()
    };
    against * ((against + with * reached).ln() - against.ln())
}

declare_effect!(PulseCoast, "pulse_coast");

#[cfg(test)]
mod tests {
    use crate::effects::testing::*;

    use super::*;

    fn effective(u: f64, emf: f64, share: f64) -> f64 {
        running_on(u, emf, [share, 0.0, 6.0])
    }

    fn running_on(u: f64, emf: f64, p: [f64; 3]) -> f64 {
        let at = Reading {
            nominal: u,
            ..reading(&[(Role::Drive, u), (Role::Armature, u - emf)])
        };
        u + PulseCoast::contribution(&at, &[], &p)
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

    /// The winding's equation, stepped finely through pulse and pause.
    #[test]
    fn the_current_that_runs_on_costs_what_the_winding_says() {
        let (supply, run_on) = (12.0, 0.05);
        let steps = 200_000;
        let h = 1.0 / f64::from(steps);
        for (u, emf) in [
            (3.0, 0.0),
            (3.0, 6.0),
            (-6.0, 4.0),
            (-6.0, -4.0),
            (0.3, 1.0),
        ] {
            let (mut current, mut mean) = (0.0f64, 0.0);
            for k in 0..steps {
                let on = f64::from(k) * h < f64::abs(u) / supply;
                let voltage = supply.copysign(u) * if on { 1.0 } else { -1.0 };
                let next = current + h / run_on * (voltage - emf - current);
                current = if on || next * current > 0.0 {
                    next
                } else {
                    0.0
                };
                mean += h * current;
            }
            let found = running_on(u, emf, [1.0, run_on, supply]) - emf;
            assert!(
                (found - mean).abs() < 2e-3,
                "{u} V, {emf} V: {found} {mean}"
            );
        }
    }

    /// The plant's damping, the reference and `run_on` say two things in three numbers.
    #[test]
    fn another_reference_is_another_damping() {
        for (u, emf) in [(3.0, 2.0), (-6.0, 4.0), (0.2, 1.0)] {
            let of_supply = running_on(u, emf, [1.0, 0.05, 12.0]) - emf;
            let of_half = running_on(u, 0.5 * emf, [1.0, 0.1, 6.0]) - 0.5 * emf;
            assert!((of_supply - of_half).abs() < 1e-12, "{of_supply} {of_half}");
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
