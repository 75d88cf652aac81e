//! What `--json` prints keeps the contract that is published under `docs/schema/`.
//!
//! `cargo test -p loopsight-tests --test contract -- --ignored` writes the schemas anew.

#![allow(
    clippy::unwrap_used,
    reason = "a command that breaks its word is how this program fails"
)]

use std::path::PathBuf;
use std::process::Command;

use loopsight_tests::json_schema::{unnamed, violations};
use loopsight_tests::repository;
use serde_json::Value;
use tempfile::TempDir;

const PROGRAM: &str = env!("CARGO_BIN_EXE_loopsight-under-test");

fn path(command: &str) -> PathBuf {
    repository().join(format!("docs/schema/{command}.json"))
}

fn written(schema: &Value) -> String {
    format!("{}\n", serde_json::to_string_pretty(schema).unwrap())
}

#[test]
fn the_published_schemas_are_those_of_the_types() {
    for (command, schema) in loopsight::schema::all() {
        let published = std::fs::read_to_string(path(command)).unwrap_or_default();
        assert!(
            published == written(&schema),
            "docs/schema/{command}.json is not what the types say: \
             `cargo test -p loopsight-tests --test contract -- --ignored` writes it anew"
        );
    }
}

#[test]
#[ignore = "writes files of the repository"]
fn write_the_schemas() {
    std::fs::create_dir_all(repository().join("docs/schema")).unwrap();
    for (command, schema) in loopsight::schema::all() {
        std::fs::write(path(command), written(&schema)).unwrap();
    }
}

/// A folder with a mass on a spring: what it is, what one believes of it, and a loop around a robot.
struct Desk(TempDir);

impl Desk {
    fn new() -> Self {
        let desk = Self(tempfile::tempdir().unwrap());
        let hidden = repository().join("examples/hidden-effect/oscillator_coulomb_friction");
        for (from, to) in [
            (hidden.join("model.toml"), "model.toml"),
            (hidden.join("mixed.csv"), "log.csv"),
            (repository().join("examples/twil/model.toml"), "robot.toml"),
        ] {
            std::fs::copy(from, desk.0.path().join(to)).unwrap();
        }
        for (name, text) in [
            (
                "experiment.toml",
                "duration_s = 2.0\nperiod_s = 0.01\n[inputs]\n\
                 voltage_right = { prbs = { amplitude = 9.0, hold_s = 0.5, seed = 3 } }\n",
            ),
            (
                "loop.toml",
                "model = \"robot.toml\"\nperiod_s = 0.01\nduration_s = 4.0\n\
                 [driver.simulated]\nlimit = 12.0\n\
                 [controller.feedback_linearizing_pi]\nsettling_time_s = 0.45\n\
                 [estimator.rls]\n[reference]\n\
                 linear_velocity = { steps = { at = [[0.5, 0.1], [2.0, -0.1]] } }\n",
            ),
            ("wrong.toml", "[plant.ddmr]\nK_Q = 1.0\n"),
        ] {
            std::fs::write(desk.0.path().join(name), text).unwrap();
        }
        desk
    }

    fn json(&self, arguments: &[&str], status: i32) -> Value {
        let output = Command::new(PROGRAM)
            .current_dir(self.0.path())
            .args(arguments)
            .output()
            .unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(status), "{arguments:?}: {said}");
        serde_json::from_slice(&output.stdout).unwrap()
    }
}

#[test]
fn every_answer_keeps_its_contract() {
    let desk = Desk::new();
    let schemas = loopsight::schema::all();
    let mut seen = Vec::new();
    let series: [&[&str]; 2] = [&["--json"], &["--json", "--series"]];
    let plain = &series[..1];
    for (arguments, status, ways) in [
        (&["list"][..], 0, plain),
        (&["inspect", "log.csv"], 0, plain),
        (
            &["convert", "model.toml", "log.csv", "-o", "si.csv"],
            0,
            plain,
        ),
        (&["explain", "ddmr"], 0, plain),
        (&["explain", "log"], 0, plain),
        (&["explain", "coulomb_friction"], 0, plain),
        (&["explain", "expression"], 0, plain),
        (
            &[
                "check",
                "model.toml",
                "loop.toml",
                "experiment.toml",
                "log.csv",
                "wrong.toml",
            ],
            2,
            plain,
        ),
        (
            &["add", "model.toml", "coulomb_friction", "-o", "with.toml"],
            0,
            plain,
        ),
        (
            &[
                "simulate",
                "robot.toml",
                "experiment.toml",
                "-o",
                "made.csv",
            ],
            0,
            plain,
        ),
        (&["compare", "robot.toml", "made.csv"], 0, &series[..]),
        (&["fit", "model.toml", "log.csv"], 0, &series[..]),
        (&["diagnose", "model.toml", "log.csv"], 0, &series[..]),
        (&["improve", "model.toml", "log.csv"], 0, &series[..]),
        (
            &["experiment", "robot.toml", "--pin", "K_A", "-o", "plan.csv"],
            0,
            plain,
        ),
        (&["run", "loop.toml"], 0, &series[..]),
    ] {
        for way in ways {
            let answer = desk.json(&[arguments, way].concat(), status);
            let (command, schema) = schemas
                .iter()
                .find(|(command, _)| *command == arguments[0])
                .unwrap();
            let broken = violations(schema, &answer);
            assert!(broken.is_empty(), "{arguments:?}: {broken:#?}");
            let unnamed = unnamed(schema, &answer);
            assert!(unnamed.is_empty(), "{arguments:?}: {unnamed:#?}");
            let first = answer.as_object().unwrap().iter().next().unwrap();
            let name = Value::from(format!("loopsight/{command}/1"));
            assert_eq!(first, (&"schema".to_owned(), &name));
            let has_series = answer.get("series").is_some();
            assert_eq!(has_series, way.contains(&"--series"), "{arguments:?}");
            seen.push(*command);
        }
    }
    // What needs a robot at the end of a line is looked at where there is one.
    let all: Vec<&str> = schemas.iter().map(|(command, _)| *command).collect();
    let left: Vec<&&str> = all.iter().filter(|c| !seen.contains(c)).collect();
    assert_eq!(left, [&"send"]);
}

/// The keys of the command contract, by command: they stay.
#[test]
fn the_agreed_keys_are_required() {
    let schemas = loopsight::schema::all();
    let errors = ["nrmse", "fit_percent", "signals", "faults"];
    let said = ["schema", "summary", "where_it_fails"];
    for (command, keys) in [
        ("compare", &[&errors[..], &said].concat()[..]),
        ("fit", &[&errors[..], &said, &["parameters"]].concat()),
        (
            "diagnose",
            &[
                &said[..],
                &[
                    "nominal",
                    "floor",
                    "verdict",
                    "missing",
                    "not_tried",
                    "candidates",
                    "faults",
                    "advice",
                ],
            ]
            .concat(),
        ),
        (
            "improve",
            &[&said[..], &["steps", "verdict", "parameters", "still_open"]].concat(),
        ),
    ] {
        let (_, schema) = schemas.iter().find(|(c, _)| *c == command).unwrap();
        let required = schema["required"].as_array().unwrap();
        for key in keys {
            assert!(required.contains(&Value::from(*key)), "{command}: {key}");
        }
    }
}
