//! Play in a gear.

use loopsight_core::{
    Effect, EffectMeta, Parameter, PlaceKind, Reading, Real, Role, declare_effect,
};

/// Backlash: play between motor and load, in which the motor drives nothing.
///
/// ```text
/// z'  = U - k D(z)          D(z) = z beyond ±play/2, 0 within
/// z₀' = U - k z₀
/// w   = k D(z) - k z₀
/// ```
///
/// | symbol | what | unit |
/// |---|---|---|
/// | `U` | voltage over the winding: what the motor drives with | V |
/// | `z` | way of the motor ahead of the load, in units of the way it runs per second and volt | V s |
/// | `play` | the play in that unit: crossing it takes `play/\|U\|` | V s |
/// | `k` | `stiffness`: rate at which an engaged gear takes the effort over | 1/s |
///
/// The effort that reaches the load is `k D(z)`: nothing while the gap is crossed, all of `U`
/// after it. `z₀` is the same gear without play; taking the difference leaves out the compliance
/// of the gear, so that nothing changes where there is no play. As an angle of the shaft the play
/// is `play/K` with the back-emf constant `K` at the shaft, V s/rad: `K = -K_A r/(2 K_C)` for a
/// `ddmr`, `-K_A/K_C` for a `dc_axis`.
///
/// Simplified, and honest about it: the rotor has no inertia of its own (its speed follows the
/// voltage at once, and it engages without an impact), and all the damping of the plant acts on
/// the motor's side, so that within the gap the load coasts but for the other effects. Position is
/// that of the load.
///
/// Reference: M. Nordin, P.-O. Gutman (2002), "Controlling mechanical systems with backlash — a
/// survey", Automatica 38(10), 1633–1649, section 2, dead-zone model.
#[derive(Clone, Copy, Debug)]
pub struct Backlash;

impl Effect<2, 2> for Backlash {
    const META: EffectMeta = EffectMeta {
        id: "backlash",
        summary: "play between motor and load: after a reversal the motor drives nothing for a while",
        symptom: "the residual is a pulse after each reversal of the drive, longer at low voltages than at high ones; constant drive shows nothing",
        remedy: "preload the gear; exchange worn gears or couplings; cross the gap with a short kick before driving",
        equation: "z' = U - k D(z); z0' = U - k z0; w = k D(z) - k z0; D(z) = z beyond ±play/2, else 0",
        reference: "Nordin, Gutman (2002), Automatica 38(10), 1633-1649, section 2 (dead-zone model)",
        example: "[[effect]]\n[effect.backlash]\nat = [\"wheel.right\", \"wheel.left\"]\nplay = 0.1\n",
        places: &[PlaceKind::Effort],
        reads: &[Role::Armature],
        parameters: &[
            Parameter::new(
                "play",
                "α",
                "channel s",
                "voltage times the time that crossing the gap takes",
            )
            .within(0.0, f64::INFINITY)
            .or(0.0)
            .nonlinear()
            .scaled(0.05),
            Parameter::new(
                "stiffness",
                "k",
                "1/s",
                "rate at which an engaged gear takes the effort over",
            )
            .within(10.0, 250.0)
            .or(200.0)
            .known()
            .nonlinear()
            .scaled(50.0),
        ],
        states: 2,
        rarity: 2,
        ..EffectMeta::PLAIN
    };

    fn contribution<S: Real>(_at: &Reading<'_, S>, z: &[S; 2], p: &[S; 2]) -> S {
        let [play, stiffness] = *p;
        stiffness * (engaged(z[0], play) - z[1])
    }

    fn state_derivative<S: Real>(at: &Reading<'_, S>, z: &[S; 2], p: &[S; 2]) -> [S; 2] {
        let [play, stiffness] = *p;
        let drive = at.get(Role::Armature);
        [
            drive - stiffness * engaged(z[0], play),
            drive - stiffness * z[1],
        ]
    }

    fn initial_state<S: Real>(at: &Reading<'_, S>, p: &[S; 2]) -> [S; 2] {
        let [play, stiffness] = *p;
        let wound = at.get(Role::Armature) / stiffness;
        let half = play * S::of(0.5);
        let beyond = if wound > S::zero() {
            wound + half
        } else if wound < S::zero() {
            wound - half
        } else {
            wound
        };
        [beyond, wound]
    }
}

declare_effect!(Backlash, "backlash", <2, 2>);

/// `z` beyond the gap, zero within; by the play it has its derivative at zero too.
fn engaged<S: Real>(z: S, play: S) -> S {
    let half = play * S::of(0.5);
    z - z.held(-half, half)
}

#[cfg(test)]
mod tests {
    use crate::effects::testing::*;

    use super::*;

    /// Drives with +U, then with -U; returns the efforts that reach the load, every 0.1 ms.
    fn reversal(play: f64, drive: f64) -> Vec<f64> {
        let p = [play, 200.0];
        let at = |u| reading(&[(Role::Armature, u)]);
        let mut z = Backlash::initial_state(&at(drive), &p);
        let h = 1e-4;
        (0..2000)
            .map(|i| {
                let u = if i < 100 { drive } else { -drive };
                let effort = u + Backlash::contribution(&at(u), &z, &p);
                let rate = Backlash::state_derivative(&at(u), &z, &p);
                z = [z[0] + h * rate[0], z[1] + h * rate[1]];
                effort
            })
            .collect()
    }

    #[test]
    fn a_reversal_loses_the_play() {
        for (play, drive) in [(0.1, 4.0), (0.2, 9.0)] {
            let effort = reversal(play, drive);
            assert!((effort[50] - drive).abs() < 1e-9);
            assert!((effort[1999] + drive).abs() < 1e-3);
            let with: f64 = effort.iter().sum::<f64>() * 1e-4;
            let without: f64 = reversal(0.0, drive).iter().sum::<f64>() * 1e-4;
            assert!((with - without - play).abs() < 2e-3, "{with} {without}");
            // In the middle of the gap nothing is driven but for what the gear's compliance left.
            let middle = 100 + (0.6 * play / drive / 1e-4) as usize;
            assert!(effort[middle].abs() < 0.15 * drive, "{}", effort[middle]);
        }
    }

    #[test]
    fn without_play_nothing_changes() {
        for (i, effort) in reversal(0.0, 5.0).iter().enumerate() {
            assert_eq!(*effort, if i < 100 { 5.0 } else { -5.0 });
        }
    }
}
