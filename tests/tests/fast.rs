//! Machines that are done in milliseconds, and that small forces move.

#![allow(
    clippy::unwrap_used,
    reason = "an answer without its keys is how this program fails"
)]

use std::fmt::Write;

use loopsight_tests::{Random, check_improved, check_left};
use serde_json::Value;

mod sessions;

use sessions::improved;

/// Checks the effects that were added, in any order, that parameters of them are what they were made to 2 %, and that hardly anything is left.
fn check(found: &Value, effects: &[&str], values: &[(&str, f64)], left: f64) {
    check_improved(found, effects, values, 0.02);
    check_left(found, left);
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
    check(
        &found,
        &["input_delay"],
        &[("input_delay.delay", delay)],
        0.005,
    );
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
    let level = ("coulomb_friction.level", friction);
    check(&found, &["coulomb_friction"], &[level], 0.005);
}

/// The cone of a loudspeaker of which a laser reads the place, 48 000 times a second. Its suspension stiffens.
///
/// From one reading to the next the cone hardly moves by more than the noise, so that the readings tell nothing of the suspension.
#[test]
fn a_cone_stiffens() {
    let (cubic, every) = (2.5e7, 4);
    let (rate, samples) = (48_000.0, 24_000);
    let step = 1.0 / rate / f64::from(every);
    let mut random = Random::new(7);
    let (mut place, mut speed, mut drive) = (0.0f64, 0.0f64, 0.0f64);
    let mut log = "time_us,drive_V,laser_um\n".to_owned();
    for k in 0..samples * every {
        if k % every == 0 {
            let time = f64::from(k / every) / rate;
            let turns = 20.0 * time + 380.0 * time * time;
            let loud = 0.5 + 0.5 * (std::f64::consts::TAU * 3.0 * time).sin().powi(2);
            drive = (9e3 * loud * (std::f64::consts::TAU * turns).sin()).round() / 1e3;
            let read = 1e6 * place + 4.0 * random.noise();
            writeln!(log, "{:.3},{drive:.3},{read:.1}", 1e6 * time).unwrap();
        }
        let force = 5.2 / 6.0 * (drive - 5.2 * speed);
        let back = 2200.0 * place + cubic * place.powi(3) + 1.1 * speed;
        speed += step * (force - back) / 0.012;
        place += step * speed;
    }
    let model = "[plant.expression.states]\nx = { unit = \"m\", rate = \"v\" }\n\
         v = { unit = \"m/s\", rate = \"(bl / 6 * (u - bl * v) - k * x - b * v + cone) / 0.012\" }\n\
         [plant.expression.inputs]\nu = { unit = \"V\" }\n\
         [plant.expression.channels]\ncone = { unit = \"N\", flow = \"v\", position = \"x\" }\n\
         [plant.expression.parameters]\nbl = { value = 4.5, unit = \"N/A\" }\n\
         k = { value = 1800, unit = \"N/m\" }\nb = { value = 1.5, unit = \"N s/m\" }\n\
         [log.inputs]\nu = \"drive_V\"\n[log.measured]\nx = { column = \"laser_um\", unit = \"um\" }\n";
    let stiffness = ("cubic_stiffness.stiffness", cubic);
    let found = improved(model, &log);
    check(&found, &["cubic_stiffness"], &[stiffness], 0.006);
}

/// A resonator of 9 kHz, logged at 1 MHz, that stiffens by `6e-2` of its stiffness. What acts on it counts in 10⁹ 1/s².
#[test]
fn a_resonator_stiffens() {
    let (stiffness, every, step) = (3.2e9, 4, 0.25e-6);
    let mut random = Random::new(8);
    let (mut place, mut speed, mut drive, mut until) = (0.0f64, 0.0f64, 0.0, 0);
    let mut log = "time_us,drive,place\n".to_owned();
    for k in 0..80_000 {
        if k == until {
            drive = (2000.0 * random.share() - 1000.0).round() / 1000.0;
            until = k + every * (40 + random.below(210));
        }
        if k % every == 0 {
            let read = place + 0.004 * random.noise();
            writeln!(log, "{},{drive:.3},{read:.4}", k / every).unwrap();
        }
        let back = place + 0.06 * place.powi(3);
        speed += step * (stiffness * (drive - back) - 2263.0 * speed);
        place += step * speed;
    }
    let model = "[plant.expression.states]\nx = { unit = \"1\", rate = \"v\" }\n\
         v = { unit = \"1/s\", rate = \"g * u - k * x - d * v + mass\" }\n\
         [plant.expression.inputs]\nu = { unit = \"1\" }\n\
         [plant.expression.channels]\nmass = { unit = \"1/s^2\", flow = \"v\", position = \"x\" }\n\
         [plant.expression.parameters]\ng = { value = 3e9, unit = \"1/s^2\" }\n\
         k = { value = 3e9, unit = \"1/s^2\" }\nd = { value = 3000, unit = \"1/s\" }\n\
         [log.inputs]\nu = \"drive\"\n[log.measured]\nx = \"place\"\n";
    let made = ("cubic_stiffness.stiffness", 0.06 * stiffness);
    let found = improved(model, &log);
    check(&found, &["cubic_stiffness"], &[made], 0.01);
}

/// A stage under control, logged at 5 kHz, that a cable pulls back and whose guide rubs: two effects, and not a spring whose force
/// depends on the way it came.
#[test]
fn a_stage_rubs_and_is_pulled_back() {
    let (friction, spring, every, step) = (0.8, 60.0, 20, 1e-5);
    let mut random = Random::new(9);
    let (mut place, mut speed, mut current) = (0.0f64, 0.0f64, 0.0f64);
    let mut log = "time_ms,current_A,stage_um\n".to_owned();
    for k in 0..150_000 {
        if k % every == 0 {
            let time = f64::from(k) * step;
            let wanted = 0.004 * (18.85 * time).sin() + 0.002 * (45.87 * time).sin();
            let read = ((place + 2e-8 * random.noise()) / 1e-7).round() * 1e-7;
            current = (900.0 * (wanted - read) - 7.0 * speed).clamp(-2.5, 2.5);
            current = (1e4 * (current + 0.05 * random.noise())).round() / 1e4;
            writeln!(log, "{:.1},{current:.4},{:.1}", 1e3 * time, 1e6 * read).unwrap();
        }
        let back = friction * (speed / 1e-4).tanh() + spring * place + 1.2 * speed;
        speed += step * (8.0 * current - back) / 0.35;
        place += step * speed;
    }
    let model = "[plant.expression.states]\nx = { unit = \"m\", rate = \"v\" }\n\
         v = { unit = \"m/s\", rate = \"(kf * i - b * v + slide) / 0.35\" }\n\
         [plant.expression.inputs]\ni = { unit = \"A\" }\n\
         [plant.expression.channels]\nslide = { unit = \"N\", flow = \"v\", position = \"x\" }\n\
         [plant.expression.parameters]\nkf = { value = 7, unit = \"N/A\" }\n\
         b = { value = 2, unit = \"N s/m\" }\n\
         [log.inputs]\ni = \"current_A\"\n[log.measured]\nx = { column = \"stage_um\", unit = \"um\" }\n";
    let values = [
        ("coulomb_friction.level", friction),
        ("linear_stiffness.stiffness", spring),
    ];
    let found = improved(model, &log);
    let effects = ["coulomb_friction", "linear_stiffness"];
    check(&found, &effects, &values, 0.002);
}

/// A mirror without a spring that a loop holds where it is asked to be, logged at 100 kHz for 0.2 s. Its bearing rubs, its cable pulls, and its
/// current comes three samples late.
///
/// The plain model stands still when it is fitted, so that its own free run does not tell how fast the mirror is.
#[test]
fn a_mirror_has_no_spring() {
    let (rate, samples, every) = (100_000.0, 20_000, 4);
    let step = 1.0 / rate / f64::from(every);
    let late = 3 * every as usize;
    let mut random = Random::new(8);
    let (mut angle, mut speed) = (0.0f64, 0.0f64);
    let (mut asked, mut until) = (0.0, 0);
    let mut currents = vec![0.0; late];
    let mut log = "time_us,coil_A,angle_mrad\n".to_owned();
    for k in 0..samples {
        if k == until {
            asked = 0.3 * random.share() - 0.15;
            until = k + 100 + random.below(500);
        }
        let read = angle + 3e-6 * random.noise();
        let current = (12.0 * (asked - read) - 0.0035 * speed).clamp(-4.0, 4.0);
        writeln!(log, "{},{current:.4},{:.4}", 10 * k, 1e3 * read).unwrap();
        for _ in 0..every {
            currents.push(current);
            let acts = currents[currents.len() - 1 - late];
            let rubs = 2e-5 * (speed / 0.2).tanh();
            speed += step * (0.003 * acts - 2e-7 * speed - rubs + 1.5e-5) / 2e-9;
            angle += step * speed;
        }
    }
    let model = "[plant.expression.states]\nangle = { unit = \"rad\", rate = \"speed\" }\n\
         speed = { unit = \"rad/s\", rate = \"(kt * current - b * speed + axle) / 2e-9\" }\n\
         [plant.expression.inputs]\ncurrent = { unit = \"A\" }\n\
         [plant.expression.channels]\naxle = { unit = \"N m\", flow = \"speed\", position = \"angle\" }\n\
         [plant.expression.parameters]\nkt = { value = 0.0025, unit = \"N m/A\" }\n\
         b = { value = 3e-7, unit = \"N m s/rad\" }\n\
         [log.inputs]\ncurrent = \"coil_A\"\n[log.measured]\nangle = \"angle_mrad\"\n";
    let found = improved(model, &log);
    // A pull is a current that is off by as much, and the angle tells no late current from a late sensor.
    check_improved(
        &found,
        &["coulomb_friction", "input_offset", "sensor_delay"],
        &[
            ("coulomb_friction.level", 2e-5),
            ("input_offset.offset", 0.005),
            ("sensor_delay.delay", 30e-6),
        ],
        0.1,
    );
    check_left(&found, 0.005);
}
