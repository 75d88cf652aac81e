//! Two inertias and a spring between them.

use crate::declare_plant;
use crate::places::{at, sized};
use loopsight_core::{
    Channel, Derived, Parameter, Parameterization, Place, Plant, PlantMeta, Reads, Real, Role,
    Signal,
};

/// A motor that turns a load through a spring: an elastic joint, a belt, a long shaft.
///
/// ```text
/// ω'_m = b (u + w_m) - d_m ω_m - k_m (δ + τ δ' - w_s)        φ'_m = ω_m        δ = φ_m - φ_l
/// ω'_l = k_l (δ + τ δ' - w_s) - d_l ω_l + w_l                φ'_l = ω_l        δ' = ω_m - ω_l
/// ```
///
/// | symbol | what | unit |
/// |---|---|---|
/// | `ω_m`, `φ_m` | speed and angle of the motor's side | rad/s, rad |
/// | `ω_l`, `φ_l` | speed and angle of the load | rad/s, rad |
/// | `u` | torque on the motor's side | N m |
/// | `δ` | twist of the spring | rad |
/// | `w_m` | effort at the motor's side, a torque | N m |
/// | `w_l` | acceleration added to the load | rad/s² |
/// | `w_s` | what pulls the spring open, as the twist that would do the same | rad |
///
/// From the inertias `J_m` and `J_l` of the two sides, the stiffness `k` and the damping `c` of the
/// spring and the viscous frictions `f_m` and `f_l`:
///
/// ```text
/// b = 1/J_m    d_m = f_m/J_m    k_m = k/J_m    k_l = k/J_l    d_l = f_l/J_l    τ = c/k
/// ```
///
/// These six are what torque and motion determine. Held at the motor the load swings with `√k_l`, where the motor
/// hardly moves when it is driven; free, the two swing against each other with `√(k_m + k_l)`.
///
/// A motor on a voltage `V` is the same with `u = (K_T/R_a) V` (`scale` and `scale_unit` of the log) and
/// its back-emf in `f_m`; a current in amperes wants `K_T`. All angles are counted behind the gear.
///
/// Assumptions: a linear spring without mass, one inertia at either end; no gravity, which is a
/// `gravity_pendulum` at the load. Dry friction is an effect at either side, a spring that hardens
/// `cubic_stiffness` at the spring.
///
/// Reference: M. W. Spong (1987), "Modeling and Control of Elastic Joint Robots", Journal of Dynamic
/// Systems, Measurement, and Control 109(4), 310–319: its model for one joint, `I q''_1 + k (q_1 - q_2) =
/// 0`, `J q''_2 - k (q_1 - q_2) = u`, with damping.
#[derive(Clone, Copy, Debug)]
pub struct FlexibleJoint;

const LUMPED: [Parameter; 6] = [
    Parameter::new(
        "drive",
        "b",
        "rad/s^2/(N m)",
        "acceleration of the motor's side per torque, one over its inertia",
    )
    .nonzero(),
    Parameter::new(
        "motor_damping",
        "d_m",
        "1/s",
        "viscous friction of the motor's side over its inertia",
    )
    .within(0.0, f64::INFINITY),
    Parameter::new(
        "motor_stiffness",
        "k_m",
        "1/s^2",
        "stiffness of the spring over the inertia of the motor's side",
    )
    .within(0.0, f64::INFINITY)
    .scaled(100.0),
    Parameter::new(
        "load_stiffness",
        "k_l",
        "1/s^2",
        "stiffness of the spring over the inertia of the load",
    )
    .within(0.0, f64::INFINITY)
    .scaled(100.0),
    Parameter::new(
        "load_damping",
        "d_l",
        "1/s",
        "viscous friction of the load over its inertia",
    )
    .within(0.0, f64::INFINITY),
    Parameter::new(
        "spring_time",
        "τ",
        "s",
        "damping of the spring over its stiffness",
    )
    .within(0.0, f64::INFINITY)
    .or(0.0)
    .nonlinear()
    .scaled(1e-3),
];

const fn inertia(id: &'static str, symbol: &'static str, doc: &'static str) -> Parameter {
    Parameter::new(id, symbol, "kg m^2", doc)
        .above(0.0)
        .nonlinear()
        .scaled(0.01)
}

const fn viscous(id: &'static str, symbol: &'static str, doc: &'static str) -> Parameter {
    Parameter::new(id, symbol, "N m s/rad", doc)
        .within(0.0, f64::INFINITY)
        .or(0.0)
        .nonlinear()
        .scaled(0.01)
}

const PHYSICAL: [Parameter; 6] = [
    inertia(
        "motor_inertia",
        "J_m",
        "moment of inertia of the motor's side",
    ),
    inertia("load_inertia", "J_l", "moment of inertia of the load"),
    Parameter::new("stiffness", "k", "N m/rad", "stiffness of the spring")
        .within(0.0, f64::INFINITY)
        .nonlinear(),
    viscous("spring_damping", "c", "damping of the spring"),
    viscous(
        "motor_friction",
        "f_m",
        "viscous friction of the motor's side",
    ),
    viscous("load_friction", "f_l", "viscous friction of the load"),
];

const MOTOR: [Reads; 4] = [
    Reads(Role::Flow, "motor_speed"),
    Reads(Role::Position, "motor_angle"),
    Reads(Role::Drive, "torque"),
    Reads(Role::Shaft, "motor_angle"),
];
const LOAD: [Reads; 3] = [
    Reads(Role::Flow, "load_speed"),
    Reads(Role::Position, "load_angle"),
    Reads(Role::Shaft, "load_angle"),
];
/// Not its speed: a friction on its twist would be far faster than any step.
const SPRING: [Reads; 1] = [Reads(Role::Position, "twist")];

const CHANNELS: [Channel; 10] = [
    sized(
        0.1,
        at(
            Place::Effort(0),
            [
                "motor",
                "N m",
                "u -> u + w",
                "the motor's side; efforts are torques on it",
            ],
            &MOTOR,
        ),
    ),
    at(
        Place::Effort(1),
        [
            "load",
            "rad/s^2",
            "ω'_l -> ω'_l + w",
            "the load; efforts as angular acceleration",
        ],
        &LOAD,
    ),
    sized(
        0.1,
        at(
            Place::Effort(2),
            [
                "spring",
                "rad",
                "δ -> δ - w in the spring",
                "the spring; efforts open it, as the twist that would do the same",
            ],
            &SPRING,
        ),
    ),
    at(
        Place::Rate(0),
        [
            "inertia.motor",
            "rad/s^2",
            "ω'_m -> ω'_m + w(ω'_m)",
            "the acceleration of the motor's side: where its inertia acts",
        ],
        &MOTOR,
    ),
    at(
        Place::Rate(2),
        [
            "inertia.load",
            "rad/s^2",
            "ω'_l -> ω'_l + w(ω'_l)",
            "the acceleration of the load: where its inertia acts",
        ],
        &LOAD,
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
            &MOTOR,
        ),
    ),
    at(
        Place::Output(0),
        [
            "sensor.motor_speed",
            "rad/s",
            "ω_m measured = ω_m + w",
            "measurement of the motor's speed",
        ],
        &MOTOR,
    ),
    at(
        Place::Output(1),
        [
            "sensor.motor_angle",
            "rad",
            "φ_m measured = φ_m + w",
            "measurement of the motor's angle",
        ],
        &MOTOR,
    ),
    at(
        Place::Output(2),
        [
            "sensor.load_speed",
            "rad/s",
            "ω_l measured = ω_l + w",
            "measurement of the load's speed",
        ],
        &LOAD,
    ),
    at(
        Place::Output(3),
        [
            "sensor.load_angle",
            "rad",
            "φ_l measured = φ_l + w",
            "measurement of the load's angle",
        ],
        &LOAD,
    ),
];

impl Plant for FlexibleJoint {
    const META: PlantMeta = PlantMeta {
        id: "flexible_joint",
        summary: "a motor and a load with a spring between them",
        equation: "ω'_m = b u - d_m ω_m - k_m (δ + τ δ');  ω'_l = k_l (δ + τ δ') - d_l ω_l;  δ = φ_m - φ_l",
        reference: "Spong (1987), Journal of Dynamic Systems, Measurement, and Control 109(4), 310-319, the model of one elastic joint",
        assumptions: "a linear spring without mass between two rigid inertias, no gravity",
        example: "[plant.flexible_joint.physical]\nmotor_inertia = 0.01     # kg m²\nload_inertia = 0.02      # kg m²\nstiffness = 8.0          # N m/rad\nspring_damping = 0.02    # N m s/rad\nmotor_friction = 0.02    # N m s/rad\nload_friction = 0.01     # N m s/rad\n",
        states: &[
            Signal::new("motor_speed", "ω_m", "rad/s", "speed of the motor's side"),
            Signal::new("motor_angle", "φ_m", "rad", "angle of the motor's side"),
            Signal::new("load_speed", "ω_l", "rad/s", "speed of the load"),
            Signal::new("load_angle", "φ_l", "rad", "angle of the load"),
        ],
        inputs: &[Signal::new("torque", "u", "N m", "torque on the motor's side").sized(0.1)],
        outputs: &[Signal::new("twist", "δ", "rad", "twist of the spring").sized(0.1)],
        integrals: &[("motor_speed", "motor_angle"), ("load_speed", "load_angle")],
        channels: &CHANNELS,
        parameters: &LUMPED,
        parameterizations: &[Parameterization {
            id: "physical",
            summary: "inertias, stiffness, damping and viscous frictions",
            parameters: &PHYSICAL,
        }],
        controlled: &[0],
    };

    const DERIVED: &'static [Derived] = &[
        Derived::new(
            "antiresonance",
            "rad/s",
            "sqrt(k_l)",
            "angular frequency of the load with the motor held",
        ),
        Derived::new(
            "resonance",
            "rad/s",
            "sqrt(k_m + k_l)",
            "angular frequency of the two against each other",
        ),
    ];

    fn derivative<S: Real>(x: &[S; 4], u: &[S; 1], w: &[S; 3], p: &[S; 6]) -> [S; 4] {
        let [motor, motor_angle, load, load_angle] = *x;
        let [drive, motor_damping, k_m, k_l, load_damping, time] = *p;
        let spring = motor_angle - load_angle + time * (motor - load) - w[2];
        [
            drive * (u[0] + w[0]) - motor_damping * motor - k_m * spring,
            motor,
            k_l * spring - load_damping * load + w[1],
            load,
        ]
    }

    fn output<S: Real>(_index: usize, x: &[S; 4], _u: &[S; 1], _p: &[S; 6]) -> S {
        x[1] - x[3]
    }

    fn lower<S: Real>(set: usize, from: &[S]) -> Option<[S; 6]> {
        if set != 0 {
            return None;
        }
        let [motor, load, stiffness, damping, f_m, f_l] = *<&[S; 6]>::try_from(from).ok()?;
        // Without a spring nothing is damped by it either.
        let time = if stiffness > S::zero() {
            damping / stiffness
        } else {
            S::zero()
        };
        Some([
            S::one() / motor,
            f_m / motor,
            stiffness / motor,
            stiffness / load,
            f_l / load,
            time,
        ])
    }

    fn derived<S: Real>(index: usize, p: &[S; 6]) -> S {
        let square = match index {
            0 => p[3],
            _ => p[2] + p[3],
        };
        // The root has no derivative at zero.
        if square > S::zero() {
            square.sqrt()
        } else {
            S::zero()
        }
    }
}

declare_plant!(FlexibleJoint, "flexible_joint");

#[cfg(test)]
mod tests {
    use loopsight_core::rk4_step;

    use super::*;

    /// J_m, J_l, k, c, f_m, f_l
    const PARTS: [f64; 6] = [0.01, 0.02, 8.0, 0.02, 0.02, 0.01];

    fn joint(change: impl Fn(&mut [f64; 6])) -> [f64; 6] {
        let mut parts = PARTS;
        change(&mut parts);
        FlexibleJoint::lower(0, &parts).unwrap()
    }

    fn run(x: &mut [f64; 4], torque: f64, p: &[f64; 6], seconds: f64) {
        let h = 1e-4;
        for _ in 0..(seconds / h).round() as usize {
            rk4_step(x, h, |x| {
                FlexibleJoint::derivative(x, &[torque], &[0.0; 3], p)
            });
        }
    }

    /// J
    fn energy([motor, angle, load, load_angle]: [f64; 4]) -> f64 {
        let [j_m, j_l, k, ..] = PARTS;
        0.5 * (j_m * motor * motor + j_l * load * load + k * (angle - load_angle).powi(2))
    }

    /// Without friction nothing is lost; with it every part of a second takes some.
    #[test]
    fn energy_is_kept_or_falls() {
        let start = [3.0, 0.2, -1.0, -0.1];
        let free = joint(|parts| parts[3..].fill(0.0));
        let mut x = start;
        run(&mut x, 0.0, &free, 2.0);
        assert!((energy(x) / energy(start) - 1.0).abs() < 1e-9);
        let (mut x, p) = (start, joint(|_| ()));
        for _ in 0..20 {
            let before = energy(x);
            run(&mut x, 0.0, &p, 0.05);
            assert!(energy(x) < before);
        }
    }

    /// The momentum of both is the impulse of the torque, whatever the spring does.
    #[test]
    fn momentum_is_the_impulse_of_the_torque() {
        let p = joint(|parts| parts[4..].fill(0.0));
        let mut x = [0.0; 4];
        run(&mut x, 0.4, &p, 1.5);
        let momentum = PARTS[0] * x[0] + PARTS[1] * x[2];
        assert!((momentum - 0.6).abs() < 1e-9, "{momentum}");
    }

    /// Let go with opposite twists the two swing with `√(k_m + k_l)`, and back after a period.
    #[test]
    fn the_two_swing_against_each_other() {
        let p = joint(|parts| parts[3..].fill(0.0));
        let resonance: f64 = FlexibleJoint::derived(1, &p);
        assert!((resonance - 1200f64.sqrt()).abs() < 1e-9);
        let start = [0.0, 0.2, 0.0, -0.1];
        let mut x = start;
        let steps = 2000;
        let h = core::f64::consts::TAU / resonance / f64::from(steps);
        for _ in 0..steps {
            rk4_step(&mut x, h, |x| {
                FlexibleJoint::derivative(x, &[0.0], &[0.0; 3], &p)
            });
        }
        for (x, s) in x.iter().zip(start) {
            assert!((x - s).abs() < 1e-8, "{x} {s}");
        }
    }

    /// Turning either way is the same, and at a constant speed the spring carries the friction of the load.
    #[test]
    fn it_is_symmetric_and_comes_to_a_steady_speed() {
        let p = joint(|_| ());
        let (mut x, mut y) = ([0.0; 4], [0.0; 4]);
        run(&mut x, 0.3, &p, 20.0);
        run(&mut y, -0.3, &p, 20.0);
        for (x, y) in x.iter().zip(y) {
            assert!((x + y).abs() < 1e-9 * x.abs().max(1.0));
        }
        let speed = 0.3 / (PARTS[4] + PARTS[5]);
        assert!((x[0] - speed).abs() < 1e-6 && (x[2] - speed).abs() < 1e-6);
        let twist = FlexibleJoint::output(0, &x, &[0.3], &p);
        assert!((twist - PARTS[5] * speed / PARTS[2]).abs() < 1e-7);
        // What opens the spring by the twist it has takes its torque away.
        let rates = FlexibleJoint::derivative(&x, &[0.3], &[0.0, 0.0, twist], &p);
        assert!((rates[2] + p[4] * x[2]).abs() < 1e-6, "{rates:?}");
    }

    /// With a stiff spring it is one inertia.
    #[test]
    fn a_stiff_spring_makes_it_one_inertia() {
        let p = joint(|parts| {
            parts[2] = 2e4;
            parts[3] = 5.0;
        });
        let mut x = [0.0; 4];
        run(&mut x, 0.3, &p, 0.5);
        let (inertia, friction) = (PARTS[0] + PARTS[1], PARTS[4] + PARTS[5]);
        let speed = 0.3 / friction * -(-0.5 * friction / inertia).exp_m1();
        assert!((x[0] - speed).abs() < 1e-3 * speed, "{} {speed}", x[0]);
    }
}
