//! Planned experiments: they separate what a usual recording cannot, keep the limits, repeat, and
//! say so where no inputs would do.

#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a plan that cannot be made is how this fails"
)]

use assert_cmd::Command;
use loopsight_diagnosis::{
    Conclusion, Diagnosis, ExperimentLimits, Measurements, Plan, Promise, Question, Work, diagnose,
    effect_at, experiment,
};
use loopsight_drivers::{Simulated, simulate_inputs};
use loopsight_hidden::{Hidden, Robot, record_along};
use loopsight_model::model::Model;
use loopsight_model::run::Run;
use loopsight_tests::{PERIOD, WINDINGS, recording, twil, twil_path};
use serde_json::Value;
use tempfile::TempDir;

const PROGRAM: &str = env!("CARGO_BIN_EXE_loopsight-under-test");

fn limits(limit: f64) -> ExperimentLimits {
    ExperimentLimits {
        limit,
        period: PERIOD,
        duration: None,
    }
}

fn separate(model: &Model, a: &str, b: &str) -> Plan {
    let question = Question::Separate(
        effect_at(model, a).unwrap(),
        Some(effect_at(model, b).unwrap()),
    );
    experiment(model, &question, &limits(9.0), &Work::quiet()).unwrap()
}

/// The Twil with an effect where it is tried first.
fn hiding(effect: &str, values: &[f64]) -> Model {
    let plain = twil();
    let at = effect_at(&plain, effect).unwrap().at;
    let at: Vec<&str> = at.iter().map(String::as_str).collect();
    let mut model = plain.with_effect(effect, &at).unwrap();
    let first = plain.parameters.len();
    for (i, value) in values.iter().enumerate() {
        model.parameters[first + i].value = Some(*value);
    }
    model
}

/// What the encoders of `robot` count while it is driven by the plan, integrated at 1e-4 s.
fn record(robot: &Model, plan: &Plan, seed: u64) -> Run {
    let settings = Simulated {
        seed,
        step_s: Some(1e-4),
        ..Simulated::default()
    };
    simulate_inputs(robot, &settings, &plan.drive.time, &plan.drive.inputs).unwrap()
}

fn asked(run: Run) -> Diagnosis {
    diagnose(&twil(), &Measurements::new(&[run]), &Work::quiet()).unwrap()
}

/// What the machine that is no model of ours, and hides something, does with the plan.
fn hidden_machine(effect: Hidden, size: f64, plan: &Plan, seed: u64) -> (Model, Run) {
    let inputs = plan.drive.inputs.chunks_exact(2);
    let commands: Vec<[f64; 2]> = inputs.map(|u| [u[0], u[1]]).collect();
    let log = record_along(Robot::Twil, &[(effect, size)], &commands, seed, WINDINGS).unwrap();
    (
        Model::from_toml("hidden", &log.model_toml).unwrap().0,
        log.run,
    )
}

/// A class that a usual recording of the hidden machine leaves is split by one along the plan made
/// to split it, whichever of the two it is.
#[test]
fn a_plan_splits_the_class_on_the_hidden_machine() {
    for (hidden, rival, size) in [
        (Hidden::DeadZone, "coulomb_friction", 1.0),
        (Hidden::CoulombFriction, "dead_zone", 1.0),
        (Hidden::BatterySag, "input_saturation", 1.0),
    ] {
        let plan = separate(&twil(), hidden.id(), rival);
        assert_eq!(plan.verdict, Promise::Answers, "{}", plan.reason);
        let (model, run) = hidden_machine(hidden, size, &plan, 3);
        let found = diagnose(&model, &Measurements::new(&[run]), &Work::quiet()).unwrap();
        assert_eq!(found.missing.unwrap().effect, hidden.id());
        let class = &found.candidates[0].indistinguishable_from;
        assert!(class.iter().all(|p| p.effect != rival), "{class:?}");
    }
}

/// Two levels cannot tell a dead zone from a gain: after 25 s of PRBS it is one name among others
/// that change nothing. The plan is shorter, and names it alone; and so it does the rival, when
/// that is true.
#[test]
fn a_plan_separates_what_a_binary_sequence_cannot() {
    let threshold = hiding("dead_zone", &[0.8]);
    let usual = asked(recording(&threshold, 1, true));
    assert_eq!(usual.verdict, Conclusion::NothingMissing);
    assert!(usual.missing.is_none());

    let plan = separate(&twil(), "dead_zone", "coulomb_friction");
    assert_eq!(plan.verdict, Promise::Answers, "{}", plan.reason);
    assert!(plan.duration_s < 25.0, "{}", plan.reason);
    for (robot, name) in [
        (threshold, "dead_zone"),
        (hiding("coulomb_friction", &[0.8]), "coulomb_friction"),
    ] {
        let found = asked(record(&robot, &plan, 5));
        assert_eq!(found.verdict, Conclusion::EffectMissing, "{name}");
        assert_eq!(found.missing.unwrap().effect, name);
        let class = &found.candidates[0].indistinguishable_from;
        assert!(class.is_empty(), "{name} and {class:?}");
    }
}

/// Friction that falls with speed shows in slow motion only: a binary sequence of 9 V calls it
/// Coulomb's.
#[test]
fn a_plan_shows_the_breakaway_that_fast_motion_hides() {
    let robot = hiding("stribeck_friction", &[0.5, 0.5, 0.3]);
    let plan = separate(&twil(), "stribeck_friction", "coulomb_friction");
    assert_eq!(plan.verdict, Promise::Answers, "{}", plan.reason);
    let found = asked(record(&robot, &plan, 6));
    assert_eq!(found.missing.unwrap().effect, "stribeck_friction");
    assert!(found.candidates[0].indistinguishable_from.is_empty());
}

#[test]
fn what_no_inputs_separate_is_said_to_be_so() {
    for (a, b, remedy) in [
        ("input_delay", "sensor_delay", "disturbance by hand"),
        ("constant_force", "input_offset", "motor disconnected"),
    ] {
        let plan = separate(&twil(), a, b);
        assert_eq!(plan.verdict, Promise::CannotBeSeparated, "{}", plan.reason);
        assert!(
            plan.reason
                .contains("cannot be separated with inputs alone")
        );
        assert!(plan.reason.contains(remedy), "{}", plan.reason);
        assert!(plan.drive.time.is_empty() && plan.needed_s.is_infinite());
    }
    // No measured signal depends on the half track: its gain is the encoder's, measured by ruler.
    let pin = Question::Pin("half_track".to_owned());
    let plan = experiment(&twil(), &pin, &limits(9.0), &Work::quiet()).unwrap();
    assert_eq!(plan.verdict, Promise::CannotBeSeparated, "{}", plan.reason);
}

#[test]
fn plans_keep_the_limit_begin_and_end_at_rest_and_repeat() {
    let model = twil();
    let questions = [
        Question::All,
        Question::Pin("K_D".to_owned()),
        Question::Separate(effect_at(&model, "dead_zone@input.left").unwrap(), None),
    ];
    for (question, limit) in questions.into_iter().zip([3.0, 9.0, 6.0]) {
        let plan = experiment(&model, &question, &limits(limit), &Work::quiet()).unwrap();
        let Plan { drive, .. } = &plan;
        let n = drive.inputs.len();
        assert!(drive.inputs.iter().all(|v| v.abs() <= limit));
        assert_eq!(drive.inputs[..2], [0.0, 0.0]);
        assert_eq!(drive.inputs[n - 2..], [0.0, 0.0]);
        assert_eq!(n, 2 * drive.time.len());
        let last = drive.time.last().unwrap();
        assert!((last - plan.duration_s).abs() < PERIOD);
        assert!((5.0..=600.0).contains(&plan.duration_s));
        let again = experiment(&model, &question, &limits(limit), &Work::quiet()).unwrap();
        assert_eq!(again.drive, plan.drive);
        assert_eq!(again.reason, plan.reason);
    }
}

/// The predicted standard error is that of a fit to what was recorded, and the value is within it.
#[test]
fn a_pinned_parameter_comes_out_as_sharp_as_was_said() {
    let model = twil();
    let question = Question::Pin("K_E".to_owned());
    let short = ExperimentLimits {
        duration: Some(20.0),
        ..limits(9.0)
    };
    let plan = experiment(&model, &question, &short, &Work::quiet()).unwrap();
    let predicted = 3.945 / plan.detectability;
    let run = record(&model, &plan, 7);
    let settings = loopsight_diagnosis::FitSettings::default();
    let fit = loopsight_diagnosis::fit(
        &model,
        &Measurements::new(&[run]),
        &settings,
        &Work::quiet(),
    )
    .unwrap();
    let found = &fit.parameters["K_E"];
    assert!(
        (found.value + 3.945).abs() < 4.0 * predicted,
        "{found:?} {predicted}"
    );
    let own = found.std_error.unwrap();
    assert!((0.3..3.0).contains(&(own / predicted)), "{own} {predicted}");
}

struct Desk(TempDir);

impl Desk {
    fn new() -> Self {
        let desk = Self(tempfile::tempdir().unwrap());
        std::fs::copy(twil_path(), desk.0.path().join("model.toml")).unwrap();
        desk
    }

    fn run(&self, arguments: &str) -> (i32, String, String) {
        let output = Command::new(PROGRAM)
            .current_dir(self.0.path())
            .args(arguments.split(' '))
            .output()
            .unwrap();
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        (
            output.status.code().unwrap(),
            text(&output.stdout),
            text(&output.stderr),
        )
    }

    fn json(&self, arguments: &str) -> Value {
        let (status, out, err) = self.run(arguments);
        assert_eq!(status, 0, "{err}");
        serde_json::from_str(&out).unwrap()
    }

    fn rows(&self, name: &str) -> Vec<String> {
        let text = std::fs::read_to_string(self.0.path().join(name)).unwrap();
        text.lines().map(str::to_owned).collect()
    }
}

#[test]
fn the_plan_is_a_file_that_a_simulation_replays() {
    let desk = Desk::new();
    let told = desk.json(
        "experiment model.toml --separate dead_zone@input.right+input.left coulomb_friction \
         --duration 6 --limit 6 -o plan.csv --json",
    );
    for key in [
        "experiment",
        "duration_s",
        "separates",
        "detectability",
        "reason",
    ] {
        assert!(!told[key].is_null(), "{key}");
    }
    assert_eq!(told["duration_s"], 6.0);
    assert_eq!(told["separates"][1]["effect"], "coulomb_friction");
    let plan = desk.rows("plan.csv");
    assert_eq!(plan[0], "time_s,voltage_right_V,voltage_left_V");
    assert_eq!((plan[1].as_str(), plan.len()), ("0,0,0", 602));

    let text = "duration_s = 6.0\nperiod_s = 0.01\ninputs_from = \"plan.csv\"\n";
    std::fs::write(desk.0.path().join("replay.toml"), text).unwrap();
    let (status, _, err) = desk.run("simulate model.toml replay.toml -o log.csv");
    assert_eq!(status, 0, "{err}");
    let log = desk.rows("log.csv");
    for (planned, logged) in plan.iter().zip(&log) {
        assert!(logged.starts_with(&format!("{planned},")), "{logged}");
    }
    std::fs::write(
        desk.0.path().join("replay.toml"),
        text.replace("plan.csv", "none.csv"),
    )
    .unwrap();
    let (status, _, err) = desk.run("simulate model.toml replay.toml -o log.csv");
    assert_eq!(status, 2);
    assert!(err.contains("none.csv"), "{err}");
}

#[test]
fn a_wrong_request_is_answered_with_the_nearest_right_one() {
    let desk = Desk::new();
    for (request, answer) in [
        (
            "--separate dead_zon coulomb_friction",
            "did you mean `dead_zone`",
        ),
        (
            "--separate dead_zone@input.rigth coulomb_friction",
            "did you mean `input.right`",
        ),
        (
            "--separate dead_zone@wheel.right coulomb_friction",
            "cannot act on `wheel.right`",
        ),
        ("--separate dead_zone dead_zone", "the same channels"),
        ("--separate dead_zone", "2 values required"),
        ("--pin K_a", "did you mean `K_A`"),
        ("--pin K_A --limit 0", "a number above 0 V"),
        ("--pin K_A --duration 1", "2 s or more"),
        ("--pin K_A --period 0", "above 0 s"),
    ] {
        let (status, _, err) = desk.run(&format!("experiment model.toml {request} -o plan.csv"));
        assert_eq!(status, 2, "{request}: {err}");
        assert!(err.contains(answer), "{request}: {err}");
    }
    assert!(!desk.0.path().join("plan.csv").exists());
    let (status, out, err) = desk.run("experiment model.toml --pin half_track -o plan.csv");
    assert_eq!(status, 0, "{err}");
    assert!(out.contains("cannot be pinned with inputs alone"), "{out}");
    assert!(err.contains("no plan was written"), "{err}");
}
