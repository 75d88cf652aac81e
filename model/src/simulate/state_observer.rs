//! The gains that tie a free run to the measurements.

/// Corrects the plant state of a free run by what was measured, where a model cannot be simulated
/// from the inputs alone: an unstable one leaves every measurement, one that integrates drifts.
///
/// ```text
/// x(k) <- x(k) + K(k) (y(k) - ŷ(k))
/// ```
///
/// `ŷ(k)` depends on the measurements before `k` only, so it stays a prediction. The gains are
/// numbers: whoever differentiates a free run differentiates through the correction.
///
/// Where a sensor has another slope than the gains were made for, its difference counts in the slope of that. A sensor that reads
/// eight times too much would correct eight times as much otherwise, and leave less of any model.
///
/// (D. G. Luenberger, 1971, "An introduction to observers", IEEE Transactions on Automatic Control
/// 16, 596–602.)
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StateObserver {
    /// `K` by sample, row by row: states × measured signals.
    pub gains: Vec<f64>,
    /// States that the measurements say something about, by index.
    pub observed: Vec<usize>,
    /// Time in which it forgets, s: what was measured longer ago than that hardly counts.
    pub horizon: f64,
    /// Time in which an error of the state doubles, s, where the model is unstable; where it is not,
    /// it integrates.
    pub doubling: Option<f64>,
    /// Parameter values of the model that it was made for.
    pub values: Vec<f64>,
    /// Entries of `K`.
    pub stride: usize,
    /// Slopes of the sensors that the gains were made for, by signal: what each reads for a signal of 1 more. Where it is not
    /// given, the one of a sensor that reads right.
    pub slopes: Vec<f64>,
}

impl StateObserver {
    /// `K` at sample `k`; empty beyond the last.
    pub fn gain(&self, k: usize) -> &[f64] {
        self.gains
            .get(k * self.stride..(k + 1) * self.stride)
            .unwrap_or(&[])
    }

    /// The slope of the sensor of a `signal` that the gains were made for.
    pub fn slope(&self, signal: usize) -> f64 {
        self.slopes.get(signal).copied().unwrap_or(1.0)
    }

    /// The gains of the samples `range` alone.
    pub fn part(&self, range: std::ops::Range<usize>) -> Self {
        let range = range.start * self.stride..range.end * self.stride;
        Self {
            gains: self.gains.get(range).unwrap_or(&[]).to_vec(),
            ..self.clone()
        }
    }
}
