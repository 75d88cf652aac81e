//! Play in a gear.

use crate::declare_effect;
use loopsight_core::{Effect, EffectMeta, Parameter, PlaceKind, Reading, Real, Role};

use super::first_order;

/// Backlash: play between motor and load. The rotor crosses it alone, and strikes at its end.
///
/// ```text
/// rotor e' = V - k D(z) - e     z'  = e - E          D(z) = z beyond ±play/2, 0 within
/// rotor e₀' = V - k z₀ - e₀     z₀' = e₀ - E         E = V - U
/// w = k D(z) - k z₀
/// ```
///
/// | symbol | what | unit |
/// |---|---|---|
/// | `V`, `U` | voltage of the motor, and over its winding while the gear is engaged | V |
/// | `E`, `e` | back-emf at the load's speed and at the rotor's | V |
/// | `z` | angle of the rotor ahead of the load, times the back-emf constant | V s |
/// | `play` | the play in that unit | V s |
/// | `rotor` | mechanical time constant of the rotor alone, `J R/(K_T K)` | s |
/// | `k` | `stiffness` of the engaged gear, as voltage per V s | 1/s |
///
/// The effort that reaches the load is `k D(z)`: nothing while the gap is crossed. There the rotor
/// runs up with its own time constant, and what it took up in speed it gives to the load when it
/// strikes. `z₀` is the same gear without play: `k z₀` is the drive less what accelerates the rotor with
/// the load. Taking the difference leaves out the compliance of the gear, so that nothing changes where there
/// is no play, and the inertia of the plant may well contain the rotor's, as a fit finds it.
/// As an angle of the shaft the play is `play/K` with the back-emf constant `K` at the shaft, V s/rad:
/// `K = -K_A r/(2 K_C)` for a `ddmr`, `-K_A/K_C` for a `dc_axis`. Of the shaft's whole inertia the rotor
/// is the share `-K_A·rotor`.
///
/// Of a very short lag of the rotor only a share is used (as in `actuator_lag`); `rotor = 0` is a rotor
/// without inertia. Simplified: all the damping of the plant acts on the motor's side, so that
/// within the gap the load coasts but for the other effects; real teeth are stiffer than `k`, by
/// default 800/s, so that a stroke lasts some ms. Position is that of the load.
///
/// Reference: M. Nordin, P.-O. Gutman (2002), "Controlling mechanical systems with backlash — a
/// survey", Automatica 38(10), 1633–1649, section 2: two inertias and a shaft with the dead-zone
/// model, here without inner damping.
#[derive(Clone, Copy, Debug)]
pub struct Backlash;

impl Effect for Backlash {
    const META: EffectMeta = EffectMeta {
        id: "backlash",
        summary: "play between motor and load: after a reversal the motor drives nothing for a while, then strikes",
        symptom: "the residual is a pulse after each reversal of the drive, longer at low voltages than at high ones; constant drive shows nothing",
        remedy: "preload the gear; exchange worn gears or couplings; cross the gap with a short kick before driving",
        equation: "rotor e' = V - k D(z) - e; z' = e - E; z0, e0 alike with D(z0) = z0; w = k D(z) - k z0; D(z) = z beyond ±play/2, else 0",
        reference: "Nordin, Gutman (2002), Automatica 38(10), 1633-1649, section 2 (two inertias, dead-zone model)",
        example: "[[effect]]\n[effect.backlash]\nat = [\"wheel.right\", \"wheel.left\"]\nplay = 0.1\nrotor = 0.01\n",
        places: &[PlaceKind::Effort],
        reads: &[Role::Drive, Role::Armature],
        parameters: &[
            Parameter::new(
                "play",
                "α",
                "channel s",
                "angle of the play times the back-emf constant at the shaft",
            )
            .within(0.0, f64::INFINITY)
            .or(0.0)
            .nonlinear()
            .scaled(0.05)
            .starting_at(&[0.05, 0.2, 0.8]),
            Parameter::new(
                "rotor",
                "T_r",
                "s",
                "mechanical time constant of the rotor alone",
            )
            .within(0.0, 0.2)
            .or(0.0)
            .nonlinear()
            .scaled(0.005)
            .starting_at(&[0.006]),
            Parameter::new(
                "stiffness",
                "k",
                "1/s",
                "stiffness of the engaged gear, as voltage per unit of play",
            )
            .within(10.0, 1000.0)
            .or(800.0)
            .known()
            .nonlinear()
            .scaled(50.0),
        ],
        states: 4,
        rarity: 2,
        max_step_s: 0.0025,
        ..EffectMeta::PLAIN
    };

    fn contribution<S: Real>(_at: &Reading<'_, S>, z: &[S; 4], p: &[S; 3]) -> S {
        let [play, _, stiffness] = *p;
        stiffness * (engaged(z[0], play) - z[2])
    }

    fn state_derivative<S: Real>(at: &Reading<'_, S>, z: &[S; 4], p: &[S; 3]) -> [S; 4] {
        let [play, rotor, stiffness] = *p;
        let [ahead, emf, ahead_without, emf_without] = *z;
        let drive = at.get(Role::Drive);
        let of_load = drive - at.get(Role::Armature);
        let gear = |wound: S, emf: S| {
            let left = drive - stiffness * wound;
            let speed = left + first_order::contribution(at, left, emf, rotor);
            [speed - of_load, first_order::rate(at, left, emf, rotor)]
        };
        let [a, b] = gear(engaged(ahead, play), emf);
        let [c, d] = gear(ahead_without, emf_without);
        [a, b, c, d]
    }

    fn initial_state<S: Real>(at: &Reading<'_, S>, p: &[S; 3]) -> [S; 4] {
        let [play, _, stiffness] = *p;
        let armature = at.get(Role::Armature);
        let emf = at.get(Role::Drive) - armature;
        let wound = armature / stiffness;
        let half = play.times(S::of(0.5));
        let beyond = if wound > S::zero() {
            wound + half
        } else if wound < S::zero() {
            wound - half
        } else {
            wound
        };
        [beyond, emf, wound, emf]
    }
}

declare_effect!(Backlash, "backlash");

/// `z` beyond the gap, zero within; by the play it has its derivative at zero too.
fn engaged<S: Real>(z: S, play: S) -> S {
    let half = play.times(S::of(0.5));
    z - z.clamp(-half, half)
}

#[cfg(test)]
mod tests {
    use crate::effects::testing::*;

    use super::*;

    /// A load that is locked: drives with +`volts`, then from 10 ms on with -`volts`; returns what the
    /// teeth push with, and the effort that the effect adds, every 0.1 ms.
    fn reversal(play: f64, rotor: f64, volts: f64) -> Vec<[f64; 2]> {
        let p = [play, rotor, 800.0];
        let at = |u| reading(&[(Role::Drive, u), (Role::Armature, u)]);
        let mut z = Backlash::initial_state(&at(volts), &p);
        let h = 1e-4;
        (0..4000)
            .map(|i| {
                let u = if i < 100 { volts } else { -volts };
                let added = Backlash::contribution(&at(u), &z, &p);
                let pushed = p[2] * engaged(z[0], play);
                // The midpoint rule: teeth and rotor swing.
                let half = Backlash::state_derivative(&at(u), &z, &p);
                let middle = std::array::from_fn(|k| z[k] + 0.5 * h * half[k]);
                let rate = Backlash::state_derivative(&at(u), &middle, &p);
                for (z, rate) in z.iter_mut().zip(rate) {
                    *z += h * rate;
                }
                [pushed, added]
            })
            .collect()
    }

    /// What the rotor turns through the gap its back-emf takes from the drive: the load loses the
    /// play, whatever the rotor's inertia.
    #[test]
    fn a_reversal_loses_the_play() {
        for (play, rotor, volts) in [(0.1, 0.0, 4.0), (0.2, 0.0, 9.0), (0.2, 0.01, 9.0)] {
            let efforts = reversal(play, rotor, volts);
            assert!((efforts[50][0] - volts).abs() < 1e-9 && efforts[50][1].abs() < 1e-9);
            let [pushed, added] = efforts[3999];
            assert!((pushed + volts).abs() < 1e-3 && added.abs() < 1e-3);
            let lost: f64 = efforts.iter().map(|[_, added]| added * 1e-4).sum();
            assert!((lost - play).abs() < 1e-4, "{lost}");
        }
    }

    /// A rotor with inertia takes longer to cross, and strikes harder than the drive alone pushes.
    #[test]
    fn a_rotor_with_inertia_is_late_and_strikes() {
        let (play, volts) = (0.2, 9.0);
        let crossing = |rotor: f64| {
            let pushed: Vec<f64> = reversal(play, rotor, volts).iter().map(|e| e[0]).collect();
            let parted = pushed.iter().position(|t| *t == 0.0).unwrap();
            let free = pushed[parted..].iter().position(|t| *t != 0.0).unwrap();
            let hardest = pushed.iter().fold(0.0f64, |m, t| m.min(*t));
            (1e-4 * free as f64, hardest)
        };
        let (light, soft) = crossing(0.0);
        assert!((light - play / volts).abs() < 3e-4, "{light}");
        assert!(soft > -1.001 * volts, "{soft}");
        // From rest it would take as long as U (t - T (1 - exp(-t/T))) = play.
        let rotor = 0.01;
        let way = |t: f64| volts * (t + rotor * (-t / rotor).exp_m1());
        let (heavy, hard) = crossing(rotor);
        assert!(way(heavy) < play && heavy > light + 0.002, "{heavy}");
        assert!(hard < -1.5 * volts, "{hard}");
    }

    #[test]
    fn without_play_nothing_changes() {
        for rotor in [0.0, 0.002, 0.02] {
            for [_, added] in reversal(0.0, rotor, 5.0) {
                assert_eq!(added, 0.0);
            }
        }
    }
}
