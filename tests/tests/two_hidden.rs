//! Machines that two things are missing from, which only both together explain.

#![allow(
    clippy::unwrap_used,
    reason = "an answer without its keys is how this program fails"
)]

use std::fmt::Write;

use loopsight_tests::{Random, check_improved, last_error};

mod sessions;

use sessions::improved;

/// A pendulum of which the angle sensor is off by 0.1 rad and whose bearing rubs. Its command changes between the samples.
#[test]
fn a_pendulum_rubs_and_its_sensor_is_off() {
    let (friction, off, step) = (0.1, 0.1, 5e-4);
    let mut random = Random::new(7);
    let (mut angle, mut rate, mut current, mut until) = (0.0f64, 0.0f64, 0.0, 0);
    let mut log = "time_s,current_A,angle_rad\n".to_owned();
    for k in 0..80_000 {
        if k == until {
            current = 8.0 * random.share() - 4.0;
            until = k + 600 + random.below(2400);
        }
        if k % 40 == 0 {
            let time = k as f64 * step;
            let read = angle + off + 0.003 * random.noise();
            writeln!(log, "{time:.2},{current:.4},{read:.4}").unwrap();
        }
        let torque = 0.2 * current - 2.0 * angle.sin() - 0.03 * rate;
        rate += step * (torque - friction * (rate / 0.01).tanh()) / 0.05;
        angle += step * rate;
    }
    let model = "[plant.expression.states]\nangle = { unit = \"rad\", rate = \"rate\" }\n\
         rate = { unit = \"rad/s\", rate = \"(kt * current + shaft - 2 * sin(angle) - b * rate) / 0.05\" }\n\
         [plant.expression.inputs]\ncurrent = { unit = \"A\" }\n\
         [plant.expression.channels]\nshaft = { unit = \"N m\", flow = \"rate\" }\n\
         [plant.expression.parameters]\nkt = { value = 0.18, unit = \"N m/A\" }\n\
         b = { value = 0.02, unit = \"N m s\" }\n\
         [log.inputs]\ncurrent = \"current_A\"\n[log.measured]\nangle = \"angle_rad\"\n";
    let effects = ["coulomb_friction", "input_lead", "sensor_offset"];
    let values = [
        ("coulomb_friction.level", friction),
        ("sensor_offset.offset", off),
        ("kt", 0.2),
    ];
    check_improved(&improved(model, &log), &effects, &values, 0.05);
}

/// A heat sink that radiates, of which a sensor with a lag tells the temperature above a room of 22 °C.
///
/// A power of its input explains most at first, and beside that a late input. Beside the drag that the power becomes then, it is the
/// lag, and the last step's error is that of the two.
#[test]
fn a_heat_sink_radiates_and_its_sensor_lags() {
    let mut random = Random::new(2);
    let (mut sink, mut sensor, mut power, mut until) = (0.0f64, 0.0f64, 0.0, 0);
    let mut log = "time_s,power_W,temp_C\n".to_owned();
    for k in 0..18_000 {
        if k == until {
            power = (400.0 * random.share()).round() / 10.0;
            until = k + 10 * (60 + random.below(340));
        }
        if k % 10 == 0 {
            let read = 22.0 + sensor + 0.05 * random.noise();
            writeln!(log, "{},{power:.1},{read:.2}", k / 10).unwrap();
        }
        sink += 0.1 * (power - 0.55 * sink - 0.004 * sink * sink) / 80.0;
        sensor += 0.1 * (sink - sensor) / 9.0;
    }
    let model = "[plant.expression.states]\nT = { unit = \"K\", rate = \"(p - g * T + sink) / c\" }\n\
         [plant.expression.inputs]\np = { unit = \"W\" }\n\
         [plant.expression.channels]\nsink = { unit = \"W\", flow = \"T\" }\n\
         [plant.expression.parameters]\ng = { value = 0.7, unit = \"W/K\" }\n\
         c = { value = 100, unit = \"J/K\" }\n\
         [log.inputs]\np = \"power_W\"\n\
         [log.measured]\nT = { column = \"temp_C\", offset = -295.15 }\n";
    let found = improved(model, &log);
    let values = [
        ("quadratic_drag.coefficient", 0.004),
        ("sensor_lag.lag", 9.0),
    ];
    check_improved(&found, &["quadratic_drag", "sensor_lag"], &values, 0.05);
    let left = last_error(&found);
    assert!(left < 0.005, "{left}");
}

/// A robot that balances on two wheels, of which the wheels rub and the pitch is read 1.7° too large.
///
/// Friction of two directions explains most at first. It is two effects, dry friction and a constant force, and a pitch that is off
/// does what the force does, better.
#[test]
#[ignore = "takes minutes: the continuous integration runs it, in release"]
fn a_balancing_robot_rubs_and_its_pitch_is_off() {
    let (friction, off, step) = (6.0, 1.7f64, 2e-4);
    let (cart, body, length, inertia, radius, g) = (3.0, 8.0, 0.28, 0.25, 0.1, 9.81);
    let mut random = Random::new(3);
    let (mut speed, mut pitch, mut rate, mut torque) = (0.0f64, 0.0f64, 0.0f64, 0.0f64);
    let (mut wanted, mut until) = (0.0, 0);
    let mut log = "t_us,motor_current,pitch_deg,pitch_rate_dps,wheel_rpm\n".to_owned();
    for k in 0..60_000 {
        if k == until {
            wanted = 1.2 * random.share() - 0.6;
            until = k + 4000 + random.below(8500);
        }
        if k % 50 == 0 {
            let seen = pitch + 0.0005 * random.noise();
            let law = 35.0 * seen + 5.5 * rate + 4.0 * (speed - wanted);
            torque = law.clamp(-12.0, 12.0) + 0.4 * random.noise();
            let read = [
                torque / 0.8,
                seen.to_degrees() + off,
                rate.to_degrees() + 0.1 * random.noise(),
                (speed / radius) * 60.0 / std::f64::consts::TAU + 0.2 * random.noise(),
            ];
            let [current, angle, turning, wheel] = read;
            let time = k * 200;
            writeln!(
                log,
                "{time},{current:.3},{angle:.3},{turning:.2},{wheel:.1}"
            )
            .unwrap();
        }
        let force = torque / radius - friction * (speed / 0.01).tanh();
        let (sin, cos) = pitch.sin_cos();
        let (all, couples, turns) = (
            cart + body,
            body * length * cos,
            inertia + body * length * length,
        );
        let pushes = force + body * length * rate * rate * sin;
        let tips = body * g * length * sin - torque;
        let determinant = all * turns - couples * couples;
        speed += step * (pushes * turns - couples * tips) / determinant;
        rate += step * (all * tips - couples * pushes) / determinant;
        pitch += step * rate;
    }
    let model = "[plant.expression.states]\n\
         speed = { unit = \"m/s\", rate = \"(0.8772 * (kt * current / 0.1 + wheel + 2.24 * pitch_rate^2 * sin(pitch)) - 2.24 * cos(pitch) * (21.97 * sin(pitch) - kt * current)) / (9.65 - 5.02 * cos(pitch)^2)\" }\n\
         pitch_rate = { unit = \"rad/s\", rate = \"(11 * (21.97 * sin(pitch) - kt * current) - 2.24 * cos(pitch) * (kt * current / 0.1 + wheel + 2.24 * pitch_rate^2 * sin(pitch))) / (9.65 - 5.02 * cos(pitch)^2)\" }\n\
         pitch = { unit = \"rad\", rate = \"pitch_rate\" }\n\
         [plant.expression.inputs]\ncurrent = { unit = \"A\" }\n\
         [plant.expression.channels]\nwheel = { unit = \"N\", flow = \"speed\" }\n\
         [plant.expression.parameters]\nkt = { value = 0.7, unit = \"N m/A\" }\n\
         [log.inputs]\ncurrent = \"motor_current\"\n[log.measured]\n\
         pitch = \"pitch_deg\"\npitch_rate = \"pitch_rate_dps\"\n\
         speed = { column = \"wheel_rpm\", unit = \"rpm\", scale = 0.1, scale_unit = \"m/rad\" }\n";
    let values = [
        ("coulomb_friction.level", friction),
        ("sensor_offset.offset", off.to_radians()),
        ("kt", 0.8),
    ];
    let effects = ["coulomb_friction", "sensor_offset"];
    check_improved(&improved(model, &log), &effects, &values, 0.05);
}
