//! A pendulum that a fan lifts.

use crate::declare_plant;
use crate::places::{at, sized};
use loopsight_core::{
    Channel, Derived, Parameter, Parameterization, Place, Plant, PlantMeta, Reads, Real, Role,
    Signal,
};

/// A pendulum with a fan or propeller at its end, which lifts it: an aeropendulum.
///
/// ```text
/// ω' = K (V + w) - D ω - A sin(φ - φ_0) + w_a        φ' = ω
/// ```
///
/// | symbol | what | unit |
/// |---|---|---|
/// | `ω`, `φ` | speed and angle of the pendulum | rad/s, rad |
/// | `φ_0` | angle at which it hangs | rad |
/// | `V` | voltage on the fan's motor | V |
/// | `w` | effort at the pivot, as the voltage that would lift as much | V |
/// | `w_a` | acceleration added to the pendulum | rad/s² |
///
/// From the moment of inertia `I` about the pivot, the mass `m` whose centre is `l` from the pivot, the thrust
/// `c` per volt at the distance `r` from the pivot and the viscous friction `f`:
///
/// ```text
/// K = c r/I        D = f/I        A = m g l/I
/// ```
///
/// Voltage and motion determine `K`, `D` and `A`; of the parts those that are marked so must be measured.
///
/// Thrust in proportion to the voltage is the plain model. A fan's thrust goes with the square of its speed
/// (`input_power` at `fan`, exponent about 2), and the fan takes its time (`actuator_lag` at `fan`); dry friction
/// of the pivot is `coulomb_friction` at `joint`.
///
/// Assumptions: a rigid pendulum in a vertical plane, thrust across it, a fan without gyroscopic
/// moment.
///
/// Reference: E. T. Enikov, G. Campa (2012), "Mechatronic Aeropendulum: Demonstration of Linear and Nonlinear
/// Feedback Control Principles With MATLAB/Simulink Real-Time Windows Target", IEEE Transactions on Education
/// 55(4), 538–545: the equation of motion of the driven pendulum.
#[derive(Clone, Copy, Debug)]
pub struct PropellerPendulum;

/// Standard gravity, m/s².
const GRAVITY: f64 = 9.806_65;

const HANGS: Parameter = Parameter::new(
    "hang_angle",
    "φ_0",
    "rad",
    "angle of the encoder at which the pendulum hangs",
)
.or(0.0)
.known()
.nonlinear();

const LUMPED: [Parameter; 4] = [
    Parameter::new("drive", "K", "rad/s^2/V", "acceleration per volt").nonzero(),
    Parameter::new("damping", "D", "1/s", "viscous friction over inertia")
        .within(0.0, f64::INFINITY),
    Parameter::new(
        "gravity_stiffness",
        "A",
        "rad/s^2",
        "acceleration by gravity of the level pendulum: square of the frequency of small swings",
    )
    .within(0.0, f64::INFINITY),
    HANGS,
];

const PHYSICAL: [Parameter; 7] = [
    Parameter::new(
        "inertia",
        "I",
        "kg m^2",
        "moment of inertia about the pivot",
    )
    .above(0.0)
    .nonlinear()
    .scaled(0.01),
    Parameter::new("mass", "m", "kg", "mass of pendulum and fan")
        .within(0.0, f64::INFINITY)
        .known()
        .nonlinear()
        .scaled(0.1),
    Parameter::new(
        "centre_of_mass",
        "l",
        "m",
        "distance of the centre of mass from the pivot",
    )
    .within(0.0, f64::INFINITY)
    .known()
    .nonlinear()
    .scaled(0.1),
    Parameter::new("fan_arm", "r", "m", "distance of the fan from the pivot")
        .above(0.0)
        .known()
        .nonlinear()
        .scaled(0.1),
    Parameter::new("thrust", "c", "N/V", "thrust per volt")
        .nonlinear()
        .scaled(0.1),
    Parameter::new(
        "viscous_friction",
        "f",
        "N m s/rad",
        "viscous friction of the pivot and in the air",
    )
    .within(0.0, f64::INFINITY)
    .or(0.0)
    .nonlinear()
    .scaled(0.01),
    HANGS,
];

const JOINT: [Reads; 5] = [
    Reads(Role::Flow, "speed"),
    Reads(Role::Position, "angle"),
    Reads(Role::Drive, "voltage"),
    Reads(Role::Shaft, "angle"),
    Reads(Role::Gravity, "gravity"),
];
/// The fan is somewhere else than the pivot: what it has to do is known by its voltage alone.
const FAN: [Reads; 1] = [Reads(Role::Drive, "voltage")];

const CHANNELS: [Channel; 6] = [
    at(
        Place::Effort(0),
        [
            "joint",
            "V",
            "V -> V + w",
            "the pivot; efforts as the voltage that would lift as much",
        ],
        &JOINT,
    ),
    at(
        Place::Effort(1),
        [
            "load",
            "rad/s^2",
            "ω' -> ω' + w",
            "the pendulum; efforts as angular acceleration",
        ],
        &JOINT,
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
    at(
        Place::Input(0),
        [
            "fan",
            "V",
            "V -> V + w(V)",
            "between the commanded voltage and the one that lifts",
        ],
        &FAN,
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
    sized(
        0.1,
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
    ),
];

impl Plant for PropellerPendulum {
    const META: PlantMeta = PlantMeta {
        id: "propeller_pendulum",
        summary: "a pendulum that a fan lifts",
        equation: "ω' = K V - D ω - A sin(φ - φ_0);  φ' = ω",
        reference: "Enikov, Campa (2012), Mechatronic Aeropendulum, IEEE Transactions on Education 55(4), 538-545",
        assumptions: "a rigid pendulum in a vertical plane, thrust across it in proportion to the voltage",
        example: "[plant.propeller_pendulum]\ndrive = 3.0               # rad/s²/V\ndamping = 0.8             # 1/s\ngravity_stiffness = 24.5  # rad/s²\n",
        states: &[
            Signal::new("speed", "ω", "rad/s", "speed of the pendulum"),
            Signal::new("angle", "φ", "rad", "angle of the pendulum"),
        ],
        inputs: &[Signal::new("voltage", "V", "V", "voltage on the fan")],
        outputs: &[Signal::new(
            "gravity",
            "g_φ",
            "rad/s^2",
            "acceleration by gravity at this angle",
        )],
        integrals: &[("speed", "angle")],
        channels: &CHANNELS,
        parameters: &LUMPED,
        parameterizations: &[Parameterization {
            id: "physical",
            summary: "inertia, mass, lengths and thrust",
            parameters: &PHYSICAL,
        }],
        controlled: &[0],
    };

    const DERIVED: &'static [Derived] = &[
        Derived::new(
            "swing_frequency",
            "rad/s",
            "sqrt(A)",
            "angular frequency of small swings",
        ),
        Derived::new(
            "level_voltage",
            "V",
            "A/K",
            "voltage that holds the pendulum level",
        ),
    ];

    fn derivative<S: Real>(x: &[S; 2], u: &[S; 1], w: &[S; 2], p: &[S; 4]) -> [S; 2] {
        let lift = p[0] * (u[0] + w[0]);
        [lift - p[1] * x[0] + gravity(x, p) + w[1], x[0]]
    }

    fn output<S: Real>(_index: usize, x: &[S; 2], _u: &[S; 1], p: &[S; 4]) -> S {
        gravity(x, p)
    }

    fn lower<S: Real>(set: usize, from: &[S]) -> Option<[S; 4]> {
        if set != 0 {
            return None;
        }
        let [inertia, mass, centre, arm, thrust, friction, hangs] =
            *<&[S; 7]>::try_from(from).ok()?;
        Some([
            thrust * arm / inertia,
            friction / inertia,
            S::of(GRAVITY) * mass * centre / inertia,
            hangs,
        ])
    }

    fn derived<S: Real>(index: usize, p: &[S; 4]) -> S {
        match index {
            // The root has no derivative at zero.
            0 if p[2] > S::zero() => p[2].sqrt(),
            1 if p[0].abs() > S::of(1e-9) => p[2] / p[0],
            _ => S::zero(),
        }
    }
}

/// Acceleration by gravity.
fn gravity<S: Real>(x: &[S; 2], p: &[S; 4]) -> S {
    -p[2] * (x[1] - p[3]).sin()
}

declare_plant!(PropellerPendulum, "propeller_pendulum");

#[cfg(test)]
mod tests {
    use loopsight_core::rk4_step;

    use super::*;

    /// I, m, l, r, c, f, φ_0
    const PARTS: [f64; 7] = [0.02, 0.2, 0.25, 0.3, 0.2, 0.0, 0.1];

    fn lumped(friction: f64) -> [f64; 4] {
        let mut parts = PARTS;
        parts[5] = friction;
        PropellerPendulum::lower(0, &parts).unwrap()
    }

    fn run(x: &mut [f64; 2], volts: f64, p: &[f64; 4], seconds: f64) {
        let h = 1e-4;
        for _ in 0..(seconds / h).round() as usize {
            rk4_step(x, h, |x| {
                PropellerPendulum::derivative(x, &[volts], &[0.0; 2], p)
            });
        }
    }

    /// J
    fn energy(x: &[f64; 2]) -> f64 {
        let [inertia, mass, centre, ..] = PARTS;
        0.5 * inertia * x[0] * x[0] - mass * GRAVITY * centre * (x[1] - PARTS[6]).cos()
    }

    #[test]
    fn energy_is_kept_or_falls_without_thrust() {
        let start = [3.0, 1.0];
        let mut x = start;
        run(&mut x, 0.0, &lumped(0.0), 3.0);
        assert!((energy(&x) - energy(&start)).abs() < 1e-9);
        let (mut x, p) = (start, lumped(0.01));
        for _ in 0..20 {
            let before = energy(&x);
            run(&mut x, 0.0, &p, 0.1);
            assert!(energy(&x) < before);
        }
    }

    /// It comes to rest where the torque of the thrust is that of the weight.
    #[test]
    fn thrust_holds_it_where_it_balances_the_weight() {
        let p = lumped(0.05);
        let [_, mass, centre, arm, thrust, _, hangs] = PARTS;
        for volts in [0.0, 4.0, -4.0] {
            let mut x = [0.0; 2];
            run(&mut x, volts, &p, 30.0);
            let weight = mass * GRAVITY * centre * (x[1] - hangs).sin();
            assert!((thrust * volts * arm - weight).abs() < 1e-9, "{x:?}");
        }
        let level: f64 = PropellerPendulum::derived(1, &p);
        let x = [0.0, hangs + core::f64::consts::FRAC_PI_2];
        let rates = PropellerPendulum::derivative(&x, &[level], &[0.0; 2], &p);
        assert!(rates[0].abs() < 1e-12);
    }

    /// Small swings have the frequency `√(m g l/I)`, and the mirrored pendulum does the same.
    #[test]
    fn small_swings_have_their_frequency() {
        let p = lumped(0.0);
        let frequency: f64 = PropellerPendulum::derived(0, &p);
        let [inertia, mass, centre, ..] = PARTS;
        assert!((frequency - (mass * GRAVITY * centre / inertia).sqrt()).abs() < 1e-12);
        let (mut x, mut y) = ([0.0, 0.1 + 1e-4], [0.0, 0.1 - 1e-4]);
        let period = core::f64::consts::TAU / frequency;
        let h = period / 2000.0;
        for _ in 0..2000 {
            for x in [&mut x, &mut y] {
                rk4_step(x, h, |x| {
                    PropellerPendulum::derivative(x, &[0.0], &[0.0; 2], &p)
                });
            }
        }
        assert!((x[1] - 0.1 - 1e-4).abs() < 1e-11 && x[0].abs() < 1e-9);
        assert!((x[1] + y[1] - 0.2).abs() < 1e-15 && (x[0] + y[0]).abs() < 1e-15);
    }
}
