//! A car whose understeer and gyro offset are missing, a vessel whose sensor takes minutes, and a capacitor that is read with its current.

#![allow(
    clippy::unwrap_used,
    reason = "an answer without its keys is how this program fails"
)]

use std::fmt::Write;

use loopsight_tests::{Random, check_improved, check_left};
use serde_json::Value;

mod sessions;

use sessions::improved;

/// The effects that were added, and the unseen error with each.
fn added(found: &Value) -> Vec<(String, f64)> {
    let steps = found["steps"].as_array().unwrap().iter();
    let added = steps.filter_map(|step| {
        let effect = step["added"]["effect"].as_str()?;
        Some((effect.to_owned(), step["nrmse_test"].as_f64().unwrap()))
    });
    added.collect()
}

/// A car on a bicycle's model, with the steering behind a lag and a gyro that is off by 0.8 °/s.
///
/// Friction of two directions explains most at first. It is two effects, viscous friction and a constant, and a gyro that is off
/// does what a constant does, better.
#[test]
fn a_car_that_understeers_has_a_gyro_that_is_off() {
    let (mass, inertia, front, rear) = (1450.0, 2300.0, 1.15, 1.45);
    let (stiffness_front, stiffness_rear) = (62e3, 78e3);
    let step = 1e-3;
    let mut random = Random::new(88);
    let (mut yaw_rate, mut sideways, mut speed, mut steer) = (0.0f64, 0.0f64, 8.0f64, 0.0f64);
    let (mut wheel, mut faster, mut until) = (0.0, 8.0, 0);
    let mut log = "time_s,speed_kph,steer_deg,yaw_rate_dps\n".to_owned();
    for k in 0..90_000 {
        if k == until {
            wheel = (120.0 * random.share() - 60.0) * 8.0 / speed.max(6.0);
            faster = 5.0 + 17.0 * random.share();
            until = k + 20 * (30 + random.below(120));
        }
        steer += step * (wheel - steer) / 0.25;
        speed += step * (faster - speed).clamp(-2.0, 2.0);
        if k % 20 == 0 {
            let read = [
                3.6 * speed + 0.1 * random.noise(),
                steer + 0.05 * random.noise(),
                yaw_rate.to_degrees() + 0.8 + 0.15 * random.noise(),
            ];
            let [speed, steer, yaw_rate] = read;
            let time = k as f64 * step;
            writeln!(log, "{time:.2},{speed:.2},{steer:.1},{yaw_rate:.2}").unwrap();
        }
        let angle = steer.to_radians() / 15.8;
        let at_front = stiffness_front * (angle - (sideways + front * yaw_rate) / speed);
        let at_rear = -stiffness_rear * (sideways - rear * yaw_rate) / speed;
        sideways += step * ((at_front + at_rear) / mass - speed * yaw_rate);
        yaw_rate += step * (front * at_front - rear * at_rear) / inertia;
    }
    let model = "[plant.expression.states]\n\
         yaw_rate = { unit = \"rad/s\", rate = \"(speed / base * (steer + wheel) / ratio - yaw_rate) / t\" }\n\
         [plant.expression.inputs]\nspeed = { unit = \"m/s\" }\nsteer = { unit = \"rad\" }\n\
         [plant.expression.channels]\nwheel = { unit = \"rad\", flow = \"yaw_rate\", drive = \"steer\" }\n\
         [plant.expression.parameters]\nbase = { value = 2.6, unit = \"m\", held = true }\n\
         ratio = { value = 15, unit = \"1\", range = [5, 30] }\n\
         t = { value = 0.1, unit = \"s\", range = [0.001, 10] }\n\
         [log.inputs]\nspeed = { column = \"speed_kph\", unit = \"km/h\" }\nsteer = \"steer_deg\"\n\
         [log.measured.yaw_rate]\ncolumn = \"yaw_rate_dps\"\nunit = \"deg/s\"\n";
    let found = improved(model, &log);
    let steps = added(&found);
    let named: Vec<&str> = steps.iter().map(|(effect, _)| &**effect).collect();
    assert_eq!(named, ["viscous_friction", "sensor_offset"]);
    assert!(steps[1].1 < 0.04, "{steps:?}");
    let offset = found["parameters"]["sensor_offset.offset"]["value"].as_f64();
    let offset = offset.unwrap().to_degrees();
    assert!((offset / 0.8 - 1.0).abs() < 0.05, "{offset} degrees/s");
}

/// A vessel in a bath, logged each 30 s through a pocket that takes 95 s to warm up.
#[test]
fn a_sensor_in_a_pocket_lags_by_a_minute_and_a_half() {
    let (rate, lag) = (0.0022, 95.0);
    let mut random = Random::new(7);
    let (mut vessel, mut pocket, mut bath, mut until) = (50.0f64, 50.0f64, 40.0, 0);
    let mut log = "time_s,bath,vessel\n".to_owned();
    for k in 0..16_000 {
        if k == until {
            bath = (20.0 + 50.0 * random.share()).round();
            until = k + 60 * (5 + random.below(20));
        }
        if k % 30 == 0 {
            let read = pocket + 0.03 * random.noise();
            writeln!(log, "{k},{bath},{read:.2}").unwrap();
        }
        vessel += rate * (bath - vessel);
        pocket += (vessel - pocket) / lag;
    }
    let model = "[plant.expression.states]\nvessel = { unit = \"degC\", rate = \"h * (bath + heat - vessel)\" }\n\
         [plant.expression.inputs]\nbath = { unit = \"degC\" }\n\
         [plant.expression.channels]\nheat = { unit = \"degC\", flow = \"vessel\" }\n\
         [plant.expression.parameters]\nh = { value = 0.001, unit = \"1/s\" }\n\
         [log.inputs]\nbath = \"bath\"\n[log.measured]\nvessel = \"vessel\"\n";
    let found = improved(&model.replace("degC", "K"), &log);
    let steps = added(&found);
    let named: Vec<&str> = steps.iter().map(|(effect, _)| &**effect).collect();
    assert_eq!(named, ["sensor_lag"]);
    let found = found["parameters"]["sensor_lag.lag"]["value"].as_f64();
    let found = found.unwrap();
    assert!((found / lag - 1.0).abs() < 0.05, "{found} s");
}

/// A capacitor whose voltage is read at once with its current, so that each line of the log has the voltage under its own current.
///
/// A lead of any part of a period does that. How long it is, nothing tells.
#[test]
fn a_voltage_is_read_with_its_current() {
    let (capacity, inner, step) = (120.0, 0.02, 0.2);
    let mut random = Random::new(89);
    let (mut charge, mut current, mut until) = (1.5f64, 0.0, 0);
    let mut log = "time_s,current_A,voltage_V\n".to_owned();
    for k in 0..10_000 {
        if k == until {
            current = (600.0 * random.share() - 300.0 - 300.0 * (charge - 1.5)).round() / 100.0;
            until = k + 5 * (10 + random.below(70));
        }
        if k % 5 == 0 {
            let read = charge + inner * current + 0.002 * random.noise();
            writeln!(log, "{},{current:.2},{read:.4}", k / 5).unwrap();
        }
        charge += step * (current - 0.05 * charge) / capacity;
    }
    let model = "[plant.expression.states]\n\
         charge = { unit = \"V\", rate = \"(current - leak * charge + plate) / c\" }\n\
         [plant.expression.outputs]\nvoltage = { unit = \"V\", value = \"charge + r * current\" }\n\
         [plant.expression.inputs]\ncurrent = { unit = \"A\" }\n\
         [plant.expression.channels]\nplate = { unit = \"A\", flow = \"charge\" }\n\
         [plant.expression.parameters]\nc = { value = 100, unit = \"A s/V\" }\n\
         r = { value = 0.03, unit = \"V/A\" }\nleak = { value = 0.04, unit = \"A/V\" }\n\
         [log.inputs]\ncurrent = \"current_A\"\n[log.measured]\nvoltage = \"voltage_V\"\n";
    let found = improved(model, &log);
    check_improved(&found, &["input_lead"], &[("c", capacity)], 0.01);
    check_left(&found, 0.006);
}
