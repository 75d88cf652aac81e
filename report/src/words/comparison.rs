//! How well a model does.

use loopsight_diagnosis::{Comparison, SignalScore, Statement};

use super::faults::faults;
use super::number::{hundredths, number, quantity, rounded};
use super::table::table;

/// What a comparison comes to, sentence by sentence: the error, the worst signal, and how the free run was
/// corrected, where it was.
pub fn summary(comparison: &Comparison) -> Vec<String> {
    let mut said = vec![headline(comparison)];
    if let Some(worst) = worst(&comparison.signals) {
        let error = quantity(&rounded(worst.rmse, 2), &worst.unit);
        said.push(if comparison.signals.len() > 1 {
            format!("The worst signal is {}: {error} rms.", worst.id)
        } else {
            format!("The error of {} is {error} rms.", worst.id)
        });
    }
    said.extend(
        comparison
            .observer
            .as_ref()
            .map(|observer| format!("Note: {}.", observer.statement)),
    );
    said
}

/// The error of the free run over all signals.
fn headline(comparison: &Comparison) -> String {
    let fit = comparison.fit_percent;
    if comparison.signals.is_empty() {
        "Nothing is measured, so the model cannot be judged.".into()
    } else if !fit.is_finite() {
        "The free run has no score: a signal has no sample, or never moves.".into()
    } else {
        let worse = if fit <= 0.0 {
            ", worse than a constant"
        } else {
            ""
        };
        format!(
            "Free run: error {} of the standard deviation, fit {fit:.2} %{worse}.",
            hundredths(comparison.nrmse),
        )
    }
}

/// A comparison for a terminal: faults, summary, a table of the signals, and where the model fails.
pub fn text(comparison: &Comparison) -> String {
    let rows: Vec<Vec<String>> = comparison
        .signals
        .iter()
        .map(|s| {
            vec![
                s.id.clone(),
                format!("{} {}", number(s.rmse), s.unit),
                hundredths(s.nrmse),
                format!("{:.2} %", s.fit_percent),
                hundredths(s.one_step_nrmse),
            ]
        })
        .collect();
    let head = ["signal", "rmse", "nrmse", "fit", "one-step nrmse"];
    format!(
        "{}{}\n{}{}",
        faults(&comparison.faults),
        summary(comparison).join("\n"),
        table(&head, &rows),
        where_it_fails(&comparison.where_it_fails)
    )
}

/// Where a model fails: a line for each statement, each with a line's end before it.
pub(crate) fn where_it_fails(statements: &[Statement]) -> String {
    statements
        .iter()
        .map(|s| format!("\nwhere it fails: {}", s.statement))
        .collect()
}

/// The signal with the greatest relative error.
fn worst(signals: &[SignalScore]) -> Option<&SignalScore> {
    signals
        .iter()
        .filter(|s| s.nrmse.is_finite())
        .max_by(|a, b| a.nrmse.total_cmp(&b.nrmse))
}

/// The name of run number `at`, or its number from 1 where it has none.
pub fn run_name(name: &str, at: usize) -> String {
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
    fn the_summary_names_the_worst_signal() {
        let mut comparison = comparison(vec![]);
        comparison.signals = scores();
        comparison.nrmse = 0.079;
        comparison.fit_percent = 92.1;
        assert_eq!(
            summary(&comparison).join(" "),
            "Free run: error 7.90 % of the standard deviation, fit 92.10 %. \
             The worst signal is linear_velocity: 0.013 m/s rms."
        );
        comparison.nrmse = 2.34;
        comparison.fit_percent = -134.0;
        assert!(summary(&comparison)[0].ends_with(
            "error 234.00 % of the standard deviation, fit -134.00 %, worse than a constant."
        ));
        comparison.fit_percent = f64::NAN;
        assert!(summary(&comparison)[0].contains("has no score"));
        comparison.signals.clear();
        assert!(summary(&comparison)[0].contains("Nothing is measured"));
    }

    #[test]
    fn the_text_has_a_row_for_each_signal() {
        let text = text(&comparison(vec![]));
        for line in [
            "  linear_velocity     0.013 m/s  10.10 %  89.90 %          1.12 %",
            "where it fails: the mean residual of linear_velocity",
        ] {
            assert!(text.contains(line), "{text}");
        }
    }
}
