//! What a diagnosis concludes.

use loopsight_diagnosis::{Conclusion, Diagnosis, EffectAt, Explanation};

use super::advice;
use super::comparison::where_it_fails;
use super::faults::faults;
use super::force;
use super::moved::moved;
use super::number::{error, hundredths, number};
use super::place::{enumerated, place, place_in_brackets, place_in_table, what_it_is};
use super::table::table;

/// A conclusion in sentences.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Said {
    /// The sentence that counts.
    pub headline: String,
    /// The numbers behind it.
    pub because: Vec<String>,
    /// What the data leave open.
    pub open: Vec<String>,
}

impl Said {
    /// All sentences in order.
    pub fn sentences(self) -> Vec<String> {
        let mut all = vec![self.headline];
        all.extend(self.because);
        all.extend(self.open);
        all
    }
}

/// What a diagnosis comes to, sentence by sentence; the first alone says the conclusion.
pub fn summary(diagnosis: &Diagnosis) -> Vec<String> {
    said(diagnosis).sentences()
}

/// What a diagnosis comes to, its parts apart.
pub fn said(diagnosis: &Diagnosis) -> Said {
    let (headline, mut because) = match diagnosis.verdict {
        Conclusion::EffectMissing => effect_missing(diagnosis),
        Conclusion::NothingMissing => nothing_missing(diagnosis),
        Conclusion::UnknownEffect => unknown_effect(diagnosis),
        Conclusion::DataInsufficient => data_insufficient(diagnosis),
        Conclusion::LogFaulty => (
            "The log is faulty, so it says nothing about the model.".to_owned(),
            vec!["Nothing was fitted to it.".to_owned()],
        ),
        Conclusion::NotFitted => not_fitted(diagnosis),
        Conclusion::Cancelled => (
            "The diagnosis was cancelled.".to_owned(),
            vec!["What was tried until then allows no conclusion.".to_owned()],
        ),
    };
    because.extend(diagnosis.model.iter().flat_map(super::fit::not_shown));
    because.extend(
        diagnosis
            .observer
            .as_ref()
            .map(|observer| format!("Note: {}.", observer.statement)),
    );
    Said {
        headline,
        because,
        open: open(diagnosis),
    }
}

/// Error over the floor above which an effect explains only a part of it.
const PART: f64 = 1.5;

fn effect_missing(diagnosis: &Diagnosis) -> (String, Vec<String>) {
    let Some(missing) = &diagnosis.missing else {
        return ("The model lacks an effect.".into(), Vec::new());
    };
    let mut because = Vec::new();
    let what = what_it_is(&missing.effect);
    if !what.is_empty() {
        because.push(format!("That is: {what}."));
    }
    let second = found(diagnosis).and_then(|best| best.together_with.as_ref());
    if let Some(second) = second {
        let what = what_it_is(&second.effect);
        if !what.is_empty() {
            because.push(format!("And: {what}."));
        }
        because.push("Neither explains the error alone.".to_owned());
    }
    if let Some(best) = found(diagnosis) {
        let with = if second.is_some() { "both" } else { "it" };
        let fit = [diagnosis.nominal_fit, best.nrmse_fit];
        because.push(format!(
            "{} Noise and resolution alone would leave {}.",
            moved(with, fit, [diagnosis.nominal.nrmse, best.nrmse]),
            error(diagnosis.floor.nrmse)
        ));
    }
    // The conclusion calls an error above half as much again too large for noise.
    let far = |best: &Explanation| best.nrmse > PART * diagnosis.floor.nrmse;
    let what = match second {
        Some(second) => format!("{} and {}", place(missing), place(second)),
        None => place(missing),
    };
    let headline = match (found(diagnosis).is_some_and(far), second) {
        (true, Some(_)) => {
            format!("The model lacks {what}, which together explain part of the error.")
        }
        (true, None) => format!("The model lacks {what}, which explains part of the error."),
        (false, _) => format!("The model lacks {what}."),
    };
    (headline, because)
}

fn nothing_missing(diagnosis: &Diagnosis) -> (String, Vec<String>) {
    let because = vec![
        left(diagnosis),
        "No effect of the library makes a significant difference.".to_owned(),
    ];
    ("Nothing is missing from the model.".to_owned(), because)
}

fn unknown_effect(diagnosis: &Diagnosis) -> (String, Vec<String>) {
    let mut because = vec![left(diagnosis)];
    if let Some(nearest) = diagnosis.candidates.first() {
        because.push(format!(
            "The best candidate is {}. It would leave {}, which is not good enough.",
            place(&nearest.place),
            error(nearest.nrmse)
        ));
    }
    let headline = "Something is missing, and no effect of the library explains it.";
    (headline.to_owned(), because)
}

fn not_fitted(diagnosis: &Diagnosis) -> (String, Vec<String>) {
    let because = format!(
        "From every start it leaves a free-run error of {}: as much as a constant would, or more.",
        error(diagnosis.nominal.nrmse)
    );
    ("The model could not be fitted.".to_owned(), vec![because])
}

/// What the model as it is leaves, and what noise would.
fn left(diagnosis: &Diagnosis) -> String {
    format!(
        "The free-run error is {}, on data that the model was not fitted to. Noise and resolution alone would \
         leave {}.",
        error(diagnosis.nominal.nrmse),
        error(diagnosis.floor.nrmse)
    )
}

fn data_insufficient(diagnosis: &Diagnosis) -> (String, Vec<String>) {
    if diagnosis.nominal.nrmse.is_finite() {
        let because = format!(
            "The free-run error is {} on the log and {} on the test log, where noise alone would leave {}. \
             The log does not show what makes the difference.",
            error(diagnosis.nominal_fit),
            error(diagnosis.nominal.nrmse),
            error(diagnosis.floor.nrmse)
        );
        let headline = "This log cannot show what is missing.";
        return (headline.to_owned(), vec![because]);
    }
    (
        "This log is not enough to judge the model.".to_owned(),
        vec!["Nothing was fitted: the parameters would be arbitrary.".to_owned()],
    )
}

/// What the data cannot tell from the effect that is missing.
fn open(diagnosis: &Diagnosis) -> Vec<String> {
    let Some(best) = found(diagnosis) else {
        return Vec::new();
    };
    let others: Vec<String> = best
        .indistinguishable_from
        .iter()
        .map(place_in_brackets)
        .collect();
    if others.is_empty() {
        return Vec::new();
    }
    vec![format!(
        "The data cannot tell {} from {}: each explains them. The advice says what to record to tell them apart.",
        place_in_brackets(&best.place),
        enumerated(&others),
    )]
}

/// The explanation that a diagnosis believes.
pub(crate) fn found(diagnosis: &Diagnosis) -> Option<&Explanation> {
    let missing = diagnosis.missing.as_ref()?;
    diagnosis.candidates.iter().find(|c| c.place == *missing)
}

/// A diagnosis for a terminal: faults, summary, a table of the explanations, where the model fails, advice,
/// and the force that is missing.
pub fn text(diagnosis: &Diagnosis) -> String {
    let mut text = faults(&diagnosis.faults) + &summary(diagnosis).join("\n");
    if !diagnosis.candidates.is_empty() {
        let rows: Vec<Vec<String>> = diagnosis.candidates.iter().map(row).collect();
        let head = ["explanation", "error", "significance", "parameters"];
        text.push_str(&format!("\n\n{}\n", table(&head, &rows)));
    }
    if let Some(sentence) = not_tried(diagnosis) {
        text.push_str(&format!("\n{sentence}\n"));
    }
    text.push_str(&where_it_fails(&diagnosis.where_it_fails));
    text.push_str(&advice::lines(&diagnosis.advice));
    text.push_str(&force::text(diagnosis.residual_force.as_ref()));
    text
}

/// Which effects were not tried, and why; none where all were.
pub(crate) fn not_tried(diagnosis: &Diagnosis) -> Option<String> {
    let each = diagnosis.not_tried.iter();
    let list: Vec<String> = each.map(|u| format!("{} ({})", u.effect, u.why)).collect();
    (!list.is_empty()).then(|| {
        format!(
            "Not tried, since this log cannot show it: {}.",
            list.join(", ")
        )
    })
}

fn row(explanation: &Explanation) -> Vec<String> {
    let parameters: Vec<String> = explanation
        .parameters
        .iter()
        .map(|(name, p)| format!("{name} {} {}", number(p.value), p.unit))
        .collect();
    let second = explanation.together_with.as_ref();
    let second = second.map_or_else(String::new, |place| format!(" + {}", place_in_table(place)));
    vec![
        place_in_table(&explanation.place) + &second,
        hundredths(explanation.nrmse),
        significance(explanation.significance),
        parameters.join(", "),
    ]
}

/// A number of standard errors: tenths are enough, and beyond a hundred none.
pub(crate) fn significance(standard_errors: f64) -> String {
    if !standard_errors.is_finite() {
        "-".into()
    } else if standard_errors < 99.95 {
        format!("{standard_errors:.1}")
    } else {
        format!("{standard_errors:.0}")
    }
}

/// `with coulomb_friction` for a legend: the effect that is missing, or the one that comes nearest.
pub(crate) fn with_effect(diagnosis: &Diagnosis) -> String {
    let name = |of: &EffectAt| format!("with {}", of.effect);
    match (found(diagnosis), diagnosis.candidates.first()) {
        (Some(best), _) => name(&best.place),
        (None, Some(nearest)) => name(&nearest.place) + ", the best candidate",
        (None, None) => "after".into(),
    }
}
