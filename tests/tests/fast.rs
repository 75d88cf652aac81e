//! Machines that are done in milliseconds, and that small forces move.

#![allow(
    clippy::unwrap_used,
    reason = "an answer without its keys is how this program fails"
)]

use std::fmt::Write;

use loopsight_tests::Random;
use serde_json::Value;

mod sessions;

use sessions::improved;

/// Checks that one effect was added, that a parameter of it is what it was made to 2 %, and that nothing more is missing.
fn check(found: &Value, effect: &str, parameter: &str, made: f64) {
    let steps = found["steps"].as_array().unwrap().iter();
    let added: Vec<&str> = steps
        .filter_map(|s| s["added"]["effect"].as_str())
        .collect();
    assert_eq!(added, [effect]);
    let value = found["parameters"][parameter]["value"].as_f64().unwrap();
    assert!((value / made - 1.0).abs() < 0.02, "{value}");
    assert!(found["steps"][1]["nrmse_test"].as_f64().unwrap() < 0.005);
}

/// A coil at a bridge, logged at 50 kHz for 0.2 s. Its command arrives two and a half samples late.
#[test]
fn a_coil_gets_its_voltage_late() {
    let (delay, step, every) = (50e-6, 2e-6, 10);
    let late = (delay / step) as usize;
    let mut random = Random::new(5);
    let (mut current, mut voltage, mut until) = (0.0f64, 0.0, 0);
    let mut asked = vec![0.0; late];
    let mut log = "time_us,voltage_V,current_A\n".to_owned();
    for k in 0..100_000 {
        if k == until {
            voltage = (1600.0 * random.share() - 800.0).round() / 100.0;
            until = k + every * (40 + random.below(80));
        }
        if k % every == 0 {
            let read = current + 0.02 * random.noise();
            writeln!(log, "{},{voltage:.2},{read:.4}", 2 * k).unwrap();
        }
        asked.push(voltage);
        current += step * (asked[k] - 0.6 * current) / 0.4e-3;
    }
    let model = "[plant.expression.states]\n\
         current = { unit = \"A\", rate = \"(voltage - r * current + coil) / l\" }\n\
         [plant.expression.inputs]\nvoltage = { unit = \"V\" }\n\
         [plant.expression.channels]\ncoil = { unit = \"V\", flow = \"current\" }\n\
         [plant.expression.parameters]\nr = { value = 0.5, unit = \"V/A\" }\nl = { value = 0.3e-3, unit = \"V s/A\" }\n\
         [log.inputs]\nvoltage = \"voltage_V\"\n[log.measured]\ncurrent = \"current_A\"\n";
    let found = improved(model, &log);
    check(&found, "input_delay", "input_delay.delay", delay);
}

/// A mirror on a torsion spring that a coil turns, logged at 20 kHz for 0.5 s. Its bearing rubs with 0.9 mN m.
#[test]
fn a_mirror_rubs() {
    let (friction, step, every) = (0.9e-3, 2.5e-6, 20);
    let (inertia, spring, damping, torque) = (2e-8, 0.02, 1.2e-5, 0.004);
    let mut random = Random::new(6);
    let (mut angle, mut speed, mut current, mut until) = (0.0f64, 0.0f64, 0.0, 0);
    let mut log = "time_ms,current_A,angle_rad\n".to_owned();
    for k in 0..200_000 {
        if k == until {
            current = (400.0 * random.share() - 200.0).round() / 100.0;
            until = k + every * (30 + random.below(60));
        }
        if k % every == 0 {
            let read = angle + 2e-4 * random.noise();
            writeln!(
                log,
                "{:.2},{current:.2},{read:.5}",
                0.05 * (k / every) as f64
            )
            .unwrap();
        }
        let rubs = friction * (speed / 0.5).tanh();
        let moves = torque * current - spring * angle - damping * speed - rubs;
        speed += step * moves / inertia;
        angle += step * speed;
    }
    let model = "[plant.expression.states]\nangle = { unit = \"rad\", rate = \"speed\" }\n\
         speed = { unit = \"rad/s\", rate = \"(kt * current - k * angle - b * speed + axle) / 2e-8\" }\n\
         [plant.expression.inputs]\ncurrent = { unit = \"A\" }\n\
         [plant.expression.channels]\naxle = { unit = \"N m\", flow = \"speed\", position = \"angle\" }\n\
         [plant.expression.parameters]\nkt = { value = 0.003, unit = \"N m/A\" }\n\
         k = { value = 0.015, unit = \"N m/rad\" }\nb = { value = 1e-5, unit = \"N m s/rad\" }\n\
         [log.inputs]\ncurrent = \"current_A\"\n[log.measured]\nangle = \"angle_rad\"\n";
    let found = improved(model, &log);
    check(
        &found,
        "coulomb_friction",
        "coulomb_friction.level",
        friction,
    );
}
