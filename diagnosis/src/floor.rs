//! The error that noise and resolution alone would leave.

use loopsight_core::model::Model;
use loopsight_core::run::Run;
use loopsight_core::sensor::Sensor;

use crate::score::Tally;

/// `nrmse` over all signals of a model without any fault.
///
/// Counted encoders: the standard deviation of rounding, from their resolution
/// ([`loopsight_core::sensor::Encoder::noise`]), and at least the noise of the differences below.
/// Other sensors: third differences of the measurement, in which a smooth motion vanishes and white
/// noise of variance `σ²` has the variance `20 σ²`; the median keeps jumps of the motion out.
pub(crate) fn floor(model: &Model, runs: &[Run]) -> f64 {
    let n = model.measured.len();
    let sum: f64 = model
        .measured
        .iter()
        .enumerate()
        .map(|(signal, measured)| {
            let (noise, std) = noise(&measured.sensor, signal, runs);
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
pub(crate) fn noise(sensor: &Sensor, signal: usize, runs: &[Run]) -> (f64, f64) {
    let mut tally = Tally::default();
    let mut thirds = Vec::new();
    let mut period = f64::NAN;
    for run in runs {
        let y = |k: usize| run.sample(k)[signal];
        for k in 0..run.len() {
            tally.add(y(k), y(k));
            if k >= 3 {
                let d = y(k) - 3.0 * y(k - 1) + 3.0 * y(k - 2) - y(k - 3);
                if d.is_finite() {
                    thirds.push(d.abs());
                }
            }
        }
        period = period.min(run.median_period());
    }
    let noise = match sensor {
        Sensor::EncoderCounts(encoder) => encoder.noise(period),
        Sensor::Instantaneous | Sensor::IntervalMean => median(thirds) / 0.6745 / 20f64.sqrt(),
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
