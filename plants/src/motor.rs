//! A DC motor behind a gear: what the plants that it drives have in common.
//!
//! ```text
//! D = I n² + J      K_A = -(K_T K_a/R_a + f)/D      K_C = n K_T/(R_a D)
//! ```
//!
//! with the inertia `I` at the shaft behind a gear `n` (shaft speed over motor speed), the inductance
//! neglected: T. G. Alves, W. F. Lages, R. V. B. Henriques (2018), IFAC PapersOnLine 51-15, 437–442,
//! equations (11)–(16), (22).

use loopsight_core::{Channel, Derived, Parameter, Place, Reads, Real, Signal};

pub(crate) const DAMPING: Parameter = Parameter::new(
    "K_A",
    "K_A",
    "1/s",
    "damping: back-emf and viscous friction over inertia",
)
.within(f64::NEG_INFINITY, 0.0);

pub(crate) const DRIVE: Parameter =
    Parameter::new("K_C", "K_C", "rad/s^2/V", "acceleration per volt").nonzero();

pub(crate) const INERTIA: Parameter =
    Parameter::new("inertia", "I", "kg m^2", "moment of inertia at the shaft")
        .above(0.0)
        .nonlinear()
        .scaled(0.01);

pub(crate) const TORQUE_CONSTANT: Parameter = Parameter::new(
    "torque_constant",
    "K_T",
    "N m/A",
    "torque constant of the motor",
)
.above(0.0)
.known()
.nonlinear()
.scaled(0.01);

pub(crate) const BACK_EMF_CONSTANT: Parameter = Parameter::new(
    "back_emf_constant",
    "K_a",
    "V s/rad",
    "back-emf constant of the motor",
)
.above(0.0)
.known()
.nonlinear()
.scaled(0.01);

pub(crate) const RESISTANCE: Parameter = Parameter::new(
    "resistance",
    "R_a",
    "Ohm",
    "armature resistance of the motor",
)
.above(0.0)
.known()
.nonlinear();

pub(crate) const GEAR_RATIO: Parameter = Parameter::new(
    "gear_ratio",
    "n",
    "1",
    "shaft speed over motor speed, below 1 for a reduction gear",
)
.above(0.0)
.known()
.nonlinear()
.or(1.0);

pub(crate) const ROTOR_INERTIA: Parameter = Parameter::new(
    "rotor_inertia",
    "J",
    "kg m^2",
    "moment of inertia of the rotor",
)
.within(0.0, f64::INFINITY)
.or(0.0)
.known()
.nonlinear()
.scaled(1e-5);

pub(crate) const VISCOUS_FRICTION: Parameter = Parameter::new(
    "viscous_friction",
    "f",
    "N m s/rad",
    "viscous friction at the rotor",
)
.within(0.0, f64::INFINITY)
.or(0.0)
.nonlinear()
.scaled(1e-5);

/// The feedforward gains of WPILib SysId that follow from the plant alone: `V = kS sgn(ω) + kV ω +
/// kA ω' + …`; `kS` is the level of a `coulomb_friction` at the shaft.
pub(crate) const FEEDFORWARD: [Derived; 2] = [
    Derived::new(
        "kV",
        "V s/rad",
        "-K_A/K_C",
        "voltage that holds a speed (SysId)",
    ),
    Derived::new(
        "kA",
        "V s^2/rad",
        "1/K_C",
        "voltage that an acceleration takes (SysId)",
    ),
];

/// What an axis behind a motor tells besides its state: the load on the supply, that at rest, and
/// the voltage over the winding.
pub(crate) const OUTPUTS: [Signal; 3] = [
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
];

/// The channels that every axis behind a motor has, where effects read `motor` or, at the body, `load`:
/// its inertia, its input, and the sensors of its speed and angle.
pub(crate) const fn channels(motor: &'static [Reads], load: &'static [Reads]) -> [Channel; 4] {
    [
        Channel {
            id: "inertia",
            place: Place::Rate(0),
            unit: "rad/s^2",
            equation: "ω' -> ω' + w(ω')",
            reads: load,
            side: 0,
            size: 1.0,
            doc: "the acceleration itself: where inertia acts",
        },
        Channel {
            id: "input",
            place: Place::Input(0),
            unit: "V",
            equation: "V -> V + w(V)",
            reads: motor,
            side: 0,
            size: 1.0,
            doc: "between the commanded and the effective voltage",
        },
        Channel {
            id: "sensor.speed",
            place: Place::Output(0),
            unit: "rad/s",
            equation: "ω_measured = ω + w",
            reads: motor,
            side: 0,
            size: 1.0,
            doc: "measurement of the speed",
        },
        Channel {
            id: "sensor.angle",
            place: Place::Output(1),
            unit: "rad",
            equation: "φ_measured = φ + w",
            reads: motor,
            side: 0,
            size: 1.0,
            doc: "measurement of the angle",
        },
    ]
}

/// `[K_T, K_a, R_a, n, J, f]`.
pub(crate) type Motor<S> = [S; 6];

/// `[K_A, K_C]` and the inertia `D` that they are over, with the inertia `I` at the shaft.
pub(crate) fn lumped<S: Real>(inertia: S, motor: &Motor<S>) -> ([S; 2], S) {
    let [k_t, k_a, r_a, n, j, f] = *motor;
    let d = inertia * n * n + j;
    ([-(k_t * k_a / r_a + f) / d, n * k_t / (r_a * d)], d)
}

/// Voltage over the winding: the command less the back-emf at this speed.
fn armature<S: Real>(voltage: S, speed: S, k_a: S, k_c: S) -> S {
    // A motor without drive has no back-emf to speak of.
    if k_c.abs() > S::of(1e-9) {
        voltage + k_a / k_c * speed
    } else {
        voltage
    }
}

/// The `index`-th of [`OUTPUTS`].
pub(crate) fn output<S: Real>(index: usize, voltage: S, speed: S, k_a: S, k_c: S) -> S {
    match index {
        0 => voltage * armature(voltage, speed, k_a, k_c),
        1 => voltage * voltage,
        _ => armature(voltage, speed, k_a, k_c),
    }
}

/// The gain `over/K_C`; zero for a motor without drive.
pub(crate) fn per_drive<S: Real>(over: S, k_c: S) -> S {
    if k_c.abs() > S::of(1e-9) {
        over / k_c
    } else {
        S::zero()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_lumped_parameters_are_those_of_the_torque_balance() {
        let (inertia, k_t, k_a, r_a, n, j, f) = (0.02, 0.03, 0.031, 1.5, 0.1, 3e-6, 1e-5);
        let ([ka, kc], _) = lumped(inertia, &[k_t, k_a, r_a, n, j, f]);
        let (speed, volt) = (12.0, 7.0);
        // Torque balance at the shaft: I ω' = (K_T i - J ω'/n - f ω/n)/n.
        let current = (volt - k_a * speed / n) / r_a;
        let rate = (k_t * current - f * speed / n) / n / (inertia + j / (n * n));
        assert!((ka * speed + kc * volt - rate).abs() < 1e-10f64 * rate.abs());
    }
}
