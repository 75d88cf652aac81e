//! The windows of a long log that a search reads.
//!
//! A search simulates thousands of times. It need not see every sample of a log of an hour for that: what it finds
//! is taken on to everything, and judged there (see [`whole`](crate::whole)). A log that is not
//! [long](crate::long) is read as a whole.
//!
//! Windows are pieces of the log at its own rate, so delays and ripples are in them as they are in the log. Half as
//! many samples as the longest log that is read as a whole has are shared among the runs by their lengths. The
//! first window of a run begins where the run begins, at rest where the run does. The rest of the run is cut into
//! equal spans. Every other span has its window where inputs and measured signals vary most; the others have it in
//! their middle, whatever happens there: rests are seen as well.
//!
//! Windows must show what the log shows. Where a measured signal varies less within them than from one to the next of a run,
//! the log is slow, and they become twice as long and half as many until that is no longer so; in the end the whole
//! log is read. This does not count for the integral of another state (an angle, a distance), which may drift
//! without end.

use loopsight_core::Signal;
use loopsight_model::model::Model;
use loopsight_model::run::{Rows, Run};

use crate::long::ENOUGH;
use crate::score::Tally;

/// Windows at first, and the samples of one.
const WINDOWS: usize = 8;
const LENGTH: usize = ENOUGH / 2 / WINDOWS;
/// Least share of a signal's variance within the runs that is within the windows.
const WITHIN: f64 = 0.5;

/// Windows of some runs.
pub(crate) struct Excerpt {
    pub(crate) windows: Vec<Run>,
    /// By run: which of the windows begins where it does.
    pub(crate) first: Vec<usize>,
}

impl Excerpt {
    /// What a search reads of `runs`; none where it reads them as a whole.
    pub(crate) fn of(model: &Model, runs: &[Run]) -> Option<Self> {
        let samples: usize = runs.iter().map(Run::len).sum();
        if samples <= ENOUGH {
            return None;
        }
        let spread = Spread::of(runs);
        let varying = varying(model, runs);
        (0..WINDOWS.ilog2())
            .map(|doubled| Self::with(runs, &spread, LENGTH << doubled))
            .take_while(|excerpt| 2 * excerpt.samples() <= samples)
            .find(|excerpt| {
                let mut signals = varying.iter();
                signals.all(|(i, all)| within(&excerpt.windows, *i) >= WITHIN * all)
            })
    }

    fn samples(&self) -> usize {
        self.windows.iter().map(Run::len).sum()
    }

    /// Windows of `length` samples, shared among the runs.
    fn with(runs: &[Run], spread: &Spread, length: usize) -> Self {
        let samples: usize = runs.iter().map(Run::len).sum();
        let count = WINDOWS * LENGTH / length;
        let mut excerpt = Self {
            windows: Vec::new(),
            first: Vec::new(),
        };
        for run in runs {
            excerpt.first.push(excerpt.windows.len());
            let share = count as f64 * run.len() as f64 / samples as f64;
            let count = (share.round() as usize).max(1);
            if run.len() <= count * length {
                excerpt.windows.push(run.clone());
                continue;
            }
            excerpt.windows.push(window(run, 0, length));
            let span = (run.len() - length) / (count - 1).max(1);
            for i in 0..count - 1 {
                let begin = length + i * span;
                let middle = begin + (span - length) / 2;
                let start = if i % 2 == 0 {
                    (begin..=begin + span - length)
                        .step_by(length / 2)
                        .max_by(|a, b| {
                            let moves = |start: &usize| spread.varies(run, *start, length);
                            moves(a).total_cmp(&moves(b))
                        })
                } else {
                    None
                };
                let start = start.unwrap_or(middle);
                excerpt.windows.push(window(run, start, length));
            }
        }
        excerpt
    }
}

/// A window of a run, as a run whose time begins at zero.
fn window(run: &Run, start: usize, length: usize) -> Run {
    let part = run.part(start..start + length);
    let first = part.time().first().copied().unwrap_or(0.0);
    let time = part.time().iter().map(|t| t - first).collect();
    let inputs = Rows::new(part.n_inputs(), part.inputs().to_vec());
    let measured = Rows::new(part.n_measured(), part.measured().to_vec());
    // Times that increase do so from any origin, unless they are so late that their differences are lost.
    Run::new(part.name(), time, inputs, measured).unwrap_or(part)
}

/// The variance of what is finite among some values.
fn variance(values: impl Iterator<Item = f64>) -> f64 {
    let mut tally = Tally::default();
    values.for_each(|value| tally.add(value, 0.0));
    tally.std().powi(2)
}

/// Variances of inputs and measured signals over all runs.
struct Spread {
    inputs: Vec<f64>,
    measured: Vec<f64>,
}

impl Spread {
    fn of(runs: &[Run]) -> Self {
        let width = |of: fn(&Run) -> usize| runs.first().map_or(0, of);
        let all = |signal: usize, row: fn(&Run, usize) -> &[f64]| {
            variance(
                runs.iter()
                    .flat_map(|run| (0..run.len()).map(move |k| row(run, k)[signal])),
            )
        };
        Self {
            inputs: (0..width(Run::n_inputs))
                .map(|i| all(i, Run::input))
                .collect(),
            measured: (0..width(Run::n_measured))
                .map(|i| all(i, Run::sample))
                .collect(),
        }
    }

    /// How much happens in a window: the sum of its variances over those of all runs.
    fn varies(&self, run: &Run, start: usize, length: usize) -> f64 {
        let share = |signal: usize, all: f64, row: fn(&Run, usize) -> &[f64]| {
            let share = variance((start..start + length).map(|k| row(run, k)[signal])) / all;
            if share.is_finite() { share } else { 0.0 }
        };
        let inputs = self.inputs.iter().enumerate();
        let measured = self.measured.iter().enumerate();
        inputs
            .map(|(i, all)| share(i, *all, Run::input))
            .sum::<f64>()
            + measured
                .map(|(i, all)| share(i, *all, Run::sample))
                .sum::<f64>()
    }
}

/// Measured signals that are no integrals, by index, and their variance within the runs.
fn varying(model: &Model, runs: &[Run]) -> Vec<(usize, f64)> {
    let is_integral = |signal: &Signal| {
        let mut integrals = model.plant.integrals.iter();
        integrals.any(|(_, integral)| *integral == signal.id)
    };
    (0..model.measured.len())
        .filter(|i| !is_integral(model.measured[*i].signal))
        .map(|i| (i, within(runs, i)))
        .collect()
}

/// The variance of a measured signal within some runs, without that from one run to the next.
fn within(runs: &[Run], signal: usize) -> f64 {
    let samples: usize = runs.iter().map(Run::len).sum();
    let share = |run: &Run| {
        let variance = variance((0..run.len()).map(|k| run.sample(k)[signal]));
        let share = run.len() as f64 / samples as f64;
        if variance.is_finite() {
            share * variance
        } else {
            0.0
        }
    };
    runs.iter().map(share).sum()
}

#[cfg(test)]
mod tests {
    use loopsight_plants as _;

    use super::*;

    const AXIS: &str = "name = \"axis\"\n[plant.dc_axis]\nK_A = -6.0\nK_C = 2.0\n[log.measured.speed]\nsensor = \"instantaneous\"\n";

    fn model() -> Model {
        Model::from_toml("axis", AXIS).unwrap().0
    }

    /// `n` samples of an input and what it moves, 1 ms apart.
    fn run(n: usize, of: impl Fn(usize) -> f64) -> Run {
        let time = (0..n).map(|k| 0.001 * k as f64).collect();
        let values: Vec<f64> = (0..n).map(of).collect();
        Run::new("", time, Rows::new(1, values.clone()), Rows::new(1, values)).unwrap()
    }

    #[test]
    fn a_short_log_is_read_as_a_whole() {
        let short = [run(ENOUGH, |k| (0.01 * k as f64).sin())];
        assert!(Excerpt::of(&model(), &short).is_none());
    }

    #[test]
    fn windows_are_spread_over_the_runs_and_lie_where_much_happens() {
        let n = 6 * ENOUGH;
        // In the middle of the first run it moves most, for three windows.
        let most = n / 2..n / 2 + 3 * LENGTH;
        let size = |k: usize| if most.contains(&k) { 3.0 } else { 1.0 };
        let runs = [
            run(n, |k| size(k) * (0.01 * k as f64).sin()),
            run(n / 3, |k| (0.01 * k as f64).sin()),
        ];
        let excerpt = Excerpt::of(&model(), &runs).unwrap();
        assert_eq!(excerpt.first, [0, 6]);
        assert_eq!(excerpt.windows.len(), 8);
        assert!(
            excerpt
                .windows
                .iter()
                .all(|w| w.len() == LENGTH && w.time()[0] == 0.0)
        );
        for (window, run) in excerpt.first.iter().zip(&runs) {
            assert_eq!(
                excerpt.windows[*window].measured(),
                &run.measured()[..LENGTH]
            );
        }
        let largest = |w: &Run| w.measured().iter().copied().fold(0.0, f64::max);
        assert!(excerpt.windows.iter().any(|w| largest(w) > 2.9));
    }

    #[test]
    fn a_slow_log_gets_longer_windows_or_is_read_as_a_whole() {
        let period = |samples: usize| std::f64::consts::TAU / samples as f64;
        let n = 20 * ENOUGH;
        let slow = [run(n, |k| (period(4 * LENGTH) * k as f64).sin())];
        let windows = Excerpt::of(&model(), &slow).unwrap().windows;
        assert!(windows[0].len() > LENGTH, "{}", windows[0].len());
        let slower = [run(n, |k| (period(n) * k as f64).sin())];
        assert!(Excerpt::of(&model(), &slower).is_none());
    }

    /// One run goes forward and the other back: how far these are apart says nothing of what a window shows.
    #[test]
    fn runs_that_differ_are_read_by_windows_all_the_same() {
        let n = 2 * ENOUGH;
        let runs = [10.0, -10.0].map(|level| run(n, |k| level + (0.01 * k as f64).sin()));
        let excerpt = Excerpt::of(&model(), &runs).unwrap();
        assert_eq!(excerpt.windows[0].len(), LENGTH);
    }
}
