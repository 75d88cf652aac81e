//! A joint that gravity pulls at.

use crate::declare_plant;
use loopsight_core::{
    Channel, Derived, Parameter, Parameterization, Place, Plant, PlantMeta, Reads, Real, Role,
    Signal,
};

use crate::motor;

/// One joint with gravity, driven by a DC motor: an arm, a lid, a pendulum.
///
/// ```text
/// ω' = K_A ω + K_C (V + w) - K_G cos(φ - φ_0) + w_a        φ' = ω
/// ```
///
/// | symbol | what | unit |
/// |---|---|---|
/// | `ω`, `φ` | speed and angle of the joint | rad/s, rad |
/// | `φ_0` | angle at which the arm is level; it rises with the angle | rad |
/// | `V` | motor voltage | V |
/// | `w` | effort at the joint, as the motor voltage that would have the same effect | V |
/// | `w_a` | acceleration added to the joint | rad/s² |
///
/// From physical parameters, with a mass `m` whose centre is `l` from the joint, the inertia `I`
/// about the joint and the motor behind a gear `n` (joint speed over motor speed):
///
/// ```text
/// D = I n² + J      K_A = -(K_T K_a/R_a + f)/D      K_C = n K_T/(R_a D)      K_G = m g l n²/D
/// ```
///
/// In the words of WPILib's SysId, `V = kS sgn(ω) + kG cos(φ) + kV ω + kA ω'`: `kV = -K_A/K_C`,
/// `kA = 1/K_C`, `kG = K_G/K_C` are shown with a fit; `kS` is the level of a `coulomb_friction` at the
/// joint.
///
/// Assumptions: a rigid arm in a vertical plane, armature inductance neglected. A recording over a
/// small part of a turn cannot tell `K_G` from a constant force.
///
/// Reference: M. W. Spong, S. Hutchinson, M. Vidyasagar (2006), "Robot Modeling and Control", Wiley,
/// chapter 7, the single link; the motor is that of Alves, Lages, Henriques (2018), equations
/// (11)–(16), (22); WPILib documentation, "Introduction to DC Motor Feedforward".
#[derive(Clone, Copy, Debug)]
pub struct Arm;

/// Standard gravity, m/s².
const GRAVITY: f64 = 9.806_65;

const LEVEL: Parameter = Parameter::new(
    "level_angle",
    "φ_0",
    "rad",
    "angle of the encoder at which the arm is level",
)
.or(0.0)
.known()
.nonlinear();

const LUMPED: [Parameter; 4] = [
    motor::DAMPING,
    motor::DRIVE,
    Parameter::new(
        "K_G",
        "K_G",
        "rad/s^2",
        "acceleration by gravity of the level arm",
    ),
    LEVEL,
];

const PHYSICAL: [Parameter; 10] = [
    motor::INERTIA,
    Parameter::new("mass", "m", "kg", "mass of the arm").within(0.0, f64::INFINITY),
    Parameter::new(
        "centre_of_mass",
        "l",
        "m",
        "distance of the centre of mass from the joint",
    )
    .known()
    .scaled(0.1),
    LEVEL,
    motor::TORQUE_CONSTANT,
    motor::BACK_EMF_CONSTANT,
    motor::RESISTANCE,
    motor::GEAR_RATIO,
    motor::ROTOR_INERTIA,
    motor::VISCOUS_FRICTION,
];

const JOINT: [Reads; 8] = [
    Reads(Role::Flow, "speed"),
    Reads(Role::Position, "angle"),
    Reads(Role::Drive, "voltage"),
    Reads(Role::Load, "supply_load"),
    Reads(Role::Stall, "stall_load"),
    Reads(Role::Armature, "armature"),
    Reads(Role::Shaft, "angle"),
    Reads(Role::Gravity, "gravity"),
];
/// Where efforts are accelerations, volts over the winding say nothing.
const LOAD: [Reads; 4] = [
    Reads(Role::Flow, "speed"),
    Reads(Role::Position, "angle"),
    Reads(Role::Shaft, "angle"),
    Reads(Role::Gravity, "gravity"),
];

const AXIS: [Channel; 4] = motor::channels(&JOINT, &LOAD);
const CHANNELS: [Channel; 6] = [
    Channel {
        id: "joint",
        place: Place::Effort(0),
        unit: "V",
        equation: "V -> V + w",
        reads: &JOINT,
        side: 0,
        size: 1.0,
        doc: "the joint; efforts in volts of equivalent motor voltage",
    },
    Channel {
        id: "load",
        place: Place::Effort(1),
        unit: "rad/s^2",
        equation: "ω' -> ω' + w",
        reads: &LOAD,
        side: 0,
        size: 1.0,
        doc: "the arm; efforts as angular acceleration",
    },
    AXIS[0],
    AXIS[1],
    AXIS[2],
    AXIS[3],
];

impl Plant for Arm {
    const META: PlantMeta = PlantMeta {
        id: "arm",
        summary: "one joint with gravity, driven by a DC motor",
        equation: "ω' = K_A ω + K_C V - K_G cos(φ - φ_0);  φ' = ω",
        reference: "Spong, Hutchinson, Vidyasagar (2006), Robot Modeling and Control, chapter 7 (single link); motor: Alves, Lages, Henriques (2018), IFAC PapersOnLine 51-15, equations (11)-(16), (22)",
        assumptions: "a rigid arm in a vertical plane, armature inductance neglected",
        example: "[plant.arm]\nK_A = -6.0\nK_C = 5.0\nK_G = 9.0\n",
        states: &[
            Signal::new("speed", "ω", "rad/s", "speed of the joint"),
            Signal::new("angle", "φ", "rad", "angle of the joint"),
        ],
        inputs: &[Signal::new("voltage", "V", "V", "voltage on the motor")],
        outputs: &[
            motor::OUTPUTS[0],
            motor::OUTPUTS[1],
            motor::OUTPUTS[2],
            Signal::new(
                "gravity",
                "g_φ",
                "rad/s^2",
                "acceleration by gravity at this angle",
            ),
        ],
        integrals: &[("speed", "angle")],
        channels: &CHANNELS,
        parameters: &LUMPED,
        parameterizations: &[Parameterization {
            id: "physical",
            summary: "mass, inertia and motor constants, from which K_A, K_C and K_G follow",
            parameters: &PHYSICAL,
        }],
        controlled: &[0],
    };

    const DERIVED: &'static [Derived] = &[
        motor::FEEDFORWARD[0],
        motor::FEEDFORWARD[1],
        Derived::new(
            "kG",
            "V",
            "K_G/K_C",
            "voltage that holds the level arm (SysId)",
        ),
    ];

    fn derivative<S: Real>(x: &[S; 2], u: &[S; 1], w: &[S; 2], p: &[S; 4]) -> [S; 2] {
        let [speed, _] = *x;
        [
            p[0] * speed + p[1] * (u[0] + w[0]) + gravity(x, p) + w[1],
            speed,
        ]
    }

    fn output<S: Real>(index: usize, x: &[S; 2], u: &[S; 1], p: &[S; 4]) -> S {
        match index {
            0..3 => motor::output(index, u[0], x[0], p[0], p[1]),
            _ => gravity(x, p),
        }
    }

    fn lower<S: Real>(set: usize, from: &[S]) -> Option<[S; 4]> {
        if set != 0 {
            return None;
        }
        let [inertia, mass, centre, level, motor @ ..] = *<&[S; 10]>::try_from(from).ok()?;
        let ([k_a, k_c], d) = motor::lumped(inertia, &motor);
        let n = motor[3];
        Some([k_a, k_c, S::of(GRAVITY) * mass * centre * n * n / d, level])
    }

    fn derived<S: Real>(index: usize, p: &[S; 4]) -> S {
        match index {
            0 => motor::per_drive(-p[0], p[1]),
            1 => motor::per_drive(S::one(), p[1]),
            _ => motor::per_drive(p[2], p[1]),
        }
    }
}

/// Acceleration by gravity.
fn gravity<S: Real>(x: &[S; 2], p: &[S; 4]) -> S {
    -p[2] * (x[1] - p[3]).cos()
}

declare_plant!(Arm, "arm");

#[cfg(test)]
mod tests {
    use core::f64::consts::{FRAC_PI_2, TAU};

    use loopsight_core::rk4_step;

    use super::*;

    /// Let go near where it hangs the arm swings with `√(m g l/I)`, its motor disconnected.
    #[test]
    fn it_swings_like_a_pendulum() {
        let (inertia, mass, centre) = (0.3f64, 2.0, 0.4);
        // A winding of very high resistance does not brake.
        let from = [inertia, mass, centre, 0.0, 0.03, 0.03, 1e12, 1.0, 0.0, 0.0];
        let p: [f64; 4] = Arm::lower(0, &from).unwrap();
        let natural = (mass * GRAVITY * centre / inertia).sqrt();
        let mut x = [0.0, -FRAC_PI_2 + 1e-4];
        let (h, mut crossings, mut before) = (1e-4, Vec::new(), 1e-4);
        for k in 1..=60_000 {
            rk4_step(&mut x, h, |x| Arm::derivative(x, &[0.0], &[0.0; 2], &p));
            let from_rest = x[1] + FRAC_PI_2;
            if before < 0.0 && from_rest >= 0.0 {
                crossings.push(h * (f64::from(k) - from_rest / (from_rest - before)));
            }
            before = from_rest;
        }
        let period = (crossings[3] - crossings[0]) / 3.0;
        assert!((period - TAU / natural).abs() < 1e-6, "{period}");
    }

    /// `kG` volts hold the level arm, and the encoder's zero may be anywhere.
    #[test]
    fn it_is_held_by_the_voltage_of_its_gravity() {
        let p = [-6.0f64, 5.0, 9.0, 0.3];
        let hold = Arm::derived(2, &p);
        assert!(Arm::derivative(&[0.0, 0.3], &[hold], &[0.0; 2], &p)[0].abs() < 1e-12);
        let up = Arm::derivative(&[0.0, 0.3 + FRAC_PI_2], &[0.0], &[0.0; 2], &p)[0];
        assert!(up.abs() < 1e-12);
    }
}
