//! The machines of one command: without an effect their plant explains them, and the walks of
//! `examples/plants/README.md` are as they stand there.

#![allow(
    clippy::unwrap_used,
    reason = "recordings that can be made, files that are there, and a panic is how this program fails"
)]

use std::path::Path;

use assert_cmd::Command;
use loopsight_diagnosis::{FitSettings, Measurements, Work, diagnose, fit};
use loopsight_hidden::{Experiment, Hidden, Robot, record};
use loopsight_model::model::Model;
use loopsight_model::run::Run;
use loopsight_plants as _;
use loopsight_tests::repository;

/// Fitted to a clean recording, the plant leaves of another one what rounding leaves.
fn explained(robot: Robot) {
    let log = record(robot, &[], robot.lesson(None), 11).unwrap();
    let test = record(robot, &[], Experiment::MultiLevel, 12).unwrap();
    let (model, _) = Model::from_toml("hidden", &log.model_toml).unwrap();
    let settings = FitSettings::default();
    let tests = [test.run.clone()];
    let found = fit(
        &model,
        &Measurements::new(std::slice::from_ref(&log.run)).tested_on(Some(&tests)),
        &settings,
        &Work::quiet(),
    )
    .unwrap();
    let left =
        loopsight_diagnosis::compare(&found.model, &Measurements::new(&tests), &Work::quiet())
            .unwrap();
    println!(
        "{}: {:.3} % of another recording, floor {:.3} %",
        robot.name(),
        100.0 * left.nrmse,
        100.0 * test.floor()
    );
    for quantity in &log.truth.lumped {
        let Some(estimate) = found.parameters.get(quantity.name) else {
            continue;
        };
        println!(
            "  {} {} (true {})",
            quantity.name, estimate.value, quantity.value
        );
    }
    assert!(left.nrmse < 1.2 * test.floor());
}

#[test]
fn a_clean_oscillator_is_an_oscillator() {
    explained(Robot::Oscillator);
}

/// What a diagnosis of a recording of `robot` names.
fn missing(robot: Robot, hidden: (Hidden, f64), seed: u64) -> Option<String> {
    let log = record(robot, &[hidden], Experiment::Mixed, seed).unwrap();
    let test = record(robot, &[hidden], Experiment::MultiLevel, 1000 + seed).unwrap();
    let (model, _) = Model::from_toml("hidden", &log.model_toml).unwrap();
    let tests = [test.run];
    let runs = std::slice::from_ref(&log.run);
    let measurements = Measurements::new(runs).tested_on(Some(&tests));
    let found = diagnose(&model, &measurements, &Work::quiet()).unwrap();
    found.missing.map(|place| place.effect)
}

/// Where the position is what is measured, the measured one tells all there is to tell, and says
/// nothing of what a spring promises.
#[test]
fn a_spring_is_found_where_its_position_is_measured() {
    let found = missing(Robot::Oscillator, (Hidden::CubicStiffness, 1.0), 31);
    assert_eq!(found.as_deref(), Some("cubic_stiffness"));
}

/// With the plain model, an upright pole on a cart that sticks drifts away at once. Fitted over too long a horizon, that model
/// becomes another machine.
#[test]
fn friction_is_found_of_a_cart_that_sticks_below_its_pole() {
    for seed in [2, 626] {
        let found = missing(Robot::CartPole, (Hidden::CoulombFriction, 2.0), seed);
        assert_eq!(found.as_deref(), Some("coulomb_friction"), "{seed}");
    }
}

#[test]
fn clean_tanks_are_a_tank_pair() {
    explained(Robot::TankPair);
}

#[test]
fn a_clean_arm_is_an_arm() {
    explained(Robot::Arm);
}

#[test]
fn a_clean_slide_is_a_servo_axis() {
    explained(Robot::ServoAxis);
}

#[test]
fn a_clean_cart_is_a_cart_pole() {
    explained(Robot::CartPole);
}

#[test]
fn a_clean_long_shaft_is_a_flexible_joint() {
    explained(Robot::FlexibleJoint);
}

/// Two masses of which one is measured: to the plant of one mass it lacks what makes it two.
#[test]
fn an_axis_with_one_of_two_masses_measured_lacks_the_spring() {
    for (side, ratio) in [(0, 0.02 / 0.01), (1, -1.0)] {
        let of_side = |experiment, seed| {
            let log = record(Robot::FlexibleJoint, &[], experiment, seed)
                .unwrap()
                .run;
            let mut seen = Run::empty(1, 1);
            for k in 0..log.len() {
                seen.push(log.time()[k], log.input(k), &log.sample(k)[side..=side])
                    .unwrap();
            }
            [seen]
        };
        let text = "[plant.dc_axis]\nK_A = -2.0\nK_C = 40.0\n\
                [log.measured.speed.sensor.encoder_counts]\ncounts_per_revolution = 8192.0\nof = { angle = 1.0 }\n";
        let (model, _) = Model::from_toml("axis", text).unwrap();
        let (log, test) = (
            of_side(Experiment::Prbs, 21),
            of_side(Experiment::MultiLevel, 22),
        );
        let found = diagnose(
            &model,
            &Measurements::new(&log).tested_on(Some(&test)),
            &Work::quiet(),
        )
        .unwrap();
        let best = &found.candidates[0];
        assert_eq!(found.missing.unwrap().effect, "elastic_coupling");
        // Flywheels of 0.01 and 0.02 kg m² and 8 N m/rad between them. The load has a bearing of its own, which is counted to
        // the motor here and shifts the ratio; the resonance stays.
        let [of_masses, resonance] = ["ratio", "resonance"].map(|id| best.parameters[id].value);
        println!(
            "{side}: {:.4} of {:.4}, {of_masses} {resonance}",
            best.nrmse, found.nominal.nrmse
        );
        assert!(
            (resonance / f64::sqrt(1200.0) - 1.0).abs() < 0.01,
            "{resonance} rad/s"
        );
        assert!((of_masses / ratio - 1.0).abs() < 0.15, "{of_masses}");
        assert!(best.nrmse < 0.2 * found.nominal.nrmse);
    }
}

/// What the steps of 0.2 ms of the recorded joint add to its friction, N m. With steps of 25 µs a fit finds
/// 0.120001 ± 0.000005 N m where 0.12 is true.
const OF_STEPS: f64 = 2e-5;

/// A model smooths the sign of friction, and the machine does not. What that does to the level is in its interval, and a
/// width that is too small for the usual step does no harm.
#[test]
fn the_interval_of_a_friction_knows_that_its_sign_is_smoothed() {
    let hidden = [(Hidden::CoulombFriction, 1.0)];
    let found = |width: f64, seed: u64| {
        let log = record(Robot::FlexibleJoint, &hidden, Experiment::Mixed, seed).unwrap();
        let effect = format!(
            "\n[[effect]]\n[effect.coulomb_friction]\nat = [\"motor\"]\nlevel = 0.1\nwidth = {width}\n"
        );
        let (model, _) = Model::from_toml("hidden", &(log.model_toml + &effect)).unwrap();
        let runs = Measurements::new(std::slice::from_ref(&log.run));
        let fit = fit(&model, &runs, &FitSettings::default(), &Work::quiet()).unwrap();
        let level = &fit.parameters["coulomb_friction.level"];
        let [low, high] = level.interval95.unwrap();
        assert!(high > low && high - low < 0.06 * level.value, "{level:?}");
        let truth = log.truth.hidden[0].fitted[0].value;
        (low..=high).contains(&(truth + OF_STEPS))
    };
    for width in [0.1, 0.005] {
        let held = (41..=46).filter(|seed| found(width, *seed)).count();
        println!("width {width} rad/s: {held} of 6 intervals hold the truth");
        assert!(held >= 5, "width {width} rad/s: {held} of 6");
    }
}

#[test]
fn a_clean_joint_on_a_current_is_a_torque_axis() {
    explained(Robot::TorqueAxis);
}

#[test]
fn a_clean_heater_is_thermal() {
    explained(Robot::Thermal);
}

#[test]
fn a_clean_rod_on_an_arm_is_a_rotary_pendulum() {
    explained(Robot::RotaryPendulum);
}

#[test]
fn a_clean_rod_with_a_fan_is_a_propeller_pendulum() {
    explained(Robot::PropellerPendulum);
}

/// A command of a walk, and the lines that its page shows of the answer.
struct Step {
    command: String,
    shown: Vec<String>,
}

/// The blocks of the console in a page, in order.
fn steps(page: &str) -> Vec<Step> {
    let mut steps: Vec<Step> = Vec::new();
    let mut inside = false;
    for line in page.lines() {
        if line.starts_with("```") {
            inside = line == "```console";
        } else if let (true, Some(command)) = (inside, line.strip_prefix("$ loopsight ")) {
            steps.push(Step {
                command: command.to_owned(),
                shown: Vec::new(),
            });
        } else if let (true, false, Some(step)) = (inside, line.trim() == "…", steps.last_mut()) {
            step.shown.push(line.to_owned());
        }
    }
    steps
}

/// Takes the walk of a page in a copy of its folder; a line is as the page has it but for the spaces between words.
fn walk(folder: &Path, page: &str) {
    let desk = tempfile::tempdir().unwrap();
    let recordings = folder.parent().unwrap().join("hidden-effect");
    let recordings = recordings.to_str().unwrap();
    let here = desk.path();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        std::fs::copy(&path, here.join(path.file_name().unwrap())).unwrap();
    }
    let words = |line: &str| line.split_whitespace().collect::<Vec<_>>().join(" ");
    for step in steps(page) {
        let output = Command::new(env!("CARGO_BIN_EXE_loopsight-under-test"))
            .args(
                step.command
                    .split(' ')
                    .map(|a| a.replace("../hidden-effect", recordings)),
            )
            .current_dir(here)
            .output()
            .unwrap();
        let mut said = String::from_utf8(output.stdout).unwrap();
        said.push_str(&String::from_utf8(output.stderr).unwrap());
        assert!(output.status.success(), "{}: {said}", step.command);
        let said: Vec<String> = said.lines().map(words).collect();
        for line in step.shown.iter().map(|line| words(line)) {
            assert!(
                said.contains(&line),
                "`{}` does not say `{line}` but:\n{}",
                step.command,
                said.join("\n")
            );
        }
    }
}

#[test]
#[ignore = "minutes: run in release"]
fn the_walks_of_the_plants_are_as_their_page_says() {
    let folder = repository().join("examples/plants");
    let page = std::fs::read_to_string(folder.join("README.md")).unwrap();
    assert!(steps(&page).len() >= 6);
    walk(&folder, &page);
}
