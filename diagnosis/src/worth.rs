//! Whether what a diagnosis names is worth adding to a model.

use crate::conclusion::{Conclusion, Diagnosis, Explanation};
use crate::criteria::Criteria;
use crate::estimate::stands_in;

/// What the diagnosis of a `round` names, or the verdict where that is not worth adding.
pub(crate) fn worth_adding(
    diagnosis: &Diagnosis,
    round: usize,
    criteria: &Criteria,
) -> Result<Explanation, Conclusion> {
    let Criteria {
        improve, missing, ..
    } = criteria;
    let best = match (&diagnosis.missing, diagnosis.candidates.first()) {
        (Some(_), Some(best)) if round < improve.most => best,
        _ => return Err(diagnosis.verdict),
    };
    let (before, floor) = (diagnosis.nominal.nrmse, diagnosis.floor.nrmse);
    let fell_to = best.nrmse / before;
    // At the floor a further effect explains noise, or how the model is computed. What is late shows in the steps, which are
    // mostly in what was fitted: where much more than noise is left there, the model is not at the floor.
    let complete = round > 0
        && before < missing.complete * floor
        && diagnosis.nominal_fit <= missing.above_floor * floor;
    if complete && fell_to >= improve.better {
        return Err(Conclusion::NothingMissing);
    }
    // Something is missing, but hardly this.
    if names_a_stand_in(diagnosis, criteria) {
        return Err(Conclusion::UnknownEffect);
    }
    Ok(best.clone())
}

/// Whether what the diagnosis names explains no large part, and only with a parameter at the end of where it is searched.
pub(crate) fn names_a_stand_in(diagnosis: &Diagnosis, criteria: &Criteria) -> bool {
    let named = diagnosis
        .candidates
        .first()
        .filter(|_| diagnosis.missing.is_some());
    named.is_some_and(|best| {
        best.nrmse >= criteria.improve.worth_blurring * diagnosis.nominal.nrmse
            && stands_in(best.parameters.values())
    })
}
