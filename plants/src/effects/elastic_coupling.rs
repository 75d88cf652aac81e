//! A load behind a spring.

use crate::declare_effect;
use loopsight_core::{Effect, EffectMeta, Parameter, PlaceKind, Reading, Real, Role, Shows};

/// Elastic coupling: a part of the inertia turns behind a spring and a damper, as behind a belt, a long shaft, a
/// harmonic drive.
///
/// ```text
/// rate = nominal + ratio (nominal - a)
/// a  = antiresonance² δ + 2 damping antiresonance (flow - z)        acceleration of the load
/// z' = a        δ' = flow - z
/// ```
///
/// | symbol | what | unit |
/// |---|---|---|
/// | `nominal` | rate of the plant, whose inertia is all of it | that of the channel |
/// | `flow` | speed of the motor's side: the one that the plant has and its sensor sees | that of the flow |
/// | `z`, `δ` | speed of the load, and how far the motor's side is ahead of it | that of the flow, and that times s |
/// | `ratio` | inertia of the load over that of the motor's side, `J_l/J_m` | 1 |
/// | `antiresonance` | angular frequency of the load with the motor held, `√(k/J_l)` | rad/s |
/// | `damping` | damping ratio of the load with the motor held, `c/(2 √(k J_l))` | 1 |
///
/// With `J = J_m + J_l` in the plant, `J_m ω' = J nominal - k δ - c δ'` and `J_l z' = k δ + c δ'`, which is what stands
/// above. So the plant keeps its parameters: driven slowly, both sides move as one. The two swing
/// against each other with `antiresonance · √(1 + ratio)`, the resonance. With `ratio = 0` nothing changes. In the
/// terms of `flexible_joint`, `ratio` is `motor_stiffness/load_stiffness`, and `antiresonance` the root of
/// `load_stiffness`.
///
/// Assumptions: what is measured is the motor's side; a sensor at the load sees `z`, and the plant `flexible_joint` says
/// so. All other forces of the plant (back-emf, friction, gravity) act on the motor's side; a load with
/// friction of its own shifts the ratio, not the resonance. At the start of a
/// run the load moves along, and the spring is relaxed. A spring that hardens is beyond it. A vehicle rolls: its body is
/// no load behind a spring. A diagnosis tries it at plants with one mass.
///
/// Reference: M. W. Spong (1987), "Modeling and Control of Elastic Joint Robots", Journal of Dynamic Systems,
/// Measurement, and Control 109(4), 310–319: its model for one joint, with damping, as in `flexible_joint`.
#[derive(Clone, Copy, Debug)]
pub struct ElasticCoupling;

impl Effect for ElasticCoupling {
    const META: EffectMeta = EffectMeta {
        id: "elastic_coupling",
        summary: "a part of the inertia behind a spring and a damper; the sensor sees the motor's side",
        symptom: "after each change of the drive the residual rings at one frequency and dies away, whatever the speed; slow motion shows nothing",
        remedy: "a stiffer or shorter belt, shaft or coupling; smooth the commands, or filter them at the resonance; a controller slower than the antiresonance",
        equation: "rate = nominal + ratio (nominal - a); a = antiresonance^2 δ + 2 damping antiresonance (flow - z); z' = a; δ' = flow - z",
        reference: "Spong (1987), ASME J. Dynamic Systems, Measurement, and Control 109(4), 310-319 (motor, spring, load)",
        example: "[[effect]]\n[effect.elastic_coupling]\nat = [\"inertia\"]\nratio = 0.5\nantiresonance = 40.0\ndamping = 0.05\n",
        places: &[PlaceKind::Body],
        reads: &[Role::Flow],
        // A vehicle rolls: its body is no load behind a spring.
        yields_to: &[Role::Heading],
        parameters: &[
            Parameter::new(
                "ratio",
                "ρ",
                "1",
                "inertia of the load over that of the motor's side",
            )
            .within(0.0, 100.0)
            .or(0.0)
            .nonlinear()
            .scaled(0.2),
            Parameter::new(
                "antiresonance",
                "ω_a",
                "rad/s",
                "angular frequency of the load with the motor held",
            )
            .within(0.1, 500.0)
            .or(30.0)
            .nonlinear()
            .starting_at(&[10.0, 30.0, 90.0, 270.0]),
            Parameter::new(
                "damping",
                "ζ",
                "1",
                "damping ratio of the load with the motor held",
            )
            .within(0.0, 2.0)
            .or(0.1)
            .nonlinear()
            .scaled(0.1)
            .starting_at(&[0.3]),
        ],
        states: 2,
        shows: Shows::OneMass,
        rarity: 2,
        // Classical Runge and Kutta's method turns a swing by (ωh)⁵/120 too little in a step: at 160 rad/s by 2·10⁻⁴ of it.
        max_step_s: 0.0025,
        ..EffectMeta::PLAIN
    };

    fn contribution<S: Real>(at: &Reading<'_, S>, z: &[S; 2], p: &[S; 3]) -> S {
        p[0] * (at.nominal - load(at, z, p))
    }

    fn state_derivative<S: Real>(at: &Reading<'_, S>, z: &[S; 2], p: &[S; 3]) -> [S; 2] {
        [at.get(Role::Flow) - z[1], load(at, z, p)]
    }

    fn initial_state<S: Real>(at: &Reading<'_, S>, _p: &[S; 3]) -> [S; 2] {
        [S::zero(), at.get(Role::Flow)]
    }
}

declare_effect!(ElasticCoupling, "elastic_coupling");

/// Acceleration of the load, whose states are the twist and its own speed.
fn load<S: Real>(at: &Reading<'_, S>, z: &[S; 2], p: &[S; 3]) -> S {
    let [_, antiresonance, damping] = *p;
    let twisting = at.get(Role::Flow) - z[1];
    antiresonance * (antiresonance * z[0] + damping.times(S::of(2.0)) * twisting)
}

#[cfg(test)]
mod tests {
    use loopsight_core::{Plant, rk4_step};

    use crate::FlexibleJoint;
    use crate::effects::testing::*;

    use super::*;

    /// J_m, J_l, k, c, f_m, f_l
    const PARTS: [f64; 6] = [0.01, 0.02, 8.0, 0.02, 0.02, 0.0];

    /// One mass with the inertia of both and the friction of the motor, and the effect, are the two masses of
    /// `flexible_joint`.
    #[test]
    fn one_mass_with_it_is_two_masses() {
        let [motor, of_load, stiffness, damper, friction, _] = PARTS;
        let antiresonance = f64::sqrt(stiffness / of_load);
        let damping = damper / (2.0 * f64::sqrt(stiffness * of_load));
        let p = [of_load / motor, antiresonance, damping];
        let joint: [f64; 6] = FlexibleJoint::lower(0, &PARTS).unwrap();
        let (mut two, mut one) = ([0.0; 4], [0.0; 3]);
        for k in 0..4000 {
            let torque = if k % 900 < 500 { 0.6 } else { -0.4 };
            rk4_step(&mut two, 1e-3, |x| {
                FlexibleJoint::derivative(x, &[torque], &[0.0; 3], &joint)
            });
            rk4_step(&mut one, 1e-3, |[speed, z @ ..]: &[f64; 3]| {
                let nominal = (torque - friction * speed) / (motor + of_load);
                let at = Reading {
                    nominal,
                    ..reading(&[(Role::Flow, *speed)])
                };
                let rate = nominal + ElasticCoupling::contribution(&at, z, &p);
                let [twist, load] = ElasticCoupling::state_derivative(&at, z, &p);
                [rate, twist, load]
            });
            let [speed, twist, load] = one;
            assert!((speed - two[0]).abs() < 1e-9, "{k}");
            assert!((load - two[2]).abs() < 1e-9, "{k}");
            assert!((twist - (two[1] - two[3])).abs() < 1e-9, "{k}");
        }
        assert!(two[0].abs() > 1.0);
    }

    #[test]
    fn a_load_that_moves_along_changes_nothing_but_at_the_start() {
        let at = Reading {
            nominal: 3.0,
            ..reading(&[(Role::Flow, 2.0)])
        };
        let p = [0.5, 40.0, 0.1];
        let z = ElasticCoupling::initial_state(&at, &p);
        assert_eq!(z, [0.0, 2.0]);
        // At first the motor's side alone is accelerated: `J_m` is two thirds of `J`.
        assert_eq!(ElasticCoupling::contribution(&at, &z, &p), 1.5);
        assert_eq!(ElasticCoupling::state_derivative(&at, &z, &p), [0.0, 0.0]);
        assert_eq!(
            ElasticCoupling::contribution(&at, &z, &[0.0, 40.0, 0.1]),
            0.0
        );
    }
}
