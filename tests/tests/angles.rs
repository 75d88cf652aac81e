//! Machines of which angles alone are logged, that wander by many turns: what is missing is a small share of the angle's standard
//! deviation.

#![allow(
    clippy::unwrap_used,
    reason = "an answer without its keys is how this program fails"
)]

use std::fmt::Write;

use loopsight::{Answer, DiagnoseOptions, FitOptions, ImproveOptions, Log, Method, Model, Session};
use loopsight_tests::Random;
use serde_json::Value;

const STEP: f64 = 1e-4;
const PERIOD: f64 = 0.01;
/// Angle of one count, degrees.
const COUNT: f64 = 0.09;
/// How late the angle is read, s.
const LATE: f64 = 0.025;
/// Torques over the inertia of 0.09 kg m², as what they are in V at the motor: dry friction, and the weight of the level arm.
const FRICTION: f64 = 0.367;
const WEIGHT: f64 = 2.067;
/// Damping, 1/s, and acceleration per volt, rad/s²/V.
const DAMPING: f64 = 100.6;
const GAIN: f64 = 33.3;

/// 40 s of an arm that a geared motor turns over the top now and then, with the model file that a user writes for it.
fn arm() -> Session {
    let mut random = Random::new(5);
    let (mut angle, mut speed, mut volts) = (-1.2f64, 0.0f64, 0.0);
    let (mut past, mut until) = (vec![angle], 0);
    let mut log = "time_s,voltage_V,angle_deg\n".to_owned();
    let every = (PERIOD / STEP).round() as usize;
    for k in 0..(40.0 / STEP) as usize {
        if k == until {
            volts = (-5.9 + 14.3 * random.share()).round();
            until = k + every * (30 + random.below(120));
        }
        if k % every == 0 {
            let then = past.len() - 1 - ((LATE / STEP).round() as usize).min(past.len() - 1);
            let counted = (past[then].to_degrees() / COUNT).round() * COUNT;
            writeln!(log, "{:.2},{volts},{counted:.2}", k as f64 * STEP).unwrap();
        }
        let driven = volts - WEIGHT * angle.cos() - DAMPING / GAIN * speed;
        // Held by friction, or sliding against it.
        let friction = match speed == 0.0 {
            true => driven.clamp(-FRICTION, FRICTION),
            false => FRICTION * speed.signum(),
        };
        let next = speed + STEP * GAIN * (driven - friction);
        speed = if speed * next < 0.0 { 0.0 } else { next };
        angle += STEP * speed;
        past.push(angle);
    }
    let text = "[plant.arm]\n[log.measured.angle]\n";
    let model = Model::from_toml("arm.toml", text).unwrap();
    let log = Log::from_bytes("arm.csv", log.as_bytes()).unwrap();
    Session::new(model, log).unwrap()
}

fn json(text: String) -> Value {
    serde_json::from_str(&text).unwrap()
}

/// The angle alone tells a regression nothing, its differences do.
#[test]
fn recursive_least_squares_finds_an_arm_by_its_angle() {
    let mut options = FitOptions::default();
    options.method = Method::Rls;
    let answer = json(arm().fit(&options).unwrap().to_json().unwrap());
    let value = |name: &str| answer["parameters"][name]["value"].as_f64().unwrap();
    // Friction and the late reading are not in the model: the ratios are those of the machine, the rates are slower.
    let weight = value("K_G") / value("K_C");
    assert!((weight / WEIGHT - 1.0).abs() < 0.1, "{weight}");
    assert!((-DAMPING..-0.1 * DAMPING).contains(&value("K_A")));
}

/// Friction leaves 0.2 % of an angle that wanders by turns, and the late reading is nearly all of that.
#[test]
fn an_arm_that_goes_over_the_top_has_friction_and_is_read_late() {
    let answer = arm().improve(&ImproveOptions::default()).unwrap();
    let answer = json(answer.to_json().unwrap());
    let steps = answer["steps"].as_array().unwrap();
    let added: Vec<&str> = steps
        .iter()
        .filter_map(|s| s["added"]["effect"].as_str())
        .collect();
    assert!(
        matches!(
            added[..],
            ["coulomb_friction", "sensor_delay" | "input_delay"]
        ),
        "{added:?}"
    );
    let value = |name: &str| answer["parameters"][name]["value"].as_f64();
    let late = value("sensor_delay.delay")
        .or(value("input_delay.delay"))
        .unwrap();
    for (name, found, truth) in [
        (
            "friction",
            value("coulomb_friction.level").unwrap(),
            FRICTION,
        ),
        ("lateness", late, LATE),
    ] {
        assert!((found / truth - 1.0).abs() < 0.05, "{name}: {found}");
    }
}

const INERTIA: [f64; 2] = [0.004, 0.02];
const SPRING: f64 = 12.0;

/// 20 s of two masses and a spring between them, with so much dry friction at the motor, whose angles are measured.
fn joint(friction: f64, model: &str) -> Session {
    const DAMPING: [f64; 2] = [0.01, 0.005];
    let mut random = Random::new(3);
    let (mut angle, mut speed, mut torque, mut until) = ([0.0f64; 2], [0.0f64; 2], 0.0, 0);
    let mut log = "time_s,torque_Nm,motor_angle_rad,load_angle_rad\n".to_owned();
    for k in 0..(20.0 / STEP) as usize {
        if k == until {
            torque = 1.8 * random.share() - 0.9;
            until = k + 100 * (3 + random.below(57));
        }
        if k % 20 == 0 {
            let seen = angle.map(|angle| angle + 2e-4 * (random.share() - 0.5));
            let time = k as f64 * STEP;
            writeln!(log, "{time:.3},{torque:.4},{:.5},{:.5}", seen[0], seen[1]).unwrap();
        }
        let twist = SPRING * (angle[0] - angle[1]);
        let held = friction * (speed[0] / 0.05).tanh();
        speed[0] += STEP * (torque - DAMPING[0] * speed[0] - held - twist) / INERTIA[0];
        speed[1] += STEP * (twist - DAMPING[1] * speed[1]) / INERTIA[1];
        angle[0] += STEP * speed[0];
        angle[1] += STEP * speed[1];
    }
    let text = format!(
        "[plant.flexible_joint]\n{model}[log.measured.motor_angle]\n[log.measured.load_angle]\n"
    );
    let model = Model::from_toml("joint.toml", &text).unwrap();
    let log = Log::from_bytes("joint.csv", log.as_bytes()).unwrap();
    Session::new(model, log).unwrap()
}

/// What the load does is measured as well as what the motor does, and a regression reads both.
#[test]
fn recursive_least_squares_finds_a_load_behind_a_spring_by_its_angle() {
    let joint = joint(
        0.0,
        "spring_time = 0.0\n\n[fit]\nfixed = [\"spring_time\"]\n\n",
    );
    let mut options = FitOptions::default();
    options.method = Method::Rls;
    let answer = json(joint.fit(&options).unwrap().to_json().unwrap());
    for (name, truth) in [
        ("drive", 1.0 / INERTIA[0]),
        ("motor_stiffness", SPRING / INERTIA[0]),
        ("load_stiffness", SPRING / INERTIA[1]),
    ] {
        let found = answer["parameters"][name]["value"].as_f64().unwrap();
        assert!((found / truth - 1.0).abs() < 0.05, "{name}: {found}");
    }
}

/// Without friction at the motor the model ends with a spring thirty times too soft, and friction at the load does best from there.
/// A regression that holds the effect begins near the machine.
#[test]
fn a_motor_before_a_spring_has_friction() {
    let answer = joint(0.12, "")
        .diagnose(&DiagnoseOptions::default())
        .unwrap();
    let answer = json(answer.to_json().unwrap());
    let best = &answer["candidates"][0];
    assert_eq!(best["effect"], "coulomb_friction", "{best}");
    assert_eq!(best["at"][0], "motor", "{best}");
    let level = best["parameters"]["level"]["value"].as_f64().unwrap();
    assert!((level / 0.12 - 1.0).abs() < 0.02, "{level}");
}
