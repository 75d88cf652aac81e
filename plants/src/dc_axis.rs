//! One motor, one axis.

use crate::declare_plant;
use loopsight_core::{
    Channel, ControlAffine, Derived, Parameter, Parameterization, Place, Plant, PlantMeta, Reads,
    Real, Role, Signal,
};

use crate::motor;

/// An axis driven by one DC motor: a wheel, a flywheel, a lift, a slide on a screw or belt.
///
/// ```text
/// ω' = K_A ω + K_C (V + w) + w_a        φ' = ω        s = r φ        v = r ω
/// ```
///
/// | symbol | what | unit |
/// |---|---|---|
/// | `ω`, `φ` | speed and angle of the shaft | rad/s, rad |
/// | `V` | motor voltage | V |
/// | `w` | effort at the shaft, as the motor voltage that would have the same effect | V |
/// | `w_a` | acceleration added to the shaft | rad/s² |
/// | `r` | travel per angle of the shaft | m/rad |
/// | `s`, `v` | travel and its speed, of a linear axis | m, m/s |
///
/// The axis is linear where travel is measured or the mass on it is given; then `r` must be known.
/// From physical parameters, with inertia `I` at the shaft, a mass `m` moved by the radius `r` and
/// the motor behind a gear `n` (shaft speed over motor speed), the inductance neglected as in (22)
/// of the paper:
///
/// ```text
/// D = (I + m r²) n² + J      K_A = -(K_T K_a/R_a + f)/D      K_C = n K_T/(R_a D)
/// ```
///
/// In the words of WPILib's SysId, `V = kS sgn(ω) + kV ω + kA ω' + kG`: `kV = -K_A/K_C` and
/// `kA = 1/K_C` follow from the plant alone and are shown with a fit; `kS` is the level of a
/// `coulomb_friction` and `-kG` the force of a `constant_force` at the shaft, both in volts.
///
/// Reference: the motor is that of Alves, Lages, Henriques (2018), equations (11)–(16), (22), with
/// an inertia as the load; WPILib documentation, "Introduction to DC Motor Feedforward".
#[derive(Clone, Copy, Debug)]
pub struct DcAxis;

const LUMPED: [Parameter; 3] = [motor::DAMPING, motor::DRIVE, RADIUS];

const RADIUS: Parameter = Parameter::new(
    "radius",
    "r",
    "m/rad",
    "travel per angle of the shaft: radius of a wheel, drum or pinion, lead of a screw",
)
.above(0.0)
.or(1.0)
.known()
.nonlinear();

const PHYSICAL: [Parameter; 9] = [
    motor::INERTIA,
    Parameter::new("mass", "m", "kg", "mass that is moved by the radius")
        .within(0.0, f64::INFINITY)
        .or(0.0)
        .known()
        .nonlinear(),
    RADIUS,
    motor::TORQUE_CONSTANT,
    motor::BACK_EMF_CONSTANT,
    motor::RESISTANCE,
    motor::GEAR_RATIO,
    motor::ROTOR_INERTIA,
    motor::VISCOUS_FRICTION,
];

const MOTOR: [Reads; 7] = [
    Reads(Role::Flow, "speed"),
    Reads(Role::Position, "angle"),
    Reads(Role::Drive, "voltage"),
    Reads(Role::Load, "supply_load"),
    Reads(Role::Stall, "stall_load"),
    Reads(Role::Armature, "armature"),
    Reads(Role::Shaft, "angle"),
];
/// The position that is measured is the travel.
const TRAVEL: [Reads; 7] = [
    Reads(Role::Flow, "linear_speed"),
    Reads(Role::Position, "travel"),
    MOTOR[2],
    MOTOR[3],
    MOTOR[4],
    MOTOR[5],
    MOTOR[6],
];
/// Where efforts are accelerations, volts over the winding say nothing.
const LOAD: [Reads; 3] = [
    Reads(Role::Flow, "speed"),
    Reads(Role::Position, "angle"),
    Reads(Role::Shaft, "angle"),
];

const AXIS: [Channel; 4] = motor::channels(&MOTOR, &LOAD);
const CHANNELS: [Channel; 8] = [
    Channel {
        id: "shaft",
        place: Place::Effort(0),
        unit: "V",
        equation: "V -> V + w",
        reads: &MOTOR,
        side: 0,
        size: 1.0,
        doc: "the shaft; efforts in volts of equivalent motor voltage",
    },
    Channel {
        id: "load",
        place: Place::Effort(1),
        unit: "rad/s^2",
        equation: "ω' -> ω' + w",
        reads: &LOAD,
        side: 0,
        size: 1.0,
        doc: "the load; efforts as angular acceleration",
    },
    AXIS[0],
    AXIS[1],
    AXIS[2],
    AXIS[3],
    Channel {
        id: "sensor.linear_speed",
        place: Place::Output(6),
        unit: "m/s",
        equation: "v_measured = v + w",
        reads: &TRAVEL,
        side: 0,
        size: 1.0,
        doc: "measurement of the speed of a linear axis",
    },
    Channel {
        id: "sensor.travel",
        place: Place::Output(7),
        unit: "m",
        equation: "s_measured = s + w",
        reads: &TRAVEL,
        side: 0,
        size: 1.0,
        doc: "measurement of the travel",
    },
];

impl Plant for DcAxis {
    const META: PlantMeta = PlantMeta {
        id: "dc_axis",
        summary: "an axis driven by one DC motor, rotary or linear",
        equation: "ω' = K_A ω + K_C V;  φ' = ω;  s = r φ;  v = r ω",
        reference: "Alves, Lages, Henriques (2018), IFAC PapersOnLine 51-15, equations (11)-(16), (22), with an inertia as the load; kV, kA: WPILib documentation, Introduction to DC Motor Feedforward",
        assumptions: "rigid shaft, armature inductance neglected",
        example: "[plant.dc_axis]\nK_A = -2.0\nK_C = 8.0\n",
        states: &[
            Signal::new("speed", "ω", "rad/s", "speed of the shaft"),
            Signal::new("angle", "φ", "rad", "angle of the shaft"),
        ],
        inputs: &[Signal::new("voltage", "V", "V", "voltage on the motor")],
        outputs: &[
            motor::OUTPUTS[0],
            motor::OUTPUTS[1],
            motor::OUTPUTS[2],
            Signal::new("linear_speed", "v", "m/s", "speed of a linear axis"),
            Signal::new("travel", "s", "m", "travel of a linear axis"),
        ],
        integrals: &[("speed", "angle"), ("linear_speed", "travel")],
        channels: &CHANNELS,
        parameters: &LUMPED,
        parameterizations: &[Parameterization {
            id: "physical",
            summary: "inertia, mass and motor constants, from which K_A and K_C follow",
            parameters: &PHYSICAL,
        }],
        controlled: &[0],
    };

    const DERIVED: &'static [Derived] = &motor::FEEDFORWARD;

    fn derivative<S: Real>(x: &[S; 2], u: &[S; 1], w: &[S; 2], p: &[S; 3]) -> [S; 2] {
        [p[0] * x[0] + p[1] * (u[0] + w[0]) + w[1], x[0]]
    }

    fn output<S: Real>(index: usize, x: &[S; 2], u: &[S; 1], p: &[S; 3]) -> S {
        let [k_a, k_c, radius] = *p;
        match index {
            0..3 => motor::output(index, u[0], x[0], k_a, k_c),
            3 => radius * x[0],
            _ => radius * x[1],
        }
    }

    fn lower<S: Real>(set: usize, from: &[S]) -> Option<[S; 3]> {
        if set != 0 {
            return None;
        }
        let [inertia, mass, radius, motor @ ..] = *<&[S; 9]>::try_from(from).ok()?;
        let ([k_a, k_c], _) = motor::lumped(inertia + mass * radius * radius, &motor);
        Some([k_a, k_c, radius])
    }

    fn derived<S: Real>(index: usize, p: &[S; 3]) -> S {
        match index {
            0 => motor::per_drive(-p[0], p[1]),
            _ => motor::per_drive(S::one(), p[1]),
        }
    }
}

impl ControlAffine for DcAxis {
    fn drift<S: Real>(y: &[S; 1], p: &[S; 3]) -> [S; 1] {
        [p[0] * y[0]]
    }
    fn input_matrix<S: Real>(_y: &[S; 1], p: &[S; 3]) -> [[S; 1]; 1] {
        [[p[1]]]
    }
    fn push<S: Real>(_y: &[S; 1], w: &[S; 2], p: &[S; 3]) -> [S; 1] {
        [p[1] * w[0] + w[1]]
    }
}

declare_plant!(DcAxis, "dc_axis");

#[cfg(test)]
mod tests {
    use super::*;

    /// A lift on a drum: the mass counts as `m r²` at the shaft.
    #[test]
    fn physical_parameters_give_the_motor_equation() {
        let (inertia, mass, radius) = (0.02, 4.0, 0.05);
        let (k_t, k_a, r_a, n, j, f) = (0.03, 0.031, 1.5, 0.1, 3e-6, 1e-5);
        let from = [inertia, mass, radius, k_t, k_a, r_a, n, j, f];
        let p: [f64; 3] = DcAxis::lower(0, &from).unwrap();
        let (speed, volt) = (12.0, 7.0);
        // Torque balance at the shaft: (I + m r²) ω' = (K_T i - J ω'/n - f ω/n)/n.
        let current = (volt - k_a * speed / n) / r_a;
        let torque = (k_t * current - f * speed / n) / n;
        let rate = torque / (inertia + mass * radius * radius + j / (n * n));
        let found = DcAxis::derivative(&[speed, 0.0], &[volt], &[0.0; 2], &p)[0];
        assert!((found - rate).abs() < 1e-10 * rate.abs());
        let [load, stall, armature, v, s] =
            [0, 1, 2, 3, 4].map(|i| DcAxis::output(i, &[speed, 2.0], &[volt], &p));
        assert!((armature - p[1].recip() * rate).abs() < 1e-9);
        assert_eq!([load, stall], [volt * armature, volt * volt]);
        assert_eq!([v, s], [radius * speed, radius * 2.0]);
    }

    /// SysId's form: the voltage of a speed and an acceleration is `kV ω + kA ω'`.
    #[test]
    fn feedforward_gains_invert_the_plant() {
        let p = [-2.0, 8.0, 1.0];
        let (speed, volt) = (3.0, 5.0);
        let rate = DcAxis::derivative(&[speed, 0.0], &[volt], &[0.0; 2], &p)[0];
        let (k_v, k_a): (f64, f64) = (DcAxis::derived(0, &p), DcAxis::derived(1, &p));
        assert!((k_v * speed + k_a * rate - volt).abs() < 1e-12);
    }
}
