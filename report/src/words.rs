//! What the pictures show, in sentences with numbers.

use loopsight_diagnosis::{Comparison, SignalScore};

use crate::numbers::{quantity, show, tenths};

/// How well the model does, and where it does worst.
pub(crate) fn verdict(comparison: &Comparison) -> String {
    let fit = comparison.fit_percent;
    let mut text = if comparison.signals.is_empty() {
        return "Nothing is measured, so the model cannot be judged.".into();
    } else if !fit.is_finite() {
        "The free run cannot be scored: a signal has no measurement, or one that never moves."
            .into()
    } else if fit <= 0.0 {
        format!(
            "In free run the model reproduces nothing of what was measured: its error is {} times \
             as large as the measured variation.",
            show(comparison.nrmse, 2)
        )
    } else {
        format!(
            "In free run the model reproduces {} of what was measured.",
            tenths(fit)
        )
    };
    if let Some(worst) = worst(&comparison.signals) {
        let error = quantity(&show(worst.rmse, 2), &worst.unit);
        let which = if comparison.signals.len() > 1 {
            format!(" {} is the worst signal: {error} rms.", worst.id)
        } else {
            format!(" {} is off by {error} rms.", worst.id)
        };
        text.push_str(&which);
    }
    if let Some(held) = &comparison.observer {
        text.push_str(&format!(" Note: {}.", held.statement));
    }
    text
}

/// The signal with the greatest relative error.
pub(crate) fn worst(signals: &[SignalScore]) -> Option<&SignalScore> {
    signals
        .iter()
        .filter(|s| s.nrmse.is_finite())
        .max_by(|a, b| a.nrmse.total_cmp(&b.nrmse))
}

/// The name of a run, or its number where it has none.
pub(crate) fn run_name(name: &str, at: usize) -> String {
    if name.is_empty() {
        format!("{}", at + 1)
    } else {
        name.into()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures::{comparison, scores};

    #[test]
    fn the_verdict_names_the_worst_signal() {
        let mut comparison = comparison(vec![]);
        comparison.signals = scores();
        comparison.nrmse = 0.079;
        comparison.fit_percent = 92.1;
        assert_eq!(
            verdict(&comparison),
            "In free run the model reproduces 92.1\u{a0}% of what was measured. \
             linear_velocity is the worst signal: 0.013\u{a0}m/s rms."
        );
        comparison.nrmse = 2.34;
        comparison.fit_percent = -134.0;
        assert!(verdict(&comparison).contains("2.3 times as large as"));
        comparison.fit_percent = f64::NAN;
        assert!(verdict(&comparison).contains("cannot be scored"));
        comparison.signals.clear();
        assert!(verdict(&comparison).contains("Nothing is measured"));
    }
}
