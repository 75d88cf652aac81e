//! `examples/scenarios`: what goes wrong with a robot while a loop learns, and what comes of it.

#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a scenario that ends otherwise is how this program fails"
)]

use std::process::Command;
use std::sync::OnceLock;

use loopsight_tests::repository;
use serde_json::Value;

const PROGRAM: &str = env!("CARGO_BIN_EXE_loopsight-under-test");

/// What a scenario came to.
struct Outcome {
    status: Option<i32>,
    said: Value,
    header: Vec<String>,
    rows: Vec<Vec<f64>>,
}

fn play(name: &str) -> Outcome {
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("log.csv");
    let output = Command::new(PROGRAM)
        .current_dir(repository().join("examples/scenarios"))
        .args(["run", &format!("{name}.toml"), "--json", "-o"])
        .arg(&log)
        .output()
        .unwrap();
    let said = serde_json::from_slice(&output.stdout)
        .unwrap_or_else(|e| panic!("{name}: {e}: {}", String::from_utf8_lossy(&output.stderr)));
    let text = std::fs::read_to_string(&log).unwrap();
    let mut lines = text.lines().filter(|l| !l.starts_with('#'));
    let header = lines
        .next()
        .unwrap()
        .split(',')
        .map(str::to_owned)
        .collect();
    let number = |field: &str| field.parse().unwrap_or(f64::NAN);
    let rows = lines.map(|l| l.split(',').map(number).collect()).collect();
    let outcome = Outcome {
        status: output.status.code(),
        said,
        header,
        rows,
    };
    // Whatever happens: no input beyond the battery, no speed beyond what that can give.
    for input in ["voltage_right_V", "voltage_left_V"] {
        assert!(
            outcome.column(input).iter().all(|u| u.abs() <= 12.0),
            "{name}"
        );
    }
    let speeds = outcome.column("linear_velocity_m_per_s");
    assert!(speeds.iter().all(|v| v.abs() < 0.25), "{name}");
    outcome
}

impl Outcome {
    fn column(&self, name: &str) -> Vec<f64> {
        let at = self.header.iter().position(|h| h == name).unwrap();
        self.rows.iter().map(|row| row[at]).collect()
    }

    /// Root mean square of the tracking error between two instants, of both signals over their sizes.
    fn error(&self, from: f64, to: f64) -> f64 {
        let time = self.column("time_s");
        let mut sum = 0.0;
        let mut n = 0;
        for (signal, size) in [
            ("linear_velocity_m_per_s", 0.1),
            ("angular_velocity_rad_per_s", 0.5),
        ] {
            let is = self.column(signal);
            let wanted = self.column(&format!("reference_{signal}"));
            for k in 0..time.len() {
                if (from..to).contains(&time[k]) {
                    sum += ((is[k] - wanted[k]) / size).powi(2);
                    n += 1;
                }
            }
        }
        assert!(n > 0);
        (sum / f64::from(n)).sqrt()
    }

    fn events(&self, part: &str) -> Vec<f64> {
        let events = self.said["events"].as_array().unwrap().iter();
        let told = events.filter(|e| e["what"].as_str().unwrap().contains(part));
        told.map(|e| e["time_s"].as_f64().unwrap()).collect()
    }

    fn parameter(&self, name: &str) -> f64 {
        self.said["parameters"][name].as_f64().unwrap()
    }

    /// Ran to its end; the error of the last third is at most `times` that of the loop with which
    /// nothing goes wrong, which follows the same references.
    fn recovers(&self, name: &str, times: f64) {
        assert_eq!(self.status, Some(0), "{name}: {}", self.said["end"]);
        assert_eq!(self.rows.len(), 6000);
        let (nothing, after) = (nothing().error(40.0, 60.0), self.error(40.0, 60.0));
        assert!(
            after < times * nothing,
            "{name}: {after}, without {nothing}"
        );
    }
}

fn nothing() -> &'static Outcome {
    static NOTHING: OnceLock<Outcome> = OnceLock::new();
    NOTHING.get_or_init(|| play("nothing"))
}

#[test]
fn what_is_learned_is_used_after_a_second_of_it_and_comes_near_the_robot() {
    let nothing = nothing();
    assert_eq!((nothing.status, nothing.rows.len()), (Some(0), 6000));
    let used = nothing.events("the controller uses what was learned");
    assert_eq!(used.len(), 1);
    assert!(
        (2.4..3.5).contains(&used[0]),
        "a second of learning after the first step: {used:?}"
    );
    for (name, value) in [
        ("K_A", -15.146),
        ("K_C", 0.136),
        ("K_D", -9.573),
        ("K_F", 0.656),
    ] {
        let found = nothing.parameter(name);
        assert!(
            (found / value - 1.0).abs() < 0.1,
            "{name}: {found} for {value}"
        );
    }
}

#[test]
fn a_doubled_mass_is_learned() {
    let payload = play("payload");
    payload.recovers("payload", 1.25);
    // Half the gain for twice the mass, after 40 s of forgetting the lighter robot.
    let found = payload.parameter("K_C");
    assert!((found / 0.068 - 1.0).abs() < 0.25, "K_C {found}");
    assert!(
        payload.events("the last good model is back").is_empty(),
        "no reason to fall back"
    );
}

#[test]
fn a_weak_motor_is_made_up_for() {
    play("weak_motor").recovers("weak motor", 1.25);
}

#[test]
fn a_falling_battery_is_learned() {
    let battery = play("battery");
    battery.recovers("battery", 1.25);
    let found = battery.parameter("K_C");
    assert!((found / (0.8 * 0.136) - 1.0).abs() < 0.15, "K_C {found}");
}

#[test]
fn one_sample_in_twenty_may_be_stale() {
    let stale = play("stale");
    stale.recovers("stale", 1.1);
    let share = stale.said["stale_share"].as_f64().unwrap();
    // Four standard deviations of a binomial.
    assert!((share - 0.05).abs() < 4.0 * (0.05 * 0.95 / 6000.0_f64).sqrt());
    let lost = stale
        .column("fresh_1")
        .iter()
        .filter(|f| **f == 0.0)
        .count();
    assert_eq!(lost as f64, (share * 6000.0).round());
    assert!(stale.error(2.0, 60.0) < 1.1 * nothing().error(2.0, 60.0));
}

#[test]
fn a_dead_encoder_stops_the_robot_in_a_third_of_a_second() {
    let dead = play("dead_encoder");
    assert_eq!(dead.status, Some(1));
    let end = dead.said["end"].as_str().unwrap();
    assert!(
        end.contains("shaft_angle_right has kept its speed"),
        "{end}"
    );
    let stopped = dead.events("stopped by the supervisor");
    assert_eq!(stopped.len(), 1);
    assert!((20.3..20.4).contains(&stopped[0]), "{stopped:?}");
}

#[test]
fn what_a_dead_encoder_taught_is_left_again() {
    let ridden_out = play("dead_encoder_ridden_out");
    ridden_out.recovers("dead encoder, ridden out", 1.1);
    // What it taught is restrained so far that the last good model is not needed.
    let back = ridden_out.events("the last good model is back");
    assert!(back.is_empty(), "{back:?}");
    let used = ridden_out.events("the controller uses what was learned");
    assert_eq!(used.len(), 1, "{used:?}");
    for (name, value) in [("K_C", 0.136), ("K_F", 0.656)] {
        let found = ridden_out.parameter(name);
        assert!(
            (found / value - 1.0).abs() < 0.1,
            "{name}: {found} for {value}"
        );
    }
}
