//! One motor, one axis.

use loopsight_core::{
    Channel, ControlAffine, Parameter, Parameterization, Place, Plant, PlantMeta, Reads, Real,
    Role, Signal, declare_plant,
};

/// An axis driven by one DC motor: a wheel, a flywheel, a joint without gravity.
///
/// ```text
/// ω' = K_A ω + K_C (V + w) + w_a        φ' = ω
/// ```
///
/// | symbol | what | unit |
/// |---|---|---|
/// | `ω`, `φ` | speed and angle of the shaft | rad/s, rad |
/// | `V` | motor voltage | V |
/// | `w` | effort at the shaft, as the motor voltage that would have the same effect | V |
/// | `w_a` | acceleration added to the shaft | rad/s² |
///
/// From physical parameters, with inertia `I` at the shaft and the motor behind a gear `n` (shaft
/// speed over motor speed), the inductance neglected as in (22) of the paper:
///
/// ```text
/// D = I n² + J      K_A = -(K_T K_a/R_a + f)/D      K_C = n K_T/(R_a D)
/// ```
///
/// Reference: the motor is that of Alves, Lages, Henriques (2018), equations (11)–(16), (22), with
/// an inertia as the load.
#[derive(Clone, Copy, Debug)]
pub struct DcAxis;

const LUMPED: [Parameter; 2] = [
    Parameter::new(
        "K_A",
        "K_A",
        "1/s",
        "damping: back-emf and viscous friction over inertia",
    )
    .within(f64::NEG_INFINITY, 0.0),
    Parameter::new("K_C", "K_C", "rad/s^2/V", "acceleration per volt"),
];

const PHYSICAL: [Parameter; 7] = [
    Parameter::new("inertia", "I", "kg m^2", "moment of inertia at the shaft")
        .above(0.0)
        .nonlinear()
        .scaled(0.01),
    Parameter::new(
        "torque_constant",
        "K_T",
        "N m/A",
        "torque constant of the motor",
    )
    .above(0.0)
    .known()
    .nonlinear()
    .scaled(0.01),
    Parameter::new(
        "back_emf_constant",
        "K_a",
        "V s/rad",
        "back-emf constant of the motor",
    )
    .above(0.0)
    .known()
    .nonlinear()
    .scaled(0.01),
    Parameter::new(
        "resistance",
        "R_a",
        "Ohm",
        "armature resistance of the motor",
    )
    .above(0.0)
    .known()
    .nonlinear(),
    Parameter::new(
        "gear_ratio",
        "n",
        "1",
        "shaft speed over motor speed, below 1 for a reduction gear",
    )
    .above(0.0)
    .known()
    .nonlinear()
    .or(1.0),
    Parameter::new(
        "rotor_inertia",
        "J",
        "kg m^2",
        "moment of inertia of the rotor",
    )
    .within(0.0, f64::INFINITY)
    .or(0.0)
    .known()
    .nonlinear()
    .scaled(1e-5),
    Parameter::new(
        "viscous_friction",
        "f",
        "N m s/rad",
        "viscous friction at the rotor",
    )
    .within(0.0, f64::INFINITY)
    .or(0.0)
    .nonlinear()
    .scaled(1e-5),
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
/// Where efforts are accelerations, volts over the winding say nothing.
const LOAD: [Reads; 3] = [
    Reads(Role::Flow, "speed"),
    Reads(Role::Position, "angle"),
    Reads(Role::Shaft, "angle"),
];

const CHANNELS: [Channel; 6] = [
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
    Channel {
        id: "inertia",
        place: Place::Rate(0),
        unit: "rad/s^2",
        equation: "ω' -> ω' + w(ω')",
        reads: &LOAD,
        side: 0,
        size: 1.0,
        doc: "the acceleration itself: where inertia acts",
    },
    Channel {
        id: "input",
        place: Place::Input(0),
        unit: "V",
        equation: "V -> V + w(V)",
        reads: &MOTOR,
        side: 0,
        size: 1.0,
        doc: "between the commanded and the effective voltage",
    },
    Channel {
        id: "sensor.speed",
        place: Place::Output(0),
        unit: "rad/s",
        equation: "ω_measured = ω + w",
        reads: &MOTOR,
        side: 0,
        size: 1.0,
        doc: "measurement of the speed",
    },
    Channel {
        id: "sensor.angle",
        place: Place::Output(1),
        unit: "rad",
        equation: "φ_measured = φ + w",
        reads: &MOTOR,
        side: 0,
        size: 1.0,
        doc: "measurement of the angle",
    },
];

impl Plant<2, 1, 2, 2, 3> for DcAxis {
    const META: PlantMeta = PlantMeta {
        id: "dc_axis",
        summary: "an axis driven by one DC motor",
        equation: "ω' = K_A ω + K_C V;  φ' = ω",
        reference: "Alves, Lages, Henriques (2018), IFAC PapersOnLine 51-15, equations (11)-(16), (22), with an inertia as the load",
        assumptions: "rigid shaft, armature inductance neglected",
        example: "[plant.dc_axis]\nK_A = -2.0\nK_C = 8.0\n",
        states: &[
            Signal::new("speed", "ω", "rad/s", "speed of the shaft"),
            Signal::new("angle", "φ", "rad", "angle of the shaft"),
        ],
        inputs: &[Signal::new("voltage", "V", "V", "voltage on the motor")],
        outputs: &[
            Signal::new(
                "supply_load",
                "V U",
                "V^2",
                "load on the supply: command times armature voltage",
            ),
            Signal::new(
                "stall_load",
                "V²",
                "V^2",
                "load on the supply if the motor stood still",
            ),
            Signal::new(
                "armature",
                "U",
                "V",
                "voltage over the motor's winding, V less what K_A takes at this speed",
            ),
        ],
        integrals: &[("speed", "angle")],
        channels: &CHANNELS,
        parameters: &LUMPED,
        parameterizations: &[Parameterization {
            id: "physical",
            summary: "inertia and motor constants, from which K_A and K_C follow",
            parameters: &PHYSICAL,
        }],
        controlled: &[0],
    };

    fn derivative<S: Real>(x: &[S; 2], u: &[S; 1], w: &[S; 2], p: &[S; 2]) -> [S; 2] {
        [p[0] * x[0] + p[1] * (u[0] + w[0]) + w[1], x[0]]
    }

    fn output<S: Real>(index: usize, x: &[S; 2], u: &[S; 1], p: &[S; 2]) -> S {
        let [k_a, k_c] = *p;
        // A motor without drive has no back-emf to speak of.
        let armature = if k_c.abs() > S::of(1e-9) {
            u[0] + k_a / k_c * x[0]
        } else {
            u[0]
        };
        match index {
            0 => u[0] * armature,
            1 => u[0] * u[0],
            _ => armature,
        }
    }

    fn lower<S: Real>(set: usize, from: &[S]) -> Option<[S; 2]> {
        if set != 0 {
            return None;
        }
        let [inertia, k_t, k_a, r_a, n, j, f] = *<&[S; 7]>::try_from(from).ok()?;
        let d = inertia * n * n + j;
        Some([-(k_t * k_a / r_a + f) / d, n * k_t / (r_a * d)])
    }
}

impl ControlAffine<1, 1, 2> for DcAxis {
    fn drift<S: Real>(y: &[S; 1], p: &[S; 2]) -> [S; 1] {
        [p[0] * y[0]]
    }
    fn input_matrix<S: Real>(_y: &[S; 1], p: &[S; 2]) -> [[S; 1]; 1] {
        [[p[1]]]
    }
}

declare_plant!(DcAxis, "dc_axis", <2, 1, 2, 2, 3>);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn physical_parameters_give_the_motor_equation() {
        let (inertia, k_t, k_a, r_a, n, j, f) = (0.02, 0.03, 0.031, 1.5, 0.1, 3e-6, 1e-5);
        let [ka, kc] = DcAxis::lower(0, &[inertia, k_t, k_a, r_a, n, j, f]).unwrap();
        let (speed, volt) = (12.0, 7.0);
        // Torque balance at the shaft: I ω' = (K_T i - J ω'/n - f ω/n)/n.
        let current = (volt - k_a * speed / n) / r_a;
        let rate = (k_t * current - f * speed / n) / n / (inertia + j / (n * n));
        assert!((ka * speed + kc * volt - rate).abs() < 1e-10 * rate.abs());
    }
}
