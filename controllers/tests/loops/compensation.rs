//! Effects of the model file, compensated without a controller knowing any.

use loopsight_core::AffineModel;

use super::*;

const STEPS: &str = "period_s = 0.01
duration_s = 8.0
model = \"model.toml\"
[driver.simulated]
model = \"robot.toml\"
step_s = 0.001
[controller.feedback_linearizing_pi]
settling_time_s = 0.45
[reference]
linear_velocity = { steps = { at = [[0.5, 0.1], [3.0, -0.1], [5.5, 0.0]] } }
angular_velocity = { steps = { at = [[1.5, 0.5], [4.0, -0.5], [6.5, 0.0]] } }
";

/// How far the `i`-th state of `trace` is from that of `other`, rms till `until`; what is measured
/// is `gain` times what is.
fn apart(trace: &Trace, other: &Trace, i: usize, gain: f64, until: usize) -> f64 {
    let pairs = trace.measured.iter().zip(&other.measured).take(until);
    let squares = pairs.map(|(a, b)| (a[i] / gain - b[i]).powi(2));
    (squares.sum::<f64>() / until as f64).sqrt()
}

/// With each effect of the file known, the loop moves as one around a robot without the effect.
#[test]
fn what_is_known_is_compensated() {
    let wheels = "at = [\"wheel.right\", \"wheel.left\"]";
    let inputs = "at = [\"input.right\", \"input.left\"]";
    let sensors = "at = [\"sensor.linear_velocity\", \"sensor.angular_velocity\"]";
    let plain = model(&format!("{TWIL}{INSTANT}"));
    let bare = run(STEPS, &plain, &plain, 800);
    // The share of the effect that is left; of friction it is what a change of direction leaves.
    for (id, at, settings, left) in [
        ("coulomb_friction", wheels, "level = 1.5", 0.3),
        (
            "stribeck_friction",
            wheels,
            "level = 1.0\nextra = 0.6\nspeed = 0.5",
            0.4,
        ),
        ("quadratic_drag", wheels, "coefficient = 0.3", 0.01),
        ("viscous_friction", wheels, "coefficient = 0.5", 0.01),
        ("constant_force", wheels, "force = 1.0", 0.01),
        ("dead_zone", inputs, "threshold = 1.5", 0.02),
        ("battery_sag", inputs, "resistance = 0.0004", 0.01),
        ("gain_asymmetry", inputs, "difference = 0.2", 0.01),
        ("input_offset", inputs, "offset = 1.0", 0.01),
        (
            "winding_heating",
            inputs,
            "heating = 0.01\ncooling = 0.05",
            0.05,
        ),
        ("sensor_scale", sensors, "error = 0.1", 0.05),
    ] {
        let text = effect(&format!("[effect.{id}]\n{at}\n{settings}"));
        let known = model(&format!("{TWIL}{text}{INSTANT}"));
        let (with, without) = (
            run(STEPS, &known, &known, 800),
            run(STEPS, &plain, &known, 800),
        );
        let gain = if id == "sensor_scale" { 1.1 } else { 1.0 };
        for i in 0..2 {
            let off = |trace: &Trace| apart(trace, &bare, i, gain, 550);
            println!("{id} {i}: {:.5} of {:.5}", off(&with), off(&without));
            assert!(off(&with) < left * off(&without).max(1e-3), "{id} {i}");
        }
    }
}

/// The controlled states behind a first-order lag, s, driven along straight lines.
fn lagged(trace: &Trace, lag: f64) -> Trace {
    let share = 1.0 - (-0.01 / lag).exp();
    let mut behind = trace.measured[0].clone();
    let mut before = behind.clone();
    let measured = trace.measured.iter().map(|now| {
        for i in 0..2 {
            // y' = (x - y)/lag with x on a straight line over the period.
            let slope = (now[i] - before[i]) / 0.01;
            let settled = before[i] - lag * slope;
            behind[i] = settled + (behind[i] - settled) * (1.0 - share) + 0.01 * slope;
        }
        before.clone_from(now);
        behind.clone()
    });
    Trace {
        measured: measured.collect(),
        ..Trace::default()
    }
}

/// Delays and lags, of commands and of measurements: the robot moves as the design says. A command's
/// delay is not even seen, since its reference was known before; its lag is what is left of it.
#[test]
fn what_comes_late_is_predicted() {
    let inputs = "at = [\"input.right\", \"input.left\"]";
    let sensors = "at = [\"sensor.linear_velocity\", \"sensor.angular_velocity\"]";
    let plain = model(&format!("{TWIL}{INSTANT}"));
    let bare = run(STEPS, &plain, &plain, 800);
    for (id, at, settings) in [
        ("input_delay", inputs, "delay = 0.06"),
        ("sensor_delay", sensors, "delay = 0.06"),
        ("actuator_lag", inputs, "lag = 0.052"),
        ("sensor_lag", sensors, "lag = 0.052"),
    ] {
        let text = effect(&format!("[effect.{id}]\n{at}\n{settings}"));
        let known = model(&format!("{TWIL}{text}{INSTANT}"));
        let lateness = known.affine().unwrap().predicting(0.01).lateness().unwrap();
        let (with, without) = (
            run(STEPS, &known, &known, 800),
            run(STEPS, &plain, &known, 800),
        );
        let expected = if id == "actuator_lag" {
            // Behind the lag, and as much before its time.
            let mut lagged = lagged(&bare, 0.052);
            lagged.measured.rotate_left(5);
            lagged
        } else if id == "sensor_lag" {
            lagged(&bare, 0.052)
        } else {
            // A sensor's delay shows in what is measured; that of a command is asked for before its time.
            let late = if id == "input_delay" { 0 } else { 6 };
            let mut measured = vec![vec![0.0; 2]; late];
            measured.extend_from_slice(&bare.measured[..800 - late]);
            Trace {
                measured,
                ..Trace::default()
            }
        };
        for i in 0..2 {
            let off = |trace: &Trace| apart(trace, &expected, i, 1.0, 790);
            println!(
                "{id} {i}: {:.6} of {:.5}, late {lateness:.4}",
                off(&with),
                off(&without)
            );
            assert!(off(&with) < 0.03 * off(&without), "{id} {i}");
        }
        let really = if id.ends_with("lag") { 0.052 } else { 0.06 };
        assert!((lateness - really).abs() < 3e-4, "{id} {lateness}");
    }
}

/// Where the model is wrong, or something pushes, no error is left, whether the plant comes to rest
/// by itself or not.
#[test]
fn a_wrong_model_behind_a_delay_leaves_no_error() {
    const HELD: &str = "period_s = 0.01
model = \"model.toml\"
[driver.simulated]
model = \"robot.toml\"
step_s = 0.001
[controller.feedback_linearizing_pi]
settling_time_s = 0.8
[reference]
speed = { steps = { at = [[0.5, 10.0]] } }
";
    let axis = |damping: f64, gain: f64, push: &str| {
        model(&format!(
            "[plant.dc_axis]\nK_A = {damping}\nK_C = {gain}\n[[effect]]\n[effect.input_delay]\nat = [\"input\"]\n\
             delay = 0.05\n{push}[log.measured]\nspeed = {{ sensor = \"instantaneous\" }}\n"
        ))
    };
    let push = effect("[effect.constant_force]\nat = [\"shaft\"]\nforce = 2.0");
    for damping in [-3.0, 0.0] {
        let believed = axis(damping, 8.0, "");
        let robot = axis(damping, 6.5, &push);
        let trace = run(HELD, &believed, &robot, 1500);
        let left = trace.worst(0, 1400);
        println!(
            "{damping}: {left:.6} left, {:.4} at most",
            trace.worst(0, 60)
        );
        assert!(left < 0.01, "{damping}: {left}");
    }
}

/// What nothing can be done about is said, with the reason.
#[test]
fn what_is_not_compensated_says_why() {
    let wheels = "at = [\"wheel.right\", \"wheel.left\"]";
    let left_out = |text: &str, measured: &str| {
        let robot = model(&format!("{TWIL}{}{INSTANT}{measured}", effect(text)));
        compose(STEPS, &robot, &robot).notes.join("\n")
    };
    for (text, why) in [
        (format!("[effect.backlash]\n{wheels}\nplay = 0.1"), "a state of its own"),
        (format!("[effect.torque_ripple]\n{wheels}\ncount = 7.0\nsine = 0.3"), "which is not measured"),
        (format!("[effect.wheel_slip]\n{wheels}\nlimit = 5.0"), "a state of its own"),
        (format!("[effect.expression]\n{wheels}\nforce = \"-0.01*drive^2\""), "depends on the command"),
        ("[effect.payload_change]\nat = [\"inertia.forward\", \"inertia.yaw\"]\nfraction = 0.3\ntime = 12.0".to_owned(), "time of a recording"),
        ("[effect.gravity_slope]\nat = [\"body.forward\"]\nsine = 0.3".to_owned(), "`heading`, which is not measured"),
    ] {
        let notes = left_out(&text, "");
        assert!(notes.contains("not compensated: ") && notes.contains(why), "{notes}");
    }
    let slope = "[effect.gravity_slope]\nat = [\"body.forward\"]\nsine = 0.3";
    let notes = left_out(slope, "heading = {}\n");
    assert!(
        notes.contains("\ncompensated: gravity_slope at body.forward"),
        "{notes}"
    );
}

/// Friction, dead zone, sag, delay and lag at once, while the model learns.
#[test]
fn compensating_and_predicting_allocate_nothing() {
    let wheels = "at = [\"wheel.right\", \"wheel.left\"]";
    let inputs = "at = [\"input.right\", \"input.left\"]";
    let effects: String = [
        ("coulomb_friction", wheels, "level = 1.5"),
        ("dead_zone", inputs, "threshold = 0.5"),
        ("battery_sag", inputs, "resistance = 0.0004"),
        ("input_delay", inputs, "delay = 0.035"),
        ("actuator_lag", inputs, "lag = 0.02"),
    ]
    .map(|(id, at, settings)| effect(&format!("[effect.{id}]\n{at}\n{settings}")))
    .concat();
    let robot = model(&format!("{TWIL}{effects}{ENCODERS}"));
    let mut composed = compose(STEPS, &robot, &robot);
    let mut worst = 0.0f64;
    let mut drive = |ticks: std::ops::Range<u32>| {
        for k in ticks {
            let v = if k / 100 % 2 == 0 { 0.1 } else { -0.05 };
            composed.host.model.learn(0, -15.0 - 0.001 * f64::from(k));
            let step = composed.host.tick(&[v, 0.3]).unwrap();
            if k % 100 == 99 {
                worst = worst.max((step.measured[0] - v).abs());
            }
        }
    };
    drive(0..10);
    let used = allocation_counter::measure(|| drive(10..5000));
    assert_eq!(used.count_total, 0);
    assert!(worst < 0.01, "{worst}");
}

/// Every effect of the library, wherever it fits: what becomes of it is as it should be where that is
/// known here, and a loop around a robot that has it runs.
#[test]
fn every_effect_of_the_library_can_stand_in_a_loop() {
    let expected = |id: &str| match id {
        "actuator_lag"
        | "input_delay"
        | "sensor_delay"
        | "sensor_lag"
        | "sensor_window"
        | "sensor_magnitude"
        | "sensor_offset"
        | "sensor_scale"
        | "wheel_radius_mismatch" => Some("predicted over"),
        "backlash" | "bridge_coast" | "elastic_coupling" | "end_stop" | "friction_drift"
        | "gain_drift" | "hysteresis" | "lugre_friction" | "input_lead" | "wheel_slip"
        | "payload_change" | "torque_ripple" | "gravity_slope" | "gravity_pendulum"
        | "linear_stiffness" | "cubic_stiffness" | "encoder_ripple" => Some("not compensated"),
        "coulomb_friction"
        | "stribeck_friction"
        | "directional_friction"
        | "scrub_friction"
        | "viscous_friction"
        | "quadratic_drag"
        | "constant_force"
        | "dead_zone"
        | "battery_sag"
        | "gain_asymmetry"
        | "input_offset"
        | "input_power"
        | "input_saturation"
        | "winding_heating"
        | "centrifugal_offset" => Some("compensated"),
        _ => None,
    };
    let axis = "[plant.dc_axis]\nK_A = -3.0\nK_C = 8.0\n[log.measured]\n\
                speed = { sensor = \"instantaneous\" }\n";
    let mut tried = 0;
    for (plant, signal) in [
        (
            format!("{TWIL}{INSTANT}"),
            "linear_velocity = { constant = 0.05 }",
        ),
        (axis.to_owned(), "speed = { constant = 2.0 }"),
    ] {
        let base = model(&plant);
        for meta in loopsight_model::registry::effects() {
            for channel in base.plant.channels {
                let Some(mut robot) = base.with_effect(meta.id, &[channel.id]) else {
                    continue;
                };
                // Neutral values would hide it.
                for parameter in &mut robot.parameters {
                    if let Some(end) = parameter.declaration.limits {
                        parameter.value = Some(end.sign() * parameter.scale());
                    } else if parameter.value.is_none_or(|v| v == 0.0) {
                        parameter.value = Some(parameter.scale().min(parameter.declaration.max));
                    }
                }
                let said = robot.affine().unwrap().treatments()[0].say();
                if let Some(start) = expected(meta.id) {
                    assert!(said.starts_with(start), "{said}");
                }
                let loop_file = format!(
                    "period_s = 0.01\nmodel = \"model.toml\"\n[driver.simulated]\nstep_s = 0.0025\nlimit = 12.0\n\
                     [controller.feedback_linearizing_pi]\nsettling_time_s = 0.5\nlimit = 12.0\n[reference]\n{signal}\n"
                );
                let trace = run(&loop_file, &robot, &robot, 50);
                assert!(
                    trace.applied.iter().flatten().all(|u| u.is_finite()),
                    "{said}"
                );
                tried += 1;
            }
        }
    }
    assert!(tried > 100, "{tried}");
}

/// A position that is measured lifts the reason: gravity on an arm, a spring on an axis.
#[test]
fn a_measured_position_makes_it_compensable() {
    const HELD: &str = "period_s = 0.01
model = \"model.toml\"
[driver.simulated]
step_s = 0.001
[controller.feedback_linearizing_pi]
settling_time_s = 0.5
[reference]
speed = { sine = { amplitude = 2.0, frequency_hz = 0.4 } }
";
    let axis = |effects: &str, angle: &str| {
        model(&format!(
            "[plant.dc_axis]\nK_A = -3.0\nK_C = 8.0\n{effects}[log.measured]\n\
             speed = {{ sensor = \"instantaneous\" }}\n{angle}"
        ))
    };
    let pendulum = effect("[effect.gravity_pendulum]\nat = [\"shaft\"]\nsine = 1.5\ncosine = 0.5");
    let angle = "angle = { sensor = \"instantaneous\" }\n";
    let without = run(HELD, &axis("", angle), &axis("", angle), 1000);
    let off = |robot: &Model| apart(&run(HELD, robot, robot, 1000), &without, 0, 1.0, 1000);
    let (seen, unseen) = (off(&axis(&pendulum, angle)), off(&axis(&pendulum, "")));
    println!("gravity: {seen:.5} rad/s with the angle, {unseen:.5} without");
    assert!(seen < 0.05 * unseen);
}
