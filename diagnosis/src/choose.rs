//! Which explanation comes first.

use crate::conclusion::{Explanation, Place};
use crate::diagnose::{CLOSE, Judged, SAME};
use crate::fit::Fit;
use crate::judge::{advantage, nrmse};

/// Share of what the best explanation leaves above the floor by which a smaller one may be worse.
const BLUR: f64 = 0.3;

/// The explanation that was put first.
pub(crate) struct Chosen {
    /// Its index among the finalists.
    pub(crate) finalist: usize,
}

/// Puts the smallest explanation that is not significantly worse than the best one first, with
/// those that cannot be told from it.
pub(crate) fn choose(
    explanations: &mut Vec<Explanation>,
    finalists: &[(Judged, Fit)],
    floor: f64,
) -> Option<Chosen> {
    let best = &finalists.first()?.0;
    let squared = |i: usize| nrmse(&finalists[i].0.rank).powi(2);
    let least = squared(0);
    // While the best explanation itself leaves much unexplained, small differences between
    // explanations are those of what else is missing.
    let allowed = least + BLUR * (least - floor * floor).max(0.0);
    let not_worse: Vec<usize> = (0..finalists.len())
        .filter(|i| {
            let rank = &finalists[*i].0.rank;
            advantage(rank, &best.rank) < SAME
                || nrmse(rank) < CLOSE * nrmse(&best.rank)
                || squared(*i) < allowed
        })
        .collect();
    let complexity = |i: usize| finalists[i].0.candidate.complexity();
    let chosen = *not_worse.iter().min_by(|a, b| {
        // The common before the rare, and both wheels alike before one wheel: what is built alike
        // fails alike.
        let channels = |i: usize| usize::MAX - explanations[i].place.at.len();
        let rarity = |i: usize| finalists[i].0.candidate.meta.rarity;
        let key = |i: usize| (complexity(i), rarity(i), channels(i));
        let error = |i: usize| nrmse(&finalists[i].0.rank);
        key(**a)
            .cmp(&key(**b))
            .then(error(**a).total_cmp(&error(**b)))
    })?;
    let class: Vec<Place> = not_worse
        .iter()
        .filter(|i| **i != chosen && complexity(**i) <= complexity(chosen))
        .map(|i| explanations[*i].place.clone())
        .collect();
    explanations[chosen].indistinguishable_from = class;
    let first = explanations.remove(chosen);
    explanations.insert(0, first);
    Some(Chosen { finalist: chosen })
}
