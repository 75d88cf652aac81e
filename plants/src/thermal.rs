//! A heater and the body that it warms.

use crate::declare_plant;
use crate::places::{at, sized};
use loopsight_core::{
    Channel, Derived, Parameter, Parameterization, Place, Plant, PlantMeta, Reads, Real, Role,
    Signal,
};

/// Two bodies that exchange heat: a heater and what it warms, in surroundings of one temperature.
///
/// ```text
/// H' = b P - a_h (H - B) + w_h            T_h = T_a + H
/// B' = a_b (H - B) - l (B - w_l) + w_b    T_b = T_a + B
/// ```
///
/// | symbol | what | unit |
/// |---|---|---|
/// | `H`, `B` | how much warmer than the surroundings heater and body are | K |
/// | `T_h`, `T_b` | temperature of the heater and of the body | K |
/// | `T_a` | temperature of the surroundings; only absolute temperatures tell it | K |
/// | `P` | power of the heater | W |
/// | `w_h`, `w_b` | what else warms a body, as the rate of its temperature | K/s |
/// | `w_l` | what holds heat back on its way to the surroundings, as temperature | K |
///
/// From the heat capacities `C_h` and `C_b`, the conductance `G` between the two and `L` from the body to
/// the surroundings:
///
/// ```text
/// b = 1/C_h        a_h = G/C_h        a_b = G/C_b        l = L/C_b
/// ```
///
/// Power and both temperatures determine all of them, measured from absolute zero (`heater`, `body`) or from the
/// surroundings (`heater_rise`, `body_rise`). From the body's temperature alone `C_h`, `C_b` and `G` follow
/// only together; give one of them as known.
///
/// A loss that grows faster than the difference (radiation, free convection) is `quadratic_drag` at `loss`;
/// a heater on a voltage, whose power goes with its square, `input_power`; a sensor in a well `sensor_lag`.
///
/// Assumptions: each body has one temperature (Biot number below 0.1), the heater loses nothing but to the body,
/// surroundings that stay as they are.
///
/// Reference: T. L. Bergman, A. S. Lavine, F. P. Incropera, D. P. DeWitt (2011), "Fundamentals of Heat and Mass
/// Transfer", 7th edition, Wiley, chapter 5, the lumped capacitance method; two of them in a row.
#[derive(Clone, Copy, Debug)]
pub struct Thermal;

const AMBIENT: Parameter = Parameter::new("ambient", "T_a", "K", "temperature of the surroundings")
    .within(0.0, f64::INFINITY)
    .or(293.15)
    .nonlinear();

const LUMPED: [Parameter; 5] = [
    Parameter::new(
        "heating",
        "b",
        "K/s/W",
        "rise of the heater per power, one over its heat capacity",
    )
    .scaled(0.01),
    Parameter::new(
        "exchange_heater",
        "a_h",
        "1/s",
        "conductance between the two over the heater's heat capacity",
    )
    .within(0.0, f64::INFINITY)
    .scaled(0.01),
    Parameter::new(
        "exchange_body",
        "a_b",
        "1/s",
        "conductance between the two over the body's heat capacity",
    )
    .within(0.0, f64::INFINITY)
    .scaled(0.01),
    Parameter::new(
        "loss",
        "l",
        "1/s",
        "conductance to the surroundings over the body's heat capacity",
    )
    .within(0.0, f64::INFINITY)
    .scaled(0.01),
    AMBIENT,
];

const fn capacity(id: &'static str, symbol: &'static str, doc: &'static str) -> Parameter {
    Parameter::new(id, symbol, "J/K", doc)
        .above(0.0)
        .nonlinear()
        .scaled(10.0)
}

const fn conductance(id: &'static str, symbol: &'static str, doc: &'static str) -> Parameter {
    Parameter::new(id, symbol, "W/K", doc)
        .within(0.0, f64::INFINITY)
        .nonlinear()
}

const PHYSICAL: [Parameter; 5] = [
    capacity("capacity_heater", "C_h", "heat capacity of the heater"),
    capacity("capacity_body", "C_b", "heat capacity of the body"),
    conductance(
        "conductance",
        "G",
        "heat flow between heater and body per difference",
    ),
    conductance(
        "conductance_ambient",
        "L",
        "heat flow from the body to the surroundings per difference",
    ),
    AMBIENT,
];

const HEATER: [Reads; 1] = [Reads(Role::Drive, "power")];
const LOSS: [Reads; 2] = [
    Reads(Role::Flow, "body_rise"),
    // Nothing rubs here.
    Reads(Role::Head, "body_rise"),
];

const fn sensor(id: &'static str, index: usize, equation: &'static str) -> Channel {
    let doc = "measurement of a temperature";
    at(Place::Output(index), [id, "K", equation, doc], &HEATER)
}

const CHANNELS: [Channel; 8] = [
    sized(
        0.1,
        at(
            Place::Effort(0),
            [
                "heater",
                "K/s",
                "H' -> H' + w",
                "the balance of the heater; what else warms it, as the rate of its temperature",
            ],
            &[],
        ),
    ),
    sized(
        0.1,
        at(
            Place::Effort(1),
            [
                "body",
                "K/s",
                "B' -> B' + w",
                "the balance of the body; what else warms it, as the rate of its temperature",
            ],
            &[],
        ),
    ),
    at(
        Place::Effort(2),
        [
            "loss",
            "K",
            "B -> B - w in the loss",
            "the way of the heat to the surroundings; what holds it back, as temperature",
        ],
        &LOSS,
    ),
    at(
        Place::Input(0),
        [
            "input",
            "W",
            "P -> P + w(P)",
            "between the commanded and the effective power",
        ],
        &HEATER,
    ),
    sensor("sensor.heater_rise", 0, "H measured = H + w"),
    sensor("sensor.body_rise", 1, "B measured = B + w"),
    sensor("sensor.heater", 3, "T_h measured = T_h + w"),
    sensor("sensor.body", 4, "T_b measured = T_b + w"),
];

impl Plant for Thermal {
    const META: PlantMeta = PlantMeta {
        id: "thermal",
        summary: "a heater and the body that it warms, in surroundings of one temperature",
        equation: "H' = b P - a_h (H - B);  B' = a_b (H - B) - l B;  T_h = T_a + H;  T_b = T_a + B",
        reference: "Bergman, Lavine, Incropera, DeWitt (2011), Fundamentals of Heat and Mass Transfer, 7th edition, chapter 5 (lumped capacitance)",
        assumptions: "each body has one temperature, the heater loses nothing but to the body, surroundings that stay as they are",
        example: "[plant.thermal.physical]\ncapacity_heater = 20.0        # J/K\ncapacity_body = 60.0          # J/K\nconductance = 1.5             # W/K, between the two\nconductance_ambient = 0.4     # W/K\nambient = 293.15              # K\n",
        states: &[
            Signal::new(
                "heater_rise",
                "H",
                "K",
                "how much warmer than the surroundings the heater is",
            )
            .sized(10.0),
            Signal::new(
                "body_rise",
                "B",
                "K",
                "how much warmer than the surroundings the body is",
            )
            .sized(10.0),
        ],
        inputs: &[Signal::new("power", "P", "W", "power of the heater").sized(10.0)],
        outputs: &[
            Signal::new("heater", "T_h", "K", "temperature of the heater").sized(10.0),
            Signal::new("body", "T_b", "K", "temperature of the body").sized(10.0),
        ],
        integrals: &[],
        channels: &CHANNELS,
        parameters: &LUMPED,
        parameterizations: &[Parameterization {
            id: "physical",
            summary: "heat capacities, conductances and the temperature of the surroundings",
            parameters: &PHYSICAL,
        }],
        controlled: &[0],
    };

    /// A heater of 1 s is followed to a part in ten thousand.
    const MAX_STEP_S: f64 = 0.25;

    const DERIVED: &'static [Derived] = &[Derived::new(
        "rise_per_power",
        "K/W",
        "b a_b/(a_h l)",
        "how much warmer than its surroundings the body is at rest, per power",
    )];

    fn derivative<S: Real>(x: &[S; 2], u: &[S; 1], w: &[S; 3], p: &[S; 5]) -> [S; 2] {
        let [heater, body] = *x;
        let [heating, exchange_heater, exchange_body, loss, _] = *p;
        let between = heater - body;
        [
            heating * u[0] - exchange_heater * between + w[0],
            exchange_body * between - loss * (body - w[2]) + w[1],
        ]
    }

    fn output<S: Real>(index: usize, x: &[S; 2], _u: &[S; 1], p: &[S; 5]) -> S {
        p[4] + x[usize::from(index > 0)]
    }

    fn lower<S: Real>(set: usize, from: &[S]) -> Option<[S; 5]> {
        if set != 0 {
            return None;
        }
        let [heater, body, between, out, ambient] = *<&[S; 5]>::try_from(from).ok()?;
        Some([
            S::one() / heater,
            between / heater,
            between / body,
            out / body,
            ambient,
        ])
    }

    fn derived<S: Real>(_index: usize, p: &[S; 5]) -> S {
        let under = p[1] * p[3];
        if under.abs() <= S::of(1e-12) {
            return S::zero();
        }
        p[0] * p[2] / under
    }
}

declare_plant!(Thermal, "thermal");

#[cfg(test)]
mod tests {
    use loopsight_core::rk4_step;

    use super::*;

    /// C_h, C_b, G, L, T_a
    const PARTS: [f64; 5] = [20.0, 60.0, 1.5, 0.4, 293.15];

    fn run(x: &mut [f64; 2], power: f64, p: &[f64; 5], seconds: f64) {
        let h = 0.1;
        for _ in 0..(seconds / h).round() as usize {
            rk4_step(x, h, |x| Thermal::derivative(x, &[power], &[0.0; 3], p));
        }
    }

    /// What is put in is kept, or has gone to the surroundings; without a way there nothing goes.
    #[test]
    fn heat_is_neither_made_nor_lost() {
        let mut parts = PARTS;
        parts[3] = 0.0;
        let p = Thermal::lower(0, &parts).unwrap();
        let heat = |x: &[f64; 2]| PARTS[0] * x[0] + PARTS[1] * x[1];
        let mut x = [7.0, 17.0];
        let before = heat(&x);
        run(&mut x, 12.0, &p, 50.0);
        assert!((heat(&x) - before - 600.0).abs() < 1e-7);
        // Let alone the two come to one temperature, that of the mean.
        run(&mut x, 0.0, &p, 1000.0);
        assert!((x[0] - x[1]).abs() < 1e-9);
        assert!((heat(&x) - before - 600.0).abs() < 1e-7);
    }

    /// At rest all the power goes out: `B = P/L`, `H - B = P/G`; without power all is as warm as
    /// the surroundings.
    #[test]
    fn it_comes_to_rest_where_the_power_goes_out() {
        let p = Thermal::lower(0, &PARTS).unwrap();
        for power in [0.0, 10.0] {
            let mut x = [27.0, -13.0];
            run(&mut x, power, &p, 6000.0);
            let rise = x[1];
            assert!((rise - power / PARTS[3]).abs() < 1e-8, "{x:?}");
            assert!((x[0] - x[1] - power / PARTS[2]).abs() < 1e-8, "{x:?}");
            for (i, above) in x.into_iter().enumerate() {
                assert_eq!(Thermal::output(i, &x, &[power], &p), PARTS[4] + above);
            }
            let per_power: f64 = Thermal::derived(0, &p);
            assert!((per_power * power - rise).abs() < 1e-8);
        }
    }

    /// No temperature leaves the range of the others without power.
    #[test]
    fn heat_flows_from_warm_to_cold() {
        let p = Thermal::lower(0, &PARTS).unwrap();
        let mut x = [57.0, 7.0];
        let mut warmest = 57.0;
        for _ in 0..200 {
            run(&mut x, 0.0, &p, 2.0);
            let now = x[0].max(x[1]);
            assert!(now < warmest && x[0].min(x[1]) > 0.0);
            warmest = now;
        }
    }

    /// What holds heat back by as much as the body is warmer keeps it all.
    #[test]
    fn the_loss_can_be_held_back() {
        let p = Thermal::lower(0, &PARTS).unwrap();
        let x = [37.0, 37.0];
        let rates = Thermal::derivative(&x, &[0.0], &[0.0, 0.0, 37.0], &p);
        assert!(rates[1].abs() < 1e-12);
    }
}
