//! Supervised loops: healthy robots are left alone, failing ones are stopped or recover, and nothing of it
//! allocates.

#![allow(
    clippy::unwrap_used,
    reason = "what is built here is right, and a panic is how this program fails"
)]

use allocation_counter::measure;
use loopsight_core::TickError;
use loopsight_core::supervisor::Action;
use loopsight_model::loop_file::Composed;
use loopsight_model::model::Model;
use loopsight_tests::loops::{GAINS, velocity_loop};
use loopsight_tests::{PERIOD, Random};
use rayon::prelude::*;

// The registry is empty unless the crates are linked.
use loopsight_controllers as _;
use loopsight_drivers as _;
use loopsight_estimators as _;
use loopsight_plants as _;

const TICKS: u64 = 2000;
const HALF_TRACK: f64 = 0.131;

fn plant([a, b, c, d, e, f]: [f64; 6]) -> String {
    format!(
        "[plant.ddmr]\nK_A = {a}\nK_B = {b}\nK_C = {c}\nK_D = {d}\nK_E = {e}\nK_F = {f}\n\
         half_track = 0.131\nwheel_radius = 0.05\n\
         [log.measured.linear_velocity.sensor.encoder_counts]\ncounts_per_revolution = 8192\n\
         of = {{ shaft_angle_right = 0.025, shaft_angle_left = 0.025 }}\n\
         [log.measured.angular_velocity.sensor.encoder_counts]\ncounts_per_revolution = 8192\n\
         of = {{ shaft_angle_right = 0.19083969465648856, shaft_angle_left = -0.19083969465648856 }}\n"
    )
}

fn composed(model: &str, robot: &str, rest: &str) -> Composed {
    let model = Model::from_toml("model.toml", model).unwrap().0;
    velocity_loop(rest, &model, robot)
}

/// A robot, a guess up to 60 % off, and a loop that learns under a supervisor. Returns the speeds that
/// no voltage can take it beyond, too.
fn supervised(index: usize, fault: &str) -> (Composed, [f64; 2]) {
    let mut random = Random::new(index as u64 + 1);
    let truth = GAINS.map(|(low, high)| low + (high - low) * random.share());
    let guess = truth.map(|k| k * (0.4 + 1.2 * random.share()));
    // What 24 V can do; a part of it is asked for.
    let most = [24.0 * truth[2] / -truth[0], 24.0 * truth[5] / -truth[3]];
    let [reach, turn] = [0.3 * most[0], 0.2 * most[1]];
    let text = format!(
        "[driver.simulated]\nmodel = \"robot.toml\"\nlimit = 12.0\nseed = {index}\nstep_s = 1e-3\n{fault}\n\
         [estimator.rls]\nforgetting = 0.995\ninitial_covariance = 1.0\n\
         [learning]\ncertainty_equivalence = true\n[supervisor]\n[reference]\n\
         linear_velocity = {{ multi_level = {{ amplitude = {reach}, hold_s = 0.7, levels = 5, seed = {index} }} }}\n\
         angular_velocity = {{ multi_level = {{ amplitude = {turn}, hold_s = 0.9, levels = 5, seed = {index} }} }}"
    );
    (composed(&plant(guess), &plant(truth), &text), most)
}

/// What became of a loop.
#[derive(Default)]
struct Outcome {
    used: bool,
    falls: usize,
    stopped: Option<String>,
}

/// Runs to the end or to the stop; every signal stays finite, and within what the voltage can do.
fn drive(index: usize, fault: &str) -> Outcome {
    let (mut composed, most) = supervised(index, fault);
    let mut outcome = Outcome::default();
    for k in 0..TICKS {
        match composed.tick(k as f64 * PERIOD) {
            Ok(step) => {
                assert!(step.applied.iter().all(|u| u.abs() <= 12.0), "{index}: {k}");
                // To a dead encoder a speed is a turn; K_E couples the two: half as much again.
                let [v, turn] = most;
                let bounds = [v + HALF_TRACK * turn, v / HALF_TRACK + turn];
                for (y, most) in step.measured.iter().zip(bounds) {
                    assert!(y.abs() < 1.5 * most, "{index}: {y} at tick {k}");
                }
                match step.event.map(|e| e.action) {
                    Some(Action::Resumed) => outcome.used = true,
                    Some(Action::FellBack) => outcome.falls += 1,
                    _ => {}
                }
            }
            Err(TickError::Supervisor(event)) => {
                outcome.stopped = Some(format!("{event:?} at tick {k}"));
                break;
            }
            Err(other) => {
                outcome.stopped = Some(format!("{other:?}"));
                break;
            }
        }
    }
    outcome
}

#[test]
fn healthy_robots_are_left_alone() {
    healthy(200);
}

#[test]
#[ignore = "thousands of loops: run in release"]
fn thousands_of_healthy_robots_are_left_alone() {
    healthy(5000);
}

/// `many` robots with a guess up to 60 % off.
fn healthy(many: usize) {
    let outcomes: Vec<Outcome> = (0..many).into_par_iter().map(|i| drive(i, "")).collect();
    let stops: Vec<&String> = outcomes.iter().filter_map(|o| o.stopped.as_ref()).collect();
    let used = outcomes.iter().filter(|o| o.used).count();
    let falls: usize = outcomes.iter().map(|o| o.falls).sum();
    println!(
        "of {many}: {} stopped, {used} used what they learned, {falls} falls",
        stops.len()
    );
    assert!(stops.is_empty(), "{stops:?}");
    assert!(100 * used >= 95 * many, "{used} of {many}");
}

#[test]
fn failing_robots_recover_or_are_stopped() {
    let faults = [
        "fault = [{ dead_encoder = { start_s = 8.0 } }]",
        "fault = [{ dead_encoder = { of = \"shaft_angle_left\", start_s = 8.0 } }]",
        "fault = [{ frozen = { signal = \"linear_velocity\", start_s = 8.0 } }]",
        "fault = [{ stale = { share = 0.05 } }]",
        "fault = [{ stale = { share = 1.0, start_s = 8.0 } }]",
    ];
    for (kind, fault) in faults.iter().enumerate() {
        let robots = (0..40).into_par_iter();
        let outcomes: Vec<Outcome> = robots.map(|i| drive(1000 + i, fault)).collect();
        let stopped = outcomes.iter().filter(|o| o.stopped.is_some()).count();
        println!("{fault}: {stopped} of 40 stopped");
        if kind == 3 {
            assert_eq!(stopped, 0, "{fault}");
        } else {
            assert_eq!(stopped, 40, "{fault}");
        }
    }
}

#[test]
fn a_supervised_and_limited_loop_allocates_nothing() {
    // A second without the encoder, ridden out: the last good model comes back on the way.
    let robot = plant([-15.146, 0.005, 0.136, -9.573, -3.945, 0.656]);
    let model = plant([-12.0, 0.005, 0.11, -11.0, -3.2, 0.8]);
    let mut composed = composed(
        &model,
        &robot,
        "[driver.simulated]\nmodel = \"robot.toml\"\nlimit = 12.0\nstep_s = 1e-3\n\
         fault = [{ dead_encoder = { of = \"shaft_angle_right\", start_s = 12.3, duration_s = 1.5 } },\n\
         { stale = { share = 0.02 } }]\n\
         [estimator.rls]\nforgetting = 0.995\ninitial_covariance = 1.0\n\
         [learning]\ncertainty_equivalence = true\n\
         [supervisor]\nfrozen_s = 2.0\ntracking_s = 0.8\n\
         [limits]\nvoltage_right = { magnitude = 11.0, rate = 500.0 }\nlinear_velocity = { rate = 2.0 }\n\
         [reference]\n\
         linear_velocity = { multi_level = { amplitude = 0.1, hold_s = 1.5, levels = 5, seed = 1 } }\n\
         angular_velocity = { multi_level = { amplitude = 0.5, hold_s = 1.1, levels = 5, seed = 2 } }",
    );
    let mut falls = 0;
    let used = measure(|| {
        for k in 0..TICKS {
            let step = composed.tick(k as f64 * PERIOD).unwrap();
            falls += usize::from(step.event.is_some_and(|e| e.action == Action::FellBack));
        }
    });
    assert_eq!(used.count_total, 0);
    assert!(falls > 0, "the last good model came back");
}
