//! The error that noise and resolution alone would leave.

use std::ops::Range;

use loopsight_model::model::Model;
use loopsight_model::run::{Run, shortest_period};
use loopsight_model::sensor::Sensor;

use crate::criteria::LogCriteria;
use crate::long::pieces;
use crate::score::Tally;

/// `nrmse` over all signals of a model without any fault.
///
/// * Encoder counts: the standard deviation of rounding, from their resolution
///   ([`loopsight_model::sensor::Encoder::noise`]).
/// * Other sensors: differences of order `n` of the measurement. In them a smooth motion vanishes, and white
///   noise of variance `σ²` has the variance `σ² (2n)!/(n!)²`. A median leaves out jumps of the motion. Of the
///   orders 1 to 4 the least result counts, because motion adds to low orders. Differences are taken between
///   neighbours and between every other sample: neighbours of noise that alternates (differences of counts)
///   differ by more than white noise of the same size would, every other sample does not. The noise is never below
///   the rounding of the log, its least change `q` over `√12`.
/// * A sensor may be noisier while the machine moves (a speed by a differentiating filter, which is quiet at rest). So
///   medians are those of blocks of a hundred values or more, and their squares are averaged. Rows of samples that are shorter
///   share blocks.
/// * A coarse log, which changes by one step of `q` or two at a time, has its noise in few values. Then the median
///   is that of grouped data: values are spread evenly over their step, and what that adds, `q²/12`, is taken off.
/// * A sensor that is read more often than it has a new value (a bus that updates every 20 ms): the age of its
///   value is anything between zero and its update time `h`. Differences are taken between new values, and the age
///   adds `(rate · h)²/12`. A coarse log that repeats a value was read all the same.
///
/// Of a long log [pieces](crate::long) tell the noise; the deviation of the signal is that of all samples.
///
/// The noise is that of the samples of `part`, so that an error is held against the noise of the samples that it was
/// measured on: a sensor that jumps once makes no floor where it does not.
pub(crate) fn floor(model: &Model, part: &Part<'_>, criteria: &LogCriteria) -> f64 {
    let n = model.measured.len();
    let sum: f64 = model
        .measured
        .iter()
        .enumerate()
        .map(|(signal, measured)| {
            let (noise, std) = noise(&measured.sensor, signal, part, criteria);
            let relative = noise / std;
            if relative.is_finite() {
                relative * relative
            } else {
                0.0
            }
        })
        .sum();
    (sum / n.max(1) as f64).sqrt()
}

/// Samples of recordings: all of them, or those that a fit sees, or those that judge it.
pub(crate) struct Part<'a> {
    pub(crate) runs: &'a [Run],
    /// By run and sample whether a fit sees it, and which of the two the part is.
    pub(crate) seen: Option<(&'a [Vec<bool>], bool)>,
}

impl<'a> Part<'a> {
    pub(crate) fn all(runs: &'a [Run]) -> Self {
        Self { runs, seen: None }
    }

    /// Itself, or all samples where it has too few to tell a noise.
    fn or_all(&self) -> Self {
        let few = (self.seen).is_some_and(|(seen, which)| {
            seen.iter().flatten().filter(|s| **s == which).count() < BLOCK
        });
        Self {
            runs: self.runs,
            seen: self.seen.filter(|_| !few),
        }
    }

    /// The longest rows of samples of a run, within its [pieces], that belong to the part.
    fn stretches(&self, run: usize) -> Vec<Range<usize>> {
        let rows = pieces(self.runs[run].len());
        let Some((seen, which)) = self.seen else {
            return rows.collect();
        };
        rows.flat_map(|piece| {
            let mut end = piece.start;
            let rows = seen[run][piece].chunk_by(|a, b| a == b);
            rows.filter_map(move |row| {
                let start = end;
                end += row.len();
                (row[0] == which).then_some(start..end)
            })
        })
        .collect()
    }
}

/// Standard deviations of the noise of the `signal`-th measured signal in a part of the samples, and of the signal
/// itself in all of them.
pub(crate) fn noise(
    sensor: &Sensor,
    signal: usize,
    part: &Part<'_>,
    criteria: &LogCriteria,
) -> (f64, f64) {
    let mut tally = Tally::default();
    let mut every: Vec<Vec<f64>> = Vec::new();
    let mut changing: Vec<Vec<f64>> = Vec::new();
    let mut holds = Vec::new();
    let mut rate = Tally::default();
    let mut period = f64::NAN;
    let part = part.or_all();
    for (index, run) in part.runs.iter().enumerate() {
        let step = run.median_period();
        for k in 0..run.len() {
            let y = run.sample(k)[signal];
            tally.add(y, y);
        }
        for piece in part.stretches(index) {
            let values = piece.clone().map(|k| run.sample(k)[signal]);
            every.push(values.filter(|y| y.is_finite()).collect());
            let mut news: Vec<(f64, f64)> = Vec::new();
            for k in piece {
                let (time, y) = (run.time()[k], run.sample(k)[signal]);
                let Some((before, last)) = news.last().copied() else {
                    if y.is_finite() {
                        news.push((time, y));
                    }
                    continue;
                };
                if y.is_finite() && y != last {
                    holds.push(time - before);
                    news.push((time, y));
                }
            }
            changing.push(news.iter().map(|(_, y)| *y).collect());
            for w in news.windows(2) {
                // Over the time it took, each sample once.
                let samples = ((w[1].0 - w[0].0) / step).round().max(1.0);
                for _ in 0..(samples as usize).min(run.len()) {
                    rate.add((w[1].1 - w[0].1) / (w[1].0 - w[0].0), 0.0);
                }
            }
        }
        period = period.min(step);
    }
    let noise = match sensor {
        Sensor::EncoderCounts(encoder) => encoder.noise(period),
        Sensor::Instantaneous | Sensor::IntervalMean => {
            let steps = changes(&changing);
            let step = least(&steps, tally.rms());
            let rounding = step / 12f64.sqrt();
            if median(steps) <= COARSE * step {
                white(&every, step).max(rounding)
            } else {
                let hold = median(holds);
                if hold > criteria.repeats_periods * period {
                    let age = rate.rms() * hold / 12f64.sqrt();
                    white(&changing, 0.0).max(rounding).hypot(age)
                } else {
                    // What it repeats now and then, while the machine rests, it reads all the same.
                    white(&every, 0.0).max(rounding)
                }
            }
        }
    };
    (noise, tally.std())
}

/// Standard deviation of what rounding alone adds to the `signal`-th measured signal: counts of an encoder, or the
/// least change in the log.
pub(crate) fn rounding(sensor: &Sensor, signal: usize, runs: &[Run]) -> f64 {
    if let Sensor::EncoderCounts(encoder) = sensor {
        return encoder.noise(shortest_period(runs));
    }
    let mut tally = Tally::default();
    let mut all: Vec<Vec<f64>> = Vec::new();
    for run in runs {
        for piece in pieces(run.len()) {
            let values = piece.map(|k| run.sample(k)[signal]);
            let values: Vec<f64> = values.filter(|y| y.is_finite()).collect();
            values.iter().for_each(|y| tally.add(*y, *y));
            all.push(values);
        }
    }
    least(&changes(&all), tally.rms()) / 12f64.sqrt()
}

/// Orders of the differences.
const ORDERS: usize = 4;
/// Samples between the values of a difference.
const SPACINGS: usize = 2;
/// A log whose changes are mostly of this many steps or fewer is coarse: with more, the steps of a normal
/// distribution's median are a small part of it.
const COARSE: f64 = 2.0;

/// Standard deviation of white noise in runs that change by multiples of `step`, or of 0 where that does not show.
fn white(runs: &[Vec<f64>], step: f64) -> f64 {
    let least = (1..=ORDERS)
        .flat_map(|order| (1..=SPACINGS).map(move |spacing| (order, spacing)))
        .filter_map(|(order, spacing)| {
            let of_runs = runs.iter().map(|run| sizes(run, order, spacing));
            let (mut rows, short): (Vec<_>, Vec<_>) = of_runs.partition(|row| row.len() >= BLOCK);
            // A median of few values follows the motion.
            rows.push(short.concat());
            let blocks = || rows.iter().flat_map(|row| row.chunks(block(row.len())));
            let variance = |block: &[f64]| {
                let spread = grouped_median(block.to_vec(), step) / 0.6745;
                (spread * spread - step * step / 12.0).max(0.0) / gain(order)
            };
            let count: usize = blocks().map(<[f64]>::len).sum();
            let sum: f64 = blocks().map(|b| b.len() as f64 * variance(b)).sum();
            (count > 0).then(|| (sum / count as f64).sqrt())
        })
        .fold(f64::INFINITY, f64::min);
    if least.is_finite() { least } else { 0.0 }
}

/// Values whose median tells the noise: with fewer, its own error of `1.25/√n` would count.
const BLOCK: usize = 100;

/// The length of the blocks of `n` values: all alike, and none much shorter than [`BLOCK`].
fn block(n: usize) -> usize {
    n.div_ceil((n / BLOCK).max(1)).max(1)
}

/// Sizes of the differences of an order, of values that are `spacing` samples apart.
fn sizes(values: &[f64], order: usize, spacing: usize) -> Vec<f64> {
    let mut left = values.to_vec();
    for _ in 0..order {
        left = (left.iter().zip(left.iter().skip(spacing)))
            .map(|(before, after)| after - before)
            .collect();
    }
    left.into_iter().map(f64::abs).collect()
}

/// Sizes of the changes from one value to the next.
fn changes(runs: &[Vec<f64>]) -> Vec<f64> {
    runs.iter().flat_map(|values| sizes(values, 1, 1)).collect()
}

/// Variance of the differences of an order of white noise of variance 1: `(2n)!/(n!)²`.
fn gain(order: usize) -> f64 {
    (1..=order).fold(1.0, |all, k| all * (order + k) as f64 / k as f64)
}

/// The least of the changes of a signal of this root mean square, or 0 where there is none.
fn least(changes: &[f64], rms: f64) -> f64 {
    let least = changes
        .iter()
        .copied()
        .filter(|change| *change > 1e-9 * rms)
        .fold(f64::INFINITY, f64::min);
    if least.is_finite() { least } else { 0.0 }
}

/// The median of sizes that were rounded to multiples of `step`, each as likely anywhere within its step.
fn grouped_median(sizes: Vec<f64>, step: f64) -> f64 {
    let half = 0.5 * sizes.len() as f64;
    let count = |below: f64| sizes.iter().filter(|size| **size < below).count() as f64;
    let middle = median(sizes.clone());
    let (low, high) = (middle - 0.5 * step, middle + 0.5 * step);
    let (below, within) = (count(low), count(high) - count(low));
    let low = low.max(0.0);
    if within > 0.0 {
        low + (high - low) * (half - below) / within
    } else {
        middle
    }
}

fn median(mut values: Vec<f64>) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}

#[cfg(test)]
mod tests {
    use loopsight_model::run::Rows;

    use super::*;
    use crate::chance::normal;

    fn of(measured: Vec<f64>) -> f64 {
        let time = (0..measured.len()).map(|k| 0.02 * k as f64).collect();
        let run = Run::new("", time, Rows::default(), Rows::new(1, measured)).unwrap();
        noise(
            &Sensor::Instantaneous,
            0,
            &Part::all(&[run]),
            &LogCriteria::DEFAULT,
        )
        .0
    }

    #[test]
    fn noise_is_found_whatever_its_colour() {
        let q = normal(4001, 5);
        let motion = |k: usize| 20.0 * (0.04 * k as f64).sin();
        let plain = of((0..4000).map(|k| motion(k) + q[k]).collect());
        assert!((plain - 1.0).abs() < 0.1, "{plain}");
        // Differences of counts have the variance 2. Neighbours differ by as much as if it were 3, the third
        // differences as if it were 3.5.
        let alternating = of((0..4000).map(|k| motion(k) + q[k + 1] - q[k]).collect());
        assert!(
            (alternating / 2f64.sqrt() - 1.0).abs() < 0.1,
            "{alternating}"
        );
        // Rounded to steps as large as the noise, or three times as large.
        for step in [1.0, 3.0] {
            let noise = 1f64.hypot(step / 12f64.sqrt());
            let coarse = of((0..4000)
                .map(|k| ((motion(k) + q[k]) / step).round() * step)
                .collect());
            assert!((coarse / noise - 1.0).abs() < 0.15, "{coarse} {noise}");
        }
        // Speed from the counts of an encoder: each is off by up to one, every other way.
        let mut angle = 0.3;
        let counts: Vec<f64> = (0..4001)
            .map(|k| {
                angle += 30.0 + motion(k) + 0.1 * q[k];
                angle.floor()
            })
            .collect();
        let counted = of(counts.windows(2).map(|w| w[1] - w[0]).collect());
        let true_noise = (1.0f64 / 6.0 + 0.01).sqrt();
        assert!(
            (counted / true_noise - 1.0).abs() < 0.25,
            "{counted} {true_noise}"
        );
        // A log that is rounded has noise, however seldom it changes.
        let rounded = of((0..4000)
            .map(|k| (motion(k / 40) * 2.0).round() / 2.0)
            .collect());
        assert!(rounded >= 0.5 / 12f64.sqrt() - 1e-12, "{rounded}");
    }

    /// White in motion, which is two seconds of five, and none at rest.
    #[test]
    fn noise_that_comes_with_motion_counts_as_often_as_it_is_there() {
        let q = normal(4000, 7);
        let moves = |k: usize| k / 100 % 5 < 2;
        let measured: Vec<f64> = (0..4000)
            .map(|k| f64::from(u8::from(moves(k))) * (10.0 * (0.06 * k as f64).sin() + q[k]))
            .collect();
        let (found, truth) = (of(measured), 0.4f64.sqrt());
        assert!((found / truth - 1.0).abs() < 0.15, "{found} {truth}");
    }

    /// A sine of amplitude 1 and 2 rad/s, read every 5 ms, new every 20 ms.
    #[test]
    fn a_held_sensor_is_as_good_as_its_age() {
        let (hold, n) = (0.02, 8000);
        let time: Vec<f64> = (0..n).map(|k| 0.005 * f64::from(k)).collect();
        let late = |t: f64| (2.0 * (t / hold + 1e-9).floor() * hold).sin();
        let measured: Vec<f64> = time.iter().map(|t| late(*t)).collect();
        // What is left by the best model there is: the sine, as late as the sensor is on average.
        let left: f64 = time
            .iter()
            .zip(&measured)
            .map(|(t, y)| (y - (2.0 * (t - 0.0075)).sin()).powi(2))
            .sum::<f64>()
            / f64::from(n);
        let run = Run::new("", time, Rows::default(), Rows::new(1, measured)).unwrap();
        let (noise, _) = noise(
            &Sensor::Instantaneous,
            0,
            &Part::all(&[run]),
            &LogCriteria::DEFAULT,
        );
        assert!(
            (noise / left.sqrt() - 1.0).abs() < 0.1,
            "{noise} {}",
            left.sqrt()
        );
    }
}
