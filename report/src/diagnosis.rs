//! The page of a diagnosis: what the model lacks, and the evidence.

use loopsight_diagnosis::{Advice, Comparison, Conclusion, Diagnosis, Statement};

use crate::beside::{self, Names};
use crate::candidates;
use crate::comparison::faults;
use crate::conclusion::{effect_name, found, of_diagnosis};
use crate::html::{marked, sentence};
use crate::next;
use crate::numbers::percent;
use crate::page::{Context, page, section};
use crate::residual_force::residual_force;

/// The page of a diagnosis: the verdict, the model `before` and `after` the best explanation was
/// added, held against the same measurements, where it fails, every explanation that was tried,
/// and what to do next.
///
/// `before` is the comparison of [`Diagnosis::model`], `after` that of the best explanation's
/// model; either may be absent.
pub fn diagnosis_page(
    context: &Context,
    diagnosis: &Diagnosis,
    before: Option<&Comparison>,
    after: Option<&Comparison>,
) -> String {
    let mut body = of_diagnosis(diagnosis).html();
    body.push_str(&faults(&diagnosis.faults, "fitted"));
    let with = match (found(diagnosis), diagnosis.candidates.first()) {
        (Some(best), _) => format!("with {}", effect_name(&best.place.effect)),
        (None, Some(nearest)) => {
            format!("with {}, the nearest", effect_name(&nearest.place.effect))
        }
        (None, None) => "after".into(),
    };
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
    if !diagnosis.candidates.is_empty() {
        body.push_str(&section(
            "What could be missing",
            CANDIDATES,
            &candidates::candidates(diagnosis),
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

/// What is to be seen in a list of explanations.
pub(crate) const CANDIDATES: &str = "Every effect of the library was added to the model at every \
    place it fits, all parameters were fitted anew, and the free run was judged on data that the \
    fit did not see. First stands the simplest that is not clearly worse than the best, then the \
    others by their error; tap one to unfold what it is and what helps against it.";

/// Measured and models over time.
pub(crate) fn against_measurements(
    before: &Comparison,
    after: Option<&Comparison>,
    names: Names,
) -> String {
    let title = match after {
        Some(_) => "Before and after, against the measurements",
        None => "The model against the measurements",
    };
    section(
        title,
        "Free run: simulated from the inputs alone, with fitted parameters. Beneath each signal \
         its residual, measured less model: the flatter, the better.",
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
                "lines: mean and standard deviation of the samples nearby, before (orange) and after (blue)"
            }
            None => "line: mean and standard deviation of the samples nearby",
        };
        body.push_str(&format!(
            "<h3 class=\"part\">What the residual depends on</h3>\n<p class=\"what\">Grey dots: \
             samples of the model as it is; {lines}. A line along zero means: nothing left to \
             explain. A jump at zero is typical of friction, a slope of a wrong gain, waves of \
             something that turns with the wheel.</p>\n{}",
            beside::dependences(before, after, names)
        ));
    }
    if body.is_empty() {
        return String::new();
    }
    section(
        title,
        "Of the model as it is, with the best parameters it can have on this log.",
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
                percent(share),
                marked(&sentence(&s.statement))
            )
        })
        .collect();
    format!(
        "<ul class=\"shares\">{rows}</ul>\n<p class=\"what\">Bars: share of the squared error that \
         the sentence speaks of; sentences may speak of the same error.</p>\n"
    )
}

/// What to record.
pub(crate) fn advice(advice: &[Advice]) -> String {
    if advice.is_empty() {
        return String::new();
    }
    // One experiment may answer several questions.
    let mut experiments: Vec<(&str, Vec<&str>)> = Vec::new();
    for a in advice {
        match experiments.iter_mut().find(|(e, _)| *e == a.experiment) {
            Some((_, reasons)) => reasons.push(&a.why),
            None => experiments.push((&a.experiment, vec![&a.why])),
        }
    }
    let items: String = experiments
        .iter()
        .map(|(experiment, reasons)| {
            let reasons: String = reasons
                .iter()
                .map(|why| format!("<br>{}", marked(&format!("Because {why}."))))
                .collect();
            format!("<li><b>{}</b>{reasons}</li>", marked(&sentence(experiment)))
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
    <dt>Free run</dt><dd>The model simulated from the measured inputs alone, from an estimated \
    initial state; it never sees the measurement on the way, so errors add up and show.</dd>\
    <dt>Error (nrmse)</dt><dd>Root mean square of measured less model, divided by the standard \
    deviation of what was measured; over all signals, the root mean square of theirs. 0 % is \
    perfect, 100 % is no better than a constant.</dd>\
    <dt>Data not fitted to</dt><dd>The test recording, or where none is given parts of the log that \
    were kept back from the fit. A needlessly large model shines on what it was fitted to and fails \
    there.</dd>\
    <dt>Noise and resolution alone (floor)</dt><dd>The error that the true model would have: what \
    the noise of the sensors and the steps of the encoders leave. An error near it cannot be \
    improved.</dd>\
    <dt>Significance</dt><dd>How many standard errors the effect is away from doing nothing. Chance \
    makes 2 often, 4 hardly ever among a hundred candidates.</dd>\
    <dt>95 % interval</dt><dd>Holds the true value in 95 of 100 such recordings, if the model is \
    right.</dd>\
    <dt>Not told apart</dt><dd>Effects that explain these data equally well. Which of them it is, \
    another recording has to say.</dd></dl></details>\n";
