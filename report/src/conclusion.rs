//! What a diagnosis or an improvement concludes, in sentences.

use loopsight_diagnosis::{
    Conclusion, Diagnosis, Explanation, Improvement, Place, Verdict as Fitted,
};
use loopsight_model::registry;

use crate::html::escape;
use crate::numbers::percent;

/// A conclusion to stand at the top of a page. Texts are plain, not HTML.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Verdict {
    /// The sentence that counts.
    pub(crate) headline: String,
    /// The numbers behind it.
    pub(crate) because: Vec<String>,
    /// What the data cannot tell apart.
    pub(crate) alike: Vec<String>,
    /// Class in the style sheet.
    class: &'static str,
}

impl Verdict {
    /// As a box.
    pub(crate) fn html(&self) -> String {
        let because: String = self
            .because
            .iter()
            .map(|s| format!("<p>{}</p>", escape(s)))
            .collect();
        let alike: String = self
            .alike
            .iter()
            .map(|s| format!("<p class=\"alike\">{}</p>", escape(s)))
            .collect();
        format!(
            "<div class=\"conclusion {}\"><p class=\"headline\">{}</p>{because}{alike}</div>\n",
            self.class,
            escape(&self.headline)
        )
    }
}

/// The name of an effect for a sentence.
pub(crate) fn effect_name(id: &str) -> String {
    id.replace('_', " ")
}

/// One sentence that says what an effect is; empty where the library does not know it.
pub(crate) fn summary(id: &str) -> &'static str {
    registry::effects()
        .iter()
        .find(|meta| meta.id == id)
        .map_or("", |meta| meta.summary)
}

/// An effect and where it acts, for a sentence.
pub(crate) fn place_name(place: &Place) -> String {
    let name = effect_name(&place.effect);
    if place.at.is_empty() {
        name
    } else {
        format!("{name} at {}", both(&place.at))
    }
}

/// An effect and where it acts, for an enumeration.
fn place_in_brackets(place: &Place) -> String {
    let name = effect_name(&place.effect);
    if place.at.is_empty() {
        name
    } else {
        format!("{name} ({})", place.at.join(", "))
    }
}

/// `a`, `a and b`, `a, b and c`.
pub(crate) fn both<T: AsRef<str>>(names: &[T]) -> String {
    match names {
        [] => String::new(),
        [one] => one.as_ref().to_owned(),
        [first @ .., last] => {
            let first: Vec<&str> = first.iter().map(AsRef::as_ref).collect();
            format!("{} and {}", first.join(", "), last.as_ref())
        }
    }
}

/// What the data cannot tell from the best explanation.
pub(crate) fn alike(diagnosis: &Diagnosis) -> Vec<String> {
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
        "The data cannot tell {} from {}: {} these measurements as well. What to record to tell \
         them apart stands below.",
        place_in_brackets(&best.place),
        both(&others),
        if others.len() == 1 {
            "either explains"
        } else {
            "each of them explains"
        }
    )]
}

/// The explanation that a diagnosis believes.
pub(crate) fn found(diagnosis: &Diagnosis) -> Option<&Explanation> {
    let missing = diagnosis.missing.as_ref()?;
    diagnosis.candidates.iter().find(|c| c.place == *missing)
}

/// What a diagnosis concludes.
pub(crate) fn of_diagnosis(diagnosis: &Diagnosis) -> Verdict {
    let nominal = percent(diagnosis.nominal.nrmse);
    let floor = percent(diagnosis.floor.nrmse);
    let (headline, mut because, class) = match diagnosis.verdict {
        Conclusion::EffectMissing => {
            let place = diagnosis
                .missing
                .as_ref()
                .or(diagnosis.candidates.first().map(|c| &c.place));
            let headline = match place {
                Some(place) => format!("The model lacks {}.", place_name(place)),
                None => "The model lacks an effect.".into(),
            };
            let mut because = Vec::new();
            if let Some(place) = place {
                let summary = summary(&place.effect);
                if !summary.is_empty() {
                    because.push(format!("That is: {summary}."));
                }
            }
            if let Some(best) = found(diagnosis) {
                because.push(format!(
                    "With it the error of the free run falls from {nominal} to {} of the measured \
                     variation, on data that the model was not fitted to. Noise and resolution \
                     alone would leave {floor}.",
                    percent(best.nrmse)
                ));
            }
            (headline, because, "missing")
        }
        Conclusion::NothingMissing => (
            "Nothing is missing from the model.".to_owned(),
            vec![format!(
                "Its free run errs by {nominal} of the measured variation, on data that it was \
                 not fitted to; noise and resolution alone would leave {floor}. No effect of the \
                 library makes a difference that counts."
            )],
            "nothing",
        ),
        Conclusion::UnknownEffect => {
            let mut because = vec![format!(
                "The free run errs by {nominal} of the measured variation, on data that the model \
                 was not fitted to; noise and resolution alone would leave {floor}."
            )];
            if let Some(nearest) = diagnosis.candidates.first() {
                because.push(format!(
                    "What comes nearest is {}, which would leave {}: too little to believe it.",
                    place_name(&nearest.place),
                    percent(nearest.nrmse)
                ));
            }
            (
                "Something is missing, and nothing in the library is it.".to_owned(),
                because,
                "unknown",
            )
        }
        Conclusion::DataInsufficient if diagnosis.nominal.nrmse.is_finite() => (
            "This log cannot show what is missing.".to_owned(),
            vec![format!(
                "On the log the model errs by {} of the measured variation, hardly more than noise \
                 leaves; on the test recording by {nominal}, where noise alone would leave {floor}. \
                 What makes the difference does not show in the log.",
                percent(diagnosis.nominal_fit)
            )],
            "refused",
        ),
        Conclusion::DataInsufficient => (
            "This log is not enough to judge the model.".to_owned(),
            vec![
                "Nothing was fitted: parameters from it would be arbitrary. What is lacking \
                 stands below."
                    .to_owned(),
            ],
            "refused",
        ),
        Conclusion::LogFaulty => (
            "The log is faulty, so it says nothing about the model.".to_owned(),
            vec!["Nothing was fitted to it. What is wrong stands below.".to_owned()],
            "refused",
        ),
        Conclusion::Cancelled => (
            "The diagnosis was cancelled.".to_owned(),
            vec![
                "The explanations below were tried until then. Nothing can be concluded from them."
                    .to_owned(),
            ],
            "refused",
        ),
    };
    if let Some(held) = &diagnosis.observer {
        because.push(format!("Note: {}.", held.statement));
    }
    Verdict {
        headline,
        because,
        alike: alike(diagnosis),
        class,
    }
}

/// The effects that an improvement has added: those of the best model, where there is one.
pub(crate) fn added(improvement: &Improvement) -> Vec<Place> {
    let before = improvement
        .diagnoses
        .first()
        .and_then(|d| d.model.as_ref())
        .map(|m| m.effects.len());
    match (&improvement.best, before) {
        (Some(best), Some(before)) => best
            .model
            .effects
            .iter()
            .skip(before)
            .map(|effect| Place {
                effect: effect.meta.id.to_owned(),
                at: effect.at.iter().map(|c| c.id.to_owned()).collect(),
            })
            .collect(),
        _ => improvement
            .steps
            .iter()
            .filter_map(|s| s.added.clone())
            .collect(),
    }
}

/// Which parameters of the added effects the data do not pin.
fn doubtful(improvement: &Improvement, added: &[Place]) -> Option<String> {
    let of_effect = |name: &str| added.iter().any(|place| name.starts_with(&place.effect));
    let names: Vec<&str> = improvement
        .best
        .iter()
        .flat_map(|best| &best.parameters)
        .filter(|(name, e)| of_effect(name) && !matches!(e.verdict, Fitted::Good | Fitted::Held))
        .map(|(name, _)| name.as_str())
        .collect();
    (!names.is_empty()).then(|| {
        format!(
            "The log does not pin {}: take the effect for likely, not its number, until another \
             recording confirms it.",
            both(&names)
        )
    })
}

/// What an improvement concludes.
pub(crate) fn of_improvement(improvement: &Improvement) -> Verdict {
    let Some(last) = improvement.diagnoses.last() else {
        return Verdict {
            headline: "There is no diagnosis.".into(),
            class: "refused",
            ..Verdict::default()
        };
    };
    let added = added(improvement);
    let (Some(first), Some(end), false) = (
        improvement.steps.first(),
        improvement.steps.last(),
        added.is_empty(),
    ) else {
        return of_diagnosis(last);
    };
    let names: Vec<String> = match added.as_slice() {
        [one] => vec![place_name(one)],
        several => several.iter().map(place_in_brackets).collect(),
    };
    let (from, to) = (percent(first.nrmse_test), percent(end.nrmse_test));
    let floor = percent(last.floor.nrmse);
    let (rest, class) = match improvement.verdict {
        Conclusion::NothingMissing => (
            format!("Nothing more is missing: noise and resolution alone would leave {floor}."),
            "nothing",
        ),
        Conclusion::UnknownEffect => (
            format!(
                "Noise and resolution alone would leave {floor}: something is still missing, and \
                 nothing in the library is it."
            ),
            "unknown",
        ),
        Conclusion::EffectMissing => (
            format!(
                "More seems to be missing (noise alone would leave {floor}), but so many effects \
                 fit anything: the search stopped here."
            ),
            "unknown",
        ),
        Conclusion::DataInsufficient | Conclusion::LogFaulty => (
            "What is left does not show in this log: record what is advised below.".to_owned(),
            "refused",
        ),
        Conclusion::Cancelled => (
            "The work was cancelled: more may be missing.".to_owned(),
            "unknown",
        ),
    };
    Verdict {
        headline: format!("The model lacked {}.", both(&names)),
        because: vec![
            format!(
                "With {} added, the error of the free run falls from {from} to {to} of the \
                 measured variation, on data that the model was not fitted to.",
                if names.len() == 1 { "it" } else { "them" }
            ),
            rest,
        ],
        alike: improvement
            .diagnoses
            .iter()
            .flat_map(alike)
            .chain(doubtful(improvement, &added))
            .collect(),
        class,
    }
}
