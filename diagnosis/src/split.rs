//! An effect that is two simpler ones.
//!
//! Friction that falls with the speed and quadratic drag both bend the line of force over speed. Alone, the first explains more
//! of a machine that has dry friction and drag. Friction of two directions does so of one that has dry friction and a weight.

use loopsight_model::model::Model;
use loopsight_model::registry;

use crate::compare::free_run_error;
use crate::effect_at::EffectAt;
use crate::error::FitError;
use crate::improvement::ImprovementStep;
use crate::measurements::Measurements;
use crate::refine::{free, instances, without_step};
use crate::refined::{Refined, refitted};

/// Two effects in place of one: those of `first` and `second`, at its channels.
struct Split {
    first: &'static str,
    second: &'static str,
}

/// Replaces an added effect by a simpler one that it contains and a second one that it does not, where both together have fewer
/// parameters and the error is the same or smaller. A step for the second one is put behind that of the first.
pub(crate) fn split(
    best: &mut Refined<'_>,
    steps: &mut Vec<ImprovementStep>,
) -> Result<(), FitError> {
    let close = best.work.criteria().choice.close;
    let mut index = 0;
    while index < steps.len() {
        let candidates = match steps[index].added.as_ref() {
            Some(place) => splits(best.model, place),
            None => Vec::new(),
        };
        if let Some(Split { first, second }) = best.takes(candidates, |_| close)? {
            divide(best, steps, index, [first, second])?;
        }
        index += 1;
    }
    Ok(())
}

/// What may stand in place of the effect at `place`, at rest until a fit moves it.
fn splits(model: &Model, place: &EffectAt) -> Vec<(Split, Model)> {
    let [instance] = instances(model, place)[..] else {
        return Vec::new();
    };
    let whole = model.effects[instance].meta;
    let at: Vec<&str> = model.effects[instance].at.iter().map(|c| c.id).collect();
    let mut found = Vec::new();
    for first in whole.simpler {
        let Some(simpler) = model.with_effect_replaced(instance, first, &at) else {
            continue;
        };
        let seconds = registry::effects().into_iter().filter(|second| {
            let reads_no_more = second.reads.iter().all(|role| whole.reads.contains(role));
            let is_other = second.id != whole.id && !whole.simpler.contains(&second.id);
            is_other && reads_no_more && second.states == 0 && !second.memory
        });
        for second in seconds {
            let Some(mut both) = simpler.with_effect(second.id, &at) else {
                continue;
            };
            for parameter in &mut both.parameters[simpler.parameters.len()..] {
                let start = parameter.value.unwrap_or(0.0) + parameter.scale();
                parameter.value = Some(parameter.declaration.nearest(start));
            }
            if free(&both) < free(model) {
                let second = second.id;
                found.push((Split { first, second }, both));
            }
        }
    }
    found
}

/// Makes two steps of one: the first with the error that its effect alone leaves, the second with that of both. Where an earlier
/// step has added the first, the one that is divided keeps the second.
fn divide(
    best: &Refined<'_>,
    steps: &mut Vec<ImprovementStep>,
    index: usize,
    effects: [&str; 2],
) -> Result<(), FitError> {
    let step = &steps[index];
    let Some(place) = step.added.clone() else {
        return Ok(());
    };
    let [first, second] = effects.map(|effect| EffectAt {
        effect: effect.to_owned(),
        at: place.at.clone(),
    });
    let known = steps[..index]
        .iter()
        .any(|s| s.added.as_ref() == Some(&first));
    let of = |added: EffectAt| ImprovementStep {
        added: Some(added),
        entries: None,
        round: None,
        nrmse_fit: step.nrmse_fit,
        nrmse_test: step.nrmse_test,
        still_open: Vec::new(),
    };
    let second = of(second);
    if known {
        steps[index] = second;
        return Ok(());
    }
    let mut first = of(first);
    first.round = step.round;
    let later = steps[index + 1..].iter().chain([&second]);
    let alone = later
        .filter(|step| step.added.is_some())
        .try_fold(best.model.clone(), |model, step| without_step(&model, step));
    let silent = best.work.silently();
    if let Some(alone) = alone
        && let Ok((error, fitted)) = refitted(&alone, best.measurements, &silent)
    {
        let runs = Measurements::new(best.measurements.runs);
        first.nrmse_fit = free_run_error(&fitted, &runs, &silent)?;
        first.nrmse_test = error;
    }
    steps.splice(index..=index, [first, second]);
    Ok(())
}
