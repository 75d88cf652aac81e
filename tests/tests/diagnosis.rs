//! What a diagnosis concludes: a few blind recordings, faulty logs, and logs that cannot tell.
//! The whole blind table is `cargo run --release -p loopsight-tests --example blind_table`.

#![allow(
    clippy::unwrap_used,
    reason = "helpers of tests: a failure is the test's failure"
)]

use loopsight::answers::Verdict;
use loopsight::{DiagnoseOptions, Log, Session};
use loopsight_diagnosis::{Conclusion, Diagnosis, Measurements, Work, diagnose};
use loopsight_hidden::{Experiment, Hidden, Recording, Robot, record_with};
use loopsight_model::model::Model;
use loopsight_plants as _;
use loopsight_tests::{WINDINGS, real_data};

fn log(hidden: &[(Hidden, f64)], kind: Experiment, seed: u64) -> Recording {
    let robot = hidden.first().map_or(Robot::Twil, |h| h.0.home());
    log_of(robot, hidden, kind, seed)
}

fn log_of(robot: Robot, hidden: &[(Hidden, f64)], kind: Experiment, seed: u64) -> Recording {
    record_with(robot, hidden, kind, seed, WINDINGS).unwrap()
}

fn model(log: &Recording) -> Model {
    Model::from_toml("hidden", &log.model_toml).unwrap().0
}

fn judge(log: &Recording, test: Option<&Recording>) -> Diagnosis {
    let tests = test.map(|t| vec![t.run.clone()]);
    diagnose(
        &model(log),
        &Measurements::new(std::slice::from_ref(&log.run)).tested_on(tests.as_deref()),
        &Work::quiet(),
    )
    .unwrap()
}

fn finds(effect: Hidden, size: f64, seed: u64) {
    finds_under(Experiment::Prbs, effect, size, seed);
}

fn finds_under(kind: Experiment, effect: Hidden, size: f64, seed: u64) {
    finds_on(effect.home(), kind, effect, size, seed);
}

fn finds_on(robot: Robot, kind: Experiment, effect: Hidden, size: f64, seed: u64) {
    let recording = log_of(robot, &[(effect, size)], kind, seed);
    let unseen = log_of(robot, &[(effect, size)], Experiment::MultiLevel, 100 + seed);
    let diagnosis = judge(&recording, Some(&unseen));
    assert_eq!(
        diagnosis.verdict,
        Conclusion::EffectMissing,
        "{}",
        effect.id()
    );
    let best = &diagnosis.candidates[0];
    let class = std::iter::once(&best.place).chain(&best.indistinguishable_from);
    let found: Vec<&str> = class.map(|p| p.effect.as_str()).collect();
    assert!(
        found.contains(&effect.id()),
        "{} found as {found:?}",
        effect.id()
    );
    assert!(
        best.nrmse < 1.1 * unseen.floor(),
        "{}: {}",
        effect.id(),
        best.nrmse
    );
    for quantity in &recording.truth.hidden[0].fitted {
        if let (Some(p), true) = (best.parameters.get(quantity.name), found[0] == effect.id()) {
            let off = (p.value - quantity.value).abs();
            assert!(
                off < 0.05 * quantity.value.abs(),
                "{}: {} ",
                quantity.name,
                p.value
            );
        }
    }
}

#[test]
fn friction_is_found_with_its_level() {
    finds(Hidden::CoulombFriction, 1.0, 1);
}

#[test]
fn small_friction_is_found() {
    let recording = log(&[(Hidden::CoulombFriction, 0.3)], Experiment::Prbs, 4);
    let diagnosis = judge(&recording, None);
    let missing = diagnosis.missing.unwrap();
    assert_eq!(missing.effect, "coulomb_friction");
    assert_eq!(missing.at, ["wheel.right", "wheel.left"]);
}

#[test]
fn a_late_sensor_is_a_class_with_a_late_command() {
    finds(Hidden::SensorDelay, 1.0, 2);
}

#[test]
fn a_stronger_motor_and_an_eccentric_encoder_are_found() {
    finds(Hidden::GainAsymmetry, 1.0, 3);
    finds(Hidden::EncoderRipple, 1.0, 3);
}

/// Two levels do not show it: the log has chirp and ramps as well.
#[test]
fn a_power_law_is_found_with_its_exponent() {
    finds_under(Experiment::Mixed, Hidden::InputPower, 1.0, 7);
}

/// Found in the log alone, whose commands come two lines late.
#[test]
#[ignore = "seconds: run in release"]
fn a_command_that_is_logged_late_is_found() {
    finds(Hidden::InputLead, 1.0, 1);
}

/// A pendulum without friction swings on. The fit to that ends far from the machine, and no effect helps from there.
#[test]
#[ignore = "seconds: run in release"]
fn a_search_whose_plain_fit_went_astray_begins_again() {
    let robot = Robot::RotaryPendulum;
    finds_on(robot, Experiment::Prbs, Hidden::CoulombFriction, 1.0, 5000);
}

/// The plain model leaves as much as a constant would, so the search begins afresh; also where the file has no values
/// to begin with.
#[test]
fn a_sensor_without_direction_is_found() {
    finds(Hidden::SensorMagnitude, 1.0, 1);
    let mut log = log(&[(Hidden::SensorMagnitude, 1.0)], Experiment::Prbs, 2);
    let lines = log.model_toml.lines();
    let lines = lines.filter(|l| !l.starts_with("K_A") && !l.starts_with("K_C"));
    log.model_toml = lines.map(|l| format!("{l}\n")).collect();
    let found = judge(&log, None);
    assert_eq!(found.missing.unwrap().effect, "sensor_magnitude");
    assert!(found.candidates[0].nrmse < 1.1 * log.floor());
}

/// Found by what happens at command zero, with the electrical share of the damping.
#[test]
fn a_coasting_bridge_is_found_with_its_share() {
    finds_under(Experiment::Mixed, Hidden::BridgeCoast, 0.5, 7);
}

/// Found with its stiffness and the shape of its loop, beside friction and springs.
#[test]
fn a_joint_with_hysteresis_is_found_with_its_loop() {
    finds(Hidden::Hysteresis, 0.5, 3);
}

/// Found with its level and its way, where creeping shows it with what breaking away takes as well, and once.
#[test]
fn a_seal_that_bends_before_it_slides_is_found_in_the_form_that_shows() {
    let recording = log(&[(Hidden::LugreFriction, 1.0)], Experiment::Mixed, 1);
    let diagnosis = judge(&recording, None);
    let best = &diagnosis.candidates[0];
    assert_eq!(best.place.effect, "lugre_friction");
    for (id, truth) in [
        ("level", 0.8),
        ("excess", 0.5),
        ("speed", 1.0),
        ("way", 0.1),
    ] {
        let found = best.parameters[id].value;
        assert!((found - truth).abs() < 0.03 * truth, "{id}: {found}");
    }
    let rows = diagnosis.candidates.iter();
    assert_eq!(rows.filter(|c| c.place == best.place).count(), 1);
}

/// Found with the share of the inertia that is behind the spring, and how it swings.
#[test]
fn a_load_behind_a_spring_is_found() {
    finds_under(Experiment::Mixed, Hidden::ElasticCoupling, 0.5, 3);
}

/// Found with the two places where the stops begin; a log that comes to one of them only says nothing of the other.
#[test]
fn stops_are_found_where_a_joint_comes_to_them() {
    finds(Hidden::EndStop, 1.0, 601);
    let recording = log(&[(Hidden::EndStop, 0.5)], Experiment::Mixed, 601);
    let diagnosis = judge(&recording, None);
    let best = &diagnosis.candidates[0];
    assert_eq!(best.place.effect, "end_stop");
    assert!((best.parameters["lower"].value + 3.0).abs() < 0.01);
    assert!(!best.parameters.contains_key("upper"));
}

/// Found with the height of its edge, in levels that stay there.
#[test]
fn a_tank_that_runs_over_is_found_with_its_edge() {
    finds_under(Experiment::Mixed, Hidden::Overflow, 1.0, 601);
}

/// A dead zone of the driver cannot lie behind the terminals of a motor: where the voltages were measured
/// there, neither it nor anything else that acts before them is looked for.
#[test]
fn what_acts_before_a_measured_input_is_no_candidate() {
    let log = log(&[(Hidden::DeadZone, 1.0)], Experiment::MultiLevel, 5);
    let mut model = model(&log);
    model.log.inputs_measured = true;
    let measured = Measurements::new(std::slice::from_ref(&log.run));
    let found = diagnose(&model, &measured, &Work::quiet()).unwrap();
    assert!(!found.candidates.is_empty());
    for candidate in &found.candidates {
        let id = candidate.place.effect.as_str();
        assert!(
            !["dead_zone", "input_saturation", "battery_sag"].contains(&id),
            "{id}"
        );
    }
}

#[test]
fn nothing_is_found_where_nothing_is_missing() {
    for (kind, seed) in [(Experiment::Prbs, 11), (Experiment::Mixed, 12)] {
        let clean = log(&[], kind, seed);
        assert_eq!(judge(&clean, None).verdict, Conclusion::NothingMissing);
    }
}

/// A dead zone under two levels is a gain: the log shows nothing, the test does.
#[test]
fn a_log_that_cannot_show_it_is_called_insufficient() {
    let recording = log(&[(Hidden::DeadZone, 1.0)], Experiment::Prbs, 5);
    let unseen = log(&[(Hidden::DeadZone, 1.0)], Experiment::MultiLevel, 105);
    let diagnosis = judge(&recording, Some(&unseen));
    assert_eq!(diagnosis.verdict, Conclusion::DataInsufficient);
    assert!(!diagnosis.advice.is_empty());
}

#[test]
fn constant_inputs_and_short_logs_are_refused_with_the_reason() {
    let mut recording = log(&[], Experiment::Prbs, 6);
    let short = recording.run.part(0..150);
    let refused = diagnose(
        &model(&recording),
        &Measurements::new(&[short]),
        &Work::quiet(),
    )
    .unwrap();
    assert_eq!(refused.verdict, Conclusion::DataInsufficient);
    assert!(
        refused.advice[0].why.contains("1.49 s"),
        "{:?}",
        refused.advice
    );
    let mut inputs = recording.run.inputs().to_vec();
    inputs.chunks_exact_mut(2).for_each(|row| row[0] = 0.0);
    recording.run = recording.run.with_inputs(inputs).unwrap();
    let refused = judge(&recording, None);
    assert_eq!(refused.verdict, Conclusion::DataInsufficient);
    assert!(
        refused.advice[0].why.contains("voltage_right"),
        "{:?}",
        refused.advice
    );
}

/// A diagnosis, and how many runs over the log it simulated without derivatives and with them.
fn counted(recording: &Recording) -> (Diagnosis, [u64; 2]) {
    let work = Work::quiet();
    let runs = std::slice::from_ref(&recording.run);
    let found = diagnose(&model(recording), &Measurements::new(runs), &work).unwrap();
    let simulated = work.simulated();
    let samples = recording.run.len() as u64;
    let counts = [simulated.plain, simulated.differentiated];
    (found, counts.map(|n| n.div_ceil(samples)))
}

/// The number of threads must not show in the result, nor in what it took.
#[test]
fn one_thread_or_two_find_the_same() {
    let recording = log(&[(Hidden::QuadraticDrag, 1.0)], Experiment::Mixed, 8);
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        let (found, counts) = pool.install(|| counted(&recording));
        (serde_json::to_string(&found).unwrap(), counts)
    };
    assert_eq!(with(1), with(2));
}

/// Real logs, where they are: friction of the drivetrains and of the flywheel.
#[test]
fn real_logs_show_their_friction() {
    let Some(folder) = real_data("drivetrains and a flywheel") else {
        return;
    };
    for (file, low, high) in [
        ("team4277-drivetrain.json", 0.55, 0.75),
        ("denham-flywheel.json", 0.6, 0.8),
    ] {
        let path = folder.join("frc").join(file);
        let session = Session::of_log(Log::read(path).unwrap()).unwrap();
        let found = session.diagnose(&DiagnoseOptions::default()).unwrap();
        assert_eq!(found.verdict, Verdict::EffectMissing, "{file}");
        let level = found
            .candidates
            .iter()
            .filter(|c| c.place.effect == "coulomb_friction")
            .filter_map(|c| c.parameters.get("level"))
            .find(|p| p.unit == "V" && (low..high).contains(&p.value));
        assert!(level.is_some(), "{file}: {:?}", found.missing);
    }
}
