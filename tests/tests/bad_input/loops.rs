//! Experiment and loop files.

use std::ffi::OsStr;

use super::{Desk, EXPERIMENT, LOOP, model_text};

#[test]
fn spoilt_experiments() {
    let desk = Desk::new();
    let period =
        |value: &str| EXPERIMENT.replace("period_s = 0.01", &format!("period_s = {value}"));
    let inputs = |value: &str| {
        let (head, _) = EXPERIMENT.split_once("[inputs]").unwrap();
        format!("{head}[inputs]\n{value}\n")
    };
    for (spoilt, words) in [
        (
            period("0"),
            &["period_s", "above 0", "spoilt.toml:2:12"][..],
        ),
        (
            period("-0.01"),
            &["period_s", "above 0", "spoilt.toml:2:12"],
        ),
        (period("nan"), &["period_s", "above 0", "spoilt.toml:2:12"]),
        (period("inf"), &["period_s", "spoilt.toml:2:12"]),
        (period("1e-12"), &["samples", "spoilt.toml:"]),
        (period("\"often\""), &["spoilt.toml:2:12"]),
        (
            EXPERIMENT.replace("duration_s = 2.0", "duration_s = 1e300"),
            &["samples", "spoilt.toml:"],
        ),
        (
            EXPERIMENT.replace("duration_s = 2.0", "duration_s = -1.0"),
            &["duration_s", "spoilt.toml:1:14"],
        ),
        (
            EXPERIMENT.replace("duration_s = 2.0\n", ""),
            &["duration_s", "missing"],
        ),
        (
            EXPERIMENT.replace("[inputs]", "[input]"),
            &["did you mean `inputs`?"],
        ),
        (
            inputs("voltage_rigth = { constant = 1.0 }"),
            &["voltage_rigth", "did you mean `voltage_right`?"],
        ),
        (
            inputs("voltage_right = { sines = { amplitude = 1.0 } }"),
            &["sines", "did you mean `sine`?"],
        ),
        (
            inputs("voltage_right = { prbs = { amplitude = 1.0, hold_s = 0.0 } }"),
            &["above 0 s", "spoilt.toml:5:"],
        ),
        (
            inputs("voltage_right = { steps = { at = [[2.0, 1.0], [1.0, 0.0]] } }"),
            &["entry 2", "increase"],
        ),
        (
            inputs("voltage_right = { constant = inf }"),
            &["finite", "spoilt.toml:5:"],
        ),
        (
            format!("{EXPERIMENT}\n[robot]\nnoise = {{ linear_velocit = 0.1 }}\n"),
            &["linear_velocit", "did you mean `linear_velocity`?"],
        ),
        (
            format!("{EXPERIMENT}\n[robot]\nstep_s = 0.0\n"),
            &["step_s", "spoilt.toml:"],
        ),
    ] {
        desk.write("spoilt.toml", spoilt);
        desk.refused_saying(
            &["simulate", "model.toml", "spoilt.toml", "-o", "new.csv"],
            words,
        );
        assert!(!desk.path("new.csv").exists());
    }
    // A robot that leaves the finite numbers has no log.
    let wild = model_text().replace("K_B = 0.005", "K_B = 500.0");
    desk.write("wild.toml", wild.replace("K_E = -3.945", "K_E = 500.0"));
    desk.refused_saying(
        &["simulate", "wild.toml", "experiment.toml", "-o", "new.csv"],
        &["unstable"],
    );
}

#[test]
fn spoilt_loops() {
    let desk = Desk::new();
    desk.write(
        "singular.toml",
        model_text().replace("K_C = 0.136", "K_C = 0.0"),
    );
    let spoil = |old: &str, new: &str| {
        assert!(LOOP.contains(old), "{old}");
        LOOP.replace(old, new)
    };
    for (spoilt, words) in [
        (
            spoil("model.toml", "nowhere.toml"),
            &["nowhere.toml", "spoilt.toml:1:9"][..],
        ),
        (spoil("model.toml", "folder"), &["folder"]),
        (spoil("model.toml", "binary"), &["binary", "text"]),
        (
            spoil("model.toml", "singular.toml"),
            &["inverted", "linear_velocity"],
        ),
        (
            spoil("0.01", "0"),
            &["period_s", "above 0", "spoilt.toml:2:12"],
        ),
        (
            spoil("0.01", "-0.01"),
            &["period_s", "above 0", "spoilt.toml:2:12"],
        ),
        (
            spoil("0.01", "nan"),
            &["period_s", "above 0", "spoilt.toml:2:12"],
        ),
        (spoil("0.01", "1e-12"), &["ticks", "spoilt.toml:"]),
        (
            spoil("duration_s = 1.0", "duration_s = 1e300"),
            &["ticks", "spoilt.toml:"],
        ),
        (
            spoil("duration_s = 1.0", "duration_s = 0.0"),
            &["duration_s", "above 0"],
        ),
        (
            spoil("driver.simulated", "driver.simulatd"),
            &["did you mean `simulated`?"],
        ),
        (
            spoil(
                "controller.feedback_linearizing_pi",
                "controller.feedback_linearising_pi",
            ),
            &["did you mean `feedback_linearizing_pi`?"],
        ),
        (
            spoil("settling_time_s = 0.45", "settling_time = 0.45"),
            &["did you mean `settling_time_s`?", "spoilt.toml:"],
        ),
        (
            spoil("settling_time_s = 0.45", "settling_time_s = -1.0"),
            &["settling_time_s", "spoilt.toml:"],
        ),
        (
            spoil("settling_time_s = 0.45", ""),
            &["settling_time_s", "spoilt.toml:"],
        ),
        (
            spoil("limit = 12.0", "limit = -12.0"),
            &["limit", "above 0", "spoilt.toml:"],
        ),
        (
            spoil("linear_velocity =", "linear_velocit ="),
            &["linear_velocit", "did you mean `linear_velocity`?"],
        ),
        (
            spoil(
                "[driver.simulated]\nlimit = 12.0",
                "[driver.replay]\nrecording = \"nowhere.csv\"",
            ),
            &["nowhere.csv"],
        ),
        (
            spoil(
                "[driver.simulated]\nlimit = 12.0",
                "[driver.replay]\nrecording = \"binary\"",
            ),
            &["binary"],
        ),
        (
            format!("{LOOP}\n[estimator.rls]\nforgetting = 1.5\n"),
            &["forgetting", "up to 1", "spoilt.toml:"],
        ),
        (
            format!("{LOOP}\n[driver.replay]\nrecording = \"log.csv\"\n"),
            &["replay", "simulated", "spoilt.toml:"],
        ),
        (
            format!("{LOOP}\n[estimator.rsl]\n"),
            &["did you mean `rls`?"],
        ),
        (
            spoil("[driver.simulated]\nlimit = 12.0\n", ""),
            &["driver", "missing"],
        ),
        (
            format!("{LOOP}\n[supervisor]\ntracking = {{ linear_velocit = 0.1 }}\n"),
            &["linear_velocit", "did you mean `linear_velocity`?"],
        ),
        (
            format!("{LOOP}\n[supervisor]\nstale_s = 0.0\n"),
            &["above 0 s", "spoilt.toml:"],
        ),
        (
            format!("{LOOP}\n[supervisor]\nfrozen = 1.0\n"),
            &["did you mean `frozen_s`?"],
        ),
        (
            format!("{LOOP}\n[supervisor]\nrange = {{ linear_velocity = [1.0, -1.0] }}\n"),
            &["lower end first", "spoilt.toml:"],
        ),
        (
            format!("{LOOP}\n[estimator.rls]\n[learning]\nrange = {{ K_A = [-inf, -inf] }}\n"),
            &[
                "`K_A` is [-inf, -inf], expected [low, high]",
                "spoilt.toml:",
            ],
        ),
        (
            format!("{LOOP}\n[limits]\nvoltage_rigth = {{ magnitude = 6.0 }}\n"),
            &["voltage_rigth", "did you mean `voltage_right`?"],
        ),
        (
            format!("{LOOP}\n[limits]\nvoltage_right = {{ magnitude = -6.0 }}\n"),
            &["above 0", "spoilt.toml:"],
        ),
        (
            spoil(
                "limit = 12.0\n",
                "limit = 12.0\nfault = [{ dead_encoder = { of = \"shaft_angle\" } }]\n",
            ),
            &["shaft_angle", "did you mean `shaft_angle_"],
        ),
        (
            spoil(
                "limit = 12.0\n",
                "limit = 12.0\nfault = [{ stale = { share = 5.0 } }]\n",
            ),
            &["from 0 to 1", "spoilt.toml:"],
        ),
    ] {
        desk.write("spoilt.toml", spoilt);
        desk.refused_saying(&["run", "spoilt.toml", "-o", "new.csv"], words);
        assert!(!desk.path("new.csv").exists());
    }
}

/// The loop's files are right, but the robot blows up: the work fails, and the log says until when.
#[test]
fn a_loop_around_an_unstable_robot_ends_with_a_message() {
    let desk = Desk::new();
    let wild = model_text().replace("K_B = 0.005", "K_B = 500.0");
    desk.write("wild.toml", wild.replace("K_E = -3.945", "K_E = 500.0"));
    let text = LOOP
        .replace("limit = 12.0", "limit = 12.0\nmodel = \"wild.toml\"")
        .replace("0.1]", "5.0]");
    desk.write(
        "loop.toml",
        format!("{text}angular_velocity = {{ constant = 5.0 }}\n"),
    );
    let output = desk.output(&["run", "loop.toml"].map(OsStr::new));
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(
        said.contains("diverged") && !said.contains("panicked"),
        "{said}"
    );
    assert!(desk.path("run.csv").exists());
}
