//! A load behind a spring.

use crate::declare_effect;
use loopsight_core::{Effect, EffectMeta, Parameter, PlaceKind, Reading, Real, Role, Shows};

/// Elastic coupling: a part of the inertia turns behind a spring and a damper, as behind a belt, a long shaft, a
/// harmonic drive.
///
/// ```text
/// rate = nominal + ratio q
/// q  = nominal - resonance² δ - 2 damping resonance d       d' = q        δ' = d
/// ```
///
/// | symbol | what | unit |
/// |---|---|---|
/// | `nominal` | rate of the plant, whose inertia is all of it | that of the channel |
/// | `d`, `δ` | how much faster the motor's side is than the load, and how far ahead, both over `1 + J_l/J_m` | that of the flow, and that times s |
/// | `ratio` | where the sensor sits: `J_l/J_m`, the inertia of the load over that of the motor's side, at the motor; -1 at the load | 1 |
/// | `resonance` | angular frequency with which the two swing against each other, `√(k/J_m + k/J_l)` | rad/s |
/// | `damping` | damping ratio of that swing, `c/2 · √((1/J_m + 1/J_l)/k)` | 1 |
///
/// With the twist `Δ` and `J = J_m + J_l` in the plant, `J_m ω_m' = J nominal - k Δ - c Δ'` and `J_l ω_l' = k Δ + c Δ'`. Then
/// `Δ = (1 + J_l/J_m) δ`, and `ω_m' = nominal + J_l/J_m q`, `ω_l' = nominal - q`. So the plant keeps its parameters: driven slowly,
/// both sides move as one. What is between motor and load sees a ratio in between: with 0, at the node of the swing, nothing
/// changes. In the terms of `flexible_joint`, `J_l/J_m` is `motor_stiffness/load_stiffness`, and `resonance` the root of their
/// sum. With the motor held the load swings with the antiresonance, `resonance/√(1 + J_l/J_m)`.
///
/// Assumptions: the plant's speed is that of the side that is measured, and all other forces of the plant (back-emf, friction,
/// gravity) follow it and act on the motor's side; a load with friction of its own shifts the ratio, not the resonance. At the
/// start of a run the load moves along, and the spring is relaxed. A spring that hardens is beyond it. A vehicle rolls: its body
/// is no load behind a spring. A diagnosis tries it at plants with one mass.
///
/// Reference: M. W. Spong (1987), "Modeling and Control of Elastic Joint Robots", Journal of Dynamic Systems,
/// Measurement, and Control 109(4), 310–319: its model for one joint, with damping, as in `flexible_joint`.
#[derive(Clone, Copy, Debug)]
pub struct ElasticCoupling;

impl Effect for ElasticCoupling {
    const META: EffectMeta = EffectMeta {
        id: "elastic_coupling",
        summary: "a part of the inertia behind a spring and a damper; the sensor sees the motor's side, or the load",
        symptom: "after each change of the drive the residual rings at one frequency and dies away, whatever the speed; slow motion shows nothing",
        remedy: "a stiffer or shorter belt, shaft or coupling; smooth the commands, or filter them at the resonance; a controller slower than that",
        equation: "rate = nominal + ratio q; q = nominal - resonance^2 δ - 2 damping resonance d; d' = q; δ' = d",
        reference: "Spong (1987), ASME J. Dynamic Systems, Measurement, and Control 109(4), 310-319 (motor, spring, load)",
        example: "[[effect]]\n[effect.elastic_coupling]\nat = [\"inertia\"]\nratio = 0.5\nresonance = 50.0\ndamping = 0.05\n",
        places: &[PlaceKind::Body],
        reads: &[Role::Flow],
        // A vehicle rolls: its body is no load behind a spring.
        yields_to: &[Role::Heading],
        parameters: &[
            Parameter::new(
                "ratio",
                "ρ",
                "1",
                "inertia of the load over that of the motor's side; -1 where the load is measured",
            )
            // Beyond the load nothing can be measured, but an estimate of -1 errs to both sides.
            .within(-2.0, 100.0)
            .or(0.0)
            .nonlinear()
            .scaled(0.2),
            Parameter::new(
                "resonance",
                "ω_r",
                "rad/s",
                "angular frequency with which the two sides swing against each other",
            )
            .within(0.1, 500.0)
            .or(30.0)
            .nonlinear()
            .starting_at(&[10.0, 30.0, 90.0, 270.0]),
            Parameter::new("damping", "ζ", "1", "damping ratio of that swing")
                // A swing that is damped more has no resonance: it is a lag.
                .within(0.0, core::f64::consts::FRAC_1_SQRT_2)
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
        p[0] * swing(at, z, p)
    }

    fn state_derivative<S: Real>(at: &Reading<'_, S>, z: &[S; 2], p: &[S; 3]) -> [S; 2] {
        [z[1], swing(at, z, p)]
    }

    fn initial_state<S: Real>(_at: &Reading<'_, S>, _p: &[S; 3]) -> [S; 2] {
        [S::zero(), S::zero()]
    }
}

declare_effect!(ElasticCoupling, "elastic_coupling");

/// How the swing, whose states are its twist and its speed, is accelerated.
fn swing<S: Real>(at: &Reading<'_, S>, z: &[S; 2], p: &[S; 3]) -> S {
    let [_, resonance, damping] = *p;
    at.nominal - resonance * (resonance * z[0] + damping.times(S::of(2.0)) * z[1])
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
    /// `flexible_joint`; with a ratio of -1 and no friction they are its load.
    #[test]
    fn one_mass_with_it_is_two_masses() {
        let [motor, of_load, stiffness, damper, friction, _] = PARTS;
        let stiff = stiffness * (1.0 / motor + 1.0 / of_load);
        let resonance = f64::sqrt(stiff);
        let damping = 0.5 * damper * (1.0 / motor + 1.0 / of_load) / resonance;
        for (ratio, friction, seen) in [(of_load / motor, friction, 0), (-1.0, 0.0, 2)] {
            let p = [ratio, resonance, damping];
            let parts = [motor, of_load, stiffness, damper, friction, 0.0];
            let joint: [f64; 6] = FlexibleJoint::lower(0, &parts).unwrap();
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
                    let [twist, ahead] = ElasticCoupling::state_derivative(&at, z, &p);
                    [rate, twist, ahead]
                });
                let [speed, twist, ahead] = one;
                let both = 1.0 + of_load / motor;
                assert!((speed - two[seen]).abs() < 1e-9, "{k}");
                assert!((both * twist - (two[1] - two[3])).abs() < 1e-9, "{k}");
                assert!((both * ahead - (two[0] - two[2])).abs() < 1e-9, "{k}");
            }
            assert!(two[0].abs() > 1.0);
        }
    }

    #[test]
    fn a_load_that_moves_along_changes_nothing_but_at_the_start() {
        let at = Reading {
            nominal: 3.0,
            ..reading(&[(Role::Flow, 2.0)])
        };
        let z = ElasticCoupling::initial_state(&at, &[0.5, 40.0, 0.1]);
        assert_eq!(z, [0.0, 0.0]);
        // At first the motor's side alone is accelerated: with a ratio of 0.5 two thirds of the inertia, and the load not at all.
        for (ratio, more) in [(0.5, 1.5), (-1.0, -3.0), (0.0, 0.0)] {
            assert_eq!(
                ElasticCoupling::contribution(&at, &z, &[ratio, 40.0, 0.1]),
                more
            );
        }
    }
}
