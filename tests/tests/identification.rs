//! What identification promises, in figures: on data of the paper's robot (Alves, Lages, Henriques
//! 2018), made by a simulator with far finer steps than the fitted model.

#![allow(
    clippy::unwrap_used,
    reason = "what is built here is right, and a panic is how this program fails"
)]

use loopsight_diagnosis::{Fit, FitSettings, Measurements, Method, Scheme, Work, fit};
use loopsight_model::model::Model;
use loopsight_model::run::{Rows, Run};
use loopsight_model::sensor::Sensor;
use loopsight_tests::{PERIOD, instants, measured_by, prbs, recording, twil, unknown};
use rayon::prelude::*;

/// The parameters that are estimated.
const NAMES: [&str; 6] = ["K_A", "K_B", "K_C", "K_D", "K_E", "K_F"];
/// Those that the project promises an accuracy for. `K_B` and `K_E` act only while the robot turns,
/// and while it drives and turns: how well they are known depends on the experiment.
const PINNED: [&str; 4] = ["K_A", "K_C", "K_D", "K_F"];

fn fitted(model: &Model, run: Run, method: Method, scheme: Scheme) -> Fit {
    let settings = FitSettings {
        method,
        scheme,
        ..FitSettings::default()
    };
    fit(
        &unknown(model.clone()),
        &Measurements::new(&[run]),
        &settings,
        &Work::quiet(),
    )
    .unwrap()
}

fn value(model: &Model, name: &str) -> f64 {
    let found = model.parameters.iter().find(|p| p.name == name);
    found.unwrap().value.unwrap()
}

/// Relative error of `name` in `fit`.
fn error(fit: &Fit, truth: &Model, name: &str) -> f64 {
    let right = value(truth, name);
    (value(&fit.model, name) - right) / right
}

#[test]
fn without_noise_output_error_finds_the_six_parameters() {
    for sensor in [Sensor::Instantaneous, Sensor::IntervalMean] {
        let truth = measured_by(twil(), &sensor);
        let run = recording(&truth, 1, false);
        let fit = fitted(&truth, run, Method::OutputError, Scheme::Integrated);
        for name in NAMES {
            let off = error(&fit, &truth, name);
            println!("{}: {name} off by {off:.1e}", sensor.name());
            assert!(off.abs() < 1e-6, "{}: {name} off by {off:e}", sensor.name());
        }
    }
}

/// On a robot that obeys (40)(41) to the last digit, their regression is exact.
#[test]
fn without_noise_the_papers_recursion_returns_the_six_parameters() {
    let truth = measured_by(twil(), &Sensor::Instantaneous);
    let [k_a, k_b, k_c, k_d, k_e, k_f] = NAMES.map(|name| value(&truth, name));
    let time = instants(25.0);
    let inputs = prbs(&truth, 9.0, 1, &time);
    let (mut v, mut omega) = (0.0, 0.0);
    let mut measured = Vec::with_capacity(2 * time.len());
    for volts in inputs.chunks_exact(2) {
        measured.extend([v, omega]);
        let (right, left) = (volts[0], volts[1]);
        let rate = [
            k_a * v + k_b * omega * omega + k_c * (right + left),
            k_d * omega + k_e * v * omega + k_f * (right - left),
        ];
        v += PERIOD * rate[0];
        omega += PERIOD * rate[1];
    }
    let run = Run::new("", time, Rows::new(2, inputs), Rows::new(2, measured)).unwrap();
    let fit = fitted(&truth, run, Method::Rls, Scheme::Euler);
    for name in NAMES {
        let off = error(&fit, &truth, name);
        println!("{name} off by {off:.1e}");
        assert!(off.abs() < 1e-6, "{name} off by {off:e}");
    }
}

/// The robot is continuous, (40)(41) is not: from samples at 100 Hz it finds `(e^(K T) - 1)/T`
/// where `K` is meant, -14.05 1/s instead of -15.146 1/s.
#[test]
fn the_papers_recursion_is_biased_on_a_continuous_robot_and_the_integrated_one_is_not() {
    let truth = measured_by(twil(), &Sensor::Instantaneous);
    let run = recording(&truth, 1, false);
    let euler = fitted(&truth, run.clone(), Method::Rls, Scheme::Euler);
    for name in ["K_A", "K_D"] {
        let k = value(&truth, name);
        let biased = ((k * PERIOD).exp() - 1.0) / PERIOD;
        let found = value(&euler.model, name);
        println!("Euler: {name} = {found:.3}, expected {biased:.3}, meant {k}");
        // Turning bends the yaw rate's decay through `K_E v`, which the closed form leaves out.
        let band = if name == "K_A" { 0.01 } else { 0.03 };
        assert!((found / biased - 1.0).abs() < band, "{name} = {found}");
    }
    let integrated = fitted(&truth, run, Method::Rls, Scheme::Integrated);
    for name in NAMES {
        println!(
            "integrated: {name} off by {:.1e}",
            error(&integrated, &truth, name)
        );
    }
    for name in PINNED {
        let off = error(&integrated, &truth, name);
        assert!(off.abs() < 5e-3, "{name} off by {off:e}");
    }
}

/// A fit to 25 s of encoder counts: relative error and whether the 95 % interval holds the truth,
/// by parameter.
fn counted(truth: &Model, seed: u64) -> [(f64, bool); 6] {
    let run = recording(truth, seed, true);
    let fit = fitted(truth, run, Method::OutputError, Scheme::Integrated);
    NAMES.map(|name| {
        let right = value(truth, name);
        let [low, high] = fit.parameters[name].interval95.unwrap();
        (error(&fit, truth, name), low <= right && right <= high)
    })
}

#[test]
fn from_encoder_counts_output_error_is_within_one_per_cent() {
    let truth = twil();
    let runs: Vec<_> = (0..8)
        .into_par_iter()
        .map(|seed| counted(&truth, 1 + seed))
        .collect();
    for (i, name) in NAMES.iter().enumerate() {
        let worst = runs.iter().fold(0.0f64, |a, run| a.max(run[i].0.abs()));
        println!("{name}: worst of {} seeds off by {worst:.1e}", runs.len());
        if PINNED.contains(name) {
            assert!(worst < 0.01, "{name} off by {worst:e}");
        }
    }
}

/// An interval of 95 % holds the truth in 93 to 97 % of 400 runs.
#[test]
#[ignore = "400 fits: run in release"]
fn intervals_of_95_per_cent_hold_the_truth_as_often_as_they_say() {
    const RUNS: u64 = 400;
    let truth = twil();
    let runs: Vec<_> = (0..RUNS)
        .into_par_iter()
        .map(|seed| counted(&truth, 1000 + seed))
        .collect();
    let mut wrong = Vec::new();
    for (i, name) in NAMES.iter().enumerate() {
        let held = runs.iter().filter(|run| run[i].1).count();
        let share = held as f64 / RUNS as f64;
        let mean = runs.iter().map(|run| run[i].0).sum::<f64>() / RUNS as f64;
        let squares: f64 = runs.iter().map(|run| (run[i].0 - mean).powi(2)).sum();
        let deviation = (squares / (RUNS - 1) as f64).sqrt();
        println!(
            "{name}: {held} of {RUNS} intervals hold it; bias {mean:.1e}, deviation {deviation:.1e} of it"
        );
        if PINNED.contains(name) && !(0.93..=0.97).contains(&share) {
            wrong.push(format!("{name}: {held} of {RUNS}"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join(", "));
}
