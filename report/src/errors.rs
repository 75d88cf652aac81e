//! Residuals of a comparison, and their size.

use loopsight_diagnosis::{RunTrace, SignalTrace};

/// Measurement minus free run.
pub(crate) fn residual(signal: &SignalTrace) -> Vec<f64> {
    signal
        .measured
        .iter()
        .zip(&signal.free_run)
        .map(|(y, p)| y - p)
        .collect()
}

/// Root mean square of the finite values.
pub(crate) fn rms(values: impl IntoIterator<Item = f64>) -> f64 {
    let (mut n, mut squares) = (0.0, 0.0);
    for value in values.into_iter().filter(|v| v.is_finite()) {
        n += 1.0;
        squares += value * value;
    }
    (squares / n).sqrt()
}

/// The signal `id` of a run.
pub(crate) fn signal<'a>(run: &'a RunTrace, id: &str) -> Option<&'a SignalTrace> {
    run.signals.iter().find(|s| s.id == id)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures::friction_runs;

    #[test]
    fn missing_samples_count_nothing() {
        assert!((rms([3.0, f64::NAN, -4.0]) - 12.5f64.sqrt()).abs() < 1e-12);
        assert!(rms([]).is_nan());
    }

    #[test]
    fn a_residual_is_measured_less_model() {
        let mut run = friction_runs(1, 20).remove(0);
        run.signals[0].measured[3] = 1.0;
        run.signals[0].free_run[3] = 0.25;
        let found = signal(&run, "linear_velocity").map(residual).unwrap();
        assert_eq!(found[3], 0.75);
        assert!(signal(&run, "no_such").is_none());
    }
}
