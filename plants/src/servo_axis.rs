//! A slide that follows a position.

use crate::declare_plant;
use crate::places::at;
use loopsight_core::{
    Channel, Derived, Parameter, Place, Plant, PlantMeta, Reads, Real, Role, Signal,
};

/// A position-controlled slide: a mass behind a cascade of position and velocity control.
///
/// ```text
/// q'  = v                  M v' = F - F_v v + w
/// v̂'  = (v - v̂)/T          F' = (k_f u - F)/T_d
/// u   = clamp(k_v (k_p (q_ref - q) - v̂) + u_d, -u_max, u_max)
/// ```
///
/// | symbol | what | unit |
/// |---|---|---|
/// | `q`, `v` | position and velocity of the slide | m, m/s |
/// | `v̂` | velocity as the controller knows it, from differences of the position | m/s |
/// | `q_ref` | position that is asked for | m |
/// | `u_d` | voltage that is added to the controller's, 0 where nothing is logged | V |
/// | `u`, `F` | control voltage, force of the drive; `k_f u` is the force that is asked of it | V, N |
/// | `w` | effort at the slide, a force | N |
/// | `M`, `F_v` | moving mass, motor included; viscous friction | kg, N s/m |
/// | `k_p`, `k_v`, `k_f`, `u_max` | gains and limit of the controller, known | 1/s, V s/m, N/V, V |
/// | `T` | lag of the velocity: half a period of the difference, its filter | s |
/// | `T_d` | lag of the drive: half a period of the controller, which holds `u`, and the current loop | s |
///
/// The slide alone is an integrator: simulated from its force it drifts away. Simulated through its
/// loop it stays where it is told, and what the model lacks shows in the force and the voltage that the
/// loop needs: these are measured.
///
/// Dry friction and offset are effects at the slide: `coulomb_friction`, `directional_friction`,
/// `constant_force`. The same slide without a loop is an `oscillator` without stiffness.
///
/// Assumptions: a rigid transmission; a sampled controller is written as a continuous one with lags,
/// which holds where its period is short against those of the loop. A log of the reference wants a
/// first-order hold, and an integration step (`max_step_s`) no longer than the shorter lag.
///
/// Reference: A. Janot, M. Gautier, M. Brunot (2019), "Data set and reference models of EMPS",
/// Workshop on Nonlinear System Identification Benchmarks, equations (1)–(4).
#[derive(Clone, Copy, Debug)]
pub struct ServoAxis;

const PARAMETERS: [Parameter; 8] = [
    Parameter::new("mass", "M", "kg", "moving mass, that of the motor included")
        .above(0.0)
        .nonlinear(),
    Parameter::new("viscous_friction", "F_v", "N s/m", "viscous friction")
        .within(0.0, f64::INFINITY)
        .nonlinear(),
    Parameter::new(
        "position_gain",
        "k_p",
        "1/s",
        "gain of the position control",
    )
    .within(0.0, f64::INFINITY)
    .known()
    .nonlinear(),
    Parameter::new(
        "velocity_gain",
        "k_v",
        "V s/m",
        "gain of the velocity control",
    )
    .within(0.0, f64::INFINITY)
    .known()
    .nonlinear(),
    Parameter::new("force_gain", "k_f", "N/V", "force of the drive per volt")
        .known()
        .nonlinear(),
    Parameter::new("voltage_limit", "u_max", "V", "largest control voltage")
        .above(0.0)
        .or(1e6)
        .known()
        .nonlinear(),
    Parameter::new(
        "velocity_lag",
        "T",
        "s",
        "lag of the velocity that is fed back",
    )
    .within(0.0002, 1.0)
    .or(0.002)
    .known()
    .nonlinear()
    .scaled(0.001),
    Parameter::new(
        "drive_lag",
        "T_d",
        "s",
        "lag of the force behind the voltage",
    )
    .within(0.0002, 1.0)
    .or(0.002)
    .known()
    .nonlinear()
    .scaled(0.001),
];

const SLIDE: [Reads; 3] = [
    Reads(Role::Flow, "velocity"),
    Reads(Role::Position, "position"),
    Reads(Role::Drive, "drive_force"),
];

const fn sensor(
    id: &'static str,
    index: usize,
    unit: &'static str,
    equation: &'static str,
    doc: &'static str,
) -> Channel {
    at(Place::Output(index), [id, unit, equation, doc], &SLIDE)
}

const CHANNELS: [Channel; 8] = [
    Channel {
        id: "slide",
        place: Place::Effort(0),
        unit: "N",
        equation: "F -> F + w",
        reads: &SLIDE,
        side: 0,
        size: 10.0,
        doc: "the slide; efforts are forces on it",
    },
    Channel {
        id: "inertia",
        place: Place::Rate(1),
        unit: "m/s^2",
        equation: "v' -> v' + w(v')",
        reads: &SLIDE,
        side: 0,
        size: 1.0,
        doc: "the acceleration itself: where the mass acts",
    },
    Channel {
        id: "reference",
        place: Place::Input(0),
        unit: "m",
        equation: "q_ref -> q_ref + w(q_ref)",
        reads: &[],
        side: 0,
        size: 0.01,
        doc: "between the logged position and the one the controller follows",
    },
    Channel {
        id: "disturbance",
        place: Place::Input(1),
        unit: "V",
        equation: "u_d -> u_d + w(u_d)",
        reads: &[],
        side: 0,
        size: 1.0,
        doc: "between the logged and the effective addition to the voltage",
    },
    sensor(
        "sensor.position",
        0,
        "m",
        "q_measured = q + w",
        "measurement of the position",
    ),
    sensor(
        "sensor.velocity",
        1,
        "m/s",
        "v_measured = v + w",
        "measurement of the velocity",
    ),
    sensor(
        "sensor.control",
        6,
        "V",
        "u_measured = u + w",
        "measurement of the control voltage",
    ),
    sensor(
        "sensor.force",
        7,
        "N",
        "k_f u measured = k_f u + w",
        "measurement of the force",
    ),
];

impl Plant for ServoAxis {
    const META: PlantMeta = PlantMeta {
        id: "servo_axis",
        summary: "a slide whose position is controlled, seen through its loop",
        equation: "q' = v;  M v' = F - F_v v;  v̂' = (v - v̂)/T;  F' = (k_f u - F)/T_d;  u = k_v (k_p (q_ref - q) - v̂) + u_d within ±u_max",
        reference: "Janot, Gautier, Brunot (2019), Data set and reference models of EMPS, equations (1)-(4)",
        assumptions: "rigid transmission, controller written as continuous; dry friction and offset are effects",
        example: "[plant.servo_axis]\nmass = 95.0\nviscous_friction = 200.0\nposition_gain = 160.0\nvelocity_gain = 243.0\nforce_gain = 35.0\nvoltage_limit = 10.0\n",
        states: &[
            Signal::new("position", "q", "m", "position of the slide").sized(0.1),
            Signal::new("velocity", "v", "m/s", "velocity of the slide").sized(0.1),
            Signal::new(
                "velocity_fed_back",
                "v̂",
                "m/s",
                "velocity as the controller knows it",
            )
            .sized(0.1),
            Signal::new("drive_force", "F", "N", "force that the drive has built up").sized(10.0),
        ],
        inputs: &[
            Signal::new(
                "position_reference",
                "q_ref",
                "m",
                "position that is asked for",
            )
            .sized(0.1),
            Signal::new(
                "voltage_added",
                "u_d",
                "V",
                "voltage added to the controller's; 0 where a log has no column",
            )
            .optional(),
        ],
        outputs: &[
            Signal::new("control_voltage", "u", "V", "control voltage"),
            Signal::new("force", "k_f u", "N", "force that is asked of the drive").sized(10.0),
        ],
        integrals: &[("velocity", "position")],
        channels: &CHANNELS,
        parameters: &PARAMETERS,
        parameterizations: &[],
        controlled: &[],
    };

    const DERIVED: &'static [Derived] = &[
        Derived::new(
            "loop_frequency",
            "rad/s",
            "sqrt(k_p k_v k_f/M)",
            "natural angular frequency of the loop",
        ),
        Derived::new(
            "loop_damping",
            "1",
            "(k_v k_f + F_v)/(2 M loop_frequency)",
            "damping ratio of the loop, without the lags",
        ),
    ];

    fn derivative<S: Real>(x: &[S; 4], u: &[S; 2], w: &[S; 1], p: &[S; 8]) -> [S; 4] {
        let [_, v, known, force] = *x;
        let [mass, viscous, _, _, force_gain, _, lag, drive_lag] = *p;
        [
            v,
            (force + w[0] - viscous * v) / mass,
            (v - known) / lag,
            (force_gain * voltage(x, u, p) - force) / drive_lag,
        ]
    }

    fn output<S: Real>(index: usize, x: &[S; 4], u: &[S; 2], p: &[S; 8]) -> S {
        match index {
            0 => voltage(x, u, p),
            _ => p[4] * voltage(x, u, p),
        }
    }

    fn derived<S: Real>(index: usize, p: &[S; 8]) -> S {
        let [mass, viscous, k_p, k_v, k_f, ..] = *p;
        let square = k_p * k_v * k_f / mass;
        if square <= S::zero() {
            return S::zero();
        }
        match index {
            0 => square.sqrt(),
            _ => (k_v * k_f + viscous) / (S::of(2.0) * mass * square.sqrt()),
        }
    }
}

/// What the controller puts out.
fn voltage<S: Real>(x: &[S; 4], u: &[S; 2], p: &[S; 8]) -> S {
    let [_, _, k_p, k_v, _, limit, _, _] = *p;
    (k_v * (k_p * (u[0] - x[0]) - x[2]) + u[1]).clamp(-limit, limit)
}

declare_plant!(ServoAxis, "servo_axis");

#[cfg(test)]
mod tests {
    use loopsight_core::rk4_step;

    use super::*;

    /// mass, F_v, k_p, k_v, k_f, limit, T, T_d
    const P: [f64; 8] = [95.0, 200.0, 160.0, 243.0, 35.0, 1e6, 5e-4, 5e-4];

    /// A step against the second-order loop that it is without lags: q/q_ref =
    /// ω²/(s² + 2 ζ ω s + ω²).
    #[test]
    fn a_step_of_the_reference_is_that_of_a_second_order_loop() {
        let mut p = P;
        (p[6], p[7]) = (1e-5, 1e-5);
        let (natural, ratio) = (ServoAxis::derived(0, &p), ServoAxis::derived(1, &p));
        let (decay, ringing) = (ratio * natural, natural * (1.0 - ratio * ratio).sqrt());
        let (mut x, h, step) = ([0.0; 4], 1e-5, 1e-3);
        for k in 1..=20_000 {
            rk4_step(&mut x, h, |x| {
                ServoAxis::derivative(x, &[step, 0.0], &[0.0], &p)
            });
            let t = h * f64::from(k);
            let swing = (ringing * t).cos() + decay / ringing * (ringing * t).sin();
            let q = step * (1.0 - (-decay * t).exp() * swing);
            assert!((x[0] - q).abs() < 0.003 * step, "{t}: {} {q}", x[0]);
        }
    }

    /// At a constant speed the loop lags by `v/k_p` and what friction asks for.
    #[test]
    fn a_ramp_is_followed_at_a_distance() {
        let (speed, load, mut x, h) = (0.1, -20.0, [0.0; 4], 1e-4);
        let mut reference = 0.0;
        for k in 0..10_000 {
            reference = speed * h * f64::from(k + 1);
            rk4_step(&mut x, h, |x| {
                ServoAxis::derivative(x, &[reference - 0.5 * speed * h, 0.0], &[load], &P)
            });
        }
        let force = ServoAxis::output(1, &x, &[reference, 0.0], &P);
        let needed = P[1] * speed - load;
        assert!((force - needed).abs() < 0.05, "{force} {needed}");
        let behind = speed / P[2] + needed / (P[2] * P[3] * P[4]);
        assert!((reference - x[0] - behind).abs() < 1e-6);
    }

    #[test]
    fn the_voltage_has_a_limit() {
        let mut p = P;
        p[5] = 10.0;
        for (reference, expected) in [(1.0, 10.0), (-1.0, -10.0)] {
            let u = ServoAxis::output(0, &[0.0; 4], &[reference, 0.0], &p);
            assert_eq!(u, expected);
        }
    }
}
