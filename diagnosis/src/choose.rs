//! Which explanation comes first.

use loopsight_core::PlaceKind;

use crate::conclusion::Explanation;
use crate::criteria::{ChoiceCriteria, Criteria};
use crate::effect_at::EffectAt;
use crate::estimate::ParameterVerdict;
use crate::judge::{advantage, nrmse};
use crate::trial::Judged;

/// How much rarer an effect on inputs is where these were measured behind it: beyond any [`EffectMeta::rarity`].
///
/// [`EffectMeta::rarity`]: loopsight_core::EffectMeta::rarity
const RARE: u8 = 4;

/// The explanation that was put first.
pub(crate) struct Chosen {
    /// Its index among the finalists.
    pub(crate) finalist: usize,
    /// The best one, where it does better by more than chance, but is not as simple.
    pub(crate) set_aside: Option<(usize, Explanation)>,
}

/// Puts the simplest explanation first that is not significantly worse than the best one, and lists those that
/// cannot be told from it. An explanation that is not `earned`, so no better on the validation data, comes first
/// only where no other one is earned.
pub(crate) fn choose(
    explanations: &mut Vec<Explanation>,
    finalists: &[Judged],
    floor: f64,
    earned: &dyn Fn(usize, &Explanation) -> bool,
    criteria: &Criteria,
) -> Option<Chosen> {
    let ChoiceCriteria {
        same: same_advantage,
        close,
        blur,
        never_same,
        ..
    } = criteria.choice;
    finalists.first()?;
    let error = |i: usize| finalists[i].error();
    let complexity = |i: usize| finalists[i].candidate.complexity();
    let squared = |i: usize| error(i).powi(2);
    let least = squared(0);
    // While the best explanation leaves much unexplained, something else is missing too. It may cause small
    // differences between explanations.
    let allowed = least + blur * (least - floor * floor).max(0.0);
    // No worse than another one: not significantly, or by too little to matter in use.
    let same = |i: usize, other: usize| {
        let ranks = [i, other].map(|i| &finalists[i].rank);
        let alike = || advantage(ranks[0], ranks[1], &criteria.window) < same_advantage;
        error(i) < close * error(other) || error(i) < never_same * error(other) && alike()
    };
    // What contains another effect hardly ever does worse.
    let simpler = |i: usize| {
        let contained = finalists[i].candidate.is_special(&finalists[0].candidate);
        contained && error(i) < criteria.choice.allowance(complexity(0), complexity(i)) * error(0)
    };
    let not_worse: Vec<usize> = (0..finalists.len())
        .filter(|i| same(*i, 0) || simpler(*i) || squared(*i) < allowed)
        .collect();
    let earned: Vec<bool> = (0..finalists.len())
        .map(|i| earned(i, &explanations[i]))
        .collect();
    let none_earned = !not_worse.iter().any(|i| earned[*i]);
    let may = |i: &usize| earned[*i] || none_earned;
    let firsts = || not_worse.iter().copied().filter(may);
    let simplest = firsts().map(complexity).min()?;
    let leader = firsts()
        .filter(|i| complexity(*i) == simplest)
        .min_by(|a, b| error(*a).total_cmp(&error(*b)))?;
    // A common effect comes before a rare one, and an effect at both wheels before one at one wheel. Of inputs that
    // were measured where they act an effect on them is rare: what is late or slow then is what was measured. This orders
    // only explanations whose errors are the same as the leader's; how far the best one is ahead of them does
    // not matter here.
    let alike = (0..finalists.len()).filter(may);
    let chosen = alike
        .filter(|i| complexity(*i) == simplest && same(*i, leader))
        .min_by(|a, b| {
            let channels = |i: usize| usize::MAX - explanations[i].place.at.len();
            let rarity = |i: usize| {
                let candidate = &finalists[i].candidate;
                let rare = candidate.model.log.inputs_measured
                    && candidate.meta.places.contains(&PlaceKind::Input);
                candidate.meta.rarity + if rare { RARE } else { 0 }
            };
            let key = |i: usize| (rarity(i), channels(i));
            key(*a).cmp(&key(*b)).then(error(*a).total_cmp(&error(*b)))
        })?;
    let determined = |i: usize| {
        (explanations[i].parameters.values()).all(|e| e.verdict == ParameterVerdict::Good)
    };
    // It comes in its fuller form where that does better and is determined.
    let simplest_form = complexity(chosen);
    let named = &finalists[chosen].candidate;
    let fuller = (0..finalists.len()).find(|i| {
        let form = &finalists[*i].candidate;
        let is_fuller = form.meta.id == named.meta.id && named.is_special(form);
        is_fuller && may(i) && determined(*i) && !same(chosen, *i)
    });
    let chosen = fuller.unwrap_or(chosen);
    // An effect that does as well as the chosen one on the validation data counts too.
    let unseen = |i: usize| nrmse(&finalists[i].losses);
    let id = |i: usize| finalists[i].candidate.meta.id;
    let as_well = |i: usize| {
        let near = unseen(i) <= unseen(chosen) && error(i) < never_same * error(chosen);
        near && id(i) != id(chosen)
    };
    let significant = criteria.missing.significant;
    let does_something = |i: usize| explanations[i].significance > significant;
    // One with more parameters is an alternative where it does better with all of them, and the chosen one is no case of it.
    let rivals = |i: usize| {
        let contains = finalists[chosen]
            .candidate
            .is_special(&finalists[i].candidate);
        !contains && error(i) <= error(chosen) && determined(i)
    };
    let class: Vec<EffectAt> = (0..finalists.len())
        .filter(|i| not_worse.contains(i) || as_well(*i))
        .filter(|i| *i != chosen && (complexity(*i) <= simplest_form || rivals(*i)))
        .filter(|i| explanations[*i].place != explanations[chosen].place)
        // An effect of no size explains nothing, so it is no alternative.
        .filter(|i| does_something(*i) || !does_something(chosen))
        .map(|i| explanations[i].place.clone())
        .collect();
    explanations[chosen].indistinguishable_from = class;
    let best = firsts().next();
    let set_aside = best.filter(|best| !same(chosen, *best) && !simpler(chosen));
    let set_aside = set_aside.map(|best| (best, explanations[best].clone()));
    let first = explanations.remove(chosen);
    explanations.insert(0, first);
    Some(Chosen {
        finalist: chosen,
        set_aside,
    })
}
