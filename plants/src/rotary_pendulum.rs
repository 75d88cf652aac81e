//! A pendulum on a turning arm.

use crate::declare_plant;
use crate::places::{at, sized};
use loopsight_core::{
    Channel, Derived, Parameter, Parameterization, Place, Plant, PlantMeta, Reads, Real, Role,
    Signal,
};

/// A pendulum that swings freely at the end of an arm, which a motor turns about the vertical: Furuta's
/// pendulum.
///
/// ```text
/// (J_0 + J_2 sin²θ) α'' + P cos(θ) θ'' = u + w_a - d_a α' + P sin(θ) θ'² - J_2 sin(2θ) α' θ'
/// P cos(θ) α'' + J_2 θ'' = w_p - d_p θ' + ½ J_2 sin(2θ) α'² - g b sin(θ)
/// ```
///
/// | symbol | what | unit |
/// |---|---|---|
/// | `α` | angle of the arm | rad |
/// | `θ` | angle of the pendulum, 0 where it hangs | rad |
/// | `u` | torque on the arm | N m |
/// | `w_a`, `w_p` | torque added to the arm, to the pendulum at its pivot | N m |
/// | `J_0` | moment of inertia of the arm with the pendulum's mass at its end | kg m² |
/// | `J_2` | moment of inertia of the pendulum about its pivot | kg m² |
/// | `P` | coupling: mass of the pendulum times length of the arm times distance of its centre from the pivot | kg m² |
/// | `b` | first moment of the pendulum: its mass times the distance of its centre from the pivot | kg m |
/// | `d_a`, `d_p` | viscous friction of arm and pivot | N m s/rad |
/// | `g` | gravity | m/s² |
///
/// With the arm's length `L_1` and moment of inertia `J_1` about the axis (motor included), the pendulum's mass
/// `m_2`, the distance `l_2` of its centre from the pivot and its moment of inertia `I_2` about that centre:
///
/// ```text
/// J_0 = J_1 + m_2 L_1²      J_2 = I_2 + m_2 l_2²      P = m_2 L_1 l_2      b = m_2 l_2
/// ```
///
/// Torque and motion determine the six numbers above; masses and lengths follow from them with `L_1` measured.
/// Hanging, with the arm held, it swings with `√(g b/J_2)`, and with the arm free faster.
///
/// A motor on a voltage is the same with `u = (K_T/R_a) V` (`scale` and `scale_unit` of the log) and its back-emf
/// in `d_a`. Dry friction is an effect at `arm` or `pendulum`.
///
/// Assumptions: a rigid arm that turns in a level plane, a pendulum thin enough that turning about its own
/// length takes nothing.
///
/// Reference: B. S. Cazzolato, Z. Prime (2011), "On the Dynamics of the Furuta Pendulum", Journal of Control
/// Science and Engineering, 528341, section 3, the equations of motion for long, slender arms; their `θ_1` is
/// `α` and their `θ_2` is `θ`.
#[derive(Clone, Copy, Debug)]
pub struct RotaryPendulum;

const GRAVITY: Parameter = Parameter::new("gravity", "g", "m/s^2", "gravity")
    .within(0.0, f64::INFINITY)
    .or(9.81)
    .known()
    .nonlinear();

const fn positive([id, symbol, unit, doc]: [&'static str; 4], scale: f64) -> Parameter {
    Parameter::new(id, symbol, unit, doc)
        .above(0.0)
        .nonlinear()
        .scaled(scale)
}

const fn viscous(id: &'static str, symbol: &'static str, doc: &'static str) -> Parameter {
    Parameter::new(id, symbol, "N m s/rad", doc)
        .within(0.0, f64::INFINITY)
        .or(0.0)
        .nonlinear()
        .scaled(1e-4)
}

const ARM_FRICTION: Parameter = viscous("arm_friction", "d_a", "viscous friction of the arm");
const PIVOT_FRICTION: Parameter = viscous("pivot_friction", "d_p", "viscous friction of the pivot");

const LUMPED: [Parameter; 7] = [
    positive(
        [
            "arm_inertia",
            "J_0",
            "kg m^2",
            "moment of inertia of the arm with the pendulum's mass at its end",
        ],
        1e-3,
    ),
    positive(
        [
            "pendulum_inertia",
            "J_2",
            "kg m^2",
            "moment of inertia of the pendulum about its pivot",
        ],
        1e-3,
    ),
    positive(
        [
            "coupling",
            "P",
            "kg m^2",
            "mass of the pendulum times length of the arm times distance of its centre from the pivot",
        ],
        1e-3,
    ),
    positive(
        [
            "pendulum_moment",
            "b",
            "kg m",
            "mass of the pendulum times the distance of its centre from the pivot",
        ],
        0.01,
    ),
    ARM_FRICTION,
    PIVOT_FRICTION,
    GRAVITY,
];

const PHYSICAL: [Parameter; 8] = [
    positive(
        [
            "arm_inertia_alone",
            "J_1",
            "kg m^2",
            "moment of inertia of arm and motor about the axis",
        ],
        1e-3,
    ),
    positive(
        [
            "arm_length",
            "L_1",
            "m",
            "distance of the pivot from the axis",
        ],
        0.1,
    )
    .known(),
    positive(["pendulum_mass", "m_2", "kg", "mass of the pendulum"], 0.1),
    positive(
        [
            "pendulum_centre",
            "l_2",
            "m",
            "distance of the pendulum's centre of mass from the pivot",
        ],
        0.1,
    ),
    Parameter::new(
        "pendulum_inertia_at_centre",
        "I_2",
        "kg m^2",
        "moment of inertia of the pendulum about its centre of mass; m L²/12 of a rod of length L",
    )
    .within(0.0, f64::INFINITY)
    .nonlinear()
    .scaled(1e-3),
    ARM_FRICTION,
    PIVOT_FRICTION,
    GRAVITY,
];

const ARM: [Reads; 4] = [
    Reads(Role::Flow, "arm_speed"),
    Reads(Role::Position, "arm_angle"),
    Reads(Role::Drive, "torque"),
    Reads(Role::Shaft, "arm_angle"),
];
const PENDULUM: [Reads; 4] = [
    Reads(Role::Flow, "pendulum_speed"),
    Reads(Role::Position, "pendulum_angle"),
    Reads(Role::Shaft, "pendulum_angle"),
    Reads(Role::Gravity, "gravity"),
];

const fn arm(place: Place, words: [&'static str; 4]) -> Channel {
    at(place, words, &ARM)
}

const fn pendulum(place: Place, words: [&'static str; 4]) -> Channel {
    at(place, words, &PENDULUM)
}

const CHANNELS: [Channel; 9] = [
    sized(
        0.01,
        arm(
            Place::Effort(0),
            [
                "arm",
                "N m",
                "u -> u + w",
                "the arm; efforts are torques on it",
            ],
        ),
    ),
    sized(
        0.01,
        pendulum(
            Place::Effort(1),
            [
                "pendulum",
                "N m",
                "P cos(θ) α'' + J_2 θ'' = … + w",
                "the pendulum at its pivot; efforts are torques",
            ],
        ),
    ),
    arm(
        Place::Rate(0),
        [
            "inertia.arm",
            "rad/s^2",
            "α'' -> α'' + w(α'')",
            "the acceleration of the arm: where its inertia acts",
        ],
    ),
    pendulum(
        Place::Rate(2),
        [
            "inertia.pendulum",
            "rad/s^2",
            "θ'' -> θ'' + w(θ'')",
            "the acceleration of the pendulum: where its inertia acts",
        ],
    ),
    sized(
        0.01,
        arm(
            Place::Input(0),
            [
                "input",
                "N m",
                "u -> u + w(u)",
                "between the commanded and the effective torque",
            ],
        ),
    ),
    arm(
        Place::Output(0),
        [
            "sensor.arm_speed",
            "rad/s",
            "α' measured = α' + w",
            "measurement of the arm's speed",
        ],
    ),
    arm(
        Place::Output(1),
        [
            "sensor.arm_angle",
            "rad",
            "α measured = α + w",
            "measurement of the arm's angle",
        ],
    ),
    pendulum(
        Place::Output(2),
        [
            "sensor.pendulum_speed",
            "rad/s",
            "θ' measured = θ' + w",
            "measurement of the pendulum's speed",
        ],
    ),
    pendulum(
        Place::Output(3),
        [
            "sensor.pendulum_angle",
            "rad",
            "θ measured = θ + w",
            "measurement of the pendulum's angle",
        ],
    ),
];

impl Plant for RotaryPendulum {
    const META: PlantMeta = PlantMeta {
        id: "rotary_pendulum",
        summary: "a pendulum at the end of an arm that a motor turns (Furuta)",
        equation: "(J_0 + J_2 sin²θ) α'' + P cos(θ) θ'' = u - d_a α' + P sin(θ) θ'^2 - J_2 sin(2θ) α' θ';  P cos(θ) α'' + J_2 θ'' = -d_p θ' + 0.5 J_2 sin(2θ) α'^2 - g b sin(θ)",
        reference: "Cazzolato, Prime (2011), On the Dynamics of the Furuta Pendulum, Journal of Control Science and Engineering, 528341, section 3 (long, slender arms)",
        assumptions: "a rigid arm in a level plane, a thin rigid pendulum, viscous friction only",
        example: "[plant.rotary_pendulum]\narm_inertia = 0.004         # kg m², pendulum's mass at the end\npendulum_inertia = 0.002    # kg m², about the pivot\ncoupling = 0.002            # kg m²\npendulum_moment = 0.01      # kg m, mass times way to the centre\narm_friction = 0.002        # N m s/rad\npivot_friction = 0.0001     # N m s/rad\n",
        states: &[
            Signal::new("arm_speed", "α'", "rad/s", "speed of the arm"),
            Signal::new("arm_angle", "α", "rad", "angle of the arm"),
            Signal::new("pendulum_speed", "θ'", "rad/s", "speed of the pendulum"),
            Signal::new(
                "pendulum_angle",
                "θ",
                "rad",
                "angle of the pendulum from where it hangs",
            ),
        ],
        inputs: &[Signal::new("torque", "u", "N m", "torque on the arm").sized(0.01)],
        outputs: &[
            Signal::new("gravity", "g_θ", "N m", "torque of gravity on the pendulum").sized(0.1),
        ],
        integrals: &[
            ("arm_speed", "arm_angle"),
            ("pendulum_speed", "pendulum_angle"),
        ],
        channels: &CHANNELS,
        parameters: &LUMPED,
        parameterizations: &[Parameterization {
            id: "physical",
            summary: "inertias, masses and lengths of arm and pendulum",
            parameters: &PHYSICAL,
        }],
        controlled: &[],
    };

    const DERIVED: &'static [Derived] = &[Derived::new(
        "swing_frequency",
        "rad/s",
        "sqrt(g b/J_2)",
        "angular frequency of the hanging pendulum with the arm held",
    )];

    fn derivative<S: Real>(x: &[S; 4], u: &[S; 1], w: &[S; 2], p: &[S; 7]) -> [S; 4] {
        let [turning, _, swinging, angle] = *x;
        let [arm, pendulum, coupling, _, arm_friction, pivot_friction, _] = *p;
        let (sin, cos) = (angle.sin(), angle.cos());
        // J_2 sin θ cos θ, half of J_2 sin 2θ.
        let lift = pendulum * sin * cos;
        let on_arm = u[0] + w[0] - arm_friction * turning + coupling * sin * swinging * swinging
            - S::of(2.0) * lift * turning * swinging;
        let on_pendulum =
            w[1] - pivot_friction * swinging + lift * turning * turning + gravity(x, p);
        // The mass matrix [m_a, m_c; m_c, J_2] times the accelerations is what acts.
        let (m_a, m_c) = (arm + pendulum * sin * sin, coupling * cos);
        let determinant = m_a * pendulum - m_c * m_c;
        [
            (pendulum * on_arm - m_c * on_pendulum) / determinant,
            turning,
            (m_a * on_pendulum - m_c * on_arm) / determinant,
            swinging,
        ]
    }

    fn output<S: Real>(_index: usize, x: &[S; 4], _u: &[S; 1], p: &[S; 7]) -> S {
        gravity(x, p)
    }

    fn lower<S: Real>(set: usize, from: &[S]) -> Option<[S; 7]> {
        if set != 0 {
            return None;
        }
        let [
            arm,
            length,
            mass,
            centre,
            inertia,
            arm_friction,
            pivot_friction,
            gravity,
        ] = *<&[S; 8]>::try_from(from).ok()?;
        let moment = mass * centre;
        Some([
            arm + mass * length * length,
            inertia + moment * centre,
            moment * length,
            moment,
            arm_friction,
            pivot_friction,
            gravity,
        ])
    }

    fn derived<S: Real>(_index: usize, p: &[S; 7]) -> S {
        let square = p[6] * p[3] / p[1];
        // The root has no derivative at zero.
        if square > S::zero() {
            square.sqrt()
        } else {
            S::zero()
        }
    }
}

/// Torque of gravity on the pendulum.
fn gravity<S: Real>(x: &[S; 4], p: &[S; 7]) -> S {
    -p[6] * p[3] * x[3].sin()
}

declare_plant!(RotaryPendulum, "rotary_pendulum");

#[cfg(test)]
mod tests {
    use loopsight_core::rk4_step;

    use super::*;

    /// J_1, L_1, m_2, l_2, I_2, d_a, d_p, g
    const PARTS: [f64; 8] = [2e-3, 0.2, 0.06, 0.15, 5e-4, 0.0, 0.0, 9.81];

    fn lumped(frictions: [f64; 2]) -> [f64; 7] {
        let mut parts = PARTS;
        parts[5..7].copy_from_slice(&frictions);
        RotaryPendulum::lower(0, &parts).unwrap()
    }

    fn run(x: &mut [f64; 4], torque: f64, p: &[f64; 7], seconds: f64) {
        let h = 1e-4;
        for _ in 0..(seconds / h).round() as usize {
            rk4_step(x, h, |x| {
                RotaryPendulum::derivative(x, &[torque], &[0.0; 2], p)
            });
        }
    }

    /// Kinetic energy of the pendulum's centre from its velocity in space, and of turning about it.
    fn energy(x: &[f64; 4]) -> f64 {
        let [arm, length, mass, centre, inertia, _, _, g] = PARTS;
        let [turning, _, swinging, angle] = *x;
        let (sin, cos) = angle.sin_cos();
        // Along the arm, across it in the level plane, and up.
        let along = -centre * sin * turning;
        let across = length * turning + centre * cos * swinging;
        let up = centre * sin * swinging;
        let moving = mass * (along * along + across * across + up * up);
        let about = inertia * (swinging * swinging + (sin * turning).powi(2));
        0.5 * (arm * turning * turning + moving + about) - mass * g * centre * cos
    }

    #[test]
    fn energy_is_kept_without_friction_and_falls_with_it() {
        let start = [4.0, 0.0, -3.0, 2.5];
        let mut x = start;
        run(&mut x, 0.0, &lumped([0.0; 2]), 3.0);
        assert!((energy(&x) - energy(&start)).abs() < 1e-9, "{x:?}");
        let (mut x, p) = (start, lumped([1e-3, 1e-4]));
        for _ in 0..20 {
            let before = energy(&x);
            run(&mut x, 0.0, &p, 0.1);
            assert!(energy(&x) < before);
        }
    }

    /// About the axis nothing acts but the torque: the momentum there is its impulse.
    #[test]
    fn the_torque_changes_the_momentum_about_the_axis() {
        let p = lumped([0.0; 2]);
        let mut x = [0.0, 0.0, 0.0, 1.0];
        run(&mut x, 0.02, &p, 1.3);
        let (sin, cos) = x[3].sin_cos();
        let momentum = (p[0] + p[1] * sin * sin) * x[0] + p[2] * cos * x[2];
        assert!((momentum - 0.026).abs() < 1e-9, "{momentum}");
    }

    /// Hanging and upright it rests, wherever the arm is; a small swing of the free arm has the frequency of
    /// the two together.
    #[test]
    fn it_rests_where_it_hangs_and_swings_about_it() {
        let p = lumped([0.0; 2]);
        for angle in [0.0, core::f64::consts::PI] {
            let x = [0.0, 0.7, 0.0, angle];
            let rates = RotaryPendulum::derivative(&x, &[0.0], &[0.0; 2], &p);
            assert!(rates.iter().all(|r| r.abs() < 1e-12), "{rates:?}");
        }
        let faster = (p[6] * p[3] * p[0] / (p[0] * p[1] - p[2] * p[2])).sqrt();
        let held: f64 = RotaryPendulum::derived(0, &p);
        assert!(faster > held && (held * held - p[6] * p[3] / p[1]).abs() < 1e-9);
        let start = [0.0, -p[2] / p[0] * 1e-4, 0.0, 1e-4];
        let mut x = start;
        let steps = 2000;
        let h = core::f64::consts::TAU / faster / f64::from(steps);
        for _ in 0..steps {
            rk4_step(&mut x, h, |x| {
                RotaryPendulum::derivative(x, &[0.0], &[0.0; 2], &p)
            });
        }
        for (x, s) in x.iter().zip(start) {
            assert!((x - s).abs() < 1e-9, "{x} {s}");
        }
    }

    /// Mirrored, everything goes the other way; turned about the vertical, nothing changes.
    #[test]
    fn it_is_symmetric() {
        let p = lumped([1e-3, 1e-4]);
        let x = [2.0, 0.3, -1.0, 0.8];
        let rates = RotaryPendulum::derivative(&x, &[0.01], &[0.002, 0.001], &p);
        let mirrored = RotaryPendulum::derivative(&x.map(|x| -x), &[-0.01], &[-0.002, -0.001], &p);
        for (a, b) in rates.iter().zip(mirrored) {
            assert!((a + b).abs() < 1e-12);
        }
        let turned = [2.0, 1.9, -1.0, 0.8];
        let again = RotaryPendulum::derivative(&turned, &[0.01], &[0.002, 0.001], &p);
        assert_eq!(rates, again);
    }
}
