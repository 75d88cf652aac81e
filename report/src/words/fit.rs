//! What a fit found.

use std::collections::BTreeMap;

use loopsight_diagnosis::{Estimate, Fit, Method, OfRun, ParameterVerdict};
use loopsight_model::model::{Model, Origin, Unshown};

use super::comparison;
use super::number::{error, number};
use super::table::table;

/// What a fit comes to, sentence by sentence: how the error fell, what it is on a test log, and which
/// parameters the data do not pin.
pub fn summary(fit: &Fit) -> Vec<String> {
    let mut said = how_it_went(fit);
    said.extend(
        by_verdict(&fit.parameters)
            .iter()
            .filter(|(verdict, _)| {
                !matches!(
                    verdict,
                    ParameterVerdict::Good
                        | ParameterVerdict::Frozen
                        | ParameterVerdict::Tied
                        | ParameterVerdict::Unfinished
                )
            })
            .map(|(verdict, names)| format!("{}: {}.", names.join(", "), verdict.text())),
    );
    said.extend(not_shown(&fit.model));
    said.extend(from_the_log(&fit.model));
    said.extend(fit.flat.iter().map(|flat| not_determined(flat) + "."));
    said
}

/// That a fit did not converge, why, and what was tried; none where it did.
pub fn not_converged(fit: &Fit) -> Option<String> {
    let convergence = fit.convergence.as_ref()?;
    let reason = convergence.reason.as_ref()?;
    let starts = convergence.starts.iter();
    let tried: Vec<String> = starts
        .map(|start| format!("{} ({})", start.from, error(start.nrmse)))
        .collect();
    Some(format!(
        "the fit did not converge: {reason}; tried: {}",
        tried.join(", ")
    ))
}

/// The parts of a plant that a log does not show, and what they were taken for.
pub(crate) fn not_shown(model: &Model) -> Vec<String> {
    let sentence = |part: &Unshown| {
        let ties: Vec<String> = part
            .ties
            .iter()
            .map(|tie| format!("{} = {tie}", tie.parameter))
            .collect();
        format!(
            "The log does not show {}: {} were assumed, as if {}.",
            part.what,
            ties.join(" and "),
            part.because
        )
    };
    model.tied_parts().map(sentence).collect()
}

/// Values that the model file leaves open and a fit does not estimate, which were taken from the log.
fn from_the_log(model: &Model) -> Vec<String> {
    let parameters = model.parameters.iter();
    parameters
        .filter(|p| p.origin == Origin::Log)
        .filter_map(|p| {
            let value = number(p.value?);
            let what = if p.is_time() { "rate" } else { "speed" };
            Some(format!(
                "{} = {value} {}, which the model file leaves open, suits the {what} in the log.",
                p.name, p.unit
            ))
        })
        .collect()
}

/// How the error fell, and what it is on a test log where there is one.
pub(crate) fn how_it_went(fit: &Fit) -> Vec<String> {
    let mut said = vec![error_fell(fit)];
    said.extend(not_converged(fit).map(|why| sentence(&why)));
    let (fitted, judged) = (fit.nrmse_fit, fit.comparison.nrmse);
    if judged.is_finite() && (judged - fitted).abs() > 1e-9 * fitted {
        said.push(format!(
            "On the test log, which the fit did not see, it is {}.",
            error(judged)
        ));
    }
    said
}

/// Words as a sentence.
fn sentence(words: &str) -> String {
    let mut letters = words.chars();
    let first = letters.next().map(|c| c.to_uppercase().to_string());
    format!("{}{}.", first.unwrap_or_default(), letters.as_str())
}

/// How the error on the fitted log fell.
fn error_fell(fit: &Fit) -> String {
    let n = fit.iterations;
    let how = match (fit.method, fit.cancelled) {
        (Method::Rls, false) => format!("Recursive least squares over {n} samples"),
        (Method::OutputError, false) => format!("Output-error fit, {n} iterations"),
        (Method::Rls, true) => format!("The fit was cancelled after {n} samples"),
        (Method::OutputError, true) => format!("The fit was cancelled after {n} iterations"),
    };
    let after = fit.nrmse_fit;
    let change = match fit.nrmse_before {
        Some(before) if error(before) == error(after) => "stayed at".to_owned(),
        Some(before) if before < after => format!("rose from {} to", error(before)),
        Some(before) => format!("fell from {} to", error(before)),
        None => "is now".to_owned(),
    };
    format!(
        "{how}: the free-run error on the log {change} {}.",
        error(after)
    )
}

/// Parameters by what the data say of them, in the order of their names.
fn by_verdict(parameters: &BTreeMap<String, Estimate>) -> Vec<(ParameterVerdict, Vec<&str>)> {
    let mut verdicts: Vec<(ParameterVerdict, Vec<&str>)> = Vec::new();
    for (name, p) in parameters {
        match verdicts
            .iter_mut()
            .find(|(verdict, _)| *verdict == p.verdict)
        {
            Some((_, names)) => names.push(name),
            None => verdicts.push((p.verdict, vec![name])),
        }
    }
    verdicts
}

/// A combination of parameters that the data leave open.
pub fn not_determined(combination: &str) -> String {
    format!("Not determined by these data: {combination}")
}

/// A fit for a terminal: the parameters, what the data say of them, how the error fell, and the fitted model
/// compared with the log, or with the log called `test`.
pub fn text(fit: &Fit, test: Option<&str>) -> String {
    let judged = match test {
        Some(test) => format!("\n\non {test}, which it was not fitted to:\n"),
        None => "\n\n".to_owned(),
    };
    found(fit) + &judged + &comparison::text(&fit.comparison)
}

/// The parameters, what the data say of them, and how the error fell.
pub(crate) fn found(fit: &Fit) -> String {
    let mut text = estimates("parameter", &fit.parameters);
    // Below the table: beside it, they would make it wider than a terminal.
    for (verdict, names) in by_verdict(&fit.parameters) {
        text.push_str(&format!("\n{}: {}", verdict.text(), names.join(", ")));
    }
    for said in (fit.flat.iter().map(|flat| not_determined(flat))).chain(from_the_log(&fit.model)) {
        text.push_str(&format!("\n{said}"));
    }
    if !fit.per_run.is_empty() {
        text.push_str(&format!(
            "\n\n{}",
            estimates("in each run", &in_each_run(fit))
        ));
    }
    if !fit.derived.is_empty() {
        text.push_str(&format!("\n\n{}", estimates("derived", &fit.derived)));
    }
    format!("{text}\n\n{}", error_fell(fit))
}

/// What differs from run to run, by parameter and run.
pub(crate) fn in_each_run(fit: &Fit) -> BTreeMap<String, Estimate> {
    let of = |(name, runs): (&String, &Vec<OfRun>)| {
        let each = runs.iter().enumerate().map(|(k, of)| {
            let run = match of.run.as_str() {
                "" => format!("run {}", k + 1),
                named => named.to_owned(),
            };
            (format!("{name}, {run}"), of.estimate.clone())
        });
        each.collect::<Vec<_>>()
    };
    fit.per_run.iter().flat_map(of).collect()
}

fn estimates(head: &str, estimates: &BTreeMap<String, Estimate>) -> String {
    let row = |(name, p): (&String, &Estimate)| {
        vec![
            name.clone(),
            number(p.value),
            p.unit.clone(),
            p.std_error
                .map_or_else(|| "-".to_owned(), |e| format!("{e:.2e}")),
            p.interval95.map_or_else(
                || "-".to_owned(),
                |[low, high]| format!("{} … {}", number(low), number(high)),
            ),
        ]
    };
    let rows: Vec<Vec<String>> = estimates.iter().map(row).collect();
    table(
        &[head, "value", "unit", "std error", "95 % interval"],
        &rows,
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::findings::improvement;
    use loopsight_diagnosis::{Conclusion, Convergence, Tried};

    #[test]
    fn the_summary_says_what_is_not_pinned() {
        let mut fit = improvement(Conclusion::NothingMissing).best.unwrap();
        fit.nrmse_before = Some(0.21);
        fit.flat = vec!["K_E + 0.3·K_B".into()];
        assert_eq!(
            summary(&fit),
            [
                "Output-error fit, 3 iterations: the free-run error on the log fell from 21.0 % to 2.00 %.",
                "On the test log, which the fit did not see, it is 7.90 %.",
                "K_B: interval wider than the value.",
                "K_E: no influence on what is measured here.",
                "coulomb_friction.level: at the end of its range.",
                "Not determined by these data: K_E + 0.3·K_B.",
            ]
        );
        fit.convergence = Some(Convergence {
            converged: false,
            reason: Some("the error was still falling at the last iteration".into()),
            starts: vec![Tried {
                from: "the file's values".into(),
                nrmse: 0.4,
            }],
        });
        assert_eq!(
            summary(&fit)[1],
            "The fit did not converge: the error was still falling at the last iteration; tried: the file's values (40.0 %)."
        );
        fit.convergence = None;
        fit.nrmse_before = Some(0.01);
        assert!(summary(&fit)[0].contains("rose from 1.00 % to 2.00 %"));
        fit.nrmse_before = Some(0.020_000_1);
        assert!(summary(&fit)[0].contains("on the log stayed at 2.00 %"));
        fit.nrmse_before = None;
        assert!(summary(&fit)[0].contains("on the log is now 2.00 %"));
    }

    #[test]
    fn the_text_groups_parameters_by_what_the_data_say() {
        let fit = improvement(Conclusion::NothingMissing).best.unwrap();
        let text = text(&fit, Some("b.csv"));
        for line in [
            "\npinned by the data: K_A, K_C, K_D\n",
            "\n\non b.csv, which it was not fitted to:\nFree run: error",
        ] {
            assert!(text.contains(line), "{text}");
        }
    }
}
