//! Two effects that explain together what neither explains alone.
//!
//! Dry friction behind a motor driver that lets go between its pulses is one: without friction such a driver hardly
//! shows in steady speeds, and friction alone makes slow motion worse while it makes fast motion better.

use crate::conclude::explained;
use crate::conclusion::{Conclusion, Diagnosis, Explanation};
use crate::criteria::Criteria;
use crate::diagnose::{Aim, Discover, diagnose_for};
use crate::error::FitError;
use crate::measurements::Measurements;
use crate::progress::{Cancelled, Work};
use crate::worth::names_a_stand_in;

/// What explains together.
pub(crate) struct Pair {
    /// The first effect, alone.
    pub(crate) first: Explanation,
    /// The diagnosis of the model with it, which misses the second one.
    pub(crate) second: Diagnosis,
}

/// Where no effect of the library explains what the model does not, or the one that is named stands in for another: the two
/// that do it best together, if any do.
///
/// The best of the `diagnosis` of a `round` are taken for granted one after the other, and each model with one of them is diagnosed
/// again. The second effect is then judged as any other, and both together must lower the validation error by enough
/// to matter.
pub(crate) fn pair(
    diagnosis: &Diagnosis,
    round: usize,
    measurements: &Measurements<'_>,
    aim: Aim,
    work: &Work<'_>,
) -> Result<Option<Pair>, Cancelled> {
    let criteria = work.criteria();
    let open =
        diagnosis.verdict == Conclusion::UnknownEffect || names_a_stand_in(diagnosis, criteria);
    // The second one is named in the next round.
    if !open || round + 1 >= criteria.improve.most {
        return Ok(None);
    }
    let (many, leaves) = allowed(diagnosis, round, criteria);
    // Of a second effect that is not found, nothing is said.
    let aim = Aim {
        discover: Discover::Never,
        force: false,
        unaided: aim.unaided.after(diagnosis.observer.as_ref()),
        leaves,
        ..aim
    };
    let mut best: Option<(f64, Pair)> = None;
    for first in firsts(diagnosis, many, criteria) {
        let second = match diagnose_for(&first.model, measurements, aim, work) {
            Err(FitError::Cancelled(cancelled)) => return Err(cancelled),
            // The model with it alone leads nowhere.
            Err(_) => continue,
            Ok(second) => second,
        };
        work.go_on()?;
        let left = left_by(&second, diagnosis, aim, criteria);
        let Some(left) = left.filter(|left| best.as_ref().is_none_or(|(least, _)| left < least))
        else {
            continue;
        };
        let first = first.clone();
        best = Some((left, Pair { first, second }));
    }
    Ok(best.map(|(_, pair)| pair))
}

/// How many effects are taken for granted, and the validation error that both together may leave. Beside effects that were found
/// before, some two fit any log better, so they must leave hardly more than noise.
fn allowed(diagnosis: &Diagnosis, round: usize, criteria: &Criteria) -> (usize, f64) {
    let better = criteria.improve.better * diagnosis.nominal.nrmse;
    if round == 0 {
        return (criteria.pairs.firsts, better);
    }
    let noise = criteria.missing.above_floor * diagnosis.floor.nrmse;
    (criteria.pairs.later, better.min(noise))
}

/// The explanations of a diagnosis to begin with: so many of the best that do something, each another response of the machine.
fn firsts<'d>(diagnosis: &'d Diagnosis, many: usize, criteria: &Criteria) -> Vec<&'d Explanation> {
    let close = criteria.choice.close;
    let near = |a: f64, b: f64| a <= close * b && b <= close * a;
    let same = |a: &Explanation, b: &Explanation| {
        a.place.effect == b.place.effect
            || a.indistinguishable_from.contains(&b.place)
            || near(a.nrmse, b.nrmse) && near(a.nrmse_fit, b.nrmse_fit)
    };
    let mut firsts: Vec<&Explanation> = Vec::new();
    for explanation in &diagnosis.candidates {
        let does_something = explanation.significance > criteria.pairs.significant;
        if does_something && !firsts.iter().any(|first| same(first, explanation)) {
            firsts.push(explanation);
        }
    }
    firsts.truncate(many);
    firsts
}

/// The validation error with the effect that the `second` diagnosis names, where it and the first one together explain
/// enough of what the model of the diagnosis leaves.
fn left_by(
    second: &Diagnosis,
    diagnosis: &Diagnosis,
    aim: Aim,
    criteria: &Criteria,
) -> Option<f64> {
    let found = second.candidates.first();
    let found = found.filter(|found| second.missing.as_ref() == Some(&found.place))?;
    // Errors are only compared under the same observer.
    let alike = second.observer.is_some() == diagnosis.observer.is_some();
    let (before, left, floor) = (diagnosis.nominal.nrmse, found.nrmse, diagnosis.floor.nrmse);
    let matters = explained(before, left)
        > (criteria.missing.matters * floor)
            .max(criteria.missing.least_share)
            .max(aim.worth);
    (alike && matters && left < aim.leaves).then_some(left)
}

impl Diagnosis {
    /// Names two effects as missing.
    pub(crate) fn lacks(&mut self, pair: &Pair) {
        let Pair { first, second } = pair;
        let Some(found) = second.candidates.first() else {
            return;
        };
        let mut both = first.clone();
        both.together_with = Some(found.place.clone());
        both.nrmse = found.nrmse;
        both.nrmse_fit = found.nrmse_fit;
        both.significance = found.significance;
        both.model = found.model.clone();
        for (name, estimate) in &mut both.parameters {
            let full = |p: &&loopsight_model::model::ModelParameter| {
                p.name == format!("{}.{name}", first.place.effect)
            };
            let fitted = both.model.parameters.iter().find(full);
            if let Some(value) = fitted.and_then(|p| p.value) {
                // Its uncertainty beside the second effect was not estimated.
                if value != estimate.value {
                    estimate.std_error = None;
                    estimate.interval95 = None;
                }
                estimate.value = value;
            }
        }
        let others = found.parameters.iter();
        let others = others.map(|(name, e)| (format!("{}.{name}", found.place.effect), e.clone()));
        both.parameters.extend(others);
        self.name(both);
        self.verdict = Conclusion::EffectMissing;
        self.residual_force = None;
        self.advice.clone_from(&second.advice);
    }
}
