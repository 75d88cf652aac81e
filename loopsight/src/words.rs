//! What the answers say in words.

use loopsight_diagnosis::{Comparison, Conclusion, Diagnosis, Fit, Plan, Promise};
use loopsight_recordings::{Fault, Severity};
use loopsight_report::ASTRAY;

use crate::answers::{RunAnswer, Tracking};

/// Six significant digits, without needless zeros.
pub(crate) fn number(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return format!("{value}");
    }
    let magnitude = value.abs().log10().floor();
    if !(-4.0..7.0).contains(&magnitude) {
        return format!("{value:.4e}");
    }
    let decimals = (5.0 - magnitude).max(0.0) as usize;
    let text = format!("{value:.decimals$}");
    if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        text
    }
}

/// Per cent with a sensible number of digits.
pub(crate) fn percent(value: f64) -> String {
    if value.is_nan() {
        "-".to_owned()
    } else if value > ASTRAY {
        format!("> {:.0} %", 100.0 * ASTRAY)
    } else {
        format!("{:.2} %", 100.0 * value)
    }
}

/// A line for each fault.
pub(crate) fn faults(faults: &[Fault]) -> String {
    let mut text = String::new();
    for fault in faults {
        let word = match fault.severity() {
            Severity::Note => "note",
            Severity::Warning => "warning",
            Severity::Fatal => "fault",
        };
        text.push_str(&format!("{word}: {fault}\n"));
    }
    text
}

/// How well a model does.
pub(crate) fn comparison(comparison: &Comparison) -> String {
    format!(
        "free run: error {} of the standard deviation, fit {:.2} %",
        percent(comparison.nrmse),
        comparison.fit_percent,
    )
}

/// What a fit came to.
pub(crate) fn fit(fit: &Fit) -> String {
    format!(
        "error on the fitted log: {}{}",
        fit.nrmse_before
            .map_or_else(String::new, |b| format!("{} before, ", percent(b))),
        percent(fit.nrmse_fit)
    )
}

/// The conclusion of a diagnosis.
pub(crate) fn diagnosis(diagnosis: &Diagnosis) -> String {
    let nominal = percent(diagnosis.nominal.nrmse);
    match (diagnosis.verdict, diagnosis.candidates.first()) {
        (Conclusion::EffectMissing, Some(best)) => format!(
            "The model lacks {} at {}: with it the free-run error falls from {nominal} to {} (noise alone: {}).",
            best.place.effect,
            best.place.at.join(" and "),
            percent(best.nrmse),
            percent(diagnosis.floor.nrmse)
        ),
        (Conclusion::UnknownEffect, _) => format!(
            "Something is missing (error {nominal}, noise alone {}), and nothing in the library is it.",
            percent(diagnosis.floor.nrmse)
        ),
        (Conclusion::LogFaulty, _) => "The log is faulty: nothing was fitted.".to_owned(),
        (Conclusion::DataInsufficient, _) => {
            "The recording cannot carry the model: nothing was fitted.".to_owned()
        }
        (Conclusion::Cancelled, _) => "The diagnosis was cancelled.".to_owned(),
        _ => format!(
            "Nothing is missing: the error of {nominal} is what noise and resolution leave ({}).",
            percent(diagnosis.floor.nrmse)
        ),
    }
}

/// What an experiment is and why.
pub(crate) fn plan(plan: &Plan) -> String {
    match plan.verdict {
        Promise::CannotBeSeparated => plan.reason.clone(),
        _ => format!("run for {} s: {}", plan.duration_s, plan.reason),
    }
}

/// What a run came to.
pub(crate) fn run(run: &RunAnswer) -> String {
    format!(
        "{} ticks in {} s: {}",
        run.ticks,
        number(run.duration_s),
        run.end
    )
}

/// How a signal followed the steps of its reference, where it had any.
pub(crate) fn reached(tracking: &Tracking) -> Option<String> {
    let steps = &tracking.steps;
    let settled: Vec<f64> = steps.iter().filter_map(|s| s.settling_time_s).collect();
    if steps.is_empty() {
        return None;
    }
    let overshoot: Vec<f64> = steps.iter().map(|s| s.overshoot_percent).collect();
    Some(format!(
        "{}: {} of {} steps came to stay within 2 %{}; overshoot {:.1} % (median)",
        tracking.id,
        settled.len(),
        steps.len(),
        median(settled).map_or_else(String::new, |m| format!(", after {m:.3} s (median)")),
        median(overshoot).unwrap_or(f64::NAN)
    ))
}

fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}

/// How a robot took what it was told.
#[cfg(feature = "serial")]
pub(crate) fn sent(answer: &crate::answers::SendAnswer) -> String {
    let ends = match (answer.runs, answer.interrupted) {
        (true, _) => "drives on with it",
        (false, true) => "took it; it was driving, and came to rest",
        (false, false) => "took it, and is at rest",
    };
    format!(
        "the robot at {} ({}, every {} s) {ends}",
        answer.line,
        answer.plant,
        number(answer.period_s)
    )
}
