//! Two tanks, one above the other.

use crate::declare_plant;
use loopsight_core::{
    Channel, Derived, Parameter, Parameterization, Place, Plant, PlantMeta, Reads, Real, Role,
    Signal,
};

/// Two tanks in cascade: a pump fills the upper one, which runs out into the lower one.
///
/// ```text
/// h'_1 = b u - c_1 f(h_1 + w_3) + w_1                  f(h) = √(2 g h)
/// h'_2 = c_2 f(h_1 + w_3) - c_3 f(h_2 + w_4) + w_2
/// ```
///
/// | symbol | what | unit |
/// |---|---|---|
/// | `h_1`, `h_2` | level of the upper and the lower tank | m |
/// | `u` | voltage of the pump | V |
/// | `b` | how fast the upper level rises per volt | m/s/V |
/// | `c_1`, `c_2`, `c_3` | outlet over tank: `a_1/A_1`, `a_1/A_2`, `a_2/A_2` | 1 |
/// | `w_1`, `w_2` | what else fills a tank, as the rate of its level | m/s |
/// | `w_3`, `w_4` | what else presses on an outlet, as head | m |
///
/// With the areas `A` of the tanks, effective areas `a` of the outlets (discharge coefficient
/// included) and the flow `K` of the pump per volt, `b = K/A_1`.
///
/// Torricelli's law `√(2 g h)` has no derivative in an empty tank. There it is made smooth, as the flow of
/// a film is slow: `f(h) = √(2 g) h/(h² + h_0²)^¼` with `h_0` = 0.1 mm, which differs by `(h_0/h)²/4`,
/// 2.5e-5 at 1 cm.
///
/// Assumptions: prismatic tanks that do not overflow (that is an effect, `overflow`), outlets that are short; a pump
/// without dynamics.
///
/// Reference: M. Schoukens, J. P. Noël (2017), "Three benchmarks addressing open challenges in
/// nonlinear system identification", IFAC PapersOnLine 50-1, 446–451, section 3, cascaded tanks.
#[derive(Clone, Copy, Debug)]
pub struct TankPair;

/// Standard gravity, m/s².
const GRAVITY: f64 = 9.806_65;
/// Head below which an outlet only drips, m.
const FILM: f64 = 1e-4;

const LUMPED: [Parameter; 4] = [
    Parameter::new(
        "pump",
        "b",
        "m/s/V",
        "rise of the upper level per volt of the pump",
    )
    .scaled(1e-3),
    Parameter::new(
        "outlet_upper",
        "c_1",
        "1",
        "outlet of the upper tank over the area of that tank",
    )
    .within(0.0, f64::INFINITY)
    .scaled(1e-3),
    Parameter::new(
        "inlet_lower",
        "c_2",
        "1",
        "outlet of the upper tank over the area of the lower tank",
    )
    .within(0.0, f64::INFINITY)
    .scaled(1e-3),
    Parameter::new(
        "outlet_lower",
        "c_3",
        "1",
        "outlet of the lower tank over the area of that tank",
    )
    .within(0.0, f64::INFINITY)
    .scaled(1e-3),
];

const PHYSICAL: [Parameter; 5] = [
    Parameter::new("area_upper", "A_1", "m^2", "area of the upper tank")
        .above(0.0)
        .known()
        .nonlinear()
        .scaled(0.01),
    Parameter::new("area_lower", "A_2", "m^2", "area of the lower tank")
        .above(0.0)
        .known()
        .nonlinear()
        .scaled(0.01),
    Parameter::new(
        "hole_upper",
        "a_1",
        "m^2",
        "effective area of the upper tank's outlet",
    )
    .within(0.0, f64::INFINITY)
    .scaled(1e-5),
    Parameter::new(
        "hole_lower",
        "a_2",
        "m^2",
        "effective area of the lower tank's outlet",
    )
    .within(0.0, f64::INFINITY)
    .scaled(1e-5),
    Parameter::new("pump_flow", "K", "m^3/s/V", "flow of the pump per volt").scaled(1e-5),
];

const PUMP: [Reads; 1] = [Reads(Role::Drive, "pump")];
/// What runs over the edge of a tank depends on its level.
const FILLED_UPPER: [Reads; 1] = [Reads(Role::Head, "level_upper")];
const FILLED_LOWER: [Reads; 1] = [Reads(Role::Head, "level_lower")];
const UPPER: [Reads; 2] = [
    Reads(Role::Flow, "outflow_upper"),
    Reads(Role::Head, "level_upper"),
];
const LOWER: [Reads; 2] = [
    Reads(Role::Flow, "outflow_lower"),
    Reads(Role::Head, "level_lower"),
];

const CHANNELS: [Channel; 7] = [
    Channel {
        id: "tank.upper",
        place: Place::Effort(0),
        unit: "m/s",
        equation: "h'_1 -> h'_1 + w",
        reads: &FILLED_UPPER,
        side: 0,
        size: 1e-3,
        doc: "the balance of the upper tank; what else fills it, as the rate of its level",
    },
    Channel {
        id: "tank.lower",
        place: Place::Effort(1),
        unit: "m/s",
        equation: "h'_2 -> h'_2 + w",
        reads: &FILLED_LOWER,
        side: 0,
        size: 1e-3,
        doc: "the balance of the lower tank; what else fills it, as the rate of its level",
    },
    Channel {
        id: "outlet.upper",
        place: Place::Effort(2),
        unit: "m",
        equation: "h_1 -> h_1 + w in f",
        reads: &UPPER,
        side: 0,
        size: 0.01,
        doc: "the outlet of the upper tank; losses and pressures, as head",
    },
    Channel {
        id: "outlet.lower",
        place: Place::Effort(3),
        unit: "m",
        equation: "h_2 -> h_2 + w in f",
        reads: &LOWER,
        side: 0,
        size: 0.01,
        doc: "the outlet of the lower tank; losses and pressures, as head",
    },
    Channel {
        id: "pump",
        place: Place::Input(0),
        unit: "V",
        equation: "u -> u + w(u)",
        reads: &PUMP,
        side: 0,
        size: 1.0,
        doc: "between the commanded and the effective voltage of the pump",
    },
    Channel {
        id: "sensor.upper",
        place: Place::Output(0),
        unit: "m",
        equation: "h_1 measured = h_1 + w",
        reads: &PUMP,
        side: 0,
        size: 0.01,
        doc: "measurement of the upper level",
    },
    Channel {
        id: "sensor.lower",
        place: Place::Output(1),
        unit: "m",
        equation: "h_2 measured = h_2 + w",
        reads: &PUMP,
        side: 0,
        size: 0.01,
        doc: "measurement of the lower level",
    },
];

impl Plant for TankPair {
    const META: PlantMeta = PlantMeta {
        id: "tank_pair",
        summary: "two tanks in cascade, the upper one filled by a pump",
        equation: "h'_1 = b u - c_1 √(2 g h_1);  h'_2 = c_2 √(2 g h_1) - c_3 √(2 g h_2)",
        reference: "Schoukens, Noël (2017), IFAC PapersOnLine 50-1, 446-451, section 3 (cascaded tanks)",
        assumptions: "prismatic tanks that do not overflow, Torricelli's law made smooth below 0.1 mm",
        example: "[plant.tank_pair]\npump = 2.0e-3\noutlet_upper = 4.0e-3\ninlet_lower = 4.0e-3\noutlet_lower = 3.5e-3\n",
        states: &[
            Signal::new("level_upper", "h_1", "m", "level of the upper tank").sized(0.1),
            Signal::new("level_lower", "h_2", "m", "level of the lower tank").sized(0.1),
        ],
        inputs: &[Signal::new("pump", "u", "V", "voltage of the pump")],
        outputs: &[
            Signal::new(
                "outflow_upper",
                "v_1",
                "m/s",
                "speed at the upper tank's outlet",
            ),
            Signal::new(
                "outflow_lower",
                "v_2",
                "m/s",
                "speed at the lower tank's outlet",
            ),
        ],
        integrals: &[],
        channels: &CHANNELS,
        parameters: &LUMPED,
        parameterizations: &[Parameterization {
            id: "physical",
            summary: "areas of tanks and outlets and the flow of the pump",
            parameters: &PHYSICAL,
        }],
        controlled: &[],
    };

    /// A film of 0.1 mm runs off in half a second or slower.
    const MAX_STEP_S: f64 = 0.25;

    const DERIVED: &'static [Derived] = &[
        Derived::new(
            "level_upper_per_squared_volt",
            "m/V^2",
            "(b/c_1)^2/(2 g)",
            "level of the upper tank at rest over the square of the voltage",
        ),
        Derived::new(
            "level_lower_per_squared_volt",
            "m/V^2",
            "(b c_2/(c_1 c_3))^2/(2 g)",
            "level of the lower tank at rest over the square of the voltage",
        ),
    ];

    fn derivative<S: Real>(x: &[S; 2], u: &[S; 1], w: &[S; 4], p: &[S; 4]) -> [S; 2] {
        let upper = torricelli(x[0] + w[2]);
        let lower = torricelli(x[1] + w[3]);
        [
            p[0] * u[0] - p[1] * upper + w[0],
            p[2] * upper - p[3] * lower + w[1],
        ]
    }

    fn output<S: Real>(index: usize, x: &[S; 2], _u: &[S; 1], _p: &[S; 4]) -> S {
        torricelli(x[usize::from(index > 0)])
    }

    fn lower<S: Real>(set: usize, from: &[S]) -> Option<[S; 4]> {
        if set != 0 {
            return None;
        }
        let [upper, lower, hole_upper, hole_lower, flow] = *<&[S; 5]>::try_from(from).ok()?;
        Some([
            flow / upper,
            hole_upper / upper,
            hole_upper / lower,
            hole_lower / lower,
        ])
    }

    fn derived<S: Real>(index: usize, p: &[S; 4]) -> S {
        // At rest the speed at an outlet, per volt, is that of the level.
        let share = match index {
            0 => p[0] / p[1],
            _ => p[0] * p[2] / (p[1] * p[3]),
        };
        share * share / S::of(2.0 * GRAVITY)
    }
}

/// Speed of what runs out below a head, by Torricelli; smooth where the tank is empty.
fn torricelli<S: Real>(head: S) -> S {
    let smooth = (head * head + S::of(FILM * FILM)).sqrt().sqrt();
    S::of(2.0 * GRAVITY).sqrt() * head / smooth
}

declare_plant!(TankPair, "tank_pair");

#[cfg(test)]
mod tests {
    use loopsight_core::rk4_step;
    use loopsight_model::{Dual, derivative, variable};

    use super::*;

    const P: [f64; 4] = [2e-3, 4e-3, 5e-3, 3.5e-3];

    fn run(from: [f64; 2], volt: f64, seconds: u32) -> [f64; 2] {
        let mut x = from;
        for _ in 0..100 * seconds {
            rk4_step(&mut x, 0.01, |x| {
                TankPair::derivative(x, &[volt], &[0.0; 4], &P)
            });
        }
        x
    }

    #[test]
    fn levels_come_to_rest_where_what_runs_in_runs_out() {
        let volt = 3.0;
        let rest = run([0.0, 0.0], volt, 1200);
        for (level, index) in rest.iter().zip(0..) {
            let expected = TankPair::derived(index, &P) * volt * volt;
            assert!(
                (level / expected - 1.0).abs() < 1e-4,
                "{index}: {level} {expected}"
            );
        }
        // Bernoulli: the outlet has the speed of a free fall.
        assert!((torricelli(0.2) - (2.0 * GRAVITY * 0.2f64).sqrt()).abs() < 1e-4);
    }

    /// `√h` falls by a straight line: `√h(t) = √h(0) - c √(g/2) t`.
    #[test]
    fn an_upper_tank_runs_empty_as_torricelli_says() {
        let (start, seconds) = (0.3f64, 20);
        let root = start.sqrt() - P[1] * (GRAVITY / 2.0).sqrt() * f64::from(seconds);
        let [level, _] = run([start, 0.0], 0.0, seconds);
        assert!(
            (level - root * root).abs() < 1e-4,
            "{level} {}",
            root * root
        );
    }

    #[test]
    fn an_empty_tank_has_a_derivative() {
        for level in [0.0, -1e-3, 1e-9] {
            let head: Dual = variable(level, 0);
            let slope = derivative(&torricelli(head), 0);
            assert!(slope.is_finite() && slope > 0.0, "{level}: {slope}");
        }
    }
}
