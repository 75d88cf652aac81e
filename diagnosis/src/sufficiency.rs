//! Whether a recording says enough to fit a model to it.

use loopsight_model::model::{MeasuredSignal, Model};
use loopsight_model::run::Run;

use crate::conclusion::Advice;
use crate::criteria::LogCriteria;
use crate::figure::{figure, significant};
use crate::floor::rounding;
use crate::holdout::deviations;

/// Whether a measured signal changes in a run.
fn moves(run: &Run) -> bool {
    (0..run.n_measured()).any(|i| {
        let mut values = (0..run.len())
            .map(|k| run.sample(k)[i])
            .filter(|v| v.is_finite());
        let first = values.next();
        values.any(|v| Some(v) != first)
    })
}

/// Whether any input varies.
fn varies(runs: &[Run]) -> bool {
    let first = runs.iter().find(|r| !r.is_empty()).map(|r| r.input(0));
    runs.iter()
        .any(|r| (0..r.len()).any(|k| first.is_some_and(|first| r.input(k) != first)))
}

/// Remarks on a recording that says enough: inputs that are constant and not zero, while others vary.
pub(crate) fn notes(model: &Model, runs: &[Run]) -> Vec<Advice> {
    let value = |i: usize| {
        let mut values = (runs.iter()).flat_map(move |r| (0..r.len()).map(move |k| r.input(k)[i]));
        let first = values.next()?;
        values.all(|v| v == first).then_some(first)
    };
    let inputs = model.plant.inputs.iter().enumerate();
    inputs
        .filter(|(_, input)| !input.optional)
        .filter_map(|(i, input)| {
            let value = value(i).filter(|v| *v != 0.0)?;
            Some(Advice {
                why: format!(
                    "`{}` is {value} {} all the time: its value counts as known, but the log cannot show what its changes do",
                    input.id, input.unit
                ),
                experiment: format!("where that matters, record at other values of `{}`", input.id),
            })
        })
        .collect()
}

/// Where every measured signal has so few levels that its steps hide the motion: what the steps are.
fn too_coarse(model: &Model, runs: &[Run], criteria: &LogCriteria) -> Option<String> {
    let stds = deviations(runs, model.measured.len());
    let coarse = |((i, measured), std): ((usize, &MeasuredSignal), f64)| {
        let step = 12f64.sqrt() * rounding(&measured.sensor, i, runs);
        let unit = measured.signal.unit;
        (std > 0.0 && step >= criteria.coarse * std).then(|| {
            format!(
                "`{}` changes in steps of {step:.2e} {unit}, and its standard deviation is {std:.2e} {unit}",
                measured.signal.id
            )
        })
    };
    let signals = model.measured.iter().enumerate().zip(stds);
    let found: Option<Vec<String>> = signals.map(coarse).collect();
    found
        .filter(|all| !all.is_empty())
        .map(|all| all.join("; "))
}

/// Why a recording does not say enough; empty when it does.
pub(crate) fn reasons(model: &Model, runs: &[Run], criteria: &LogCriteria) -> Vec<Advice> {
    let least = criteria.motion_s;
    let mut list = Vec::new();
    let mut say = |why: String, experiment: &str| {
        list.push(Advice {
            why,
            experiment: experiment.to_owned(),
        });
    };
    let duration: f64 = runs.iter().map(Run::duration).sum();
    let enough = significant(10.0 * least, 3);
    if duration < least {
        say(
            format!("the runs last {} s in all", figure(duration, 2)),
            &format!("record at least ten times the slowest time constant, {enough} s as a rule"),
        );
    }
    let longest = runs.iter().map(Run::duration).fold(0.0, f64::max);
    if (criteria.run_s..f64::INFINITY).contains(&duration) && longest < criteria.run_s {
        say(
            format!("no run is longer than {} s", figure(longest, 2)),
            "record longer runs without a gap",
        );
    }
    for (i, input) in model.plant.inputs.iter().enumerate() {
        if input.optional {
            continue;
        }
        let values = || {
            runs.iter()
                .flat_map(|r| (0..r.len()).map(move |k| r.input(k)[i]))
        };
        let (low, high) = values().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| {
            (a.min(v), b.max(v))
        });
        // A constant input that is not zero has a known influence. One that is always zero tells nothing.
        if low >= high && !(low != 0.0 && varies(runs)) {
            say(
                format!("`{}` is {low} {} all the time", input.id, input.unit),
                "vary every input: a pseudo-random sequence of several levels",
            );
        }
    }
    let moving: f64 = runs.iter().filter(|r| moves(r)).map(Run::duration).sum();
    if moving > 0.0 && moving < least && duration >= least {
        say(
            format!(
                "something moves in {} s of {} s only; in the other runs no measured signal changes",
                figure(moving, 2),
                figure(duration, 2)
            ),
            &format!(
                "record runs in which the machine moves, with inputs above its friction, {enough} s as a rule"
            ),
        );
    }
    if let Some(why) = too_coarse(model, runs, criteria) {
        say(
            why,
            "measure with more counts per turn, or move further and faster, so that a signal has ten levels and more",
        );
    }
    if !runs.iter().any(moves) {
        say(
            "no measured signal ever changes".to_owned(),
            "check that the motors are enabled and the sensors connected, and record again",
        );
    }
    list
}
