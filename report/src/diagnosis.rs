//! The page of a diagnosis: what the model lacks, and the evidence.

use loopsight_diagnosis::{Advice, Comparison, Conclusion, Diagnosis, Statement};

use crate::beside::{self, Names};
use crate::candidates;
use crate::comparison::faults;
use crate::conclusion::conclusion;
use crate::html::{escape, marked, sentence, text};
use crate::next;
use crate::page::{Context, page, section};
use crate::residual_force::residual_force;
use crate::words::diagnosis::{not_tried, said, with_effect};
use crate::words::{percent, recordings};

/// The page of a diagnosis: the verdict, the model `before` and `after` the best explanation was added,
/// compared with the same measurements, where it fails, every explanation that was tried, and what to do
/// next.
///
/// `before` is the comparison of [`Diagnosis::model`], `after` that of the best explanation's
/// model; either may be absent.
pub fn diagnosis_page(
    context: &Context,
    diagnosis: &Diagnosis,
    before: Option<&Comparison>,
    after: Option<&Comparison>,
) -> String {
    let mut body = conclusion(&said(diagnosis), diagnosis.verdict);
    body.push_str(&faults(&diagnosis.faults));
    let with = with_effect(diagnosis);
    let names = Names {
        before: "the model as it is",
        after: &with,
    };
    // Where nothing is missing, what a needless effect does is of no interest.
    let after = after.filter(|_| diagnosis.verdict != Conclusion::NothingMissing);
    if let Some(before) = before {
        body.push_str(&against_measurements(before, after, names));
    }
    let title = match diagnosis.verdict {
        Conclusion::NothingMissing => "What is left of the error",
        _ => "Where it fails",
    };
    body.push_str(&failures(
        title,
        &diagnosis.where_it_fails,
        before,
        after,
        names,
    ));
    body.push_str(&residual_force(diagnosis.residual_force.as_ref()));
    if candidates::were_tried(diagnosis) {
        let note = match diagnosis.candidates[..] {
            [] => TRIED.to_owned(),
            _ => about_candidates(),
        };
        body.push_str(&section(
            "What could be missing",
            &note,
            &(candidates::candidates(diagnosis) + &untried(diagnosis)),
        ));
    }
    body.push_str(&advice(&diagnosis.advice));
    body.push_str(&section(
        "What to do next",
        "",
        &next::list(&next::after_diagnosis(context, diagnosis)),
    ));
    body.push_str(TERMS);
    page(context, &body)
}

/// The effects that were not tried.
fn untried(diagnosis: &Diagnosis) -> String {
    not_tried(diagnosis).map_or_else(String::new, |sentence| {
        format!("<p>{}</p>\n", escape(&sentence))
    })
}

/// How the explanations are found.
const TRIED: &str = "Every effect that the log can show was tried at every place where it fits: one step of a fit says what \
    it promises.";

/// How the list of them is made.
const FITTED: &str = "Where it promised most, all parameters were fitted again, and the free run was judged on \
    data that the fit did not see. The first candidate is the simplest that is not clearly worse than the best. The others \
    follow by their error. Tap a candidate to see what it is and what helps against it.";

/// What is to be seen in a list of explanations.
pub(crate) fn about_candidates() -> String {
    format!("{TRIED} {FITTED}")
}

/// Measured and models over time.
pub(crate) fn against_measurements(
    before: &Comparison,
    after: Option<&Comparison>,
    names: Names,
) -> String {
    let title = match after {
        Some(_) => "Before and after, compared with the measurements",
        None => "The model compared with the measurements",
    };
    section(
        title,
        "Both are free runs: simulated from the inputs alone, with fitted parameters. Below each signal is its \
         residual, the measurement minus the model. The flatter it is, the better.",
        &beside::over_time(before, after, names),
    )
}

/// Where the model fails: statements with their shares, then the residual's dependences.
pub(crate) fn failures(
    title: &str,
    statements: &[Statement],
    before: Option<&Comparison>,
    after: Option<&Comparison>,
    names: Names,
) -> String {
    let mut body = shares(statements);
    if let Some(before) = before {
        let lines = match after {
            Some(_) => {
                "The lines are the means of the samples nearby with their standard deviations, before \
                 (orange) and after (blue)."
            }
            None => "The line is the mean of the samples nearby with their standard deviation.",
        };
        body.push_str(&format!(
            "<h3 class=\"part\">What the residual depends on</h3>\n<p class=\"what\">Grey dots are samples \
             of the model as it is. {lines} A line along zero leaves nothing to explain. A jump at zero is \
             typical of friction, a slope of a wrong gain, waves of something that turns with the wheel.</p>\n{}",
            beside::dependences(before, after, names)
        ));
    }
    if body.is_empty() {
        return String::new();
    }
    section(
        title,
        "This is the error of the model as it is, with the parameters that fit this log best.",
        &body,
    )
}

/// Statements with bars for their shares of the squared error.
pub(crate) fn shares(statements: &[Statement]) -> String {
    if statements.is_empty() {
        return String::new();
    }
    let rows: String = statements
        .iter()
        .map(|s| {
            let share = s.share_of_squared_error;
            let width = if share.is_finite() {
                (100.0 * share).clamp(0.0, 100.0)
            } else {
                0.0
            };
            format!(
                "<li><svg viewBox=\"0 0 100 10\" preserveAspectRatio=\"none\" aria-hidden=\"true\">\
                 <rect class=\"ground\" x=\"0\" y=\"2\" width=\"100\" height=\"6\"/>\
                 <rect class=\"error\" x=\"0\" y=\"2\" width=\"{width:.1}\" height=\"6\"/></svg>\
                 <b>{}</b><span>{}</span></li>",
                text(&percent(share)),
                marked(&sentence(&s.statement))
            )
        })
        .collect();
    format!(
        "<ul class=\"shares\">{rows}</ul>\n<p class=\"what\">Each bar is a share of the squared error. Two \
         sentences may speak of the same error.</p>\n"
    )
}

/// What to record.
pub(crate) fn advice(advice: &[Advice]) -> String {
    if advice.is_empty() {
        return String::new();
    }
    let items: String = recordings(advice)
        .iter()
        .map(|r| {
            let reasons: String = r
                .because
                .iter()
                .map(|why| format!("<br>{}", marked(&format!("Because {why}."))))
                .collect();
            format!(
                "<li><b>{}</b>{reasons}</li>",
                marked(&sentence(&r.experiment))
            )
        })
        .collect();
    section(
        "What to record next",
        "",
        &format!("<ul class=\"advice\">{items}</ul>\n"),
    )
}

/// The words of the page.
pub(crate) const TERMS: &str = "<details><summary>What the words mean</summary><dl class=\"terms\">\
    <dt>Free run</dt><dd>The model is simulated from the measured inputs alone, from an estimated initial state. \
    It never sees the measurement, so its errors add up and show.</dd>\
    <dt>Error (nrmse)</dt><dd>Root mean square of measurement minus model, divided by the standard deviation of \
    the measurement. Over all signals it is the root mean square of theirs. 0 % is perfect, 100 % is no better \
    than a constant.</dd>\
    <dt>Data that the model was not fitted to</dt><dd>Validation data: the test log, or parts of the log that were \
    held out of the fit. A model that is too large does well on the data it was fitted to, and fails there.</dd>\
    <dt>What noise and resolution would leave</dt><dd>The error of the true model: it comes from the noise of the \
    sensors and the steps of the encoders. No model does better.</dd>\
    <dt>Significance</dt><dd>How many standard errors the effect is from no effect. Among a hundred candidates \
    chance often makes 2, and hardly ever 4.</dd>\
    <dt>95 % interval</dt><dd>If the model is right, the interval contains the true value in 95 of 100 such \
    logs.</dd>\
    <dt>Could be this instead</dt><dd>An effect that explains these data equally well. Another log has to \
    decide.</dd></dl></details>\n";
