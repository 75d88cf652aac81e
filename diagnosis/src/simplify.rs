//! A simpler effect in place of one that contains it.

use loopsight_model::model::Model;

use crate::effect_at::{EffectAt, instances};
use crate::error::FitError;
use crate::improvement::ImprovementStep;
use crate::refined::Refined;

/// Replaces an added effect by a simpler one that it contains, where the error hardly grows: what looked like
/// breakaway friction may have been friction with a delay that was still missing. The step then names the
/// simpler effect.
pub(crate) fn simplified(
    best: &mut Refined<'_>,
    steps: &mut [ImprovementStep],
) -> Result<(), FitError> {
    let criteria = &best.work.criteria().choice;
    for place in steps.iter_mut().filter_map(|step| step.added.as_mut()) {
        let many = free(best.model);
        let share = |model: &Model| criteria.allowance(many, free(model));
        if let Some(id) = best.takes(simpler(best.model, place), share)? {
            id.clone_into(&mut place.effect);
        }
    }
    Ok(())
}

/// The models with a simpler effect in place of the one at `place`, by its id.
pub(crate) fn simpler(model: &Model, place: &EffectAt) -> Vec<(&'static str, Model)> {
    let instances = instances(model, place);
    let Some(effect) = instances.first().map(|i| &model.effects[*i]) else {
        return Vec::new();
    };
    let ids = effect.meta.simpler.iter();
    let models = ids.filter_map(|id| {
        let candidate = instances.iter().try_fold(model.clone(), |model, i| {
            let at: Vec<&str> = model.effects[*i].at.iter().map(|c| c.id).collect();
            model.with_effect_replaced(*i, id, &at)
        });
        Some((*id, candidate?))
    });
    models.collect()
}

/// Parameters that are fitted.
pub(crate) fn free(model: &Model) -> usize {
    model.parameters.iter().filter(|p| p.free).count()
}
