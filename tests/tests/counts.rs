//! Counts that do not depend on the machine, beside those of `tests/counts.toml`: none may grow by more than a tenth.

#![allow(
    clippy::unwrap_used,
    reason = "helpers of tests: a failure is the test's failure"
)]

use loopsight_diagnosis::{
    ImproveSettings, Measurements, Simulated, Work, compare, diagnose, improve,
};
use loopsight_hidden::{Experiment, Hidden, Recording, record_with};
use loopsight_model::model::Model;
use loopsight_plants as _;
use loopsight_tests::{WINDINGS, repository};

/// What a piece of `work` with a recording of `hidden` simulates is no more than the table says of `name`.
fn no_more(name: &str, hidden: &[Hidden], work: impl FnOnce(&Model, &Measurements<'_>, &Work<'_>)) {
    let with: Vec<(Hidden, f64)> = hidden.iter().map(|h| (*h, 1.0)).collect();
    let recording: Recording =
        record_with(hidden[0].home(), &with, Experiment::Prbs, 1, WINDINGS).unwrap();
    let (model, _) = Model::from_toml("hidden", &recording.model_toml).unwrap();
    let (counted, runs) = (Work::quiet(), std::slice::from_ref(&recording.run));
    work(&model, &Measurements::new(runs), &counted);
    let Simulated {
        plain,
        differentiated,
        ..
    } = counted.simulated();
    let ids: Vec<&str> = hidden.iter().map(|h| h.id()).collect();
    let of = ids.join("_and_");
    let text = std::fs::read_to_string(repository().join("tests/counts.toml")).unwrap();
    let table: toml::Table = text.parse().unwrap();
    let samples = recording.run.len() as u64;
    for (kind, now) in [("plain", plain), ("differentiated", differentiated)] {
        let now = now.div_ceil(samples);
        let before = table[name][&of][kind].as_integer().unwrap().unsigned_abs();
        println!("{name}, {of}, {kind}: {now} runs, {before} in the table");
        assert!(
            now <= before + before / 10,
            "{name}, {of}, {kind}: {now} runs, {before} in the table"
        );
    }
}

#[test]
fn a_comparison_simulates_no_more_than_it_did() {
    no_more(
        "compare",
        &[Hidden::CoulombFriction],
        |model, measurements, work| {
            compare(model, measurements, work).unwrap();
        },
    );
}

#[test]
fn a_diagnosis_simulates_no_more_than_it_did() {
    for hidden in [Hidden::CoulombFriction, Hidden::LinearStiffness] {
        no_more("diagnose", &[hidden], |model, measurements, work| {
            diagnose(model, measurements, work).unwrap();
        });
    }
}

#[test]
fn an_improvement_simulates_no_more_than_it_did() {
    let hidden = [Hidden::CoulombFriction, Hidden::InputDelay];
    no_more("improve", &hidden, |model, measurements, work| {
        let settings = ImproveSettings::default();
        let found = improve(model, measurements, &settings, work).unwrap();
        assert_eq!(found.steps.len(), 3, "{:?}", found);
    });
}
