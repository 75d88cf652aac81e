//! Fits and diagnoses of models with expressions: what their numbers say is found.

#![allow(
    clippy::unwrap_used,
    reason = "helpers of tests: a failure is the test's failure"
)]

mod candidates;
mod states;

use std::collections::BTreeMap;

use loopsight_diagnosis::fit;
use loopsight_diagnosis::{Conclusion, FitSettings, Measurements, Work, diagnose};
use loopsight_drivers::{Simulated, simulate_inputs};
use loopsight_model::excitation::{Excitation, build, sample_rows};
use loopsight_model::model::Model;
use loopsight_model::registry::plants;
use loopsight_model::run::Run;
use loopsight_model::simulate::Simulator;
use loopsight_tests::{instants, repository, unknown};

/// An axis with two states, a quadratic drag of its own, and a tachometer.
const AXIS: &str = "[plant.expression.states]
speed = { unit = \"rad/s\", rate = \"K_A * speed + K_C * (voltage + shaft)\" }
angle = { unit = \"rad\", rate = \"speed\" }
[plant.expression.inputs]
voltage = { unit = \"V\" }
[plant.expression.channels]
shaft = { unit = \"V\", flow = \"speed\", position = \"angle\", drive = \"voltage\", shaft = \"angle\" }
[plant.expression.parameters]
K_A = { value = -4.0, unit = \"1/s\" }
K_C = { value = 3.0, unit = \"rad/s^2/V\" }
[[effect]]
[effect.expression]
name = \"drag\"
at = [\"shaft\"]
force = \"-b * flow * abs(flow) - c * tanh(flow / s)\"
[effect.expression.parameters]
b = { value = 0.05, unit = \"V/(rad/s)^2\", range = [0.0, 1.0] }
c = { value = 0.6, unit = \"V\", range = [0.0, 5.0] }
s = { value = 0.05, unit = \"rad/s\", held = true }
[log.measured.speed]
";

const FRICTION: &str = "
[[effect]]
[effect.coulomb_friction]
at = [\"shaft\"]
level = 0.7
width = 0.1
";

fn model(text: &str) -> Model {
    Model::from_toml("model.toml", text).unwrap().0
}

/// 12 s of voltages at several levels, with noise on the speed.
fn record(model: &Model) -> Run {
    let time = instants(12.0);
    let levels = Excitation::MultiLevel {
        amplitude: 6.0,
        hold_s: 0.4,
        levels: 7,
        seed: 7,
        common: false,
    };
    let given = BTreeMap::from([("voltage".to_owned(), levels)]);
    let inputs = sample_rows(&build(&given, model.plant.inputs).unwrap(), &time);
    let settings = Simulated {
        seed: 4,
        noise: BTreeMap::from([("speed".to_owned(), 0.02)]),
        ..Simulated::default()
    };
    simulate_inputs(model, &settings, &time, &inputs).unwrap()
}

/// From nothing but the ranges, a fit finds what the recording was made with.
#[test]
fn a_fit_finds_the_parameters_of_expressions() {
    let truth = model(AXIS);
    let run = record(&truth);
    let settings = FitSettings::default();
    let found = fit(
        &unknown(truth.clone()),
        &Measurements::new(&[run]),
        &settings,
        &Work::quiet(),
    )
    .unwrap();
    let mut checked = 0;
    for parameter in truth.parameters.iter().filter(|p| p.free) {
        let estimate = &found.parameters[&parameter.name];
        let error = estimate.std_error.unwrap();
        let value = parameter.value.unwrap();
        assert!(
            (estimate.value - value).abs() < 4.0 * error && error < 0.1 * value.abs(),
            "{}: {} ± {error}, made with {value}",
            parameter.name,
            estimate.value
        );
        checked += 1;
    }
    assert_eq!(checked, 4);
}

/// Effects of the library are candidates at the channels of a plant of one's own.
#[test]
fn a_diagnosis_names_what_an_expression_plant_lacks() {
    let (plant, rest) = AXIS.split_once("[[effect]]").unwrap();
    let plain = format!("{plant}{}", &rest[rest.find("[log.").unwrap()..]);
    let run = record(&model(&format!("{plain}{FRICTION}")));
    let diagnosis = diagnose(&model(&plain), &Measurements::new(&[run]), &Work::quiet()).unwrap();
    assert_eq!(diagnosis.verdict, Conclusion::EffectMissing);
    let best = &diagnosis.candidates[0];
    let mut class = std::iter::once(&best.place).chain(&best.indistinguishable_from);
    assert!(class.any(|p| p.effect == "coulomb_friction" && p.at == ["shaft"]));
    assert!(best.nrmse < 0.5 * diagnosis.nominal.nrmse);
}

/// The files that the documentation is about, and the entries in it.
#[test]
fn what_is_documented_works() {
    assert!(!plants().is_empty());
    let page = std::fs::read_to_string(repository().join("docs/own-in-toml.md")).unwrap();
    let blocks: Vec<&str> = page
        .split("```toml\n")
        .skip(1)
        .map(|b| b.split("```").next().unwrap())
        .collect();
    assert_eq!(blocks.len(), 5);
    let twil = std::fs::read_to_string(repository().join("examples/twil/model.toml")).unwrap();
    let with = model(&format!("{twil}\n{}", blocks[0]));
    assert_eq!(with.effects[0].at.len(), 2);
    let oscillator = "[plant.oscillator.physical]\nmass = 2.0\nstiffness = 5e4\ndamping = 10.0\n";
    let with = model(&format!("{oscillator}\n{}", blocks[1]));
    assert_eq!(with.effects[0].meta.states, 1);
    let with = model(&format!("[plant.dc_axis]\n{}", blocks[2]));
    assert!(with.effects.is_empty());
    assert_eq!(with.candidates.len(), 1);
    let pendulum = model(blocks[3]);
    assert_eq!(pendulum.parameters.len(), 4);
    assert!(pendulum.affine().is_some());
    let with = model(&format!("[plant.dc_axis]\n{}", blocks[4]));
    assert_eq!(with.parameters.last().unwrap().name, "discovered.c");
}

/// Two bodies of 2 s and 200 s, read every 5 s.
const OVEN: &str = "[plant.expression.states]\n\
    element = { unit = \"1\", rate = \"0.5 * (heater - element)\" }\n\
    body = { unit = \"1\", rate = \"0.005 * (element - body)\" }\n\
    [plant.expression.inputs]\nheater = { unit = \"1\" }\n[log.measured.body]\n";

fn oven(text: &str) -> Vec<f64> {
    let (model, _) = Model::from_toml("oven.toml", text).unwrap();
    let mut simulator = Simulator::new(&model, &model.values());
    let mut body = Vec::new();
    for k in 0..200_u32 {
        let heater = if k / 40 % 2 == 0 { 1.0 } else { 0.2 };
        simulator.advance(5.0 * f64::from(k + 1), &[heater]);
        body.push(simulator.state()[1]);
    }
    body
}

#[test]
fn long_steps_come_to_the_same_place() {
    let given = oven(&format!("{OVEN}[simulation]\nmax_step_s = 0.0025\n"));
    let chosen = oven(OVEN);
    let off = given.iter().zip(&chosen).map(|(a, b)| (a - b).abs());
    assert!(off.fold(0.0, f64::max) < 2e-5);
    // They are not the short ones.
    assert!(given.iter().zip(&chosen).any(|(a, b)| a != b));
}

#[test]
fn a_stiff_model_takes_as_short_steps_as_it_needs() {
    // 2 ms beside 5 s between samples: longer steps would be unstable.
    let stiff = OVEN.replace("0.5 * (heater", "500.0 * (heater");
    let body = oven(&stiff);
    assert!(body.iter().all(|v| (0.0..=1.0).contains(v)), "{body:?}");
}
