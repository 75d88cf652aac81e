//! Where a model fails, in words with numbers.

use loopsight_core::model::{Model, signals};
use loopsight_core::run::Run;
use loopsight_core::simulate::{Simulator, follow};
use serde::Serialize;

use crate::problem::Solution;

/// One statement.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Statement {
    /// In words.
    pub statement: String,
    /// Share of the squared error it speaks of.
    pub share_of_squared_error: f64,
}

/// How long after a change of direction its effect is looked for, s.
const AFTER_CHANGE: f64 = 0.1;
/// Bins of a quantity the error may depend on.
const BINS: usize = 20;
/// A statement must speak of this much more error than its share of the samples.
const TELLING: f64 = 1.5;

/// Samples of one signal.
struct Samples {
    error: Vec<f64>,
    measured: Vec<f64>,
    time: Vec<f64>,
    run: Vec<usize>,
    /// By signal of the plant.
    quantities: Vec<Vec<f64>>,
}

/// Statements about the free run of the fitted model, the most telling first.
pub(crate) fn where_it_fails(model: &Model, solution: &Solution, runs: &[Run]) -> Vec<Statement> {
    let mut list = Vec::new();
    for (i, m) in model.measured.iter().enumerate() {
        let samples = collect(model, solution, runs, i);
        let name = m.signal.id;
        list.extend(after_change(name, &samples));
        list.extend(by_direction(name, m.signal.unit, &samples));
        list.extend(dependence(model, name, &samples));
        list.extend(by_run(name, runs, &samples));
    }
    list.sort_by(|a, b| {
        b.share_of_squared_error
            .total_cmp(&a.share_of_squared_error)
    });
    list.truncate(8);
    list
}

fn collect(model: &Model, solution: &Solution, runs: &[Run], signal: usize) -> Samples {
    let n = signals(model.plant).count();
    let mut samples = Samples {
        error: Vec::new(),
        measured: Vec::new(),
        time: Vec::new(),
        run: Vec::new(),
        quantities: vec![Vec::new(); n],
    };
    for (index, (run, x0)) in runs.iter().zip(&solution.states).enumerate() {
        let mut simulator = Simulator::new(model, &solution.values);
        follow(&mut simulator, x0.as_slice(), run, |k, y, now| {
            let measured = run.sample(k)[signal];
            let error = measured - y[signal];
            if !error.is_finite() {
                return;
            }
            samples.error.push(error);
            samples.measured.push(measured);
            samples.time.push(run.time[k]);
            samples.run.push(index);
            for (list, value) in samples.quantities.iter_mut().zip(now.signals()) {
                list.push(*value);
            }
        });
    }
    samples
}

fn share(samples: &Samples, pick: impl Fn(usize) -> bool) -> (f64, f64) {
    let (mut inside, mut all, mut count) = (0.0, 0.0, 0usize);
    for (k, e) in samples.error.iter().enumerate() {
        all += e * e;
        if pick(k) {
            inside += e * e;
            count += 1;
        }
    }
    (
        inside / all,
        count as f64 / samples.error.len().max(1) as f64,
    )
}

fn after_change(name: &str, samples: &Samples) -> Option<Statement> {
    let rms = (samples.measured.iter().map(|v| v * v).sum::<f64>()
        / samples.measured.len().max(1) as f64)
        .sqrt();
    let mut marked = vec![false; samples.error.len()];
    let mut direction = 0.0;
    let mut changed_at: Option<(usize, f64)> = None;
    for (k, mark) in marked.iter_mut().enumerate() {
        let v = samples.measured[k];
        if v.abs() > 0.05 * rms {
            if direction != 0.0 && v.signum() != direction {
                changed_at = Some((samples.run[k], samples.time[k]));
            }
            direction = v.signum();
        }
        *mark = changed_at
            .is_some_and(|(run, t)| run == samples.run[k] && samples.time[k] - t <= AFTER_CHANGE);
    }
    let (error, part) = share(samples, |k| marked[k]);
    (part > 0.0 && error > TELLING * part).then(|| Statement {
        statement: format!(
            "{:.0} % of the squared error of {name} lies within {AFTER_CHANGE} s after a change of direction, which is {:.0} % of the time",
            100.0 * error,
            100.0 * part
        ),
        share_of_squared_error: error,
    })
}

fn by_direction(name: &str, unit: &str, samples: &Samples) -> Option<Statement> {
    let mean = |sign: f64| {
        let (mut sum, mut n) = (0.0, 0usize);
        for (e, v) in samples.error.iter().zip(&samples.measured) {
            if v * sign > 0.0 {
                sum += e;
                n += 1;
            }
        }
        (sum / n.max(1) as f64, n)
    };
    let ((forwards, a), (backwards, b)) = (mean(1.0), mean(-1.0));
    if a < 10 || b < 10 {
        return None;
    }
    let explained = a as f64 * forwards * forwards + b as f64 * backwards * backwards;
    let all: f64 = samples.error.iter().map(|e| e * e).sum();
    let part = explained / all;
    (part > 0.05).then(|| Statement {
        statement: format!(
            "the mean residual of {name} is {forwards:+.3} {unit} forwards and {backwards:+.3} {unit} backwards"
        ),
        share_of_squared_error: part,
    })
}

/// The quantity that the residual depends on most: share of its variance between bins.
fn dependence(model: &Model, name: &str, samples: &Samples) -> Option<Statement> {
    let all: f64 = samples.error.iter().map(|e| e * e).sum();
    let mut best: Option<(f64, &str)> = None;
    for (signal, values) in signals(model.plant).zip(&samples.quantities) {
        let (low, high) = values
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| {
                (a.min(*v), b.max(*v))
            });
        if high <= low || !(high - low).is_finite() {
            continue;
        }
        let mut bins = [(0.0f64, 0usize); BINS];
        for (value, error) in values.iter().zip(&samples.error) {
            let i = (((value - low) / (high - low)) * BINS as f64) as usize;
            let bin = &mut bins[i.min(BINS - 1)];
            bin.0 += error;
            bin.1 += 1;
        }
        let between: f64 = bins
            .iter()
            .filter(|b| b.1 > 0)
            .map(|b| b.0 * b.0 / b.1 as f64)
            .sum::<f64>()
            / all;
        if best.is_none_or(|(most, _)| between > most) {
            best = Some((between, signal.id));
        }
    }
    let (part, quantity) = best?;
    (part > 0.1).then(|| Statement {
        statement: format!(
            "the residual of {name} depends on {quantity}: its mean over that accounts for {:.0} % of the squared error",
            100.0 * part
        ),
        share_of_squared_error: part,
    })
}

fn by_run(name: &str, runs: &[Run], samples: &Samples) -> Option<Statement> {
    if runs.len() < 2 {
        return None;
    }
    let (worst, error, part) = (0..runs.len())
        .map(|i| {
            let (error, part) = share(samples, |k| samples.run[k] == i);
            (i, error, part)
        })
        .max_by(|a, b| (a.1 / a.2).total_cmp(&(b.1 / b.2)))?;
    (error > TELLING * part && error > 0.3).then(|| Statement {
        statement: format!(
            "{:.0} % of the squared error of {name} is in run {}, which is {:.0} % of the samples",
            100.0 * error,
            runs[worst].name,
            100.0 * part
        ),
        share_of_squared_error: error,
    })
}
