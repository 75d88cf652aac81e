//! The walk of the README, taken by a program: parts that only this crate has are in every command.

#![allow(
    clippy::unwrap_used,
    reason = "a command that breaks its word is how this program fails"
)]

use std::io::{BufRead as _, BufReader, Write as _};
use std::net::TcpListener;
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

#[test]
fn the_helmsman_holds_the_rate_and_the_estimator_sees_the_damping() {
    for (role, id) in [
        ("controllers", "three_position"),
        ("estimators", "random_walk"),
        ("drivers", "tcp_lines"),
    ] {
        assert!(done(&["list", role]).contains(id), "{id}");
        assert!(done(&["explain", id]).contains("Settings"), "{id}");
    }
    // No robot needs to listen for its loop to be checked.
    done(&["check", "helm.toml", "learn.toml", "pond.toml"]);
    let run = json(&["run", "helm.toml", "--json"]);
    let error = run["tracking"][0]["rms_error"].as_f64().unwrap();
    assert!(error < 0.04, "{run}");
    let run = json(&["run", "learn.toml", "--json"]);
    // Of the linear damping alone 0.5 1/s would be found; the cube adds 3 · 4 · 0.15² at most.
    let damping = run["parameters"]["damping"].as_f64().unwrap();
    assert!((0.5..0.77).contains(&damping), "{run}");
}

/// A ship behind a TCP connection, on its own clock: 20 ms between two readings.
fn pond() -> std::net::SocketAddr {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap();
    std::thread::spawn(move || {
        let (stream, _) = listener.accept().unwrap();
        let mut lines = BufReader::new(stream);
        let (mut rate, mut heading, mut rudder) = (0.0, 0.0, 0.0);
        let mut asked = String::new();
        while lines.read_line(&mut asked).is_ok_and(|n| n > 0) {
            let answer = match asked.trim().split_once(' ') {
                Some(("write", angle)) => {
                    rudder = angle.parse::<f64>().unwrap().clamp(-0.4, 0.4);
                    format!("{rudder}\n")
                }
                _ => {
                    heading += 0.02 * rate;
                    rate += 0.02 * (0.25 * rudder - 0.5 * rate - 4.0 * rate * rate * rate);
                    format!("{rate} {heading}\n")
                }
            };
            lines.get_mut().write_all(answer.as_bytes()).unwrap();
            asked.clear();
        }
    });
    address
}

#[test]
fn a_loop_drives_a_ship_over_tcp() {
    let desk = tempfile::tempdir().unwrap();
    let path = |name: &str| desk.path().join(name);
    std::fs::write(path("helm_model.toml"), here("helm_model.toml")).unwrap();
    let text = here("pond.toml")
        .replace("127.0.0.1:5555", &pond().to_string())
        .replace("period_s = 0.1", "period_s = 0.02")
        .replace("duration_s = 10.0", "duration_s = 4.0");
    std::fs::write(path("pond.toml"), text).unwrap();
    let log = path("log.csv");
    let log = log.to_str().unwrap();
    done(&["run", path("pond.toml").to_str().unwrap(), "-o", log]);
    let text = std::fs::read_to_string(log).unwrap();
    // Time, rudder, yaw rate; what stands behind them is about the loop and may be empty, and events
    // are comments.
    let rows: Vec<Vec<f64>> = text
        .lines()
        .skip(1)
        .filter(|line| !line.starts_with('#'))
        .map(|line| {
            line.split(',')
                .take(3)
                .map(|v| v.parse().unwrap())
                .collect()
        })
        .collect();
    assert_eq!(rows.len(), 200);
    // The log holds what the ship applied: its rudder ends at 0.4 rad, 0.5 rad were asked for.
    assert_eq!(rows[0][1], 0.4);
    let late = &rows[150..];
    let mean = late.iter().map(|r| r[2]).sum::<f64>() / late.len() as f64;
    assert!((mean - 0.1).abs() < 0.005, "{mean} rad/s");
}
