//! What an improvement came to.

use loopsight_diagnosis::{Conclusion, EffectAt, Improvement, ImprovementStep, ParameterVerdict};

use loopsight_model::model::Attached;

use super::diagnosis::{self, Said};
use super::faults::faults;
use super::moved::moved;
use super::number::{error, hundredths};
use super::place::{enumerated, place, place_in_brackets, place_in_table};
use super::table::table;
use super::{advice, fit, force};

/// What an improvement comes to, sentence by sentence; the first alone says the conclusion.
pub fn summary(improvement: &Improvement) -> Vec<String> {
    said(improvement).sentences()
}

/// What an improvement comes to, its parts apart.
pub fn said(improvement: &Improvement) -> Said {
    let Some(last) = improvement.diagnoses.last() else {
        return Said {
            headline: "There is no diagnosis.".into(),
            ..Said::default()
        };
    };
    let added = added(improvement);
    let (Some(first), Some(end), false) = (
        improvement.steps.first(),
        improvement.steps.last(),
        added.is_empty(),
    ) else {
        let mut said = diagnosis::said(last);
        if improvement.verdict == Conclusion::Cancelled && last.verdict != Conclusion::Cancelled {
            said.because
                .push("The work was cancelled before it was added.".to_owned());
        }
        return said;
    };
    let own = |effect: &EffectAt| {
        let mut steps = improvement.steps.iter().filter(|s| s.entries.is_some());
        let is_own = steps.any(|s| s.added.as_ref().is_some_and(|a| a.effect == effect.effect));
        if is_own { "an effect of its own, " } else { "" }
    };
    let names: Vec<String> = match added.as_slice() {
        [one] => vec![format!("{}{}", own(one), place(one))],
        several => (several.iter())
            .map(|one| format!("{}{}", own(one), place_in_brackets(one)))
            .collect(),
    };
    let with = if names.len() == 1 { "it" } else { "them" };
    let fit = [first, end].map(|step| step.nrmse_fit);
    let unseen = [first, end].map(|step| step.nrmse_test);
    let mut because = vec![moved(with, fit, unseen)];
    because.extend(
        improvement
            .steps
            .iter()
            .flat_map(|step| written(improvement, step)),
    );
    because.push(rest(improvement.verdict, end.nrmse_test, last.floor.nrmse));
    because.extend((improvement.best.iter()).flat_map(|best| fit::not_shown(&best.model)));
    because.extend(
        last.observer
            .as_ref()
            .map(|observer| format!("Note: {}.", observer.statement)),
    );
    Said {
        headline: format!("The model lacked {}.", enumerated(&names)),
        because,
        open: improvement
            .steps
            .iter()
            .filter_map(not_told)
            .chain(not_pinned(improvement, &added))
            .collect(),
    }
}

/// What an effect of the model file's own says, and which known physics its terms resemble: for each of its channels, or
/// for all alike.
fn written(improvement: &Improvement, step: &ImprovementStep) -> Vec<String> {
    let (Some(best), Some(added), Some(_)) = (&improvement.best, &step.added, &step.entries) else {
        return Vec::new();
    };
    let effects = best.model.effects.iter();
    effects
        .filter(|effect| effect.meta.id == added.effect)
        .map(|effect| {
            let at: Vec<&str> = effect.at.iter().map(|c| c.id).collect();
            let law = effect.meta.equation.trim_start_matches("w = ");
            let mut text = format!("{} at {} is {law}", added.effect, enumerated(&at));
            for parameter in effect.meta.parameters.iter().filter(|p| p.estimated) {
                if !parameter.doc.is_empty() {
                    text.push_str(&format!("; {} {}", parameter.id, parameter.doc));
                }
            }
            text + "."
        })
        .collect()
}

/// What is still missing at the end, where the error is `left` and noise would leave the `floor`.
fn rest(verdict: Conclusion, left: f64, floor: f64) -> String {
    // The floor is an estimate: what is nearer to it is at it.
    let below = left < 0.9 * floor;
    let floor = error(floor);
    match verdict {
        Conclusion::NothingMissing if below => format!(
            "Nothing more is missing: that is no more than noise and resolution seem to leave, {floor}."
        ),
        Conclusion::NothingMissing => {
            format!("Nothing more is missing: noise and resolution alone would leave {floor}.")
        }
        Conclusion::UnknownEffect if below => format!(
            "That is below what noise and resolution seem to leave, {floor}. But quantities of the model still predict it: \
             something is still missing, and no effect of the library explains it."
        ),
        Conclusion::UnknownEffect => format!(
            "Noise and resolution alone would leave {floor}: something is still missing, and no effect of the \
             library explains it."
        ),
        Conclusion::EffectMissing => format!(
            "Noise and resolution alone would leave {floor}: more may be missing, but with still more effects \
             any log can be fitted. The search stopped here."
        ),
        Conclusion::DataInsufficient | Conclusion::LogFaulty | Conclusion::NotFitted => {
            "The log does not show what is left. The advice says what to record.".to_owned()
        }
        Conclusion::Cancelled => "The work was cancelled: more may be missing.".to_owned(),
    }
}

/// The effects that an improvement has added: those of the best model, where there is one.
pub fn added(improvement: &Improvement) -> Vec<EffectAt> {
    let place = |effect: &Attached| EffectAt {
        effect: effect.meta.id.to_owned(),
        at: effect.at.iter().map(|c| c.id.to_owned()).collect(),
    };
    let first = improvement.diagnoses.first();
    match (&improvement.best, first.and_then(|d| d.model.as_ref())) {
        // One that contains an effect of the file takes its place: how many there are does not tell.
        (Some(best), Some(before)) => {
            let before: Vec<EffectAt> = before.effects.iter().map(place).collect();
            let all = best.model.effects.iter().map(place);
            all.filter(|effect| !before.contains(effect)).collect()
        }
        _ => improvement
            .steps
            .iter()
            .filter_map(|s| s.added.clone())
            .collect(),
    }
}

/// What the data cannot tell from the effect of a step, at the end.
fn not_told(step: &ImprovementStep) -> Option<String> {
    let others: Vec<String> = step.still_open.iter().map(place_in_brackets).collect();
    let added = step.added.as_ref().filter(|_| !others.is_empty())?;
    Some(format!(
        "The data cannot tell {} from {}.",
        place_in_brackets(added),
        enumerated(&others)
    ))
}

/// Which parameters of the added effects the data do not pin.
fn not_pinned(improvement: &Improvement, added: &[EffectAt]) -> Option<String> {
    let of_effect = |name: &str| added.iter().any(|place| name.starts_with(&place.effect));
    let names: Vec<&str> = improvement
        .best
        .iter()
        .flat_map(|best| &best.parameters)
        .filter(|(name, e)| of_effect(name) && doubtful(e.verdict))
        .map(|(name, _)| name.as_str())
        .collect();
    (!names.is_empty()).then(|| {
        format!(
            "The log does not pin {}: the effect is likely, its size is not known. Another recording can tell.",
            enumerated(&names)
        )
    })
}

/// Whether the data leave a parameter open.
fn doubtful(verdict: ParameterVerdict) -> bool {
    !matches!(
        verdict,
        ParameterVerdict::Good
            | ParameterVerdict::Frozen
            | ParameterVerdict::Tied
            | ParameterVerdict::Unfinished
    )
}

/// An improvement for a terminal: faults of the log, the error step by step, summary, the force that is missing, what to
/// record next, and the best model's parameters.
pub fn text(improvement: &Improvement) -> String {
    let rows: Vec<Vec<String>> = improvement
        .steps
        .iter()
        .map(|step| {
            vec![
                step.added.as_ref().map_or_else(
                    || "the model as it is".to_owned(),
                    |p| format!("+ {}", place_in_table(p)),
                ),
                hundredths(step.nrmse_fit),
                hundredths(step.nrmse_test),
            ]
        })
        .collect();
    let first = improvement.diagnoses.first();
    let mut text = first.map_or_else(String::new, |d| faults(&d.faults));
    if !rows.is_empty() {
        text += &(table(&["step", "fit error", "validation error"], &rows) + "\n");
    }
    text.push_str(&summary(improvement).join("\n"));
    text.push_str(&advice::lines(&improvement.advice()));
    let last = improvement.diagnoses.last();
    text.push_str(&force::text(last.and_then(|d| d.residual_force.as_ref())));
    if let Some(best) = &improvement.best {
        text.push_str("\n\n");
        text.push_str(&fit::found(best));
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What is below the floor is not said to be above it.
    #[test]
    fn an_error_below_the_floor_is_said_to_be_there() {
        for verdict in [Conclusion::NothingMissing, Conclusion::UnknownEffect] {
            let below = rest(verdict, 0.017, 0.045);
            assert!(!below.contains("alone would leave"), "{below}");
            assert!(below.contains("4.50 %"), "{below}");
            assert!(rest(verdict, 0.047, 0.045).contains("alone would leave"));
            assert!(rest(verdict, 0.044, 0.045).contains("alone would leave"));
        }
    }
}
