//! How far a model is from a measurement, in one number.

use serde::Serialize;

/// The errors of one measured signal over all runs.
///
/// With residuals `e = y - ŷ`, `rmse = sqrt(mean(e²))`, `nrmse = rmse/std(y)`, `fit_percent =
/// 100 (1 - nrmse)` (L. Ljung, 1999, "System Identification", 2nd edition, section 16.4; the fit
/// of MATLAB's `compare`).
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SignalScore {
    /// The signal.
    pub id: String,
    /// Its unit.
    pub unit: String,
    /// Root mean square of the free-run error, in the signal's unit.
    pub rmse: f64,
    /// The same over the standard deviation of the measurement.
    pub nrmse: f64,
    /// `100 (1 - nrmse)`.
    pub fit_percent: f64,
    /// As `nrmse`, for the prediction of one sample from the measured state.
    pub one_step_nrmse: f64,
}

/// Sums over the samples of one signal, in one pass.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Tally {
    n: f64,
    mean: f64,
    squares: f64,
    errors: f64,
    n_one_step: f64,
    one_step_errors: f64,
}

impl Tally {
    /// A measurement and the free-run prediction of it; NaN measurements count nothing.
    pub(crate) fn add(&mut self, measured: f64, predicted: f64) {
        if !measured.is_finite() {
            return;
        }
        // Welford's running mean and sum of squares.
        self.n += 1.0;
        let before = measured - self.mean;
        self.mean += before / self.n;
        self.squares += before * (measured - self.mean);
        self.errors += (measured - predicted).powi(2);
    }

    pub(crate) fn add_one_step(&mut self, measured: f64, predicted: f64) {
        if measured.is_finite() && predicted.is_finite() {
            self.n_one_step += 1.0;
            self.one_step_errors += (measured - predicted).powi(2);
        }
    }

    pub(crate) fn rms(&self) -> f64 {
        (self.squares / self.n + self.mean * self.mean).sqrt()
    }

    pub(crate) fn std(&self) -> f64 {
        (self.squares / self.n).sqrt()
    }

    pub(crate) fn score(&self, id: &str, unit: &str) -> SignalScore {
        let rmse = (self.errors / self.n).sqrt();
        let nrmse = rmse / self.std();
        SignalScore {
            id: id.to_owned(),
            unit: unit.to_owned(),
            rmse,
            nrmse,
            fit_percent: 100.0 * (1.0 - nrmse),
            one_step_nrmse: (self.one_step_errors / self.n_one_step).sqrt() / self.std(),
        }
    }
}

/// Root mean square over the signals.
pub(crate) fn overall(signals: &[SignalScore]) -> f64 {
    (signals.iter().map(|s| s.nrmse * s.nrmse).sum::<f64>() / signals.len() as f64).sqrt()
}
