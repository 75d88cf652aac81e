//! Loops that use what they learn: any robot, any guess up to 60 % off, every estimator.

#![allow(
    clippy::unwrap_used,
    reason = "what is built here is right, and a panic is how this program fails"
)]

use allocation_counter::measure;
use loopsight_core::learning::Withheld;
use loopsight_model::loop_file::Composed;
use loopsight_model::model::Model;
use loopsight_tests::loops::{self, GAINS, velocity_loop};
use loopsight_tests::{PERIOD, Random};
use rayon::prelude::*;

// The registry is empty unless the crates are linked.
use loopsight_controllers as _;
use loopsight_drivers as _;
use loopsight_estimators as _;
use loopsight_plants as _;

const ESTIMATORS: [&str; 5] = [
    "[estimator.rls]\nforgetting = 0.998\ninitial_covariance = 1e3",
    "[estimator.rls]\nforgetting = 0.998\nrule = \"variable\"\ninitial_covariance = 1e3",
    "[estimator.rls]\nforgetting = 0.998\nrule = \"directional\"\ninitial_covariance = 1e3",
    "[estimator.kalman]\ninitial_covariance = 1e3\ndrift = 1e-3",
    "[estimator.lms]\nstep = 0.05",
];

fn plant(k: [f64; 6]) -> String {
    let [a, b, c, d, e, f] = k;
    format!(
        "[plant.ddmr]\nK_A = {a}\nK_B = {b}\nK_C = {c}\nK_D = {d}\nK_E = {e}\nK_F = {f}\n\
         half_track = 0.131\nwheel_radius = 0.05\n\n\
         [log.measured.linear_velocity]\n[log.measured.angular_velocity]\n"
    )
}

fn composed(model: &str, robot: &str, rest: &str) -> (Model, Composed) {
    let model = Model::from_toml("model.toml", model).unwrap().0;
    let composed = velocity_loop(rest, &model, robot);
    (model, composed)
}

/// From -1 to 1.
fn next(random: &mut Random) -> f64 {
    2.0 * random.share() - 1.0
}

/// Ticks on, and calls `each` with the squares of the tracking errors.
fn drive(composed: &mut Composed, ticks: u64, mut each: impl FnMut(u64, &Composed, [f64; 2])) {
    for k in 0..ticks {
        let time = k as f64 * PERIOD;
        let reference = [0, 1].map(|i| composed.references[i].sample(time));
        let step = composed.host.tick(&reference).unwrap();
        let finite = step.measured.iter().chain(step.command).chain(step.applied);
        assert!(finite.clone().all(|v| v.is_finite()), "{k}");
        assert!(step.command.iter().all(|v| v.abs() <= 12.0 + 1e-9), "{k}");
        let errors = [0, 1].map(|i| (reference[i] - step.measured[i]).powi(2));
        each(k, composed, errors);
    }
}

/// What became of one robot: rms error of the speed over its reference's amplitude, in the first and in
/// the last quarter, and how far its gains are off at the end.
struct Outcome {
    first: f64,
    last: f64,
    gains: f64,
}

fn one(index: usize) -> Outcome {
    let mut random = Random::new(index as u64 + 1);
    let truth = GAINS.map(|(low, high)| low + 0.5 * (high - low) * (1.0 + next(&mut random)));
    let guess = truth.map(|k| k * (1.0 + 0.6 * next(&mut random)));
    let estimator = ESTIMATORS[index % ESTIMATORS.len()];
    // Within what 12 V can do with the weakest motor that the guess may stand for.
    let reach = 0.4 * 24.0 * truth[2] / -truth[0];
    let turn = 0.3 * 24.0 * truth[5] / -truth[3];
    // White, as a share of what is asked for.
    let noise = [0.0, 0.01][index % 2];
    let (_, mut composed) = composed(
        &plant(guess),
        &plant(truth),
        &format!(
            "[driver.simulated]\nmodel = \"robot.toml\"\nlimit = 12.0\nseed = {index}\nstep_s = 1e-3\n\
             noise = {{ linear_velocity = {}, angular_velocity = {} }}\n{estimator}\n\
             [learning]\ncertainty_equivalence = true\n[reference]\n\
             linear_velocity = {{ multi_level = {{ amplitude = {reach}, hold_s = 0.7, levels = 5, seed = 1 }} }}\n\
             angular_velocity = {{ multi_level = {{ amplitude = {turn}, hold_s = 0.9, levels = 5, seed = 2 }} }}",
            noise * reach,
            noise * turn,
        ),
    );
    let ticks = 2000;
    let (mut first, mut last) = (0.0, 0.0);
    drive(&mut composed, ticks, |k, composed, errors| {
        let values = composed.host.observer.as_ref().unwrap().values();
        assert!(values[0] <= 0.0 && values[3] <= 0.0, "{index}: {values:?}");
        assert!(
            values[2] >= 0.1 * guess[2] && values[5] >= 0.1 * guess[5],
            "{index}: {values:?}"
        );
        let relative = errors[0] / (reach * reach) + errors[1] / (turn * turn);
        if k < ticks / 4 {
            first += relative;
        } else if k >= ticks - ticks / 4 {
            last += relative;
        }
    });
    let values = composed.host.observer.as_ref().unwrap().values();
    let off = |i: usize| (values[i] / truth[i] - 1.0).abs();
    let share = ticks as f64 / 4.0;
    Outcome {
        first: (first / share).sqrt(),
        last: (last / share).sqrt(),
        gains: off(2).max(off(5)),
    }
}

/// Every signal stays finite, commands and estimates in range at every tick; where the estimator has
/// a covariance the gains are found. `many` robots.
fn robots(many: usize) {
    let outcomes: Vec<Outcome> = (0..many).into_par_iter().map(one).collect();
    for (kind, estimator) in ESTIMATORS.iter().enumerate() {
        let of = || outcomes.iter().skip(kind).step_by(ESTIMATORS.len());
        let mean = |value: fn(&Outcome) -> f64| of().map(value).sum::<f64>() / of().count() as f64;
        let worst = |value: fn(&Outcome) -> f64| of().map(value).fold(0.0, f64::max);
        let name = estimator.lines().next().unwrap();
        println!(
            "{name} ({kind}), {} robots: error {:.3} at first, {:.3} at last (worst {:.3}); gains off by \
             {:.3} (worst {:.3})",
            of().count(),
            mean(|o| o.first),
            mean(|o| o.last),
            worst(|o| o.last),
            mean(|o| o.gains),
            worst(|o| o.gains),
        );
        assert!(worst(|o| o.last) < 1.0, "{name}");
        if kind < 4 {
            assert!(mean(|o| o.gains) < 0.05, "{name}");
        }
    }
}

#[test]
fn whatever_the_robot_the_loop_stays_bounded_and_learns() {
    robots(100);
}

#[test]
#[ignore = "five thousand loops: run in release"]
fn thousands_of_robots_stay_bounded_and_learn() {
    robots(5000);
}

const TWIL: [f64; 6] = [-15.146, 0.005, 0.136, -9.573, -3.945, 0.656];

const FRICTION: &str = "
[[effect]]
[effect.coulomb_friction]
at = [\"wheel.right\", \"wheel.left\"]
";

const DELAY: &str = "
[[effect]]
[effect.input_delay]
at = [\"input.right\", \"input.left\"]
delay = 0.023

[[effect]]
[effect.actuator_lag]
at = [\"input.right\", \"input.left\"]
lag = 0.015
";

const DRIVEN: &str = "[driver.simulated]\nmodel = \"robot.toml\"\nlimit = 12.0\nstep_s = 1e-3\n\
    [estimator.rls]\nforgetting = 0.999\ninitial_covariance = 1e4\n\
    [learning]\ncertainty_equivalence = true\n[reference]\n\
    linear_velocity = { multi_level = { amplitude = 0.12, hold_s = 0.8, levels = 5, seed = 1 } }\n\
    angular_velocity = { multi_level = { amplitude = 0.6, hold_s = 1.1, levels = 5, seed = 2 } }";

/// Friction at the wheels multiplies the gains; the commands arrive late. Level, damping and gains are
/// learned all the same, and nothing allocates meanwhile.
#[test]
fn friction_is_learned_behind_a_delay() {
    let guess = [-10.0, 0.0, 0.18, -13.0, -2.0, 0.45];
    let model = format!("{}{FRICTION}level = 0.2\n{DELAY}", plant(guess));
    let robot = format!("{}{FRICTION}level = 0.9\n{DELAY}", plant(TWIL));
    let (model, mut composed) = composed(&model, &robot, DRIVEN);
    assert!(
        composed
            .notes
            .iter()
            .any(|n| n.contains("not learned: input_delay.delay")),
        "{:?}",
        composed.notes
    );
    assert!(!composed.notes.iter().any(|n| n.contains("as if")));
    drive(&mut composed, 3000, |_, _, _| {});
    let counted = measure(|| drive(&mut composed, 200, |_, _, _| {}));
    assert_eq!(counted.count_total, 0);
    let values = composed.host.observer.as_ref().unwrap().values();
    for (name, truth, share) in [
        ("K_A", TWIL[0], 0.15),
        ("K_C", TWIL[2], 0.1),
        ("K_D", TWIL[3], 0.15),
        ("K_F", TWIL[5], 0.1),
        ("coulomb_friction.level", 0.9, 0.2),
    ] {
        let j = model
            .parameters
            .iter()
            .position(|p| p.name == name)
            .unwrap();
        println!("{name}: {:.4} of {truth}", values[j]);
        assert!(
            (values[j] / truth - 1.0).abs() < share,
            "{name}: {}",
            values[j]
        );
    }
}

/// An effect that the regression cannot take in is named.
#[test]
fn what_is_not_reckoned_with_is_said() {
    let lag = "\n[[effect]]\n[effect.sensor_lag]\nat = [\"sensor.linear_velocity\"]\nlag = 0.02\n";
    let (_, composed) = composed(&format!("{}{lag}", plant(TWIL)), &plant(TWIL), DRIVEN);
    let said = |what: &str| composed.notes.iter().any(|n| n.contains(what));
    assert!(
        said("learned as if there were no sensor_lag"),
        "{:?}",
        composed.notes
    );
    assert!(said(
        "not learned: sensor_lag.lag, because it enters non-linearly"
    ));
}

/// One sample in twenty is stale: they teach nothing, say so, and the rest is learned from.
#[test]
fn stale_samples_teach_nothing() {
    let stale = DRIVEN.replace(
        "step_s = 1e-3",
        "step_s = 1e-3\nfault = [{ stale = { share = 0.05 } }]",
    );
    let (_, mut composed) = composed(&plant(TWIL.map(|k| 1.4 * k)), &plant(TWIL), &stale);
    let (mut withheld, mut learned) = (0, 0);
    drive(&mut composed, 3000, |_, composed, _| {
        let lesson = composed.host.observer.as_ref().unwrap().lesson(0);
        withheld += u32::from(lesson.withheld == Some(Withheld::Stale));
        learned += u32::from(lesson.withheld.is_none());
    });
    println!("{withheld} stale, {learned} learned from");
    assert!((100..200).contains(&withheld) && learned > 1000);
    let values = composed.host.observer.as_ref().unwrap().values();
    assert!((values[2] / TWIL[2] - 1.0).abs() < 0.03, "{values:?}");
    assert!((values[5] / TWIL[5] - 1.0).abs() < 0.03, "{values:?}");
}

fn mistake(learning: &str) -> String {
    let model = Model::from_toml("model.toml", &plant(TWIL)).unwrap().0;
    let text = format!(
        "model = \"model.toml\"\nperiod_s = 0.01\n[driver.simulated]\n\
         [controller.feedback_linearizing_pi]\nsettling_time_s = 0.45\n[learning]\n{learning}\n"
    );
    loops::composed(&text, &model, &plant(TWIL))
        .err()
        .unwrap()
        .to_string()
}

#[test]
fn mistakes_in_learning_are_pointed_at() {
    let none = mistake("");
    assert!(none.contains("there is none"), "{none}");
    for (text, line, expected) in [
        ("window_s = 0", 7, "expected a number above 0 s"),
        (
            "clearance = 1.0",
            7,
            "expected a number above 0 and below 1",
        ),
        (
            "dead_zone = { linear_velocty = 0.1 }",
            7,
            "unknown controlled signal",
        ),
        (
            "least_excitation = { linear_velocity = -0.1 }",
            7,
            "expected a number from 0",
        ),
        ("range = { K_C = [0.5, 0.1] }", 7, "expected [low, high]"),
        ("range = { K_C = [0.2, 0.5] }", 7, "outside the range"),
        ("range = { K_X = [0.2, 0.5] }", 7, "unknown parameter"),
    ] {
        let said = mistake(&format!("{text}\n[estimator.rls]"));
        assert!(said.contains(expected), "{text}: {said}");
        assert!(
            said.contains(&format!("loop.toml:{line}")),
            "{text}: {said}"
        );
    }
}
