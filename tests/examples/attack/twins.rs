//! Two ways to the same number: an expression beside Rust, and a robot in single precision beside the same loop on a desk. Where they
//! differ, the input counts as one that panics.

use loopsight_controllers::FeedbackLinearizingPi;
use loopsight_core::{Loop, Plant};
use loopsight_estimators::Rls;
use loopsight_link::{Configuration, Hello, LONGEST, Measured, Reply, Request, VERSION, encode};
use loopsight_model::model::Model;
use loopsight_model::simulate::Simulator;
use loopsight_onboard::{
    AffinePlant, Efforts, Learner, OnboardLaw, Port, Prompted, Session, Twil, aboard,
};
use loopsight_plants::Ddmr;
use nalgebra::Const;

use crate::targets::{SESSION, Take, configuration, list};

/// What the Twil has beside its plant: friction at one wheel, and two sensors.
const FRICTION: &str = "[[effect]]
[effect.coulomb_friction]
at = [\"wheel.right\"]
level = 0.9
width = 0.3
[log.measured.linear_velocity]
[log.measured.angular_velocity]
";

/// The same equations as the library's parts, written as expressions.
const EXPRESSIONS: &str = "[plant.expression.states]
v = { unit = \"m/s\", rate = \"K_A * v + K_B * w * w + K_C * (r + right + l)\" }
w = { unit = \"rad/s\", rate = \"K_D * w + K_E * v * w + K_F * (r + right - l)\" }
heading = { unit = \"rad\", rate = \"w\" }
travel = { unit = \"m\", rate = \"v\" }
x = { unit = \"m\", rate = \"v * cos(heading)\" }
y = { unit = \"m\", rate = \"v * sin(heading)\" }
[plant.expression.inputs]
r = { unit = \"V\" }
l = { unit = \"V\" }
[plant.expression.outputs]
wheel = { unit = \"rad/s\", value = \"(v + half_track * w) / wheel_radius\" }
[plant.expression.channels]
right = { unit = \"V\", flow = \"wheel\" }
[plant.expression.parameters]
K_A = { value = -15.146 }
K_B = { value = 0.005 }
K_C = { value = 0.136 }
K_D = { value = -9.573 }
K_E = { value = -3.945 }
K_F = { value = 0.656 }
half_track = { value = 0.131 }
wheel_radius = { value = 0.05 }
[[effect]]
[effect.expression]
name = \"friction\"
at = [\"right\"]
force = \"-level * tanh(flow / width)\"
[effect.expression.parameters]
level = { value = 0.9 }
width = { value = 0.3 }
[log.measured.v]
[log.measured.w]
";

/// Parameters, states and inputs, in bytes.
const PARAMETERS: usize = 10;
const STATES: usize = 6;
const INPUTS: usize = 2;

pub(crate) fn places() -> Vec<Vec<u8>> {
    let parameters = [
        -15.146, 0.005, 0.136, -9.573, -3.945, 0.656, 0.131, 0.05, 0.9, 0.3,
    ];
    let places = [
        [0.0; STATES + INPUTS],
        [0.1, -0.4, 0.3, 0.2, 1.0, -1.0, 3.0, -2.0],
        [-0.02, 1.1, -3.0, 7.0, 1e3, 1e-3, 12.0, 11.5],
    ];
    let bytes = |place: &[f64; STATES + INPUTS]| {
        let numbers = parameters.iter().chain(place);
        numbers.flat_map(|n| n.to_le_bytes()).collect()
    };
    places.iter().map(bytes).collect()
}

/// Numbers of so many bytes each; what is cut off is zero.
fn number<const N: usize>(bytes: &[u8], at: usize) -> [u8; N] {
    let mut of = [0; N];
    let there = bytes.get(at * N..).unwrap_or_default();
    for (to, from) in of.iter_mut().zip(there) {
        *to = *from;
    }
    of
}

/// Both are driven for three periods, and are at the same place, digit for digit, or both nowhere.
pub(crate) fn expression_and_rust() -> Take {
    let made = |text: &str| Model::from_toml("twin.toml", text).unwrap().0;
    let rust = format!("{}{FRICTION}", <Ddmr as Plant>::META.example);
    let models = [made(&rust), made(EXPRESSIONS)];
    assert!(models.iter().all(|m| m.parameters.len() == PARAMETERS));
    let values = models.each_ref().map(Model::values);
    assert_eq!(values[0], values[1]);
    let mut simulators = models.map(|m| {
        let values = m.values();
        Simulator::owning(m, &values)
    });
    Box::new(move |bytes| {
        let number = |at| f64::from_le_bytes(number(bytes, at));
        let values: Vec<f64> = (0..PARAMETERS).map(number).collect();
        let start: Vec<f64> = (0..STATES).map(|i| number(PARAMETERS + i)).collect();
        let inputs = [0, 1].map(|i| number(PARAMETERS + STATES + i));
        for simulator in &mut simulators {
            simulator.set_values(&values);
            simulator.reset(&start, &inputs);
        }
        for k in 1..=3 {
            for simulator in &mut simulators {
                simulator.advance(f64::from(k) * 0.01, &inputs);
            }
            let [a, b] = simulators.each_ref().map(Simulator::state);
            for (a, b) in a.iter().zip(b) {
                let same = a.to_bits() == b.to_bits() || a.is_nan() && b.is_nan();
                assert!(same, "{a} {b}");
            }
        }
        simulators[0].state().iter().all(|x| x.is_finite())
    })
}

aboard! {
    /// The Twil in the numbers of a desk.
    struct Wide {
        scalar: f64,
        plant: Ddmr,
        effects: library,
        estimator: Rls<f64, Const<3>>,
    }
}

/// Ticks that both drive, and numbers of each: measured, then wanted.
const TICKS: usize = 32;
const EACH: usize = 4;

/// Largest speed, m/s, and yaw rate, rad/s: a metre a second more than the motors can do.
const FASTEST: [f32; 2] = [1.2, 3.0];

pub(crate) fn drives() -> Vec<Vec<u8>> {
    let drive = |gain: f64| {
        let numbers = (0..TICKS).flat_map(move |k| {
            let t = k as f64 * 0.01;
            [
                gain * 0.1 * t,
                gain * (0.3 * (5.0 * t).sin()),
                0.1 * gain,
                0.2,
            ]
        });
        numbers.flat_map(|n| (n as f32).to_le_bytes()).collect()
    };
    vec![drive(1.0), drive(-0.3), drive(0.0)]
}

/// The command of the robot is that of the desk but for what single precision rounds, V.
const ROUNDING: f64 = 0.01;

pub(crate) fn robot_and_desk() -> Take {
    let configuration = Configuration {
        learning: None,
        ..configuration()
    };
    Box::new(move |bytes| {
        let mut robot: Session<Twil, ()> = Session::new(10_000, ());
        let mut send = |request: &Request| {
            let mut frame = [0; LONGEST];
            let length = encode(request, &mut frame).unwrap();
            let mut said = None;
            for byte in &frame[..length] {
                robot.take(*byte, &mut |reply| said = Some(reply.clone()));
            }
            said
        };
        send(&Request::Hello(Hello {
            version: VERSION,
            session: SESSION,
        }));
        send(&Request::Configure {
            session: SESSION,
            configuration: configuration.clone(),
        });
        let mut desk = desk(&configuration);
        for tick in 0..TICKS {
            let numbers: [f32; EACH] = std::array::from_fn(|i| {
                let number = f32::from_le_bytes(number(bytes, EACH * tick + i));
                let most = FASTEST[i % 2];
                let held = number.clamp(-most, most);
                if held.is_nan() { 0.0 } else { held }
            });
            let [v, w, v_wanted, w_wanted] = numbers;
            let said = send(&Request::Step(Measured {
                session: SESSION,
                tick: tick as u32,
                age_us: 200,
                supply: 12.0,
                measured: list(&[v, w]),
                reference: list(&[v_wanted, w_wanted]),
            }));
            desk.driver.measured = [v, w].map(f64::from);
            desk.driver.fresh = true;
            let wanted = [v_wanted, w_wanted].map(f64::from);
            let here = desk.tick(&wanted).unwrap().applied.to_vec();
            let act = match said {
                Some(Reply::Act(act)) => Some(act),
                _ => None,
            };
            for (there, here) in act.unwrap().command.iter().zip(&here) {
                let apart = (f64::from(*there) - here).abs();
                assert!(apart <= ROUNDING, "tick {tick}: {there} {here}");
            }
        }
        true
    })
}

type Desk = Loop<
    f64,
    Port<f64, [f64; 2]>,
    FeedbackLinearizingPi<f64, Const<2>>,
    AffinePlant<Wide>,
    Option<Learner<Wide>>,
    Prompted,
    [f64; 2],
>;

/// The loop of a configuration, in double precision.
fn desk(configuration: &Configuration) -> Desk {
    let parameters: [f64; 8] = std::array::from_fn(|i| f64::from(configuration.parameters[i]));
    let efforts = Efforts::new(&configuration.effects, &parameters).unwrap();
    let bands = [0, 1].map(|i| f64::from(configuration.bands[i]));
    let port = Port {
        most: 12.0,
        ..Port::default()
    };
    Loop::new(
        port,
        OnboardLaw::new(&configuration.controller, 0.01).unwrap(),
        AffinePlant::new(parameters, efforts, bands),
        None,
        Prompted,
        0.01,
        [0.0; 2],
        [0.0; 2],
        [0.0; 2],
        [0.0; 2],
    )
}
