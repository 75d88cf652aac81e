//! What is reported of a candidate.

use std::collections::BTreeMap;

use crate::candidates::Candidate;
use crate::conclusion::Explanation;
use crate::effect_at::EffectAt;
use crate::estimate::{Estimate, ParameterVerdict};
use crate::fitted::Fit;
use crate::judge::{nrmse, significance};
use crate::plausible::implausible;
use crate::progress::Cancelled;
use crate::settings::Method;
use crate::trial::{Judged, Nominal};

/// Most standard errors that are reported.
const MOST: f64 = 1e6;

/// The explanation of a candidate with a full fit.
pub(crate) fn explain(
    judged: &Judged,
    fit: &Fit,
    nominal: &Nominal<'_>,
) -> Result<Explanation, Cancelled> {
    let candidate = &judged.candidate;
    let significance = significance(nominal.rank, &judged.rank, nominal.work)?;
    let holdout = nominal.holdout;
    let fitted = holdout.fitted(
        &candidate.model,
        &judged.solution,
        &judged.rank,
        nominal.work,
    )?;
    let implausible = implausible(candidate, &judged.solution.values, holdout.runs);
    Ok(Explanation {
        place: place(candidate),
        together_with: None,
        nrmse: nrmse(&judged.losses),
        parameters: parameters(candidate, &fit.parameters),
        significance: significance.min(MOST),
        indistinguishable_from: Vec::new(),
        note: note(fit, candidate, implausible.as_ref()),
        implausible,
        model: fit.model.clone(),
        entries: candidate.entries.clone(),
        nrmse_fit: nrmse(&fitted),
    })
}

/// The explanation of a candidate that had only a short fit when the work was cancelled.
pub(crate) fn explain_look(judged: &Judged) -> Explanation {
    let candidate = &judged.candidate;
    let mut model = candidate.model.clone();
    model.set_values(&judged.solution.values);
    let fit = Fit::cancelled(model, Method::OutputError, f64::NAN, 0);
    Explanation {
        place: place(candidate),
        together_with: None,
        nrmse: nrmse(&judged.losses),
        parameters: parameters(candidate, &fit.parameters),
        significance: f64::NAN,
        indistinguishable_from: Vec::new(),
        note: note(&fit, candidate, None),
        implausible: None,
        model: fit.model,
        entries: candidate.entries.clone(),
        nrmse_fit: f64::NAN,
    }
}

/// The effect of a candidate, and where.
pub(crate) fn place(candidate: &Candidate) -> EffectAt {
    EffectAt {
        effect: candidate.meta.id.to_owned(),
        at: candidate.at.iter().map(|c| (*c).to_owned()).collect(),
    }
}

/// The candidate's own parameters, with their estimates.
fn parameters(
    candidate: &Candidate,
    fitted: &BTreeMap<String, Estimate>,
) -> BTreeMap<String, Estimate> {
    let mut own = BTreeMap::new();
    for i in candidate.own() {
        let parameter = &candidate.model.parameters[i];
        let Some(estimate) = fitted.get(&parameter.name) else {
            continue;
        };
        // A parameter that is chosen from a list, such as a number of teeth, counts as found.
        if parameter.free || !parameter.declaration.starts.is_empty() {
            own.insert(candidate.name(i), estimate.clone());
        }
    }
    own
}

/// What to know about a fitted explanation.
fn note(fit: &Fit, candidate: &Candidate, implausible: Option<&String>) -> String {
    let mut words = vec![candidate.meta.symptom.to_owned()];
    if let Some((simpler, _)) = &candidate.replaces {
        words.push(format!("in place of {simpler}, which it contains"));
    }
    for (name, estimate) in &fit.parameters {
        if matches!(
            estimate.verdict,
            ParameterVerdict::AtBound | ParameterVerdict::Flat | ParameterVerdict::NotPinned
        ) {
            words.push(format!("{name}: {}", estimate.verdict.text()));
        }
    }
    words.extend(implausible.cloned());
    words.join("; ")
}
