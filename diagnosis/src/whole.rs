//! What a search found in [windows](crate::excerpt) of a long log, taken on to everything that was measured.
//!
//! The fit to the windows ends close to that of all samples, so one or two Gauss–Newton steps are enough:
//!
//! ```text
//! θ <- θ - (JᵀJ)⁻¹ Jᵀ r
//! ```
//!
//! They need only the sums `JᵀJ`, `Jᵀr` and `rᵀr`, which are added up sample by sample. So nothing as long as the
//! log is kept, whatever the number of unknowns.
//!
//! The covariance of coloured noise is that of [`noise`](crate::noise), with the scores `s = Σ Jᵀr` of groups of
//! samples in place of those of samples; within a group any colour is accounted for, so no noise model is needed.
//! (Batch means; the window over the groups is that of W. K. Newey, K. D. West, 1987, Econometrica 55, 703–708.)

use loopsight_core::Real;
use loopsight_model::model::Model;
use loopsight_model::run::Run;
use loopsight_model::simulate::Simulator;
use loopsight_model::{DUAL_WIDTH, Dual, derivative, variable};
use nalgebra::{DMatrix, DVector};

use crate::error::FitError;
use crate::fitted::Fit;
use crate::holdout::Holdout;
use crate::long::ENOUGH;
use crate::omitted::{Omitted, SHARPER};
use crate::prediction::Solution;
use crate::problem::Problem;
use crate::progress::{Cancelled, Work};
use crate::trial::FINAL;
use crate::window::{bartlett, lags};

/// Most steps, and most times that one is made shorter.
const STEPS: usize = 4;
const SHORTER: i32 = 3;
/// Rows for what the model leaves out.
const OMISSIONS: usize = 2;
/// Groups of samples with a score of their own.
const GROUPS: usize = ENOUGH / 8;

/// The fit to all samples that `holdout` lets it see, from `start`, which is close to it. None where the model
/// diverges there.
pub(crate) fn taken_on(
    model: &Model,
    start: &Solution,
    holdout: &Holdout<'_>,
    work: &Work<'_>,
) -> Result<Option<(Solution, Fit)>, FitError> {
    let seen = holdout.seen.as_deref();
    let problem = Problem::with(model, holdout.runs, seen, None, work.silently())?;
    let mut at = problem.pack(&start.values, &start.states);
    let mut sums = problem.sums(&at)?;
    for _ in 0..STEPS {
        if !sums.cost.is_finite() {
            return Ok(None);
        }
        let step = problem.step(&at, &sums);
        let gain = sums.right.rows(0, step.len()).dot(&step);
        if gain.is_nan() || gain <= FINAL.tolerance * sums.cost {
            break;
        }
        let mut better = None;
        for halvings in 0..SHORTER {
            let next = problem.within(&at - &step * 0.25f64.powi(halvings));
            let there = problem.sums(&next)?;
            if there.cost < sums.cost {
                better = Some((next, there));
                break;
            }
        }
        let Some((next, there)) = better else { break };
        (at, sums) = (next, there);
    }
    let fit = problem.fit_of_sums(&at, &sums);
    Ok(Some((problem.solution(&at), fit)))
}

/// What is added up over all samples. The last two rows and columns belong to what the model leaves out, see
/// [`Problem::omissions`]: a shift of the response in time, and sharp signs.
struct Sums {
    /// `rᵀr`
    cost: f64,
    /// `JᵀJ`
    gram: DMatrix<f64>,
    /// `Jᵀr`
    right: DVector<f64>,
    /// `Jᵀr` of each group of samples.
    scores: Vec<DVector<f64>>,
}

impl Problem<'_> {
    /// The sums over all samples, at scaled unknowns.
    fn sums(&self, scaled: &DVector<f64>) -> Result<Sums, Cancelled> {
        let n = scaled.len() + OMISSIONS;
        let mut sums = Sums {
            cost: 0.0,
            gram: DMatrix::zeros(n, n),
            right: DVector::zeros(n),
            scores: Vec::new(),
        };
        let (values, states) = self.unpack(scaled);
        for (index, (run, x0)) in self.runs.iter().zip(&states).enumerate() {
            self.add_run(index, run, &values, x0.as_slice(), &mut sums)?;
        }
        Ok(sums)
    }

    /// Adds the sums over one run.
    fn add_run(
        &self,
        index: usize,
        run: &Run,
        values: &[f64],
        x0: &[f64],
        sums: &mut Sums,
    ) -> Result<(), Cancelled> {
        if run.is_empty() {
            return Ok(());
        }
        // The unknowns that this run depends on: all parameters, its own initial state.
        let parameters = self.free.len();
        let before = parameters + index * self.visible.len();
        let own: Vec<usize> = (0..parameters)
            .chain(before..before + self.visible.len())
            .collect();
        let all_unknowns = sums.right.len() - OMISSIONS;
        let mut simulators = self.simulators(own.len(), values, x0, run);
        let period = run.median_period();
        let group = self
            .runs
            .iter()
            .map(Run::len)
            .sum::<usize>()
            .div_ceil(GROUPS);
        let n_signals = self.weights.len();
        let mut predicted = vec![Dual::of(0.0); n_signals];
        let mut last = vec![0.0; n_signals];
        let mut row = vec![0.0; own.len() + OMISSIONS];
        let mut sharp = self.sharper(values).map(|values| {
            let mut simulator = Simulator::new(self.model, &values);
            simulator.reset(x0, run.input(0));
            simulator
        });
        let mut sharply = vec![0.0; n_signals];
        let mut gram = DMatrix::<f64>::zeros(row.len(), row.len());
        let mut score = DVector::<f64>::zeros(row.len());
        let place = |local: usize| match own.get(local) {
            Some(place) => *place,
            None => all_unknowns + local - own.len(),
        };
        let mut slopes = vec![0.0; n_signals * own.len()];
        for k in 0..run.len() {
            self.work.go_on()?;
            let mut now = 0.0;
            for (block, simulator) in simulators.iter_mut().enumerate() {
                if k > 0 {
                    now = run.time()[k] - run.time()[k - 1];
                    simulator.advance_to(run, k);
                }
                simulator.measure(&mut predicted);
                let first = block * DUAL_WIDTH;
                for column in first..own.len().min(first + DUAL_WIDTH) {
                    for (signal, y) in predicted.iter().enumerate() {
                        slopes[signal * own.len() + column] = derivative(y, column - first);
                    }
                }
                if let Some(observer) = run.observer() {
                    simulator.correct(observer, k, run.sample(k), &predicted);
                }
            }
            if let Some(simulator) = &mut sharp {
                if k > 0 {
                    simulator.advance_to(run, k);
                }
                simulator.measure(&mut sharply);
                if let Some(observer) = run.observer() {
                    simulator.correct(observer, k, run.sample(k), &sharply);
                }
            }
            for (signal, y) in run.sample(k).iter().enumerate() {
                let p = predicted[signal].value();
                let change = if now > 0.0 {
                    (p - last[signal]) / now * period
                } else {
                    0.0
                };
                last[signal] = p;
                let weight = self.weight(index, k * n_signals + signal);
                if weight == 0.0 || !y.is_finite() {
                    continue;
                }
                let residual = (y - p) * weight;
                let slopes = &slopes[signal * own.len()..][..own.len()];
                for (column, slope) in slopes.iter().enumerate() {
                    row[column] = -slope * weight * self.scales[own[column]];
                }
                row[own.len()] = change * weight;
                if sharp.is_some() {
                    row[own.len() + 1] = SHARPER * (p - sharply[signal]) * weight;
                }
                sums.cost += residual * residual;
                for (i, a) in row.iter().enumerate() {
                    score[i] += a * residual;
                    for (j, b) in row[..=i].iter().enumerate() {
                        gram[(i, j)] += a * b;
                    }
                }
            }
            if (k + 1) % group == 0 || k + 1 == run.len() {
                let mut all = DVector::zeros(sums.right.len());
                for local in 0..row.len() {
                    all[place(local)] = score[local];
                }
                sums.right += &all;
                sums.scores.push(all);
                score.fill(0.0);
            }
        }
        for i in 0..row.len() {
            for j in 0..row.len() {
                sums.gram[(place(i), place(j))] += gram[(i.max(j), i.min(j))];
            }
        }
        Ok(())
    }

    /// One simulator at the beginning of a run for every few of its `unknowns`: a dual number has a fixed number of
    /// derivatives.
    fn simulators(
        &self,
        unknowns: usize,
        values: &[f64],
        x0: &[f64],
        run: &Run,
    ) -> Vec<Simulator<'_, Dual>> {
        let seeded = |value: f64, unknown: Option<usize>, first: usize| match unknown {
            Some(column) if (first..first + DUAL_WIDTH).contains(&column) => {
                variable(value, column - first)
            }
            _ => Dual::of(value),
        };
        let of_parameter = |i: usize| self.free.iter().position(|f| *f == i);
        let of_state = |i: usize| {
            let found = self.visible.iter().position(|s| *s == i);
            found.map(|k| self.free.len() + k)
        };
        (0..unknowns.max(1))
            .step_by(DUAL_WIDTH)
            .map(|first| {
                let values: Vec<Dual> = (values.iter().enumerate())
                    .map(|(i, v)| seeded(*v, of_parameter(i), first))
                    .collect();
                let x0: Vec<Dual> = (x0.iter().enumerate())
                    .map(|(i, v)| seeded(*v, of_state(i), first))
                    .collect();
                let mut simulator = Simulator::new(self.model, &values);
                simulator.reset(&x0, run.input(0));
                simulator
            })
            .collect()
    }

    /// A full Gauss–Newton step, for `at - step`. An unknown that would leave its range stays at its end.
    fn step(&self, at: &DVector<f64>, sums: &Sums) -> DVector<f64> {
        let n = at.len();
        let mut right = sums.right.rows(0, n).into_owned();
        let mut gram = sums.gram.view((0, 0), (n, n)).into_owned();
        loop {
            let step = self.flat(&gram).1 * &right;
            let leaves = (0..n).find(|i| {
                let (next, here) = (at[*i] - step[*i], at[*i]);
                (next < self.lower[*i] && here <= self.lower[*i])
                    || (next > self.upper[*i] && here >= self.upper[*i])
            });
            let Some(leaves) = leaves else { return step };
            right[leaves] = 0.0;
            gram.row_mut(leaves).fill(0.0);
            gram.column_mut(leaves).fill(0.0);
        }
    }

    /// Scaled unknowns, each within its range.
    fn within(&self, scaled: DVector<f64>) -> DVector<f64> {
        scaled.zip_zip_map(&self.lower, &self.upper, |value, low, high| {
            value.max(low).min(high)
        })
    }

    /// The fit that sums at a solution give.
    fn fit_of_sums(&self, at: &DVector<f64>, sums: &Sums) -> Fit {
        let n = at.len();
        let (flatness, inverse) = self.flat(&sums.gram.view((0, 0), (n, n)).into_owned());
        let meat = self.meat(sums);
        let mut covariance = &inverse * meat.view((0, 0), (n, n)) * &inverse;
        let criteria = &self.work.criteria().parameters;
        let sums = (&sums.gram, &sums.right, &meat);
        for (extra, known) in (n..).zip([criteria.clock, 1.0]) {
            let omitted = Omitted::of_sums(sums, &inverse, extra, known, criteria.flat);
            if let Some(omitted) = omitted {
                omitted.widen(&mut covariance);
            }
        }
        self.fit_of(at, &covariance, flatness)
    }

    /// The covariance of `Jᵀr`, by the scores of groups.
    fn meat(&self, sums: &Sums) -> DMatrix<f64> {
        let (groups, n) = (sums.scores.len(), sums.right.len());
        let scores = DMatrix::from_columns(&sums.scores);
        let criteria = &self.work.criteria().window;
        let lags = lags(criteria.error_lags, groups, criteria.error_most).min(groups / 4);
        let mut meat = &scores * scores.transpose();
        for lag in 1..=lags {
            let (later, earlier) = (
                scores.columns(lag, groups - lag),
                scores.columns(0, groups - lag),
            );
            let product = later * earlier.transpose() * bartlett(lag, lags);
            meat += product.transpose();
            meat += product;
        }
        // Degrees of freedom that the fit has used up.
        meat * (self.samples / (self.samples - n as f64).max(1.0))
    }
}
