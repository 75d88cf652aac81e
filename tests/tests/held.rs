//! What cannot be simulated from the inputs alone: a pole held upright by a loop, and a mass that a
//! motor pushes to and fro.

#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a wrong conclusion is how this program fails"
)]

use assert_cmd::Command;
use loopsight_diagnosis::{
    Because, Conclusion, ExperimentLimits, FitSettings, Measurements, Question, QuestionError,
    Work, compare, diagnose, experiment,
};
use loopsight_diagnosis::{Fit, fit};
use loopsight_model::model::Model;
use loopsight_model::run::Run;
use loopsight_tests::balance::{axis, cart_pole, servo, upright};
use loopsight_tests::{PERIOD, repository, unknown};
use rayon::prelude::*;
use serde_json::Value;

const SEEDS: std::ops::RangeInclusive<u64> = 1..=8;
/// A first guess that is off by a quarter.
const OFF: [f64; 3] = [1.25, 0.75, 0.8];

fn fitted(model: &Model, run: Run) -> Fit {
    let settings = FitSettings::default();
    fit(model, &Measurements::new(&[run]), &settings, &Work::quiet()).unwrap()
}

/// How many of the intervals of `fits` hold the truth.
fn covered(fits: &[Fit], truth: &[(&str, f64)]) -> usize {
    let mut count = 0;
    for fit in fits {
        for (name, value) in truth {
            let found = &fit.parameters[*name];
            let [low, high] = found.interval95.unwrap();
            count += usize::from((low..=high).contains(value));
            let off = (found.value - value).abs() / value.abs();
            assert!(off < 0.03, "{name}: {found:?}");
        }
    }
    count
}

const POLE: [(&str, f64); 3] = [
    ("total_mass", 1.2),
    ("pole_moment", 0.06),
    ("pole_inertia", 0.024),
];

#[test]
fn a_pole_held_upright_tells_its_masses() {
    let truth = cart_pole([1.0; 3], "", true);
    let fits: Vec<Fit> = SEEDS
        .into_par_iter()
        .map(|seed| fitted(&cart_pole(OFF, "", true), upright(&truth, 30.0, seed)))
        .collect();
    for fit in &fits {
        let held = fit.comparison.observer.as_ref().unwrap();
        assert_eq!(held.because, Because::Unstable);
        // It falls with λ = 5.3 1/s.
        assert!(held.statement.contains("doubles in 0.13 s"), "{held:?}");
        assert!(fit.nrmse_before.unwrap() > 3.0 * fit.nrmse_fit);
    }
    let count = covered(&fits, &POLE);
    println!("{count} of {} intervals hold the truth", 3 * fits.len());
    assert!(count >= 20, "{count} of {}", 3 * fits.len());
}

/// The speeds are not measured, so those at the start are found with the rest.
#[test]
fn a_pole_needs_no_speeds_to_tell_its_masses() {
    let truth = cart_pole([1.0; 3], "", false);
    let fits: Vec<Fit> = (1..=3u64)
        .into_par_iter()
        .map(|seed| fitted(&cart_pole(OFF, "", false), upright(&truth, 30.0, seed)))
        .collect();
    let count = covered(&fits, &POLE);
    println!("{count} of {} intervals hold the truth", 3 * fits.len());
    assert!(count >= 7, "{count} of {}", 3 * fits.len());
}

#[test]
fn a_pole_needs_no_first_guess() {
    let truth = cart_pole([1.0; 3], "", true);
    let fit = fitted(&unknown(truth.clone()), upright(&truth, 20.0, 9));
    assert_eq!(fit.nrmse_before, None);
    covered(&[fit], &POLE);
}

#[test]
fn a_wrong_model_of_a_pole_is_compared_without_running_away() {
    let truth = cart_pole([1.0; 3], "", true);
    let run = upright(&truth, 30.0, 1);
    let right = compare(
        &truth,
        &Measurements::new(std::slice::from_ref(&run)),
        &Work::quiet(),
    )
    .unwrap();
    let wrong = compare(
        &cart_pole(OFF, "", true),
        &Measurements::new(&[run]),
        &Work::quiet(),
    )
    .unwrap();
    assert!(right.nrmse < 0.2, "{}", right.nrmse);
    assert!(wrong.nrmse > 2.0 * right.nrmse && wrong.nrmse < 2.0);
    let json = serde_json::to_value(&wrong).unwrap();
    assert_eq!(json["observer"]["because"], "unstable");
    assert!(json["observer"]["horizon_s"].as_f64().unwrap() > 0.3);
}

#[test]
fn nothing_is_missing_from_a_pole_without_a_secret() {
    let truth = cart_pole([1.0; 3], "", true);
    let run = upright(&truth, 30.0, 5);
    let told = diagnose(
        &cart_pole(OFF, "", true),
        &Measurements::new(&[run]),
        &Work::quiet(),
    )
    .unwrap();
    assert_eq!(
        told.verdict,
        Conclusion::NothingMissing,
        "{:?}",
        told.missing
    );
    assert_eq!(told.observer.unwrap().because, Because::Unstable);
}

/// The story of `examples/cart-pole`, as a user has it.
#[test]
fn friction_of_the_cart_is_named_from_a_pole_held_upright() {
    let folder = repository().join("examples/cart-pole");
    let output = Command::new(env!("CARGO_BIN_EXE_loopsight-under-test"))
        .current_dir(folder)
        .args(["diagnose", "model.toml", "upright.csv", "--json"])
        .output()
        .unwrap();
    let text = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(0), "{text}");
    assert!(text.contains("The model lacks coulomb_friction at cart"));
    assert!(text.contains("Note: the model is unstable"), "{text}");
    let told: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(told["missing"]["at"], serde_json::json!(["cart"]));
    assert_eq!(told["observer"]["because"], "unstable");
    let number = |value: &Value| value.as_f64().unwrap();
    let best = &told["candidates"][0];
    let level = number(&best["parameters"]["level"]["value"]);
    assert!((level - 0.4).abs() < 0.01, "{level} N");
    assert!(number(&best["nrmse"]) < 1.2 * number(&told["floor"]["nrmse"]));
    assert!(number(&told["nominal"]["nrmse"]) > 2.0 * number(&best["nrmse"]));
}

const AXIS: [(&str, f64); 2] = [("K_A", -0.08), ("K_C", 6.0)];

#[test]
fn an_axis_that_drifts_tells_its_parameters() {
    let truth = axis([1.0; 2], "");
    let fits: Vec<Fit> = SEEDS
        .into_par_iter()
        .map(|seed| fitted(&axis([1.3, 0.75], ""), servo(&truth, 30.0, seed, 0.02)))
        .collect();
    for fit in &fits {
        let held = fit.comparison.observer.as_ref().unwrap();
        assert_eq!(held.because, Because::Integrating, "{held:?}");
    }
    let count = covered(&fits, &AXIS);
    println!("{count} of {} intervals hold the truth", 2 * fits.len());
    assert!(count >= 13, "{count} of {}", 2 * fits.len());
}

#[test]
fn an_axis_that_drifts_is_diagnosed() {
    let friction =
        "[[effect]]\n[effect.coulomb_friction]\nat = [\"shaft\"]\nlevel = 0.1\nwidth = 0.02\n";
    let told = |effects: &str| {
        let run = servo(&axis([1.0; 2], effects), 30.0, 5, 0.02);
        diagnose(
            &axis([1.3, 0.75], ""),
            &Measurements::new(&[run]),
            &Work::quiet(),
        )
        .unwrap()
    };
    let clean = told("");
    assert_eq!(
        clean.verdict,
        Conclusion::NothingMissing,
        "{:?}",
        clean.missing
    );
    let rough = told(friction);
    assert_eq!(rough.missing.unwrap().effect, "coulomb_friction");
}

/// A pole falls whatever was planned; an axis that drifts can still be driven.
#[test]
fn no_experiment_is_planned_for_what_falls_over() {
    let limits = ExperimentLimits {
        duration: Some(5.0),
        limit: 2.0,
        period: PERIOD,
    };
    let plan = |model: &Model| experiment(model, &Question::All, &limits, &Work::quiet());
    let falls = plan(&cart_pole([1.0; 3], "", true)).err();
    assert!(matches!(falls, Some(QuestionError::Unstable)), "{falls:?}");
    assert!(plan(&axis([1.0; 2], "")).is_ok());
}

/// With some damping the drift is bounded, and the inputs alone say all.
#[test]
fn a_damped_axis_runs_freely() {
    let truth = axis([100.0, 10.0], "");
    let compared = compare(
        &truth,
        &Measurements::new(&[servo(&truth, 30.0, 1, 0.02)]),
        &Work::quiet(),
    )
    .unwrap();
    assert_eq!(compared.observer, None);
    let json = serde_json::to_value(&compared).unwrap();
    assert!(json.get("observer").is_none());
}
