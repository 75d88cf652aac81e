//! The limit of traction.

use crate::declare_effect;
use loopsight_core::{Effect, EffectMeta, Parameter, PlaceKind, Reading, Real, Role};

/// Wheel slip: the ground takes no more than the traction limit; what exceeds it spins the wheel up.
///
/// ```text
/// F₀ = U + other efforts - T_w E'             E = V - U
/// F  = clamp(F₀ + (g T_w - 1) s, -L(s), L(s))       w = F - F₀
/// T_w s' = F₀ - F - s                         L(s) = limit (sliding + (1 - sliding)/(1 + |s|/fall))
/// ```
///
/// | symbol | what | unit |
/// |---|---|---|
/// | `V`, `U` | voltage of the motor, and over its winding while the wheel rolls | V |
/// | `E` | back-emf at the speed over ground | V |
/// | `F₀`, `F` | force that a wheel that rolls would need, and the one that the ground takes | V |
/// | `s` | slip: the wheel's speed ahead of the ground, as its back-emf | V |
/// | `limit` | the largest force | that of the channel, V |
/// | `sliding` | force of fast sliding over the largest | 1 |
/// | `fall` | slip at which half of that is lost | V |
/// | `wheel` | `T_w`, mechanical time constant of a wheel with its rotor in the air, `J R/(K_T K)` | s |
///
/// Forces are in volts: `μ N r` in newton metres times winding resistance over torque constant and
/// gear, the inertia of wheel and rotor not counted. A wheel that rolls pushes with `F₀`: of the
/// drive, what does not accelerate wheel and rotor themselves. Beyond the limit it spins up by itself; the ground takes
/// the limit, less the faster it slips, and goes on taking it until the wheel is back at the speed
/// of the ground: what it took up in speed it gives back. It grips again with the rate `g` = 200/s. The
/// acceleration `E'` is that of a filter of 1.25 ms, `y' = (E - y)/1.25 ms = E'`.
///
/// A tyre's force rises within a slip far below what is seen here, has its peak, and falls: past the
/// peak of the Magic Formula the force comes near to that of sliding with the inverse of the slip, and
/// so does `L`. A log without hard reversals does not show the fall: `sliding` is frozen at 0.87, the
/// middle of what Wong's table of road adhesion has from ice (0.70) to earth roads (0.96), and
/// `fall` at 1 V, unless a file frees them.
///
/// Assumptions: the same forwards and backwards, no lateral force, constant load on the wheel. The
/// model knows one speed per wheel, that over ground; an encoder on a wheel that spins shows more.
///
/// References: J. Y. Wong (2008), "Theory of Ground Vehicles", 4th edition, Wiley, sections 1.3
/// (force over slip, peak and sliding) and 3.1 (maximum tractive effort); H. B. Pacejka (2012), "Tire and Vehicle
/// Dynamics", 3rd edition, section 4.3 (Magic Formula); U. Kiencke, L. Nielsen (2005), "Automotive Control
/// Systems", 2nd edition, chapter 8 (torque balance of a wheel that slips).
#[derive(Clone, Copy, Debug)]
pub struct WheelSlip;

/// Rate at which a wheel that does not exceed the limit any more grips, 1/s.
const GRIP: f64 = 200.0;
/// Rate of the filter that has the acceleration, 1/s.
const FILTER: f64 = 800.0;

impl Effect for WheelSlip {
    const META: EffectMeta = EffectMeta {
        id: "wheel_slip",
        summary: "the ground takes no more than the traction limit; what exceeds it spins the wheel",
        symptom: "gentle starts are right, hard ones and reversals are too slow in the robot; the residual appears only where the acceleration is high",
        remedy: "limit the acceleration that is asked for; more weight on the driven wheels, softer tyres, a cleaner floor",
        equation: "F0 = U + efforts - T E'; F = clamp(F0 + (g T - 1) s, -L(s), L(s)); T s' = F0 - F - s; w = F - F0; L = limit (sliding + (1 - sliding)/(1 + |s|/fall))",
        reference: "Wong (2008), Theory of Ground Vehicles, 4th ed., sections 1.3, 3.1; Pacejka (2012), Tire and Vehicle Dynamics, 3rd ed., section 4.3",
        example: "[[effect]]\n[effect.wheel_slip]\nat = [\"wheel.right\", \"wheel.left\"]\nlimit = 5.0\n",
        places: &[PlaceKind::Effort],
        reads: &[Role::Drive, Role::Armature],
        parameters: &[
            Parameter::new(
                "limit",
                "F_max",
                "channel",
                "traction limit, as the voltage of that torque at the wheel",
            )
            .above(0.0)
            .or(1000.0)
            .nonlinear()
            .starting_at(&[1.5, 3.0, 5.0, 8.0, 12.0, 20.0]),
            Parameter::new(
                "wheel",
                "T_w",
                "s",
                "mechanical time constant of a wheel with its rotor, off the ground",
            )
            .within(0.002, 0.2)
            .or(0.01)
            .nonlinear()
            .scaled(0.005)
            .starting_at(&[0.01]),
            Parameter::new(
                "sliding",
                "λ",
                "1",
                "force of fast sliding over the largest force",
            )
            .within(0.0, 1.0)
            .or(0.87)
            .known()
            .nonlinear()
            .scaled(0.05),
            Parameter::new(
                "fall",
                "s_f",
                "channel",
                "slip at which half of the fall from the largest force to sliding is done",
            )
            .above(0.0)
            .or(1.0)
            .known()
            .nonlinear(),
        ],
        states: 2,
        rarity: 2,
        max_step_s: 0.0025,
        ..EffectMeta::PLAIN
    };

    fn contribution<S: Real>(at: &Reading<'_, S>, z: &[S; 2], p: &[S; 4]) -> S {
        let needed = needed(at, z, p);
        taken(needed, z[0], p) - needed
    }

    fn state_derivative<S: Real>(at: &Reading<'_, S>, z: &[S; 2], p: &[S; 4]) -> [S; 2] {
        let needed = needed(at, z, p);
        let spun_up = (needed - taken(needed, z[0], p) - z[0]) / p[1];
        [spun_up, acceleration(at, z)]
    }

    fn initial_state<S: Real>(at: &Reading<'_, S>, _p: &[S; 4]) -> [S; 2] {
        [S::zero(), over_ground(at)]
    }
}

declare_effect!(WheelSlip, "wheel_slip");

/// Back-emf at the speed over ground.
fn over_ground<S: Real>(at: &Reading<'_, S>) -> S {
    at.get(Role::Drive) - at.get(Role::Armature)
}

/// The rate of that.
fn acceleration<S: Real>(at: &Reading<'_, S>, z: &[S; 2]) -> S {
    (over_ground(at) - z[1]).times(S::of(FILTER))
}

/// The force that a wheel that rolls would need.
fn needed<S: Real>(at: &Reading<'_, S>, z: &[S; 2], p: &[S; 4]) -> S {
    at.get(Role::Armature) + at.nominal - p[1] * acceleration(at, z)
}

/// The force that the ground takes at the slip `s`.
fn taken<S: Real>(needed: S, s: S, p: &[S; 4]) -> S {
    let [limit, wheel, sliding, fall] = *p;
    let most = limit * (sliding + (S::one() - sliding) / (S::one() + s.abs() / fall));
    (needed + (wheel.times(S::of(GRIP)) - S::one()) * s).clamp(-most, most)
}

#[cfg(test)]
mod tests {
    use crate::effects::testing::*;

    use super::*;

    const P: [f64; 4] = [5.0, 0.012, 0.8, 1.0];
    const H: f64 = 1e-4;

    /// A wheel whose robot stands, driven with these volts, one every 0.1 ms; what the ground takes, and
    /// the slip.
    fn driven(p: &[f64; 4], volts: impl Iterator<Item = f64>, friction: f64) -> Vec<[f64; 2]> {
        let mut z = [0.0; 2];
        volts
            .map(|u| {
                let at = Reading {
                    nominal: friction,
                    ..reading(&[(Role::Drive, u), (Role::Armature, u)])
                };
                let taken = u + friction + WheelSlip::contribution(&at, &z, p);
                let rate = WheelSlip::state_derivative(&at, &z, p);
                z = [z[0] + H * rate[0], z[1] + H * rate[1]];
                [taken, z[0]]
            })
            .collect()
    }

    #[test]
    fn what_exceeds_the_limit_spins_the_wheel() {
        let constant = |volts: f64| std::iter::repeat_n(volts, 2000);
        assert!(
            driven(&P, constant(5.5), -1.0)
                .iter()
                .all(|x| *x == [4.5, 0.0])
        );
        for sign in [1.0, -1.0] {
            let found = driven(&P, constant(sign * 10.0), -sign);
            assert_eq!(found[0][0], sign * 5.0);
            // It comes to the slip at which drive, back-emf of the slip and force balance.
            let [force, slip] = found[1999].map(|x| sign * x);
            assert!((9.0 - slip - force).abs() < 1e-6, "{slip} {force}");
            let level = 5.0 * (0.8 + 0.2 / (1.0 + slip));
            assert!((force - level).abs() < 1e-6 && force < 4.3, "{force}");
        }
    }

    /// What the wheel took up in speed it gives back before it rolls: over all the ground gets what was driven less what
    /// the back-emf of the slip took.
    #[test]
    fn a_wheel_that_grips_again_gives_back_what_it_took_up() {
        let volts = (0..3000).map(|i| if i < 1000 { 12.0 } else { 1.0 });
        let found = driven(&P, volts.clone(), 0.0);
        let after = found.iter().skip(1001).take(20);
        assert!(
            after
                .clone()
                .all(|[force, slip]| *force > 4.0 && *slip > 1.0)
        );
        let [force, slip] = found[2999];
        assert!(
            (force - 1.0).abs() < 1e-6 && slip.abs() < 1e-6,
            "{force} {slip}"
        );
        let balance: f64 = volts.zip(&found).map(|(u, [f, s])| H * (u - f - s)).sum();
        assert!(balance.abs() < 2e-3, "{balance}");
    }

    /// While the robot gains speed, wheel and rotor keep their share of the drive.
    #[test]
    fn the_share_of_wheel_and_rotor_does_not_load_the_ground() {
        let gain = 20.0;
        let force = |volts: f64| {
            let mut z = [0.0; 2];
            let mut last = 0.0;
            for i in 0..3000 {
                let emf = gain * f64::from(i) * H;
                let at = reading(&[(Role::Drive, volts + emf), (Role::Armature, volts)]);
                last = WheelSlip::contribution(&at, &z, &P);
                let rate = WheelSlip::state_derivative(&at, &z, &P);
                z = [z[0] + H * rate[0], z[1] + H * rate[1]];
            }
            last
        };
        let share = P[1] * gain;
        assert!(force(P[0] + 0.9 * share).abs() < 1e-9);
        assert!(force(P[0] + 1.5 * share) < 0.0);
    }
}
