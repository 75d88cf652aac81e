//! Real measurements, made by others on real hardware, without a model file. They are not part of
//! the project: the environment variable `LOOPSIGHT_DATA` names the folder that holds them.

#![allow(
    clippy::unwrap_used,
    reason = "logs that are known to be readable, and a panic is how this program fails"
)]

use std::path::{Path, PathBuf};
use std::process::Output;

use assert_cmd::Command;
use loopsight_tests::real_data;
use serde_json::Value;

fn data(file: &str) -> Option<PathBuf> {
    Some(real_data(file)?.join("frc").join(file))
}

fn loopsight(arguments: &[&str], log: &Path, page: &Path) -> Output {
    Command::new(env!("CARGO_BIN_EXE_loopsight-under-test"))
        .args(arguments)
        .arg(log)
        .arg("--json")
        .arg("--html")
        .arg(page)
        .output()
        .unwrap()
}

/// Compares and fits without a model file; returns what both say.
fn compared_and_fitted(file: &str) -> Option<(Value, Value)> {
    let log = data(file)?;
    let folder = tempfile::tempdir().unwrap();
    let mut said = ["compare", "fit"].map(|command| {
        let page = folder.path().join(format!("{command}.html"));
        let output = loopsight(&[command], &log, &page);
        let text = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(0), "{command} {file}: {text}");
        println!("{command} {file}:\n{text}");
        let html = std::fs::read_to_string(&page).unwrap();
        assert!(html.contains("<html") && html.len() > 10_000, "{file}");
        serde_json::from_slice::<Value>(&output.stdout).unwrap()
    });
    let fitted = said[1].take();
    let compared = said[0].take();
    // Without values to compare, a comparison shows the best that the plain model can do.
    let (a, b) = (number(&compared["nrmse"]), number(&fitted["nrmse"]));
    assert!((a / b - 1.0).abs() < 1e-6, "compare {a}, fit {b}");
    Some((compared, fitted))
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or(f64::NAN)
}

fn kinds(said: &Value) -> Vec<&str> {
    let faults = said["faults"].as_array().unwrap();
    faults.iter().map(|f| f["kind"].as_str().unwrap()).collect()
}

/// The error of every signal and the whole is within `band`.
fn nrmse_within(said: &Value, band: std::ops::Range<f64>) {
    let mut errors = vec![number(&said["nrmse"])];
    for signal in said["signals"].as_array().unwrap() {
        errors.push(number(&signal["nrmse"]));
        assert!(number(&signal["one_step_nrmse"]) < 1.0, "{signal}");
    }
    for error in errors {
        assert!(band.contains(&error), "{error} is outside {band:?}");
    }
}

fn value(said: &Value, name: &str) -> f64 {
    number(&said["parameters"][name]["value"])
}

#[test]
fn team4277_is_fitted_and_its_gyro_is_named() {
    let Some((compared, fitted)) = compared_and_fitted("team4277-drivetrain.json") else {
        return;
    };
    assert!(kinds(&compared).contains(&"gyro_scale"), "{compared}");
    nrmse_within(&compared, 0.02..0.5);
    // A robot that slows down without voltage and speeds up with it.
    assert!(
        value(&fitted, "K_A") < 0.0 && value(&fitted, "K_C") > 0.0,
        "{fitted}"
    );
}

#[test]
fn team564_straight_is_fitted_and_its_unsigned_voltages_are_named() {
    let Some((compared, fitted)) = compared_and_fitted("team564-drivetrain-linear.json") else {
        return;
    };
    assert!(kinds(&compared).contains(&"unsigned_voltage"), "{compared}");
    nrmse_within(&compared, 0.02..0.5);
    assert!(
        value(&fitted, "K_A") < 0.0 && value(&fitted, "K_C") > 0.0,
        "{fitted}"
    );
}

#[test]
fn team564_turning_is_fitted_and_its_unsigned_voltages_are_named() {
    let Some((compared, fitted)) = compared_and_fitted("team564-drivetrain-angular.json") else {
        return;
    };
    assert!(kinds(&compared).contains(&"unsigned_voltage"), "{compared}");
    nrmse_within(&compared, 0.02..0.7);
    // The scrub of turning on the spot bends the plain model's damping to nothing: only the sign of
    // the drive is sure.
    assert!(value(&fitted, "K_F") > 0.0, "{fitted}");
}

#[test]
fn team157_is_fitted_without_complaint() {
    let Some((compared, _)) = compared_and_fitted("team157-drivetrain.json") else {
        return;
    };
    nrmse_within(&compared, 0.02..0.5);
}

#[test]
fn denhams_flywheel_is_fitted() {
    let Some((compared, fitted)) = compared_and_fitted("denham-flywheel.json") else {
        return;
    };
    nrmse_within(&compared, 0.02..0.5);
    assert!(
        value(&fitted, "K_A") < 0.0 && value(&fitted, "K_C") > 0.0,
        "{fitted}"
    );
}

/// An arm that hardly moved: named as such, and no more claimed than the log holds.
#[test]
fn team581s_arm_is_named_as_the_hard_case_it_is() {
    let Some(log) = data("team581-arm.json") else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let output = loopsight(&["compare"], &log, &folder.path().join("page.html"));
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    println!("{text}");
    assert!(matches!(output.status.code(), Some(0 | 2)), "{text}");
    assert!(
        text.contains("motionless") && text.contains("short run"),
        "{text}"
    );
}
