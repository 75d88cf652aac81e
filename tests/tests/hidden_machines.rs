//! The machines of one command: without an effect their plant explains them.

#![allow(
    clippy::unwrap_used,
    reason = "recordings that can be made, and a panic is how this program fails"
)]

use loopsight_diagnosis::{FitSettings, Measurements, Work, diagnose, fit};
use loopsight_hidden::{Experiment, Hidden, Robot, record};
use loopsight_model::model::Model;
use loopsight_plants as _;

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

/// Where the position is what is measured, the measured one tells all there is to tell, and says
/// nothing of what a spring promises.
#[test]
fn a_spring_is_found_where_its_position_is_measured() {
    let hidden = [(Hidden::CubicStiffness, 1.0)];
    let log = record(Robot::Oscillator, &hidden, Experiment::Mixed, 31).unwrap();
    let test = record(Robot::Oscillator, &hidden, Experiment::MultiLevel, 1031).unwrap();
    let (model, _) = Model::from_toml("hidden", &log.model_toml).unwrap();
    let tests = [test.run];
    let runs = std::slice::from_ref(&log.run);
    let found = diagnose(
        &model,
        &Measurements::new(runs).tested_on(Some(&tests)),
        &Work::quiet(),
    )
    .unwrap();
    assert_eq!(found.missing.unwrap().effect, "cubic_stiffness");
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
