//! `improve` where no effect of the library helps alone: with [`ImproveSettings::discover`] an expression does, and else
//! two effects together.

#![allow(
    clippy::unwrap_used,
    reason = "helpers of tests: a failure is the test's failure"
)]

use loopsight_diagnosis::{
    Conclusion, ImproveSettings, Improvement, Measurements, Work, diagnose, improve,
};
use loopsight_model::excitation::{Excitation, Sequence};
use loopsight_model::model::Model;
use loopsight_model::run::Run;
use loopsight_plants as _;

const PERIOD: f64 = 0.01;
const STEPS: usize = 100;

/// Rates of the states at time (s), with the inputs.
type Rates = fn(time: f64, u: &[f64], x: &[f64]) -> Vec<f64>;

/// A machine from first principles, and the model that lacks something.
struct Machine {
    /// Time between two samples, s.
    period: f64,
    inputs: &'static [&'static str],
    /// Mean of the commands, and how far they go from it.
    commands: [f64; 2],
    states: usize,
    /// Where all of them begin.
    at_rest: f64,
    /// Which states are measured, and the standard deviation of the noise.
    measured: &'static [usize],
    noise: f64,
    rates: Rates,
    model: &'static str,
}

/// A recording: semi-implicit Euler at a hundredth of a period, an integrator that no model uses. States come as speed, position pairs.
fn record(machine: &Machine, samples: usize, seed: u64) -> Run {
    let commands: Vec<Sequence> = (0..)
        .zip(machine.inputs)
        .map(|(i, name)| {
            let levels = Excitation::MultiLevel {
                amplitude: machine.commands[1],
                hold_s: 50.0 * machine.period,
                levels: 7,
                seed: seed + i,
                common: false,
            };
            levels.build(name).unwrap()
        })
        .collect();
    let mut noise = noise(seed);
    let h = machine.period / STEPS as f64;
    let mut x = vec![machine.at_rest; machine.states];
    let mut run = Run::empty(machine.inputs.len(), machine.measured.len());
    for k in 0..=samples {
        let time = machine.period * k as f64;
        let commands = commands.iter();
        let u: Vec<f64> = commands
            .map(|c| machine.commands[0] + c.sample(time))
            .collect();
        let measured = machine.measured.iter();
        let y: Vec<f64> = measured.map(|i| x[*i] + machine.noise * noise()).collect();
        run.push(time, &u, &y).unwrap();
        for step in 0..STEPS {
            let now = time + h * step as f64;
            for i in 0..x.len() {
                x[i] += h * (machine.rates)(now, &u, &x)[i];
            }
        }
    }
    run
}

/// Noise of variance one: the sum of twelve uniform numbers.
fn noise(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15);
    move || {
        let mut sum = -6.0;
        for _ in 0..12 {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            sum += (state >> 11) as f64 / (1u64 << 53) as f64;
        }
        sum
    }
}

/// Improves the machine's model with one recording, judged on another.
fn discover(machine: &Machine) -> Improvement {
    let model = Model::from_toml("machine", machine.model).unwrap().0;
    let [log, test] = [1, 20].map(|seed| record(machine, 3000, seed));
    let measurements =
        Measurements::new(std::slice::from_ref(&log)).tested_on(Some(std::slice::from_ref(&test)));
    let settings = ImproveSettings { discover: true };
    improve(&model, &measurements, &settings, &Work::quiet()).unwrap()
}

/// The error at the end is at the floor, with the discovered `law` alone. Each of its parameters has its `truth` in its
/// 95 % interval, widened by a thousandth for the integrator.
fn is_found(found: &Improvement, law: &str, truth: &[(&str, f64)]) {
    let steps: Vec<_> = found
        .steps
        .iter()
        .map(|s| s.added.as_ref().map(|a| &a.effect))
        .collect();
    let best = found.best.as_ref().unwrap();
    assert_eq!(steps.len(), 2, "{steps:?}");
    assert_eq!(best.model.effects[0].meta.equation, format!("w = {law}"));
    assert_eq!(found.verdict, Conclusion::NothingMissing);
    let floor = found.diagnoses.last().unwrap().floor.nrmse;
    let left = found.steps[1].nrmse_test;
    assert!(left < 1.1 * floor, "{left} above the floor {floor}");
    for (name, value) in truth {
        let [low, high] = best.parameters[*name].interval95.unwrap();
        let slack = 1e-3 * value.abs();
        let holds = (low - slack..=high + slack).contains(value);
        assert!(holds, "{name}: {low} … {high}, expected {value}");
    }
}

/// A motor that turns a load, whose model lacks nothing.
const AXIS: Machine = Machine {
    period: PERIOD,
    inputs: &["voltage"],
    commands: [0.0, 9.0],
    states: 1,
    at_rest: 0.0,
    measured: &[0],
    noise: 0.02,
    rates: |_, u, x| vec![6.0 * u[0] - 2.0 * x[0]],
    model: "[plant.dc_axis]\n[log.measured]\nspeed = { column = \"speed\" }\n",
};

/// An amplifier that is stronger to one side: `u + 0.03 u²`.
#[test]
#[ignore = "seconds: `.ci/run` runs it in release"]
fn the_curve_of_an_amplifier_is_found() {
    let machine = Machine {
        rates: |_, u, x| vec![6.0 * (u[0] + 0.03 * u[0] * u[0]) - 2.0 * x[0]],
        ..AXIS
    };
    let truth = [("discovered.c", 0.03), ("K_C", 6.0), ("K_A", -2.0)];
    is_found(&discover(&machine), "c * drive^2", &truth);
}

/// A bucket that fills under a tap pulls at the shaft.
#[test]
#[ignore = "seconds: `.ci/run` runs it in release"]
fn a_load_that_grows_with_time_is_found() {
    let machine = Machine {
        rates: |t, u, x| vec![6.0 * (u[0] - 0.02 * t) - 2.0 * x[0]],
        ..AXIS
    };
    let truth = [("discovered.c", -0.02), ("K_C", 6.0), ("K_A", -2.0)];
    is_found(&discover(&machine), "c * time", &truth);
}

/// A pendulum against a spring that stiffens, on one side. An offset of twice the largest command was an explanation.
#[test]
#[ignore = "seconds: `.ci/run` runs it in release"]
fn a_spring_on_one_side_is_found() {
    let machine = Machine {
        commands: [0.0, 3.0],
        states: 2,
        measured: &[1],
        noise: 1e-3,
        rates: |_, u, x| {
            let spring = 5.0 * x[1].max(0.0) * x[1];
            vec![6.0 * (u[0] - spring) - 2.0 * x[0] - 40.0 * x[1].sin(), x[0]]
        },
        model: "[plant.arm]\nlevel_angle = 1.5707963267948966\n[log.measured]\nangle = { column = \"angle\" }\n",
        ..AXIS
    };
    let truth = [("discovered.c", -5.0), ("K_G", 40.0), ("K_C", 6.0)];
    is_found(
        &discover(&machine),
        "c * max(position, 0) * position",
        &truth,
    );
}

/// A stove that radiates, read once a second. With a drag that grows with the square of the difference, and nothing more, ten
/// times the floor was left.
#[test]
#[ignore = "seconds: `.ci/run` runs it in release"]
fn heat_that_is_radiated_is_found() {
    let machine = Machine {
        period: 1.0,
        inputs: &["power"],
        commands: [60.0, 60.0],
        states: 2,
        at_rest: 293.15,
        measured: &[0, 1],
        rates: |_, u, x| {
            let radiated = 2e-9 * (x[1].powi(4) - 293.15f64.powi(4));
            let between = 2.0 * (x[0] - x[1]);
            vec![
                (u[0] - between) / 50.0,
                (between - 0.2 * (x[1] - 293.15) - radiated) / 200.0,
            ]
        },
        model: "[plant.thermal]\n[log.measured]\nheater = { column = \"heater\" }\nbody = { column = \"body\" }\n",
        ..AXIS
    };
    let truth = [("discovered.c", -1e-11), ("loss", 1e-3), ("heating", 0.02)];
    is_found(&discover(&machine), "c * (body^4 - s^4)", &truth);
}

/// A contact that corrodes: the current falls by a half per cent each second, whatever drives it. The library knows that:
/// the gain of the input falls, and so does the part of the damping that is the back-emf's.
#[test]
#[ignore = "seconds: `.ci/run` runs it in release"]
fn a_resistance_that_grows_with_time_is_known() {
    let machine = Machine {
        rates: |t, u, x| vec![(1.0 - 0.005 * t) * (6.0 * u[0] - 1.5 * x[0]) - 0.5 * x[0]],
        ..AXIS
    };
    let found = discover(&machine);
    let added = found.steps.iter().filter_map(|s| s.added.as_ref());
    let mut added: Vec<&str> = added.map(|a| a.effect.as_str()).collect();
    added.sort_unstable();
    assert_eq!(added, ["friction_drift", "gain_drift"]);
    assert_eq!(found.verdict, Conclusion::NothingMissing);
    let best = found.best.as_ref().unwrap();
    for (name, value) in [
        ("gain_drift.rate", -0.005),
        ("friction_drift.rate", -0.00125),
    ] {
        let rate = best.parameters[name].value;
        assert!((rate - value).abs() < 0.1 * value.abs(), "{name}: {rate}");
    }
}

/// A driver on 5 V that lets go of the motor in the pauses of its pulses, and dry friction behind it. Without friction the
/// driver's motor comes to one speed whatever the command is, and friction alone makes the middle commands worse.
#[test]
fn friction_behind_a_driver_that_coasts_is_found_with_it() {
    let machine = Machine {
        commands: [3.2, 1.6],
        rates: |_, u, x| {
            let friction = 1.4 * (x[0] / 0.05).tanh();
            vec![30.0 * (u[0] - friction) - 10.0 * x[0] * u[0] / 5.0]
        },
        ..AXIS
    };
    let model = Model::from_toml("machine", machine.model).unwrap().0;
    let log = record(&machine, 3000, 1);
    let measurements = Measurements::new(std::slice::from_ref(&log));
    let found = diagnose(&model, &measurements, &Work::quiet()).unwrap();
    let best = &found.candidates[0];
    let both = [Some(&best.place), best.together_with.as_ref()];
    let both = both.map(|place| place.map_or("", |p| p.effect.as_str()));
    assert_eq!(both, ["pulse_coast", "coulomb_friction"]);
    assert_eq!(found.missing.as_ref(), Some(&best.place));
    let settings = ImproveSettings::default();
    let improved = improve(&model, &measurements, &settings, &Work::quiet()).unwrap();
    let added = improved.steps.iter().filter_map(|s| s.added.as_ref());
    let added: Vec<&str> = added.map(|a| a.effect.as_str()).collect();
    assert_eq!(added, ["pulse_coast", "coulomb_friction"]);
    assert_eq!(improved.verdict, Conclusion::NothingMissing);
    let gain = improved.best.as_ref().unwrap().parameters["K_C"].value;
    assert!((gain - 30.0).abs() < 1.0, "{gain}");
}

/// Two sledges on springs. The force on the first is in proportion to both positions.
#[test]
fn a_force_that_depends_on_two_positions_is_found() {
    let machine = Machine {
        inputs: &["f1", "f2"],
        states: 4,
        measured: &[1, 3],
        noise: 5e-4,
        rates: |_, u, x| {
            vec![
                u[0] - 1.2 * x[0] - 20.0 * x[1] - 15.0 * x[1] * x[3],
                x[0],
                (u[1] - 1.5 * x[2] - 30.0 * x[3]) / 1.5,
                x[2],
            ]
        },
        model: r#"
[plant.expression.states]
v1 = { unit = "m/s", rate = "f1 + first - d1 * v1 - k1 * x1" }
x1 = { unit = "m", rate = "v1" }
v2 = { unit = "m/s", rate = "(f2 + second - d2 * v2 - k2 * x2) / 1.5" }
x2 = { unit = "m", rate = "v2" }
[plant.expression.inputs]
f1 = { unit = "N" }
f2 = { unit = "N" }
[plant.expression.channels]
first = { unit = "N", flow = "v1", position = "x1", drive = "f1" }
second = { unit = "N", flow = "v2", position = "x2", drive = "f2" }
[plant.expression.parameters]
d1 = { value = 1.0, unit = "N s/m", range = [0.0, 50.0] }
k1 = { value = 15.0, unit = "N/m", range = [0.0, 500.0] }
d2 = { value = 1.0, unit = "N s/m", range = [0.0, 50.0] }
k2 = { value = 25.0, unit = "N/m", range = [0.0, 500.0] }
[log.measured]
x1 = { column = "x1" }
x2 = { column = "x2" }
"#,
        ..AXIS
    };
    let truth = [("discovered.c", -15.0), ("k1", 20.0), ("d2", 1.5)];
    is_found(&discover(&machine), "c * position * x2", &truth);
}
