//! Weights of the first samples of a run, from which its initial state is estimated.

use loopsight_model::model::Model;
use loopsight_model::run::Run;
use nalgebra::DVector;

use crate::commands::largest_inputs;
use crate::criteria::{Criteria, StartCriteria};
use crate::floor::{Part, noise};
use crate::gram::gram;
use crate::linearised::Linearised;
use crate::problem::Problem;
use crate::progress::Cancelled;
use crate::window::lags;

/// How many times as much the first samples of each run count as any other: by run, one after the other, by signal. It is
/// the first sample alone, or those in which the machine rests.
///
/// The first sample differs from the model only by the noise `σ` of its sensor; later samples differ by the
/// error of the model as well. With `std` the signal's standard deviation and `e` the share of it that a model
/// is commonly wrong by,
///
/// ```text
/// weight = e std/σ, between 1 and a limit
/// ```
///
/// the start stays where it was measured, and does not make up for missing physics. Once `e` is known, it counts, see
/// [`Problem::reweigh_starts`]. `σ` is the largest of
///
/// * the noise and resolution of the signal;
/// * the distance of the first sample from the line through the next two, so that an outlier counts little;
/// * how far the signal moves while a measurement may be late: a late sensor does not tell the state at the
///   first instant of a run that was cut out of a motion.
///
/// Where the machine rests at the start ([`at_rest`]), how late a measurement is does not matter, and all samples of the rest
/// count so: a position that stays says that the speed is zero, too. With one that is free, a pendulum begins at some
/// speed to make up for a fan that answers late, and a drive that rests begins to move before it is driven.
///
/// (The prior of a start is that of a Kalman filter, L. Ljung, 1999, "System Identification", 2nd edition,
/// section 4.3.)
pub(crate) fn first_weights(model: &Model, runs: &[Run], criteria: &Criteria) -> Vec<Vec<f64>> {
    let known: Vec<(f64, f64)> = (model.measured.iter().enumerate())
        .map(|(i, m)| noise(&m.sensor, i, &Part::all(runs), &criteria.log))
        .collect();
    let largest = largest_inputs(model, runs);
    runs.iter()
        .map(|run| {
            let rest = at_rest(run, &known, &largest, &criteria.start);
            // At rest it does not matter how late a measurement is.
            let late_s = if rest > 0 { 0.0 } else { criteria.start.late_s };
            let weight =
                |(i, known): (usize, &(f64, f64))| of_run(run, i, *known, late_s, &criteria.start);
            let weights: Vec<f64> = known.iter().enumerate().map(weight).collect();
            weights.repeat(rest.max(1))
        })
        .collect()
}

/// Samples at the start of a run in which the machine is known to rest; none where it is not known to. It rests where no signal
/// moves by more than its noise until an input acts, and not before a motion that went before would have shown either.
fn at_rest(run: &Run, known: &[(f64, f64)], largest: &[f64], criteria: &StartCriteria) -> usize {
    let soon = |k: &usize| run.time()[*k] - run.time()[0] <= criteria.rest_s;
    let acts = |k: &usize| {
        let mut inputs = run.input(*k).iter().zip(largest);
        inputs.any(|(u, largest)| u.abs() > criteria.idle * largest)
    };
    let first = (0..run.len()).find(acts).unwrap_or(run.len());
    let moves = |k: usize| {
        let mut signals = run.sample(k).iter().zip(run.sample(0)).zip(known);
        signals.any(|((now, before), (noise, _))| (now - before).abs() > criteria.still * noise)
    };
    if (0..run.len())
        .take_while(|k| *k < first || soon(k))
        .any(moves)
    {
        return 0;
    }
    (0..first).take_while(soon).count()
}

fn of_run(
    run: &Run,
    signal: usize,
    (noise, std): (f64, f64),
    late_s: f64,
    criteria: &StartCriteria,
) -> f64 {
    // An observer corrects the start.
    if run.len() < 3 || run.observer().is_some() {
        return 1.0;
    }
    let [a, b, c] = [0, 1, 2].map(|k| run.sample(k)[signal]);
    // White noise of variance `σ²` has `6 σ²` in second differences.
    let off = (a - 2.0 * b + c).abs() / 6f64.sqrt();
    let late = (run.time().iter().zip(0..))
        .take_while(|(t, _)| **t - run.time()[0] <= late_s)
        .map(|(_, k)| (run.sample(k)[signal] - a).abs())
        .fold(0.0, f64::max);
    let weight = criteria.wrong * std / noise.max(off).max(late);
    if off.is_nan() || weight.is_nan() {
        1.0
    } else {
        weight.clamp(1.0, criteria.most.max(1.0))
    }
}

/// Standard errors that parameters may be off because of the weights of first samples. Of intervals of 95 % that are off by
/// as much, 94 % hold the truth.
const OFF: f64 = 0.3;

impl Problem<'_> {
    /// Begins the second pass of a fit if the model turns out to be better than models commonly are. A first sample counts
    /// by the error of this model then, and no longer by what a model is commonly wrong by: with a model that is right it is
    /// a sample as any other. Whether the solution moves with that.
    ///
    /// Of residuals `r` that have a variance `σ_r²` and the autocorrelations `ρ`, a sample says as much as one of white noise
    /// of the variance
    ///
    /// ```text
    /// e² = σ_r² (1 + 2 Σ_l ρ(l)²)
    /// ```
    ///
    /// where what is estimated moves the response as the residuals move. (M. S. Bartlett, 1935, "Some aspects of the
    /// time-correlation problem in regard to tests of significance", Journal of the Royal Statistical Society 98, 536–543.)
    pub(crate) fn reweigh_starts(&mut self, solution: &DVector<f64>) -> Result<bool, Cancelled> {
        if self.first.is_empty() {
            return Ok(false);
        }
        let wrong = self.work.criteria().start.wrong;
        let errors = self.lasting_errors(&self.linearise(solution)?.residual);
        let shares: Vec<f64> = errors.iter().map(|e| (e / wrong).min(1.0)).collect();
        if shares.iter().all(|share| *share == 1.0) {
            return Ok(false);
        }
        let mut linear = self.linearise_once(solution)?;
        let Linearised {
            residual, jacobian, ..
        } = &mut linear;
        let rows: Vec<usize> = self.first_rows().collect();
        let weights = self.first.iter_mut().flatten();
        for ((weight, share), row) in weights.zip(shares.iter().cycle()).zip(rows) {
            let now = (*weight * share).max(1.0);
            residual[row] *= now / *weight;
            jacobian.row_mut(row).scale_mut(now / *weight);
            *weight = now;
        }
        let (_, inverse) = self.flat(&gram(jacobian));
        let step = &inverse * jacobian.tr_mul(residual);
        let variance = residual.norm_squared() / residual.len() as f64;
        let moves = (0..self.free.len())
            .any(|i| step[i].powi(2) > OFF.powi(2) * variance * inverse[(i, i)]);
        // Nothing needs to be simulated again.
        self.keep(linear);
        Ok(moves)
    }

    /// `e` by signal, in its standard deviations, without the first samples.
    fn lasting_errors(&self, residual: &DVector<f64>) -> Vec<f64> {
        let criteria = &self.work.criteria().window;
        let n_signals = self.weights.len();
        let per_signal = residual.len() / n_signals.max(1);
        let most = lags(criteria.error_lags, per_signal, criteria.error_most);
        let of_signal = |signal: usize| {
            let mut products = vec![0.0; most + 1];
            let (mut count, mut row) = (0, 0);
            for run in self.runs {
                let rows = (row..row + run.len() * n_signals).skip(signal);
                let series: Vec<f64> = (rows.step_by(n_signals).skip(1))
                    .map(|row| residual[row])
                    .collect();
                for (lag, product) in products.iter_mut().enumerate() {
                    let pairs = series.iter().zip(series.iter().skip(lag));
                    *product += pairs.map(|(a, b)| a * b).sum::<f64>();
                }
                count += series.iter().filter(|r| **r != 0.0).count();
                row += run.len() * n_signals;
            }
            let squares = products[0];
            if squares == 0.0 {
                return 0.0;
            }
            let correlated: f64 = products[1..].iter().map(|p| (p / squares).powi(2)).sum();
            (squares / count as f64 * self.samples * (1.0 + 2.0 * correlated)).sqrt()
        };
        (0..n_signals).map(of_signal).collect()
    }
}

#[cfg(test)]
mod tests {
    use loopsight_model::run::Rows;

    use super::*;

    fn run(measured: Vec<f64>) -> Run {
        let time = (0..measured.len()).map(|k| 0.01 * k as f64).collect();
        Run::new("", time, Rows::default(), Rows::new(1, measured)).unwrap()
    }

    #[test]
    fn a_start_counts_as_much_as_its_sensor_is_good() {
        let criteria = &StartCriteria::DEFAULT;
        let smooth = run(vec![1.0; 10]);
        let of = |run: &Run, noise| of_run(run, 0, (noise, 1.0), criteria.late_s, criteria);
        assert!((of(&smooth, 0.01) - 10.0).abs() < 1e-9);
        // No better than the model, and no better than can be computed with.
        assert_eq!((of(&smooth, 0.5), of(&smooth, 0.0)), (1.0, criteria.most));
        let mut spike = vec![1.0; 10];
        spike[0] = 7.0;
        assert_eq!(of(&run(spike), 0.01), 1.0);
        // A run that is cut out of a motion.
        let moving = run((0..10).map(|k| f64::from(k) * 0.1).collect());
        assert_eq!(of(&moving, 0.001), 1.0);
        // Wherever its clock began.
        let ramp = (0..20).map(|k| f64::from(k) * 0.1).collect();
        assert_eq!(of(&run(ramp).part(10..20), 0.001), 1.0);
        let mut missing = vec![1.0; 10];
        missing[0] = f64::NAN;
        assert_eq!(of(&run(missing), 0.01), 1.0);
    }

    /// A position at 100 Hz that begins to move at sample `moves`, with an input from sample `acts` on.
    fn driven(acts: usize, moves: usize) -> Run {
        let of = |from: usize, k: usize, value: f64| if k < from { 0.0 } else { value };
        let time = (0..40).map(|k| 0.01 * f64::from(k)).collect();
        let input = (0..40).map(|k| of(acts, k, 5.0)).collect();
        let measured = (0..40).map(|k| of(moves, k, 0.1 * k as f64)).collect();
        Run::new("", time, Rows::new(1, input), Rows::new(1, measured)).unwrap()
    }

    #[test]
    fn a_machine_rests_until_it_is_driven() {
        let criteria = &StartCriteria::DEFAULT;
        let rest = |acts, moves| {
            let run = driven(acts, moves);
            at_rest(&run, &[(0.001, 1.0)], &[5.0], criteria)
        };
        // The samples until an input acts, and no more than are soon after the start.
        assert_eq!((rest(1, 9), rest(4, 9), rest(20, 25)), (1, 4, 6));
        // It is driven from the first sample on, moves before it is driven, or moves soon enough to have moved before.
        assert_eq!((rest(0, 9), rest(20, 10), rest(1, 3)), (0, 0, 0));
        // How late a sensor may be does not matter at rest.
        let run = driven(4, 9);
        let of = |late_s| of_run(&run, 0, (0.001, 1.0), late_s, criteria);
        assert_eq!((of(0.0), of(criteria.late_s)), (criteria.most, 1.0));
    }
}
