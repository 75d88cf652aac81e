//! A pole on a cart.

use crate::declare_plant;
use loopsight_core::{
    Channel, Parameter, Parameterization, Place, Plant, PlantMeta, Reads, Real, Role, Signal,
};

/// A pole that turns freely on a cart: the inverted pendulum, or a crane.
///
/// ```text
/// M p'' + b cos(θ) θ'' = F + w_c + b sin(θ) θ'²        p' = v
/// b cos(θ) p'' + J θ'' = w_p + b g sin(θ)              θ' = q
/// ```
///
/// | symbol | what | unit |
/// |---|---|---|
/// | `p`, `v` | position and velocity of the cart | m, m/s |
/// | `θ`, `q` | angle of the pole from upright, positive where it leans towards positive `p`, and its rate | rad, rad/s |
/// | `F` | force on the cart | N |
/// | `w_c`, `w_p` | force added to the cart, torque added to the pole | N, N m |
/// | `M` | mass of cart and pole | kg |
/// | `b` | first moment of the pole: its mass times the distance of its centre from the pivot | kg m |
/// | `J` | moment of inertia of the pole about the pivot | kg m² |
/// | `g` | gravity | m/s² |
///
/// Upright it falls with the rate `λ = (b g/(J - b²/M))^½`, hanging (`θ = π`) it swings with that
/// angular frequency. From force and motion these three numbers are all that can be found: with the
/// mass `m` of the pole, the distance `l` of its centre from the pivot and its moment of inertia
/// `I` about that centre,
///
/// ```text
/// M = m_cart + m        b = m l        J = I + m l²
/// ```
///
/// and for a uniform rod of length `L`, `l = L/2` and `I = m L²/12`.
///
/// Assumptions: rigid pole, level rail, no friction; friction of the wheels is an effect on `cart`,
/// that of the pivot one on `pole`.
///
/// Reference: R. V. Florian (2007), "Correct equations for the dynamics of the cart-pole system",
/// Center for Cognitive and Neural Studies, equations (23) and (24), there solved for `θ''` and
/// `p''` of a uniform rod.
#[derive(Clone, Copy, Debug)]
pub struct CartPole;

const LUMPED: [Parameter; 4] = [
    Parameter::new("total_mass", "M", "kg", "mass of cart and pole")
        .above(0.0)
        .nonlinear(),
    Parameter::new(
        "pole_moment",
        "b",
        "kg m",
        "mass of the pole times the distance of its centre from the pivot",
    )
    .above(0.0)
    .nonlinear()
    .scaled(0.1),
    Parameter::new(
        "pole_inertia",
        "J",
        "kg m^2",
        "moment of inertia of the pole about the pivot",
    )
    .above(0.0)
    .nonlinear()
    .scaled(0.1),
    GRAVITY,
];

const GRAVITY: Parameter = Parameter::new("gravity", "g", "m/s^2", "gravity")
    .within(0.0, f64::INFINITY)
    .or(9.81)
    .known()
    .nonlinear();

const CART_MASS: Parameter = Parameter::new("cart_mass", "m_cart", "kg", "mass of the cart")
    .above(0.0)
    .nonlinear();

const POLE_MASS: Parameter = Parameter::new("pole_mass", "m", "kg", "mass of the pole")
    .above(0.0)
    .nonlinear()
    .scaled(0.1);

const PHYSICAL: [Parameter; 5] = [
    CART_MASS,
    POLE_MASS,
    Parameter::new(
        "pole_centre",
        "l",
        "m",
        "distance of the pole's centre of mass from the pivot",
    )
    .above(0.0)
    .nonlinear()
    .scaled(0.1),
    Parameter::new(
        "pole_inertia_at_centre",
        "I",
        "kg m^2",
        "moment of inertia of the pole about its centre of mass; 0 for a small weight on a light pole",
    )
    .within(0.0, f64::INFINITY)
    .or(0.0)
    .known()
    .nonlinear()
    .scaled(0.1),
    GRAVITY,
];

const ROD: [Parameter; 4] = [
    CART_MASS,
    POLE_MASS,
    Parameter::new("pole_length", "L", "m", "length of the pole from the pivot")
        .above(0.0)
        .nonlinear()
        .scaled(0.1),
    GRAVITY,
];

const CART: [Reads; 3] = [
    Reads(Role::Flow, "velocity"),
    Reads(Role::Position, "position"),
    Reads(Role::Drive, "force"),
];
const POLE: [Reads; 2] = [Reads(Role::Flow, "rate"), Reads(Role::Position, "angle")];

const CHANNELS: [Channel; 9] = [
    Channel {
        id: "cart",
        place: Place::Effort(0),
        unit: "N",
        equation: "F -> F + w",
        reads: &CART,
        side: 0,
        size: 1.0,
        doc: "the cart on its rail; efforts as forces",
    },
    Channel {
        id: "pole",
        place: Place::Effort(1),
        unit: "N m",
        equation: "b cos(θ) p'' + J θ'' = b g sin(θ) + w",
        reads: &POLE,
        side: 0,
        size: 0.1,
        doc: "the pole at its pivot; efforts as torques",
    },
    Channel {
        id: "mass",
        place: Place::Rate(1),
        unit: "m/s^2",
        equation: "v' -> v' + w(v')",
        reads: &CART,
        side: 0,
        size: 1.0,
        doc: "the acceleration of the cart: where mass acts",
    },
    Channel {
        id: "inertia",
        place: Place::Rate(3),
        unit: "rad/s^2",
        equation: "q' -> q' + w(q')",
        reads: &POLE,
        side: 0,
        size: 1.0,
        doc: "the angular acceleration of the pole: where its inertia acts",
    },
    Channel {
        id: "input",
        place: Place::Input(0),
        unit: "N",
        equation: "F -> F + w(F)",
        reads: &CART,
        side: 0,
        size: 1.0,
        doc: "between the commanded and the effective force",
    },
    Channel {
        id: "sensor.position",
        place: Place::Output(0),
        unit: "m",
        equation: "p_measured = p + w",
        reads: &CART,
        side: 0,
        size: 0.1,
        doc: "measurement of the cart's position",
    },
    Channel {
        id: "sensor.velocity",
        place: Place::Output(1),
        unit: "m/s",
        equation: "v_measured = v + w",
        reads: &CART,
        side: 0,
        size: 0.1,
        doc: "measurement of the cart's velocity",
    },
    Channel {
        id: "sensor.angle",
        place: Place::Output(2),
        unit: "rad",
        equation: "θ_measured = θ + w",
        reads: &POLE,
        side: 0,
        size: 0.1,
        doc: "measurement of the pole's angle",
    },
    Channel {
        id: "sensor.rate",
        place: Place::Output(3),
        unit: "rad/s",
        equation: "q_measured = q + w",
        reads: &POLE,
        side: 0,
        size: 1.0,
        doc: "measurement of the pole's rate",
    },
];

impl Plant for CartPole {
    const META: PlantMeta = PlantMeta {
        id: "cart_pole",
        summary: "a pole that turns freely on a cart: inverted pendulum or crane",
        equation: "M p'' + b cos(θ) θ'' = F + b sin(θ) θ'^2;  b cos(θ) p'' + J θ'' = b g sin(θ)",
        reference: "Florian (2007), Correct equations for the dynamics of the cart-pole system, Center for Cognitive and Neural Studies, equations (23), (24)",
        assumptions: "rigid pole, level rail, no friction",
        example: "[plant.cart_pole]\ntotal_mass = 1.2        # kg, cart and pole\npole_moment = 0.06      # kg m, mass of the pole times the way to its centre\npole_inertia = 0.024    # kg m², about the pivot\n",
        states: &[
            Signal::new("position", "p", "m", "position of the cart"),
            Signal::new("velocity", "v", "m/s", "velocity of the cart"),
            Signal::new("angle", "θ", "rad", "angle of the pole from upright"),
            Signal::new("rate", "q", "rad/s", "angular rate of the pole"),
        ],
        inputs: &[Signal::new("force", "F", "N", "force on the cart")],
        outputs: &[],
        integrals: &[("velocity", "position"), ("rate", "angle")],
        channels: &CHANNELS,
        parameters: &LUMPED,
        parameterizations: &[
            Parameterization {
                id: "physical",
                summary: "masses, centre and inertia of cart and pole",
                parameters: &PHYSICAL,
            },
            Parameterization {
                id: "rod",
                summary: "a cart and a uniform rod",
                parameters: &ROD,
            },
        ],
        controlled: &[],
    };

    fn derivative<S: Real>(x: &[S; 4], u: &[S; 1], w: &[S; 2], p: &[S; 4]) -> [S; 4] {
        let [_, velocity, angle, rate] = *x;
        let [mass, moment, inertia, gravity] = *p;
        let (sin, cos) = (angle.sin(), angle.cos());
        // The mass matrix [M, b cos; b cos, J] times the accelerations is:
        let on_cart = u[0] + w[0] + moment * sin * rate * rate;
        let on_pole = w[1] + moment * gravity * sin;
        let coupling = moment * cos;
        let determinant = mass * inertia - coupling * coupling;
        [
            velocity,
            (inertia * on_cart - coupling * on_pole) / determinant,
            rate,
            (mass * on_pole - coupling * on_cart) / determinant,
        ]
    }

    fn output<S: Real>(_index: usize, _x: &[S; 4], _u: &[S; 1], _p: &[S; 4]) -> S {
        S::zero()
    }

    fn lower<S: Real>(set: usize, from: &[S]) -> Option<[S; 4]> {
        match set {
            0 => {
                let [cart, pole, centre, inertia, gravity] = *<&[S; 5]>::try_from(from).ok()?;
                let moment = pole * centre;
                Some([cart + pole, moment, inertia + moment * centre, gravity])
            }
            1 => {
                let [cart, pole, length, gravity] = *<&[S; 4]>::try_from(from).ok()?;
                let moment = pole * length * S::of(0.5);
                let inertia = pole * length * length * S::of(1.0 / 3.0);
                Some([cart + pole, moment, inertia, gravity])
            }
            _ => None,
        }
    }
}

declare_plant!(CartPole, "cart_pole");

#[cfg(test)]
mod tests {
    use loopsight_core::rk4_step;

    use super::*;

    const P: [f64; 4] = [1.2, 0.06, 0.024, 9.81];

    fn energy(x: &[f64; 4]) -> f64 {
        let [_, v, angle, q] = *x;
        let [mass, moment, inertia, g] = P;
        0.5 * mass * v * v
            + moment * angle.cos() * v * q
            + 0.5 * inertia * q * q
            + moment * g * angle.cos()
    }

    fn run(x: &mut [f64; 4], force: f64, seconds: f64) {
        let h = 1e-4;
        for _ in 0..(seconds / h).round() as usize {
            rk4_step(x, h, |x| CartPole::derivative(x, &[force], &[0.0; 2], &P));
        }
    }

    #[test]
    fn energy_is_conserved_without_friction_and_input() {
        let mut x = [0.1, 0.4, 0.3, -0.2];
        let before = energy(&x);
        // It falls over, swings through and comes up again, several times.
        let mut lowest = f64::INFINITY;
        for _ in 0..100 {
            run(&mut x, 0.0, 0.1);
            lowest = lowest.min(x[2].cos());
            assert!((energy(&x) - before).abs() < 1e-9 * before, "{x:?}");
        }
        assert!(lowest < -0.9);
    }

    #[test]
    fn momentum_grows_by_the_impulse_of_the_force() {
        let mut x = [0.0, 0.0, 0.7, 0.0];
        run(&mut x, 1.5, 2.0);
        let momentum = P[0] * x[1] + P[1] * x[2].cos() * x[3];
        assert!((momentum - 3.0).abs() < 1e-9, "{momentum}");
    }

    #[test]
    fn a_small_angle_grows_with_the_unstable_pole() {
        let [mass, moment, inertia, g] = P;
        let lambda = (moment * g / (inertia - moment * moment / mass)).sqrt();
        // On the unstable direction: the cart gives way so that the momentum stays zero.
        let small = 1e-6;
        let mut x = [
            -moment / mass * small,
            -moment / mass * small * lambda,
            small,
            small * lambda,
        ];
        run(&mut x, 0.0, 1.0);
        let grown = (x[2] / small).ln();
        assert!((grown - lambda).abs() < 1e-6 * lambda, "{grown} {lambda}");
    }

    /// Florian's equations (23) and (24), for a uniform rod of half length `l`.
    #[test]
    fn a_rod_obeys_the_published_equations() {
        let (m_c, m_p, length, g) = (1.1, 0.15, 0.8, 9.81);
        let p = CartPole::lower(1, &[m_c, m_p, length, g]).unwrap();
        let (angle, rate, force) = (0.4f64, -1.3f64, 2.1);
        let (l, total) = (0.5 * length, m_c + m_p);
        let (sin, cos) = angle.sin_cos();
        let turning = (g * sin + cos * (-force - m_p * l * rate * rate * sin) / total)
            / (l * (4.0 / 3.0 - m_p * cos * cos / total));
        let moving = (force + m_p * l * (rate * rate * sin - turning * cos)) / total;
        let got = CartPole::derivative(&[0.0, 0.2, angle, rate], &[force], &[0.0; 2], &p);
        assert!((got[1] - moving).abs() < 1e-12 && (got[3] - turning).abs() < 1e-12);
        let inertia = m_p * length * length / 12.0;
        assert_eq!(
            CartPole::lower(0, &[m_c, m_p, l, inertia, g]).map(|q| (q[2] - p[2]).abs() < 1e-15),
            Some(true)
        );
    }
}
