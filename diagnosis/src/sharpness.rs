//! How sharp the signs of a model are while it is improved.

use loopsight_model::model::{Model, Origin};

use crate::effect_at::instances;
use crate::error::FitError;
use crate::improvement::ImprovementStep;
use crate::refined::Refined;

/// Most halvings, and most doublings.
const HALVINGS: usize = 3;

/// Halves the smoothing width of the effect that the last of `steps` added while that lowers the error, then those of the others: a
/// sign that makes up for what was still missing is softer than its own.
pub(crate) fn sharpened(best: &mut Refined<'_>, steps: &[ImprovementStep]) -> Result<(), FitError> {
    while_better(best, |model| sharper(model, &added_last(model, steps)))?;
    while_better(best, |model| sharper(model, &added_before(model, steps)))
}

/// The models that this begins with.
pub(crate) fn sharper_ones(model: &Model, steps: &[ImprovementStep]) -> Vec<Model> {
    let effects = [added_last(model, steps), added_before(model, steps)];
    let models = effects.iter().filter_map(|of| sharper(model, of));
    models.collect()
}

/// Doubles the smoothing widths of the effects that were added before while that lowers the error. Each was found where the model
/// still left what the later ones explain, which hides how soft a sign is. So does what is still missing: this is done only where the
/// model explains the log and leaves hardly more than its noise, the `floor`.
pub(crate) fn softened(
    best: &mut Refined<'_>,
    steps: &[ImprovementStep],
    floor: f64,
) -> Result<(), FitError> {
    let explained = best.work.criteria().missing.explained;
    if best.error().is_some_and(|error| error < explained * floor) {
        while_better(best, |model| softer(model, steps))?;
    }
    Ok(())
}

/// Takes what `changed` makes of the model while that lowers the error.
fn while_better(
    best: &mut Refined<'_>,
    changed: impl Fn(&Model) -> Option<Model>,
) -> Result<(), FitError> {
    let criteria = &best.work.criteria().improve;
    for _ in 0..HALVINGS {
        let Some(candidate) = changed(best.model) else {
            break;
        };
        let taken = best.takes(vec![((), candidate)], |_| criteria.sharper)?;
        if taken.is_none() {
            break;
        }
    }
    Ok(())
}

/// The model with half the widths that a log gave the signs of some effects; none where there is no such.
fn sharper(model: &Model, effects: &[usize]) -> Option<Model> {
    times_as_wide(model, effects, 0.5)
}

/// The model with twice the widths that a log gave the signs of other effects; none where there is no such.
fn softer(model: &Model, steps: &[ImprovementStep]) -> Option<Model> {
    times_as_wide(model, &added_before(model, steps), 2.0)
}

/// The effects that were there before the last step.
fn added_before(model: &Model, steps: &[ImprovementStep]) -> Vec<usize> {
    let last = added_last(model, steps);
    (0..model.effects.len())
        .filter(|i| !last.contains(i))
        .collect()
}

/// The effect that the last step added: one, or one for each of its channels.
fn added_last(model: &Model, steps: &[ImprovementStep]) -> Vec<usize> {
    let place = steps.last().and_then(|step| step.added.as_ref());
    place.map_or(Vec::new(), |place| instances(model, place))
}

/// The model with the smoothing widths of some of its effects so many times as wide, where a log gave them; none where it gave none.
fn times_as_wide(model: &Model, effects: &[usize], times: f64) -> Option<Model> {
    let mut candidate = model.clone();
    let mut any = false;
    for effect in effects.iter().map(|i| &model.effects[*i]) {
        let own = effect.own();
        for parameter in &mut candidate.parameters[own] {
            let known = parameter.free || parameter.origin != Origin::Log;
            if known || !parameter.declaration.is_width() {
                continue;
            }
            any |= parameter.value.is_some();
            parameter.value = parameter.value.map(|width| times * width);
        }
    }
    any.then_some(candidate)
}
