//! The error that noise and resolution alone would leave.

use loopsight_model::model::Model;
use loopsight_model::run::Run;
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
///   orders 1 to 4 the least result counts: motion adds to low orders, and noise that alternates (differences
///   of counts) adds to high ones. The noise is never below the rounding of the log, its least change over
///   `√12`.
/// * A sensor that is read more often than it has a new value (a bus that updates every 20 ms, a coarse scale):
///   the age of its value is anything between zero and its update time `h`. Differences are taken between new
///   values, and the age adds `(rate · h)²/12`.
///
/// Of a long log [pieces](crate::long) tell the noise; the deviation of the signal is that of all samples.
pub(crate) fn floor(model: &Model, runs: &[Run], criteria: &LogCriteria) -> f64 {
    let n = model.measured.len();
    let sum: f64 = model
        .measured
        .iter()
        .enumerate()
        .map(|(signal, measured)| {
            let (noise, std) = noise(&measured.sensor, signal, runs, criteria);
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

/// Standard deviations of the noise of the `signal`-th measured signal, and of the signal itself.
pub(crate) fn noise(
    sensor: &Sensor,
    signal: usize,
    runs: &[Run],
    criteria: &LogCriteria,
) -> (f64, f64) {
    let mut tally = Tally::default();
    let mut differences = [const { Vec::new() }; ORDERS];
    let mut holds = Vec::new();
    let mut rate = Tally::default();
    let mut period = f64::NAN;
    for run in runs {
        let step = run.median_period();
        for k in 0..run.len() {
            let y = run.sample(k)[signal];
            tally.add(y, y);
        }
        for piece in pieces(run.len()) {
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
            let changes: Vec<f64> = news.iter().map(|(_, y)| *y).collect();
            for (order, sizes) in differences.iter_mut().enumerate() {
                sizes.extend(difference(&changes, order + 1).map(f64::abs));
            }
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
            let rounding = rounded(&differences[0], tally.rms());
            let orders = differences.into_iter().zip(1..);
            let white = orders
                .filter(|(sizes, _)| !sizes.is_empty())
                .map(|(sizes, order)| median(sizes) / 0.6745 / gain(order).sqrt())
                .fold(f64::INFINITY, f64::min);
            let white = if white.is_finite() { white } else { 0.0 };
            let white = white.max(rounding);
            let hold = median(holds);
            let age = if hold > criteria.repeats_periods * period {
                rate.rms() * hold / 12f64.sqrt()
            } else {
                0.0
            };
            white.hypot(age)
        }
    };
    (noise, tally.std())
}

/// Standard deviation of what rounding alone adds to the `signal`-th measured signal: counts of an encoder, or the
/// least change in the log.
pub(crate) fn rounding(sensor: &Sensor, signal: usize, runs: &[Run]) -> f64 {
    if let Sensor::EncoderCounts(encoder) = sensor {
        let periods = runs.iter().map(Run::median_period);
        return encoder.noise(periods.fold(f64::INFINITY, f64::min));
    }
    let mut tally = Tally::default();
    let mut changes = Vec::new();
    for run in runs {
        for piece in pieces(run.len()) {
            let values = piece.map(|k| run.sample(k)[signal]);
            let values: Vec<f64> = values.filter(|y| y.is_finite()).collect();
            values.iter().for_each(|y| tally.add(*y, *y));
            changes.extend(difference(&values, 1).map(f64::abs));
        }
    }
    rounded(&changes, tally.rms())
}

/// Orders of the differences.
const ORDERS: usize = 4;

/// Differences of an order.
fn difference(values: &[f64], order: usize) -> impl Iterator<Item = f64> + '_ {
    values.windows(order + 1).map(move |w| {
        let mut factor = 1.0;
        let mut sum = 0.0;
        for (k, value) in w.iter().rev().enumerate() {
            sum += factor * value;
            factor *= -((order - k) as f64) / (k + 1) as f64;
        }
        sum
    })
}

/// Variance of the differences of an order of white noise of variance 1: `(2n)!/(n!)²`.
fn gain(order: usize) -> f64 {
    (1..=order).fold(1.0, |all, k| all * (order + k) as f64 / k as f64)
}

/// Standard deviation of rounding to the least that a signal of this root mean square changes by.
fn rounded(changes: &[f64], rms: f64) -> f64 {
    let least = changes
        .iter()
        .copied()
        .filter(|change| *change > 1e-9 * rms)
        .fold(f64::INFINITY, f64::min);
    if least.is_finite() {
        least / 12f64.sqrt()
    } else {
        0.0
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

    fn of(measured: Vec<f64>) -> f64 {
        let time = (0..measured.len()).map(|k| 0.02 * k as f64).collect();
        let run = Run::new("", time, Rows::default(), Rows::new(1, measured)).unwrap();
        noise(&Sensor::Instantaneous, 0, &[run], &LogCriteria::DEFAULT).0
    }

    #[test]
    fn noise_is_found_whatever_its_colour() {
        let mut state = 5u64;
        let mut white = || {
            let mut sum = 0.0;
            for _ in 0..12 {
                state = state
                    .wrapping_mul(6_364_136_223_846_793_005)
                    .wrapping_add(1);
                sum += (state >> 11) as f64 / (1u64 << 53) as f64 - 0.5;
            }
            sum
        };
        let q: Vec<f64> = (0..4001).map(|_| white()).collect();
        let motion = |k: usize| 20.0 * (0.04 * k as f64).sin();
        let plain = of((0..4000).map(|k| motion(k) + q[k]).collect());
        assert!((plain - 1.0).abs() < 0.1, "{plain}");
        // Differences of counts have the variance 2, and their first differences 6, as if it were 3; the
        // third differences have 70, as if it were 3.5.
        let alternating = of((0..4000).map(|k| motion(k) + q[k + 1] - q[k]).collect());
        assert!(
            (alternating / 3f64.sqrt() - 1.0).abs() < 0.05,
            "{alternating}"
        );
        // A log that is rounded has noise, however seldom it changes.
        let rounded = of((0..4000)
            .map(|k| (motion(k / 40) * 2.0).round() / 2.0)
            .collect());
        assert!(rounded >= 0.5 / 12f64.sqrt() - 1e-12, "{rounded}");
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
        let (noise, _) = noise(&Sensor::Instantaneous, 0, &[run], &LogCriteria::DEFAULT);
        assert!(
            (noise / left.sqrt() - 1.0).abs() < 0.1,
            "{noise} {}",
            left.sqrt()
        );
    }
}
