//! What the pictures show, in sentences with numbers.

use loopsight_diagnosis::{Comparison, RunTrace, SignalScore};

use crate::errors::{AFTER_CHANGE, Errors, Motion};
use crate::numbers::{percent, quantity, show, signed, tenths};

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

/// Where the free run of a signal errs.
pub(crate) fn where_it_fails(unit: &str, errors: &Errors, runs: &[RunTrace]) -> Vec<String> {
    if errors.all.count == 0 {
        return vec!["There is no measurement to compare with.".into()];
    }
    let motion = Motion::of(unit);
    vec![by_direction(unit, motion, errors)]
        .into_iter()
        .chain(after_change(motion, errors))
        .chain(worst_run(errors, runs))
        .collect()
}

fn by_direction(unit: &str, motion: Motion, errors: &Errors) -> String {
    let (forwards, backwards) = match (motion, unit) {
        (Motion::Speed, "m/s") => ("forwards", "backwards"),
        (Motion::Speed, _) => ("in the positive direction", "in the negative direction"),
        (Motion::Position, _) => ("while it increases", "while it decreases"),
        (Motion::Sign, _) => ("while it is positive", "while it is negative"),
    };
    let with_unit = |mean: f64| quantity(&signed(mean, 2), unit);
    let all = with_unit(errors.all.value());
    match (errors.forwards.count, errors.backwards.count) {
        (0, 0) => format!("Mean residual {all}; the signal stays at zero."),
        (_, 0) => format!("Mean residual {all}; nothing was measured {backwards}."),
        (0, _) => format!("Mean residual {all}; nothing was measured {forwards}."),
        _ => format!(
            "Mean residual {} {forwards}, {} {backwards} ({all} over all samples).",
            with_unit(errors.forwards.value()),
            with_unit(errors.backwards.value()),
        ),
    }
}

fn after_change(motion: Motion, errors: &Errors) -> Option<String> {
    let change = match motion {
        Motion::Sign => "change of sign",
        Motion::Speed | Motion::Position => "change of direction",
    };
    if errors.changes == 0 {
        return Some(format!("There is no {change} in this log."));
    }
    errors.after_change.is_finite().then(|| {
        format!(
            "{} of the squared error lies within {AFTER_CHANGE} s after a {change} ({} of them, \
             {} of the samples).",
            percent(errors.after_change),
            errors.changes,
            percent(errors.samples_after_change),
        )
    })
}

/// The run that holds much more of the error than its share.
fn worst_run(errors: &Errors, runs: &[RunTrace]) -> Option<String> {
    let samples: usize = runs.iter().map(|r| r.time.len()).sum();
    let (at, share) = errors
        .by_run
        .iter()
        .copied()
        .enumerate()
        .max_by(|a, b| a.1.total_cmp(&b.1))?;
    let of_samples = runs.get(at)?.time.len() as f64 / samples as f64;
    (runs.len() > 1 && share > 1.5 * of_samples).then(|| {
        format!(
            "Run {} holds {} of the squared error and {} of the samples.",
            run_name(&runs[at].name, at),
            percent(share),
            percent(of_samples)
        )
    })
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
    use crate::errors::errors;
    use crate::fixtures::{comparison, friction_runs, scores};

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

    #[test]
    fn friction_is_told_by_direction() {
        let runs = friction_runs(1, 2000);
        let said = where_it_fails("m/s", &errors(&runs, "linear_velocity"), &runs);
        assert!(said[0].starts_with("Mean residual −0.0"), "{said:?}");
        assert!(said[0].contains("m/s forwards, +0.0"), "{said:?}");
        assert!(
            said[1].contains("% of the squared error lies within 0.1 s after"),
            "{said:?}"
        );
    }

    #[test]
    fn what_was_not_measured_is_said() {
        let mut runs = friction_runs(1, 50);
        let said = where_it_fails("m/s", &errors(&runs, "no_such"), &runs);
        assert_eq!(said, ["There is no measurement to compare with."]);
        runs[0].signals[0].measured.fill(1.0);
        let said = where_it_fails("m/s", &errors(&runs, "linear_velocity"), &runs);
        assert!(
            said[0].ends_with("nothing was measured backwards."),
            "{said:?}"
        );
        assert_eq!(said[1], "There is no change of direction in this log.");
    }

    #[test]
    fn a_bad_run_is_named() {
        let mut runs = friction_runs(3, 500);
        runs[1].signals[0]
            .free_run
            .iter_mut()
            .for_each(|v| *v += 5.0);
        let said = where_it_fails("m/s", &errors(&runs, "linear_velocity"), &runs);
        assert!(said[2].starts_with("Run run-2 holds"), "{said:?}");
    }
}
