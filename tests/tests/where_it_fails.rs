//! Where a model fails is said in one place, for comparisons and diagnoses alike.

#![allow(
    clippy::unwrap_used,
    reason = "helpers of tests: a failure is the test's failure"
)]

use loopsight_diagnosis::{Measurements, Statement, Work, compare};
use loopsight_hidden::{Experiment, Hidden, Robot, record};
use loopsight_model::model::Model;
use loopsight_model::run::Run;
use loopsight_plants as _;

fn stiff_axis() -> (Model, Run) {
    let log = record(
        Robot::Axis,
        &[(Hidden::CoulombFriction, 1.0)],
        Experiment::MultiLevel,
        2,
    )
    .unwrap();
    (
        Model::from_toml("hidden", &log.model_toml).unwrap().0,
        log.run,
    )
}

fn of<'a>(said: &'a [Statement], part: &str) -> Option<&'a Statement> {
    said.iter().find(|s| s.statement.contains(part))
}

#[test]
fn friction_is_told_by_direction() {
    let (model, run) = stiff_axis();
    let said = compare(&model, &Measurements::new(&[run]), &Work::quiet())
        .unwrap()
        .where_it_fails;
    let direction = of(&said, "in the positive direction and").unwrap();
    assert!(
        direction
            .statement
            .starts_with("the mean residual of speed is -")
            && direction.statement.contains(" and +"),
        "{direction:?}"
    );
    assert!(direction.share_of_squared_error > 0.3);
    assert!(said.iter().all(|s| s.signal == "speed"));
    let shares: Vec<f64> = said.iter().map(|s| s.share_of_squared_error).collect();
    assert!(shares.is_sorted_by(|a, b| a >= b), "{shares:?}");
}

/// Time stamps need not begin at zero, and a run need not have a name.
#[test]
fn a_bad_run_is_named_or_numbered() {
    let (model, run) = stiff_axis();
    let mut runs = vec![run.part(0..800), run.part(800..1600), run.part(1600..2400)];
    let mut off = runs[1].measured().to_vec();
    off[300..500].iter_mut().for_each(|y| *y += 30.0);
    runs[1] = runs[1].clone().with_measured(off).unwrap();
    let said = |runs: &[Run]| {
        compare(&model, &Measurements::new(runs), &Work::quiet())
            .unwrap()
            .where_it_fails
    };
    assert!(of(&said(&runs), "of speed is in run 2, which is 33 %").is_some());
    let names = ["slow", "fast", "back"];
    let runs: Vec<_> = runs
        .into_iter()
        .zip(names)
        .map(|(run, name)| run.named(name))
        .collect();
    assert!(of(&said(&runs), "is in run fast, which").is_some());
}

#[test]
fn what_was_not_measured_is_no_reason_to_fail() {
    let (model, run) = stiff_axis();
    let nothing = vec![f64::NAN; run.measured().len()];
    let run = run.with_measured(nothing).unwrap();
    assert_eq!(
        compare(&model, &Measurements::new(&[run]), &Work::quiet())
            .unwrap()
            .where_it_fails,
        []
    );
}
