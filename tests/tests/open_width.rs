//! Friction that is written by hand, without a width for its sign.

#![allow(
    clippy::unwrap_used,
    reason = "helpers of tests: a failure is the test's failure"
)]

use loopsight::answers::Verdict;
use loopsight::{DiagnoseOptions, FitOptions, Log, Model, Session};
use loopsight_tests::repository;

/// The `log` of a machine with dry friction, and its model with friction at `place` and these `lines`.
fn session(example: &str, log: &str, place: &str, lines: &str) -> Session {
    let folder = repository().join("examples/hidden-effect").join(example);
    let text = std::fs::read_to_string(folder.join("model.toml")).unwrap();
    let text = format!("{text}\n[[effect]]\n[effect.coulomb_friction]\nat = [{place}]\n{lines}");
    let model = Model::from_toml("model.toml", &text).unwrap();
    Session::new(model, Log::read(folder.join(log)).unwrap()).unwrap()
}

/// A mass on a spring moves at 0.2 m/s at most, and the default is 0.1 m/s: its friction was 0.40 N of 0.25, and 4.9 % were left.
#[test]
fn a_slow_machine_has_a_sharp_sign() {
    let slow = |lines: &str| {
        session(
            "oscillator_coulomb_friction",
            "mixed.csv",
            "\"mass\"",
            lines,
        )
    };
    let fitted = slow("").fit(&FitOptions::default()).unwrap();
    let level = &fitted.parameters["coulomb_friction.level"];
    assert!((level.value - 0.25).abs() < 0.002, "{level:?}");
    assert!(fitted.nrmse_fit < 0.0065, "{}", fitted.nrmse_fit);
    let width = fitted.parameters["coulomb_friction.width"].value;
    assert!(width < 0.003, "{width}");
    assert!(
        fitted.summary.contains("coulomb_friction.width = "),
        "{}",
        fitted.summary
    );
    // The model that is written has it: it says the same when it is read again.
    let again = fitted.model().to_toml();
    assert!(again.contains(&format!("width = {width}")), "{again}");
    // Nor does anything stand in for a sign that is too smooth.
    let found = slow("").diagnose(&DiagnoseOptions::default()).unwrap();
    assert_eq!(
        found.verdict,
        Verdict::NothingMissing,
        "{:?}",
        found.missing
    );
    // What the file says stays.
    let said = slow("width = 0.1\n").fit(&FitOptions::default()).unwrap();
    assert_eq!(said.parameters["coulomb_friction.width"].value, 0.1);
    assert!(
        !said.summary.contains("coulomb_friction.width = "),
        "{}",
        said.summary
    );
}

/// The wheels of a robot turn at several radians per second: the default, 0.1 rad/s, stays.
#[test]
fn a_quick_machine_keeps_the_default() {
    let quick = session(
        "coulomb_friction",
        "prbs.csv",
        "\"wheel.right\", \"wheel.left\"",
        "",
    );
    let fitted = quick.fit(&FitOptions::default()).unwrap();
    assert_eq!(fitted.parameters["coulomb_friction.width"].value, 0.1);
}
