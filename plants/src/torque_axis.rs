//! A joint driven by a torque.

use crate::declare_plant;
use crate::places::{at, sized};
use loopsight_core::{
    Channel, ControlAffine, Derived, Parameter, Parameterization, Place, Plant, PlantMeta, Reads,
    Real, Role, Signal,
};

/// A joint or shaft that a torque drives: a motor whose current is controlled, a direct drive, a
/// reaction wheel.
///
/// ```text
/// ω' = b (u + w) - d ω        φ' = ω
/// ```
///
/// | symbol | what | unit |
/// |---|---|---|
/// | `ω`, `φ` | speed and angle of the joint | rad/s, rad |
/// | `u` | torque | N m |
/// | `w` | effort at the joint, a torque | N m |
/// | `b` | acceleration per torque | rad/s²/(N m) |
/// | `d` | viscous friction over inertia | 1/s |
///
/// From the inertia `J` and the viscous friction `f` of all that turns, `b = 1/J` and `d = f/J`: both
/// are determined by torque and speed.
///
/// Where the log has the motor's current, the torque is `K_T i`, and behind a gear that turns `N` times
/// slower `N K_T i`; the log says so by a transducer of its own:
///
/// ```toml
/// [log.inputs.torque]
/// column = "current_A"
/// scale = 0.05
/// scale_unit = "N m/A"
/// ```
///
/// With a `K_T` that is only guessed `b K_T` is right, and the inertia off by the same factor.
///
/// Unlike `dc_axis` there is no voltage, hence no back-emf: what brakes is friction alone.
///
/// Assumptions: one rigid inertia, no gravity (`gravity_pendulum`), a current loop faster than what is
/// looked at (`actuator_lag`, `input_delay`). Dry friction and cogging are effects at the joint.
///
/// Reference: B. Armstrong-Hélouvry, P. Dupont, C. Canudas de Wit (1994), "A survey of models, analysis tools
/// and compensation methods for the control of machines with friction", Automatica 30(7), 1083–1138: a
/// mass under a force and viscous friction.
#[derive(Clone, Copy, Debug)]
pub struct TorqueAxis;

const LUMPED: [Parameter; 2] = [
    Parameter::new(
        "drive",
        "b",
        "rad/s^2/(N m)",
        "acceleration per torque, one over the inertia",
    )
    .nonzero(),
    Parameter::new("damping", "d", "1/s", "viscous friction over inertia")
        .within(0.0, f64::INFINITY),
];

const PHYSICAL: [Parameter; 2] = [
    Parameter::new(
        "inertia",
        "J",
        "kg m^2",
        "moment of inertia of all that turns",
    )
    .above(0.0)
    .nonlinear()
    .scaled(0.01),
    Parameter::new(
        "viscous_friction",
        "f",
        "N m s/rad",
        "viscous friction of all that turns",
    )
    .within(0.0, f64::INFINITY)
    .or(0.0)
    .nonlinear()
    .scaled(0.01),
];

const JOINT: [Reads; 4] = [
    Reads(Role::Flow, "speed"),
    Reads(Role::Position, "angle"),
    Reads(Role::Drive, "torque"),
    Reads(Role::Shaft, "angle"),
];

const CHANNELS: [Channel; 5] = [
    sized(
        0.1,
        at(
            Place::Effort(0),
            [
                "joint",
                "N m",
                "u -> u + w",
                "the joint; efforts are torques on it",
            ],
            &JOINT,
        ),
    ),
    at(
        Place::Rate(0),
        [
            "inertia",
            "rad/s^2",
            "ω' -> ω' + w(ω')",
            "the acceleration itself: where inertia acts",
        ],
        &JOINT,
    ),
    sized(
        0.1,
        at(
            Place::Input(0),
            [
                "input",
                "N m",
                "u -> u + w(u)",
                "between the commanded and the effective torque",
            ],
            &JOINT,
        ),
    ),
    at(
        Place::Output(0),
        [
            "sensor.speed",
            "rad/s",
            "ω_measured = ω + w",
            "measurement of the speed",
        ],
        &JOINT,
    ),
    at(
        Place::Output(1),
        [
            "sensor.angle",
            "rad",
            "φ_measured = φ + w",
            "measurement of the angle",
        ],
        &JOINT,
    ),
];

impl Plant for TorqueAxis {
    const META: PlantMeta = PlantMeta {
        id: "torque_axis",
        summary: "a joint driven by a torque, or by a motor whose current is controlled",
        equation: "ω' = b u - d ω;  φ' = ω",
        reference: "Armstrong-Hélouvry, Dupont, Canudas de Wit (1994), Automatica 30(7), 1083-1138: a mass under a force and viscous friction",
        assumptions: "one rigid inertia, no gravity, a current loop that is faster than what is looked at",
        example: "[plant.torque_axis.physical]\ninertia = 0.05            # kg m²\nviscous_friction = 0.1    # N m s/rad\n",
        states: &[
            Signal::new("speed", "ω", "rad/s", "speed of the joint"),
            Signal::new("angle", "φ", "rad", "angle of the joint"),
        ],
        inputs: &[Signal::new("torque", "u", "N m", "torque on the joint").sized(0.1)],
        outputs: &[],
        integrals: &[("speed", "angle")],
        channels: &CHANNELS,
        parameters: &LUMPED,
        parameterizations: &[Parameterization {
            id: "physical",
            summary: "inertia and viscous friction",
            parameters: &PHYSICAL,
        }],
        controlled: &[0],
    };

    const DERIVED: &'static [Derived] = &[
        Derived::new(
            "moment_of_inertia",
            "kg m^2",
            "1/b",
            "what the torque moves",
        ),
        Derived::new(
            "friction_torque_per_speed",
            "N m s/rad",
            "d/b",
            "torque that holds a speed",
        ),
    ];

    fn derivative<S: Real>(x: &[S; 2], u: &[S; 1], w: &[S; 1], p: &[S; 2]) -> [S; 2] {
        [p[0] * (u[0] + w[0]) - p[1] * x[0], x[0]]
    }

    fn output<S: Real>(_index: usize, _x: &[S; 2], _u: &[S; 1], _p: &[S; 2]) -> S {
        S::zero()
    }

    fn lower<S: Real>(set: usize, from: &[S]) -> Option<[S; 2]> {
        if set != 0 {
            return None;
        }
        let [inertia, friction] = *<&[S; 2]>::try_from(from).ok()?;
        Some([S::one() / inertia, friction / inertia])
    }

    fn derived<S: Real>(index: usize, p: &[S; 2]) -> S {
        if p[0].abs() <= S::of(1e-9) {
            return S::zero();
        }
        match index {
            0 => S::one() / p[0],
            _ => p[1] / p[0],
        }
    }
}

impl ControlAffine for TorqueAxis {
    fn drift<S: Real>(y: &[S; 1], p: &[S; 2]) -> [S; 1] {
        [-p[1] * y[0]]
    }
    fn input_matrix<S: Real>(_y: &[S; 1], p: &[S; 2]) -> [[S; 1]; 1] {
        [[p[0]]]
    }
    fn push<S: Real>(_y: &[S; 1], w: &[S; 1], p: &[S; 2]) -> [S; 1] {
        [p[0] * w[0]]
    }
}

declare_plant!(TorqueAxis, "torque_axis");

#[cfg(test)]
mod tests {
    use loopsight_core::rk4_step;

    use super::*;

    const PARTS: [f64; 2] = [0.05, 0.1];

    fn run(x: &mut [f64; 2], torque: f64, p: &[f64; 2], seconds: f64) {
        let h = 1e-3;
        for _ in 0..(seconds / h).round() as usize {
            rk4_step(x, h, |x| {
                TorqueAxis::derivative(x, &[torque - 0.5], &[0.5], p)
            });
        }
    }

    /// `ω = u/f (1 - e^{-f t/J})`, either way round; the effort counts as torque.
    #[test]
    fn a_step_of_torque_comes_to_its_speed() {
        let p = TorqueAxis::lower(0, &PARTS).unwrap();
        for torque in [0.8, -0.8] {
            let mut x = [0.0; 2];
            run(&mut x, torque, &p, 0.7);
            let lag = PARTS[0] / PARTS[1];
            let gone = (-0.7f64 / lag).exp();
            let speed = torque / PARTS[1] * (1.0 - gone);
            let angle = torque / PARTS[1] * (0.7 - lag * (1.0 - gone));
            assert!((x[0] - speed).abs() < 1e-10 && (x[1] - angle).abs() < 1e-10);
        }
    }

    /// What the torque works goes into motion and friction: `½ J ω² = ∫ (u - f ω) ω dt`.
    #[test]
    fn work_is_motion_and_friction() {
        let p = TorqueAxis::lower(0, &[PARTS[0], 0.0]).unwrap();
        let mut x = [2.0, 0.0];
        run(&mut x, 0.3, &p, 1.0);
        let gained = 0.5 * PARTS[0] * (x[0] * x[0] - 4.0);
        assert!((gained - 0.3 * x[1]).abs() < 1e-12);
        let p = TorqueAxis::lower(0, &PARTS).unwrap();
        let mut before = f64::INFINITY;
        for _ in 0..10 {
            run(&mut x, 0.0, &p, 0.1);
            let energy = x[0] * x[0];
            assert!(energy < before);
            before = energy;
        }
    }

    #[test]
    fn what_follows_are_the_parts() {
        let p = TorqueAxis::lower(0, &PARTS).unwrap();
        for (i, part) in PARTS.into_iter().enumerate() {
            let found: f64 = TorqueAxis::derived(i, &p);
            assert!((found - part).abs() < 1e-15);
        }
        let rate =
            TorqueAxis::drift(&[3.0], &p)[0] + 0.4 * TorqueAxis::input_matrix(&[3.0], &p)[0][0];
        let full = TorqueAxis::derivative(&[3.0, 0.0], &[0.4], &[0.0], &p)[0];
        assert!((rate - full).abs() < 1e-12);
    }
}
