//! Whether a recording can carry a model at all.

use loopsight_core::model::Model;
use loopsight_core::run::Run;

use crate::advice::Advice;

/// Reasons why not; empty when it can.
pub(crate) fn reasons(model: &Model, runs: &[Run]) -> Vec<Advice> {
    let mut list = Vec::new();
    let mut say = |why: String, experiment: &str| {
        list.push(Advice {
            why,
            experiment: experiment.to_owned(),
        });
    };
    let duration: f64 = runs.iter().map(Run::duration).sum();
    if duration < 2.0 {
        say(
            format!("the runs last {duration:.2} s in all"),
            "record at least ten times the slowest time constant, 20 s as a rule",
        );
    }
    let longest = runs.iter().map(Run::duration).fold(0.0, f64::max);
    if (1.0..f64::INFINITY).contains(&duration) && longest < 1.0 {
        say(
            format!("no run is longer than {longest:.2} s"),
            "record longer runs without a gap",
        );
    }
    for (i, input) in model.plant.inputs.iter().enumerate() {
        let values = || {
            runs.iter()
                .flat_map(|r| (0..r.len()).map(move |k| r.input(k)[i]))
        };
        let (low, high) = values().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| {
            (a.min(v), b.max(v))
        });
        if low >= high {
            say(
                format!("`{}` is {low} {} all the time", input.id, input.unit),
                "vary every input: a pseudo-random sequence of several levels",
            );
        }
    }
    let moves = (0..model.measured.len()).any(|i| {
        let mut values = runs
            .iter()
            .flat_map(|r| (0..r.len()).map(move |k| r.sample(k)[i]));
        let first = values.find(|v| v.is_finite());
        values.any(|v| v.is_finite() && Some(v) != first)
    });
    if !moves {
        say(
            "no measured signal ever changes".to_owned(),
            "check that the motors are enabled and the sensors connected, and record again",
        );
    }
    list
}
