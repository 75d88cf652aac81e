//! Which samples a fit may see, and how the others judge it.

use loopsight_core::model::Model;
use loopsight_core::run::Run;

use crate::judge::Losses;
use crate::prediction::predict;
use crate::problem::Solution;
use crate::score::Tally;

/// Recordings divided into what a fit sees and what judges it.
pub(crate) struct Holdout<'a> {
    pub(crate) runs: &'a [Run],
    /// Recording of its own to be judged on.
    pub(crate) test: Option<&'a [Run]>,
    /// By run and sample of `runs`: whether a fit sees it; all where there is a test recording.
    pub(crate) seen: Option<Vec<Vec<bool>>>,
    /// Standard deviations of the signals in what judges, and in what is seen.
    std_test: Vec<f64>,
    std_fit: Vec<f64>,
}

/// Shortest and longest block, s: shorter than levels of an input are mostly held, for what a fit saw
/// nothing of says how well it extrapolates, not what is missing.
const BLOCK: (f64, f64) = (0.5, 2.5);

impl<'a> Holdout<'a> {
    /// With `test`, all of `runs` is seen and `test` judges. Without, every fourth block of each run
    /// judges, another one in each run, never the first, which the initial state needs: the free run goes on through it, so delays, friction and
    /// slow changes are judged in motion and over the whole length.
    pub(crate) fn new(model: &Model, runs: &'a [Run], test: Option<&'a [Run]>) -> Self {
        let seen = test.is_none().then(|| {
            runs.iter()
                .enumerate()
                .map(|(index, run)| {
                    let block = (run.duration() / 16.0).clamp(BLOCK.0, BLOCK.1);
                    run.time
                        .iter()
                        .map(|t| t < &block || !((t / block) as usize + index).is_multiple_of(4))
                        .collect()
                })
                .collect::<Vec<Vec<bool>>>()
        });
        let n = model.measured.len();
        Self {
            std_test: deviations(test.unwrap_or(runs), n),
            std_fit: deviations(runs, n),
            runs,
            test,
            seen,
        }
    }

    /// Losses on what was not seen: mean over the signals of their squared errors over their
    /// variances.
    pub(crate) fn judge(&self, model: &Model, solution: &Solution) -> Losses {
        match self.test {
            Some(test) => {
                let initial =
                    crate::prediction::InitialStates::estimate(model, &solution.values, test);
                losses(
                    model,
                    &solution.values,
                    &initial.states,
                    test,
                    &self.std_test,
                    None,
                )
            }
            None => {
                let unseen: Option<Vec<Vec<bool>>> = self.seen.as_ref().map(|seen| {
                    seen.iter()
                        .map(|run| run.iter().map(|s| !s).collect())
                        .collect()
                });
                let (values, states) = (&solution.values, &solution.states);
                losses(
                    model,
                    values,
                    states,
                    self.runs,
                    &self.std_test,
                    unseen.as_deref(),
                )
            }
        }
    }

    /// Losses that candidates are ranked by: those of [`Holdout::judge`] and those on what was seen. A transient happens once in a run: whether it was
    /// explained must count, wherever it falls. A handful of parameters more cannot fake that on
    /// thousands of samples.
    pub(crate) fn rank(&self, model: &Model, solution: &Solution, judged: &Losses) -> Losses {
        if self.test.is_some() {
            let mut all = judged.clone();
            all.extend(self.fitted(model, solution));
            return all;
        }
        let (values, states) = (&solution.values, &solution.states);
        losses(model, values, states, self.runs, &self.std_test, None)
    }

    /// Losses on what was seen.
    pub(crate) fn fitted(&self, model: &Model, solution: &Solution) -> Losses {
        let (values, states) = (&solution.values, &solution.states);
        losses(
            model,
            values,
            states,
            self.runs,
            &self.std_fit,
            self.seen.as_deref(),
        )
    }
}

fn deviations(runs: &[Run], n: usize) -> Vec<f64> {
    (0..n)
        .map(|signal| {
            let mut tally = Tally::default();
            for run in runs {
                for k in 0..run.len() {
                    tally.add(run.sample(k)[signal], 0.0);
                }
            }
            tally.std()
        })
        .collect()
}

fn losses(
    model: &Model,
    values: &[f64],
    states: &[nalgebra::DVector<f64>],
    runs: &[Run],
    std: &[f64],
    only: Option<&[Vec<bool>]>,
) -> Losses {
    let n = std.len();
    let mut all = Losses::new();
    for (index, (run, x0)) in runs.iter().zip(states).enumerate() {
        let predicted = predict(model, values, x0.as_slice(), run);
        for k in 0..run.len() {
            if only.is_some_and(|o| !o[index][k]) {
                continue;
            }
            let loss: f64 = (0..n)
                .map(|i| {
                    let e = (run.sample(k)[i] - predicted[k * n + i]) / std[i];
                    // A missing sample, or a signal that never moves, counts nothing.
                    if e.is_nan() { 0.0 } else { e * e }
                })
                .sum();
            all.push(loss / n as f64);
        }
    }
    all
}
