//! Where a model fails, in words with numbers.

use loopsight_core::Signal;
use loopsight_model::model::{Model, signals};
use loopsight_model::run::Run;
use loopsight_model::simulate::{Simulator, try_follow};
use serde::Serialize;

use crate::criteria::FailsCriteria;
use crate::figure::{pair, significant};
use crate::floor::rounding;
use crate::long::Thinned;
use crate::motion::{Motion, changes, rest, speed};
use crate::prediction::Solution;
use crate::progress::{Cancelled, Work};

/// One statement.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Statement {
    /// In words.
    pub statement: String,
    /// Share of the squared error that it explains.
    pub share_of_squared_error: f64,
    /// The measured signal it is about.
    #[serde(skip)]
    pub signal: String,
}

/// Bins of a quantity the error may depend on.
const BINS: usize = 20;
/// Most statements of a diagnosis.
const MOST: usize = 8;

/// Samples of one signal.
#[derive(Default)]
struct Samples {
    error: Vec<f64>,
    /// The quantity whose sign is the direction of motion, and the size below which it counts as rest.
    speed: Vec<f64>,
    rest: f64,
    run: Vec<usize>,
    /// Just after a change of direction.
    after_change: Vec<bool>,
    /// By signal of the plant.
    quantities: Vec<Vec<f64>>,
}

/// Statements about the free run of the fitted model, the most telling first.
pub(crate) fn where_it_fails(
    model: &Model,
    solution: &Solution,
    runs: &[Run],
    work: &Work<'_>,
) -> Result<Vec<Statement>, Cancelled> {
    let criteria = &work.criteria().fails;
    let mut list = Vec::new();
    for (m, samples) in model
        .measured
        .iter()
        .zip(collect(model, solution, runs, work)?)
    {
        let name = m.signal.id;
        let motion = Motion::of(m.signal.unit);
        let found = [
            after_change(name, motion, &samples, criteria),
            by_direction(m.signal, motion, &samples, criteria),
            dependence(model, name, &samples, criteria),
            by_run(name, runs, &samples, criteria),
        ];
        list.extend(
            found
                .into_iter()
                .flatten()
                .map(|(statement, share)| Statement {
                    statement,
                    share_of_squared_error: share,
                    signal: name.to_owned(),
                }),
        );
    }
    list.sort_by(|a, b| {
        b.share_of_squared_error
            .total_cmp(&a.share_of_squared_error)
    });
    list.truncate(MOST);
    Ok(list)
}

/// Contiguous parts of a log for cross-validation.
const PARTS: usize = 16;

/// Whether a quantity of the model predicts the error of a measured signal on held-out parts of the log. Then that
/// error is not noise.
///
/// Rounding is no noise either: at a level that returns it is the same each time. What is predicted must be more than
/// that leaves.
pub(crate) fn predictable(
    model: &Model,
    solution: &Solution,
    runs: &[Run],
    work: &Work<'_>,
) -> Result<bool, Cancelled> {
    let least = work.criteria().missing.predicted;
    let all = collect(model, solution, runs, work)?;
    let mut measured = model.measured.iter().zip(&all).enumerate();
    Ok(measured.any(|(i, (measured, samples))| {
        let squares: f64 = samples.error.iter().map(|e| e * e).sum();
        let rounded = rounding(&measured.sensor, i, runs).powi(2) * samples.error.len() as f64;
        let least = least.max(rounded / squares);
        let mut quantities = samples.quantities.iter();
        quantities.any(|values| predicted(values, &samples.error) > least)
    }))
}

/// Share of the squared error that means over bins of a quantity explain. The means of each half of the log's
/// parts come from the other half. Negative where they add to the error.
fn predicted(values: &[f64], errors: &[f64]) -> f64 {
    let (low, high) = extent(values);
    if high <= low || !(high - low).is_finite() {
        return 0.0;
    }
    let half = |k: usize| (k * PARTS / errors.len().max(1)) % 2;
    let bin = |value: f64| ((((value - low) / (high - low)) * BINS as f64) as usize).min(BINS - 1);
    let mut sums = [[(0.0f64, 0usize); BINS]; 2];
    for (k, (value, error)) in values.iter().zip(errors).enumerate() {
        let sum = &mut sums[half(k)][bin(*value)];
        sum.0 += error;
        sum.1 += 1;
    }
    let (mut before, mut after) = (0.0, 0.0);
    for (k, (value, error)) in values.iter().zip(errors).enumerate() {
        let (sum, n) = sums[1 - half(k)][bin(*value)];
        before += error * error;
        after += (error - sum / n.max(1) as f64).powi(2);
    }
    1.0 - after / before
}

fn extent(values: &[f64]) -> (f64, f64) {
    values
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| {
            (a.min(*v), b.max(*v))
        })
}

/// The samples of each measured signal; of a long log those that stand for it.
fn collect(
    model: &Model,
    solution: &Solution,
    runs: &[Run],
    work: &Work<'_>,
) -> Result<Vec<Samples>, Cancelled> {
    let criteria = &work.criteria().fails;
    let thinned = Thinned::of(runs.iter().map(Run::len).sum());
    let n = model.measured.len();
    let mut all: Vec<Samples> = (0..n)
        .map(|_| Samples {
            quantities: vec![Vec::new(); signals(model.plant).count()],
            ..Samples::default()
        })
        .collect();
    let speeds: Vec<Vec<Vec<f64>>> = model
        .measured
        .iter()
        .enumerate()
        .map(|(i, m)| {
            let of_run = |run: &Run| {
                let values: Vec<f64> = (0..run.len()).map(|k| run.sample(k)[i]).collect();
                speed(run.time(), &values, Motion::of(m.signal.unit))
            };
            runs.iter().map(of_run).collect()
        })
        .collect();
    for (samples, of_signal) in all.iter_mut().zip(&speeds) {
        samples.rest = rest(of_signal.iter().flatten().copied(), criteria.rest);
    }
    for (index, (run, x0)) in runs.iter().zip(&solution.states).enumerate() {
        let turned: Vec<Vec<usize>> = all
            .iter()
            .zip(&speeds)
            .map(|(samples, of_signal)| changes(&of_signal[index], samples.rest))
            .collect();
        let mut simulator = Simulator::new(model, &solution.values);
        try_follow(&mut simulator, x0.as_slice(), run, |k, predicted, now| {
            work.go_on()?;
            if !thinned.takes(k) {
                return Ok(());
            }
            for (i, samples) in all.iter_mut().enumerate() {
                let error = run.sample(k)[i] - predicted[i];
                if !error.is_finite() {
                    continue;
                }
                samples.error.push(error);
                samples.speed.push(speeds[i][index][k]);
                samples.run.push(index);
                let last = turned[i].partition_point(|change| *change <= k);
                let since = last
                    .checked_sub(1)
                    .map(|last| run.time()[k] - run.time()[turned[i][last]]);
                samples
                    .after_change
                    .push(since.is_some_and(|s| s < criteria.after_change_s * (1.0 + 1e-9)));
                for (list, value) in samples.quantities.iter_mut().zip(now.signals()) {
                    list.push(*value);
                }
            }
            Ok(())
        })?;
    }
    Ok(all)
}

/// A statement, and the share of the squared error that it explains.
type Said = (String, f64);

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

fn after_change(
    name: &str,
    motion: Motion,
    samples: &Samples,
    criteria: &FailsCriteria,
) -> Option<Said> {
    let (error, part) = share(samples, |k| samples.after_change[k]);
    (part > 0.0 && error > criteria.telling * part).then(|| {
        let said = format!(
            "{:.0} % of the squared error of {name} lies within {} s after a {}, which is {:.0} % of the time",
            100.0 * error,
            significant(criteria.after_change_s, 4),
            motion.change(),
            100.0 * part
        );
        (said, error)
    })
}

fn by_direction(
    signal: &Signal,
    motion: Motion,
    samples: &Samples,
    criteria: &FailsCriteria,
) -> Option<Said> {
    let (name, unit) = (signal.id, signal.unit);
    let mean = |sign: f64| {
        let (mut sum, mut n) = (0.0, 0usize);
        for (e, v) in samples.error.iter().zip(&samples.speed) {
            if v * sign > samples.rest {
                sum += e;
                n += 1;
            }
        }
        (sum / n.max(1) as f64, n)
    };
    let ((forwards, a), (backwards, b)) = (mean(1.0), mean(-1.0));
    if a < criteria.fewest || b < criteria.fewest {
        return None;
    }
    let explained = a as f64 * forwards * forwards + b as f64 * backwards * backwards;
    let all: f64 = samples.error.iter().map(|e| e * e).sum();
    let part = explained / all;
    (part > criteria.directions).then(|| {
        let [ahead, back] = motion.directions(unit);
        let [forwards, backwards] = pair([forwards, backwards], 3);
        let said = format!(
            "the mean residual of {name} is {forwards} {unit} {ahead} and {backwards} {unit} {back}"
        );
        (said, part)
    })
}

/// The quantity that the residual depends on most: share of its variance between bins.
fn dependence(
    model: &Model,
    name: &str,
    samples: &Samples,
    criteria: &FailsCriteria,
) -> Option<Said> {
    let all: f64 = samples.error.iter().map(|e| e * e).sum();
    let mut best: Option<(f64, &str)> = None;
    for (signal, values) in signals(model.plant).zip(&samples.quantities) {
        let (low, high) = extent(values);
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
    (part > criteria.depends).then(|| {
        let said = format!(
            "the residual of {name} depends on {quantity}: its mean at each value of that explains {:.0} % of the squared error",
            100.0 * part
        );
        (said, part)
    })
}

fn by_run(name: &str, runs: &[Run], samples: &Samples, criteria: &FailsCriteria) -> Option<Said> {
    if runs.len() < 2 {
        return None;
    }
    let (worst, error, part) = (0..runs.len())
        .map(|i| {
            let (error, part) = share(samples, |k| samples.run[k] == i);
            (i, error, part)
        })
        .max_by(|a, b| (a.1 / a.2).total_cmp(&(b.1 / b.2)))?;
    (error > criteria.telling * part && error > criteria.run).then(|| {
        let called = match runs[worst].name() {
            "" => format!("{}", worst + 1),
            called => called.to_owned(),
        };
        let said = format!(
            "{:.0} % of the squared error of {name} is in run {called}, which is {:.0} % of the samples",
            100.0 * error,
            100.0 * part
        );
        (said, error)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chance::uniform;

    #[test]
    fn noise_is_not_predicted_and_a_law_is() {
        let mut noise = uniform(1);
        let values: Vec<f64> = (0..3000).map(|k| (0.01 * f64::from(k)).sin()).collect();
        let white: Vec<f64> = values.iter().map(|_| noise()).collect();
        assert!(predicted(&values, &white) < 0.02);
        let law: Vec<f64> = values.iter().map(|v| 0.3 * v.signum() + noise()).collect();
        let share = predicted(&values, &law);
        assert!((share - 0.09 / (0.09 + 1.0 / 12.0)).abs() < 0.05, "{share}");
        // An error in only one half cannot be predicted from the other.
        let drift: Vec<f64> = (0..3000).map(f64::from).collect();
        assert!(predicted(&drift, &white) < 0.02);
    }
}
