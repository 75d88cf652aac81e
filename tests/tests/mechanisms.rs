//! Logs of arms, lifts and flywheels in SysId's format, without a model file: friction, weight, drag and gain are those of the
//! machine.
//!
//! An arm and a lift begin on a stop, as they do in a workshop, and are held there until the voltage lifts them.

#![allow(
    clippy::unwrap_used,
    reason = "an answer without its keys is how this program fails"
)]

use std::f64::consts::TAU;
use std::fmt::Write;

use loopsight::{Answer, ImproveOptions, Log, Session};
use serde_json::Value;

/// `u = kS sign(v) + weight(x) + kV v + drag v abs(v) + kA v'`, V, m (or rad) and s, between stops `ends`.
struct Machine {
    test: &'static str,
    units: &'static str,
    per_rotation: f64,
    friction: f64,
    weight: fn(f64) -> f64,
    per_speed: f64,
    drag: f64,
    per_acceleration: f64,
    ends: [f64; 2],
    step: f64,
}

const STEP: f64 = 0.0005;
const PERIOD: f64 = 0.005;

impl Machine {
    /// One run of SysId: a ramp of 0.25 V/s or a step, up or down, until it is near its other end.
    fn run(&self, forward: bool, fast: bool) -> String {
        let sign = if forward { 1.0 } else { -1.0 };
        let [start, end] = match forward {
            true => self.ends,
            false => [self.ends[1], self.ends[0]],
        };
        let (mut x, mut v, mut rows) = (start, 0.0f64, Vec::new());
        for k in 0..40_000 {
            let t = STEP * f64::from(k);
            let u = sign
                * if fast {
                    self.step * f64::from(u8::from(t >= 0.02))
                } else {
                    0.25 * t
                };
            if k % 10 == 0 {
                let counts = self.per_rotation / 4096.0;
                let position = (x / counts).floor() * counts / self.per_rotation;
                let t = PERIOD * f64::from(k / 10);
                rows.push(format!("[{t},{u},{position},{}]", v / self.per_rotation));
            }
            let driven = u - (self.weight)(x) - (self.per_speed + self.drag * v.abs()) * v;
            // Held by friction, or sliding against it.
            let friction = match v == 0.0 {
                true => driven.clamp(-self.friction, self.friction),
                false => self.friction * v.signum(),
            };
            let next = v + STEP * (driven - friction) / self.per_acceleration;
            v = if next * v < 0.0 { 0.0 } else { next };
            x += STEP * v;
            if sign * (x - start) < 0.0 {
                (x, v) = (start, 0.0);
            }
            if sign * (x - end) > -0.05 * (end - start).abs() {
                break;
            }
        }
        rows.join(",")
    }

    fn answer(&self) -> Value {
        let (test, units, turn) = (self.test, self.units, self.per_rotation);
        let mut text = format!(r#"{{"test":"{test}","units":"{units}","unitsPerRotation":{turn}"#);
        for (name, forward, fast) in [
            ("slow-forward", true, false),
            ("slow-backward", false, false),
            ("fast-forward", true, true),
            ("fast-backward", false, true),
        ] {
            write!(text, r#","{name}":[{}]"#, self.run(forward, fast)).unwrap();
        }
        let log = Log::from_bytes("log.json", (text + "}").as_bytes()).unwrap();
        let session = Session::of_log(log).unwrap();
        let answer = session.improve(&ImproveOptions::default()).unwrap();
        serde_json::from_str(&answer.to_json().unwrap()).unwrap()
    }
}

fn is_near(answer: &Value, key: &str, truth: f64) {
    let value = answer["feedforward"][key]["value"].as_f64().unwrap();
    assert!(
        (value / truth - 1.0).abs() < 0.03,
        "{key}: {value} for {truth}"
    );
}

#[test]
fn a_lift_on_its_floor() {
    let answer = Machine {
        test: "Elevator",
        units: "Meters",
        per_rotation: 0.1,
        friction: 0.3,
        weight: |_| 0.9,
        per_speed: 6.0,
        drag: 0.0,
        per_acceleration: 0.25,
        ends: [0.0, 1.2],
        step: 5.0,
    }
    .answer();
    for (key, truth) in [("kS", 0.3), ("kG", 0.9), ("kV", 6.0), ("kA", 0.25)] {
        is_near(&answer, key, truth);
    }
}

#[test]
fn an_arm_on_its_stop() {
    let answer = Machine {
        test: "Arm",
        units: "Radians",
        per_rotation: TAU,
        friction: 0.25,
        weight: |x| 0.8 * x.cos(),
        per_speed: 2.0,
        drag: 0.0,
        per_acceleration: 0.15,
        ends: [-0.4, 1.2],
        step: 4.0,
    }
    .answer();
    for (key, truth) in [("kS", 0.25), ("kG", 0.8), ("kV", 2.0), ("kA", 0.15)] {
        is_near(&answer, key, truth);
    }
}

/// Alone, friction that falls with the speed explains more of it than dry friction or drag.
#[test]
fn a_flywheel_with_drag() {
    let answer = Machine {
        test: "Simple",
        units: "Rotations",
        per_rotation: 1.0,
        friction: 0.5,
        weight: |_| 0.0,
        per_speed: 0.12,
        drag: 4e-4,
        per_acceleration: 0.06,
        ends: [0.0, 180.0],
        step: 6.0,
    }
    .answer();
    let steps = answer["steps"].as_array().unwrap().iter();
    let added: Vec<&str> = steps
        .filter_map(|s| s["added"]["effect"].as_str())
        .collect();
    assert_eq!(added, ["coulomb_friction", "quadratic_drag"]);
    let level = &answer["parameters"]["coulomb_friction.level"]["value"];
    assert!(
        (level.as_f64().unwrap() / 0.5 - 1.0).abs() < 0.03,
        "{level}"
    );
}
