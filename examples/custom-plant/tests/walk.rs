//! The walk of the README, taken by a program: parts that only this crate has are in every command.

#![allow(
    clippy::unwrap_used,
    reason = "a command that breaks its word is how this program fails"
)]

use std::path::Path;
use std::process::Command;

use serde_json::Value;

/// The command, run in the folder of this crate; returns what it prints.
fn done(arguments: &[&str]) -> String {
    let output = Command::new(env!("CARGO_BIN_EXE_custom-plant"))
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .args(arguments)
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{arguments:?}: {said}");
    String::from_utf8(output.stdout).unwrap()
}

fn json(arguments: &[&str]) -> Value {
    serde_json::from_str(&done(arguments)).unwrap()
}

fn here(name: &str) -> String {
    std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(name)).unwrap()
}

const JUDGED: [&str; 4] = ["model.toml", "turns.csv", "--test", "zigzag.csv"];

#[test]
fn the_plant_and_the_effect_are_listed_and_explained() {
    assert!(done(&["list", "plants"]).contains("ship_heading"));
    assert!(done(&["list", "effects"]).contains("norrbin_damping"));
    // Our effect fits where theirs do, and theirs fit on our plant.
    let plant = done(&["explain", "ship_heading"]);
    for effect in [
        "norrbin_damping",
        "quadratic_drag",
        "dead_zone",
        "sensor_delay",
    ] {
        assert!(plant.contains(effect), "{plant}");
    }
    let effect = done(&["explain", "norrbin_damping"]);
    assert!(
        effect.contains("hull") && effect.contains("shaft"),
        "{effect}"
    );
    for file in ["ship.toml", "model.toml", "zigzag.toml", "turns.toml"] {
        done(&["check", file]);
    }
}

#[test]
fn the_recordings_are_those_that_the_command_makes() {
    let desk = tempfile::tempdir().unwrap();
    for name in ["turns", "zigzag"] {
        let log = desk.path().join("log.csv");
        let experiment = format!("{name}.toml");
        done(&[
            "simulate",
            "ship.toml",
            &experiment,
            "-o",
            log.to_str().unwrap(),
        ]);
        let made = std::fs::read_to_string(&log).unwrap();
        assert!(made == here(&format!("{name}.csv")), "{name}.csv differs");
    }
}

#[test]
fn the_model_is_wrong_the_effect_is_named_and_the_error_falls() {
    let desk = tempfile::tempdir().unwrap();
    let page = |name: &str| desk.path().join(name).to_str().unwrap().to_owned();
    let before = json(&["compare", "model.toml", "zigzag.csv", "--json"]);
    let before = before["nrmse"].as_f64().unwrap();
    assert!(before > 0.2, "{before}");

    let fit = json(&[&["fit"][..], &JUDGED, &["--json"]].concat());
    assert!(
        fit["parameters"]["time_constant"]["value"].is_f64(),
        "{fit}"
    );

    let why = page("why.html");
    let said = done(&[&["diagnose"][..], &JUDGED, &["--html", &why]].concat());
    let verdict = said.lines().next().unwrap();
    assert!(
        verdict.starts_with("The model lacks norrbin_damping at hull"),
        "{said}"
    );
    let html = std::fs::read_to_string(&why).unwrap();
    assert!(
        html.contains("norrbin"),
        "the page does not name the effect"
    );

    let (better, page) = (page("better.toml"), page("better.html"));
    let output = ["-o", &better, "--html", &page];
    done(&[&["improve"][..], &JUDGED, &output].concat());
    let text = std::fs::read_to_string(&better).unwrap();
    assert!(text.contains("[effect.norrbin_damping]"), "{text}");
    let cubic = text.lines().find_map(|l| l.strip_prefix("cubic = "));
    let cubic: f64 = cubic.unwrap().parse().unwrap();
    // 4 s/rad² went into the recording.
    assert!((cubic - 4.0).abs() < 0.1, "{cubic}");
    let html = std::fs::read_to_string(&page).unwrap();
    assert!(html.contains("norrbin"), "the page does not name it");
    let after = json(&["compare", &better, "zigzag.csv", "--json"]);
    let after = after["nrmse"].as_f64().unwrap();
    assert!(after < 0.012, "{before} before, {after} after");
}
