//! Validation: which samples a fit may see, and how well it does on the held-out ones.

use loopsight_model::model::Model;
use loopsight_model::run::Run;
use loopsight_model::simulate::{Simulator, try_follow};

use crate::criteria::HoldoutCriteria;
use crate::floor::Part;
use crate::judge::Losses;
use crate::long::ENOUGH;
use crate::prediction::{InitialStates, Solution};
use crate::progress::{Cancelled, Work};
use crate::score::Tally;

/// How long the blocks of a run are, s. A slow process has few samples in the usual time; blocks of one or two samples would
/// be told by their neighbours, and where a sample is as long as all blocks between two that are held out, they would all be.
fn block(run: &Run, criteria: &HoldoutCriteria) -> f64 {
    let duration = run.duration();
    let usual = (duration / criteria.blocks as f64)
        .max(criteria.shortest_s)
        .min(criteria.longest_s);
    let enough = criteria.samples as f64 * run.median_period();
    // One in so many must come up twice.
    usual.max(enough.min(duration / (2 * criteria.every.max(2)) as f64))
}

/// Recordings divided into fitting data and validation data.
pub(crate) struct Holdout<'a> {
    pub(crate) runs: &'a [Run],
    /// Recording of its own to be judged on.
    pub(crate) test: Option<&'a [Run]>,
    /// By run and sample of `runs`: whether a fit sees it; all where there is a test recording.
    pub(crate) seen: Option<Vec<Vec<bool>>>,
    /// Samples of a run whose mean is one loss: more than one where the recordings are [long](crate::long).
    group: usize,
    /// Standard deviations of the signals in the validation data, and in the fitting data.
    std_test: Vec<f64>,
    std_fit: Vec<f64>,
}

impl<'a> Holdout<'a> {
    /// With `test`, the fits see all of `runs`, and `test` judges.
    ///
    /// Without, each run is cut into blocks of time, and one in every few is held out for validation: different
    /// blocks in each run, and never the first, which the initial state needs. The free run goes on through
    /// held-out blocks, so delays, friction and slow changes are judged in motion and over the whole length.
    pub(crate) fn new(
        model: &Model,
        runs: &'a [Run],
        test: Option<&'a [Run]>,
        criteria: &HoldoutCriteria,
    ) -> Self {
        let every = criteria.every.max(2);
        let samples = |runs: &[Run]| runs.iter().map(Run::len).sum::<usize>();
        let most = samples(runs).max(test.map_or(0, samples));
        let group = most.div_ceil(ENOUGH).max(1);
        let seen = test.is_none().then(|| {
            runs.iter()
                .enumerate()
                .map(|(index, run)| {
                    let block = block(run, criteria);
                    (0..run.len())
                        .map(|k| {
                            let t = run.time()[k - k % group];
                            t < block
                                || !((t / block) as usize)
                                    .wrapping_add(index)
                                    .is_multiple_of(every)
                        })
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
            group,
        }
    }

    /// The samples that solutions are judged on.
    pub(crate) fn judging(&self) -> Part<'_> {
        match self.test {
            Some(test) => Part::all(test),
            None => self.part_of_runs(false),
        }
    }

    /// The samples that fits see.
    pub(crate) fn fitting(&self) -> Part<'_> {
        self.part_of_runs(true)
    }

    fn part_of_runs(&self, which: bool) -> Part<'_> {
        Part {
            runs: self.runs,
            seen: self.seen.as_deref().map(|seen| (seen, which)),
        }
    }

    /// Losses of a solution, in one pass over the data, whose free runs over the fitting data may be `known`.
    pub(crate) fn judge(
        &self,
        model: &Model,
        solution: &Solution,
        known: Option<&[Vec<f64>]>,
        work: &Work<'_>,
    ) -> Result<Judgement, Cancelled> {
        let of_runs = |std: &[f64]| match known {
            Some(predicted) => Ok(self.losses_of(predicted, std)),
            None => self.losses(model, solution, self.runs, std, work),
        };
        let Some(test) = self.test else {
            let rank = of_runs(&self.std_test)?;
            return Ok(Judgement {
                losses: self.part(&rank, false),
                rank,
            });
        };
        let values = solution.values.clone();
        let states = InitialStates::estimate(model, &values, test, work)?.states;
        let on_test = Solution { values, states };
        let losses = self.losses(model, &on_test, test, &self.std_test, work)?;
        let mut rank = losses.clone();
        rank.extend(self.part(&of_runs(&self.std_fit)?, true));
        Ok(Judgement { losses, rank })
    }

    /// Losses on the fitting data of a solution that was judged, and has these losses to be `rank`ed by.
    pub(crate) fn fitted(
        &self,
        model: &Model,
        solution: &Solution,
        rank: &Losses,
        work: &Work<'_>,
    ) -> Result<Losses, Cancelled> {
        if self.test.is_none() {
            return Ok(self.part(rank, true));
        }
        // A test recording was judged on, so this is one more pass over the data.
        let all = self.losses(model, solution, self.runs, &self.std_fit, work)?;
        Ok(self.part(&all, true))
    }

    /// Of the losses on all samples of `runs`, those on the fitting data or those on the held-out data.
    fn part(&self, all: &Losses, seen: bool) -> Losses {
        let Some(mask) = &self.seen else {
            return all.clone();
        };
        let mask = mask.iter().flat_map(|run| run.iter().step_by(self.group));
        let samples = all.iter().zip(mask);
        samples
            .filter(|(_, s)| **s == seen)
            .map(|(loss, _)| *loss)
            .collect()
    }

    /// Losses on all samples of `runs`.
    fn losses(
        &self,
        model: &Model,
        solution: &Solution,
        runs: &[Run],
        std: &[f64],
        work: &Work<'_>,
    ) -> Result<Losses, Cancelled> {
        let mut all = Losses::new();
        for (run, x0) in runs.iter().zip(&solution.states) {
            work.count_plain(run.len());
            let mut simulator = Simulator::new(model, &solution.values).without_trail();
            let mut groups = Groups::new(self.group, run, std);
            try_follow(&mut simulator, x0.as_slice(), run, |k, predicted, _| {
                all.extend(groups.add(k, predicted));
                work.go_on()
            })?;
        }
        Ok(all)
    }

    /// Losses on all samples of the fitting data, of which the free runs were `predicted`, row by row.
    fn losses_of(&self, predicted: &[Vec<f64>], std: &[f64]) -> Losses {
        let mut all = Losses::new();
        for (run, predicted) in self.runs.iter().zip(predicted) {
            let mut groups = Groups::new(self.group, run, std);
            let rows = predicted.chunks_exact(std.len().max(1)).enumerate();
            all.extend(rows.filter_map(|(k, row)| groups.add(k, row)));
        }
        all
    }
}

/// The mean losses of groups of samples of a run.
struct Groups<'a> {
    /// Samples of a group; the last one may have fewer.
    size: usize,
    run: &'a Run,
    /// Standard deviations of the signals.
    std: &'a [f64],
    sum: f64,
    count: usize,
}

impl<'a> Groups<'a> {
    fn new(size: usize, run: &'a Run, std: &'a [f64]) -> Self {
        Self {
            size,
            run,
            std,
            sum: 0.0,
            count: 0,
        }
    }

    /// Adds sample `k`; the loss of its group where that ends.
    fn add(&mut self, k: usize, predicted: &[f64]) -> Option<f64> {
        let n = self.std.len();
        let loss: f64 = (0..n)
            .map(|i| {
                let (measured, predicted) = (self.run.sample(k)[i], predicted[i]);
                let e = (measured - predicted) / self.std[i];
                // A missing sample, or a signal that never moves, counts nothing; a run that diverges
                // to no number at all is as wrong as can be.
                if !e.is_nan() {
                    e * e
                } else if predicted.is_nan() && measured.is_finite() {
                    f64::INFINITY
                } else {
                    0.0
                }
            })
            .sum();
        self.sum += loss / n as f64;
        self.count += 1;
        if self.count < self.size && k + 1 < self.run.len() {
            return None;
        }
        let mean = self.sum / self.count as f64;
        (self.sum, self.count) = (0.0, 0);
        Some(mean)
    }
}

/// The losses of a solution.
pub(crate) struct Judgement {
    /// Losses on the validation data: mean over the signals of their squared errors over their variances.
    pub(crate) losses: Losses,
    /// Losses that candidates are ranked by: those on all samples, held out or not. A transient happens once in
    /// a run, and must count wherever it falls. Over thousands of samples a few more parameters gain nothing by
    /// that.
    pub(crate) rank: Losses,
}

/// The standard deviations of the first `n` measured signals.
pub(crate) fn deviations(runs: &[Run], n: usize) -> Vec<f64> {
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
