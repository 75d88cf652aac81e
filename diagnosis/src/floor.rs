//! The error that noise and resolution alone would leave.

use loopsight_model::model::Model;
use loopsight_model::run::Run;
use loopsight_model::sensor::Sensor;

use crate::criteria::LogCriteria;
use crate::score::Tally;

/// `nrmse` over all signals of a model without any fault.
///
/// * Encoder counts: the standard deviation of rounding, from their resolution
///   ([`loopsight_model::sensor::Encoder::noise`]).
/// * Other sensors: third differences of the measurement. In them a smooth motion vanishes, and white noise of
///   variance `σ²` has the variance `20 σ²`. The median keeps jumps of the motion out.
/// * A sensor that is read more often than it has a new value (a bus that updates every 20 ms, a coarse scale):
///   its value is old by anything between zero and its update time `h`. Differences are taken between new
///   values, and the age adds `(rate · h)²/12`.
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
    let mut thirds = Vec::new();
    let mut holds = Vec::new();
    let mut rate = Tally::default();
    let mut period = f64::NAN;
    for run in runs {
        let step = run.median_period();
        let mut news: Vec<(f64, f64)> = Vec::new();
        for k in 0..run.len() {
            let (time, y) = (run.time()[k], run.sample(k)[signal]);
            tally.add(y, y);
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
        for w in news.windows(4) {
            thirds.push((w[3].1 - 3.0 * w[2].1 + 3.0 * w[1].1 - w[0].1).abs());
        }
        for w in news.windows(2) {
            // Over the time it took, each sample once.
            let samples = ((w[1].0 - w[0].0) / step).round().max(1.0);
            for _ in 0..(samples as usize).min(run.len()) {
                rate.add((w[1].1 - w[0].1) / (w[1].0 - w[0].0), 0.0);
            }
        }
        period = period.min(step);
    }
    let noise = match sensor {
        Sensor::EncoderCounts(encoder) => encoder.noise(period),
        Sensor::Instantaneous | Sensor::IntervalMean => {
            let white = median(thirds) / 0.6745 / 20f64.sqrt();
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
