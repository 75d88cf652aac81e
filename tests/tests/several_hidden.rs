//! Machines that hide several effects, of which none explains much beside the others.

#![allow(
    clippy::unwrap_used,
    reason = "recordings that can be made, and a panic is how this program fails"
)]

use loopsight_diagnosis::{ImproveSettings, Measurements, Work, compare, improve};
use loopsight_hidden::{Experiment, Hidden, Robot, record_with};
use loopsight_model::model::Model;
use loopsight_plants as _;
use loopsight_tests::WINDINGS;

/// Checks that `improve` finds the `effects` from one recording, and that the model then leaves of another one what noise and
/// resolution leave, but for a tenth.
fn found(robot: Robot, hidden: &[(Hidden, f64)], seed: u64, effects: &[&str]) {
    let recorded = |kind, seed| record_with(robot, hidden, kind, seed, WINDINGS).unwrap();
    let log = recorded(Experiment::Mixed, seed);
    let unseen = recorded(Experiment::MultiLevel, 500 + seed);
    let (model, _) = Model::from_toml("hidden", &log.model_toml).unwrap();
    let (runs, work) = ([log.run], Work::quiet());
    let settings = ImproveSettings::default();
    let found = improve(&model, &Measurements::new(&runs), &settings, &work).unwrap();
    let steps = found.steps.iter().filter_map(|step| step.added.as_ref());
    let mut added: Vec<&str> = steps.map(|place| place.effect.as_str()).collect();
    added.sort_unstable();
    assert_eq!(added, effects);
    let best = &found.best.as_ref().unwrap().model;
    let floor = unseen.floor();
    let left = compare(best, &Measurements::new(&[unseen.run]), &work).unwrap();
    assert!(left.nrmse < 1.1 * floor, "{}, floor {floor}", left.nrmse);
}

/// Without the pump, the edge of the upper tank seems to be without end, and its derivatives had none.
#[test]
fn a_tank_runs_over_and_a_pump_draws_from_the_other() {
    let hidden = [(Hidden::Overflow, 1.0), (Hidden::ConstantForce, 1.0)];
    let effects = ["constant_force", "overflow"];
    found(Robot::TankPair, &hidden, 2, &effects);
}

/// Once the stops are in the model, neither the play nor the shaft that bends explains enough alone.
#[test]
#[ignore = "20 s in a release build"]
fn an_axis_has_stops_play_and_a_shaft_that_bends() {
    let hidden = [
        (Hidden::Backlash, 0.5),
        (Hidden::EndStop, 1.0),
        (Hidden::ElasticCoupling, 1.0),
    ];
    let effects = ["backlash", "elastic_coupling", "end_stop"];
    found(Robot::Axis, &hidden, 309, &effects);
}

/// Where friction holds the machine, the long steps of a first look said nothing of the other two.
#[test]
#[ignore = "30 s in a release build"]
fn a_twil_has_friction_scrub_and_a_power_law_of_its_inputs() {
    let hidden = [
        (Hidden::CoulombFriction, 2.0),
        (Hidden::InputPower, 1.0),
        (Hidden::ScrubFriction, 2.0),
    ];
    let effects = ["coulomb_friction", "input_power", "scrub_friction"];
    found(Robot::Twil, &hidden, 314, &effects);
}
