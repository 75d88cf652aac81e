//! An effect that is two simpler ones.
//!
//! Friction that falls with the speed and quadratic drag both bend the line of force over speed. Alone, the first explains more
//! of a machine that has dry friction and drag. Friction of two directions does so of one that has dry friction and a weight.

use loopsight_model::model::Model;
use loopsight_model::registry;

use crate::conclusion::{Diagnosis, Explanation};
use crate::diagnose::{Aim, diagnose_for};
use crate::effect_at::{EffectAt, instances};
use crate::error::FitError;
use crate::improvement::ImprovementStep;
use crate::measurements::Measurements;
use crate::moves::Moves;
use crate::progress::Work;
use crate::refine::without_steps;
use crate::refined::{Alike, Refined};
use crate::simplify::free;
use crate::suited::suit;

/// Two effects in place of one: those of `first` and `second`, at its channels.
struct Split {
    first: &'static str,
    second: &'static str,
    /// Their indices in the model with both.
    at: [usize; 2],
}

/// Replaces an added effect by a simpler one that it contains and a second one that it does not, where both together have fewer
/// parameters and the error is the same or smaller. A step for the second one is put behind that of the first.
pub(crate) fn split(
    best: &mut Refined<'_>,
    steps: &mut Vec<ImprovementStep>,
    diagnoses: &[Diagnosis],
) -> Result<(), FitError> {
    let close = best.work.criteria().choice.close;
    let mut index = 0;
    while index < steps.len() {
        let mut candidates = match steps[index].added.as_ref() {
            Some(place) => splits(best.model, place),
            None => Vec::new(),
        };
        if !candidates.is_empty() {
            let (rms, commands, motion) = best.moves()?;
            let sign_width = best.work.criteria().search.sign_width;
            for (split, both) in &mut candidates {
                suit(both, &rms, &commands, sign_width);
                let moves = Moves::of_last(both, &rms, &commands);
                let own = both.effects.last().map_or(0, |e| e.first_parameter);
                for parameter in &mut both.parameters[own..] {
                    let start = parameter.value.unwrap_or(0.0) + moves.first_step(parameter);
                    parameter.value = Some(parameter.declaration.nearest(start));
                }
                motion.begin(both, &split.at);
            }
        }
        if let Some(Split { first, second, .. }) = best.takes(candidates, |_| close)? {
            divide(best, steps, index, [first, second], diagnoses)?;
        }
        index += 1;
    }
    Ok(())
}

/// What may stand in place of the effect at `place`, neutral.
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
            let Some(both) = simpler.with_effect(second.id, &at) else {
                continue;
            };
            if free(&both) < free(model) {
                let split = Split {
                    first,
                    second: second.id,
                    at: [instance, both.effects.len() - 1],
                };
                found.push((split, both));
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
    diagnoses: &[Diagnosis],
) -> Result<(), FitError> {
    let step = &steps[index];
    let Some(place) = step.added.clone() else {
        return Ok(());
    };
    let [first, second] = effects.map(|effect| EffectAt {
        effect: effect.to_owned(),
        at: place.at.clone(),
    });
    let diagnosis = step.round.and_then(|round| diagnoses.get(round));
    let better = best.work.criteria().improve.better;
    let mut both = ImprovementStep {
        twins: diagnosis.map_or(Vec::new(), |diagnosis| as_good(&second, diagnosis, better)),
        added: Some(second),
        round: None,
        ..step.clone()
    };
    let later = &steps[index + 1..];
    measure(&mut both, best, later)?;
    let known = |s: &ImprovementStep| s.added.as_ref() == Some(&first);
    if steps[..index].iter().any(known) {
        steps[index] = both;
        return Ok(());
    }
    let named = diagnosis.and_then(|diagnosis| diagnosis.explanation(&first));
    let mut alone = ImprovementStep {
        added: Some(first),
        ..step.clone()
    };
    if let Some(named) = named {
        (alone.nrmse_fit, alone.nrmse_test) = (named.nrmse_fit, named.nrmse);
    } else {
        let others: Vec<ImprovementStep> = later.iter().chain([&both]).cloned().collect();
        measure(&mut alone, best, &others)?;
    }
    steps.splice(index..=index, [alone, both]);
    Ok(())
}

/// Of two steps that one was made into, nothing has compared the second with other effects. So the `model` without it and what was
/// added after it is diagnosed, with `aim`: if what that names does better than all of these, then how many of the `steps` remain,
/// their model and the diagnosis. That is judged once: those among the steps `before` the last round were.
pub(crate) fn second_anew(
    model: &Model,
    steps: &[ImprovementStep],
    before: &[ImprovementStep],
    aim: Aim,
    measurements: &Measurements<'_>,
    work: &Work<'_>,
) -> Result<Option<(usize, Model, Diagnosis)>, FitError> {
    let is_new = |second: &ImprovementStep| {
        second.round.is_none() && before.iter().all(|step| step.added != second.added)
    };
    let (Some(remain), [.., last]) = (steps.iter().position(is_new), steps) else {
        return Ok(None);
    };
    let second = &steps[remain];
    let Some(without) = without_steps(model, &steps[remain..]) else {
        return Ok(None);
    };
    let diagnosis = match diagnose_for(&without, measurements, aim, work) {
        // Only all together lead anywhere.
        Err(error) if error.is_divergence() => return Ok(None),
        done => done?,
    };
    let candidates = &diagnosis.candidates;
    let is_second = |c: &&Explanation| second.added.as_ref() == Some(&c.place);
    let kept = candidates.iter().find(is_second);
    let kept = kept.filter(|_| remain + 1 == steps.len());
    let left = kept.map_or(last.nrmse_test, |kept| kept.nrmse);
    let better = work.criteria().improve.better * left;
    let named = candidates.first().filter(|_| diagnosis.missing.is_some());
    let does_better = named.is_some_and(|named| named.nrmse < better);
    Ok(does_better.then_some((remain, without, diagnosis)))
}

/// What does about as well as the effect at `place` by itself, where a diagnosis has it among its explanations.
fn as_good(place: &EffectAt, diagnosis: &Diagnosis, better: f64) -> Vec<EffectAt> {
    let Some(own) = diagnosis.explanation(place) else {
        return Vec::new();
    };
    let near = |other: &&Explanation| {
        better * other.nrmse <= own.nrmse && better * own.nrmse <= other.nrmse
    };
    (diagnosis.candidates.iter().filter(near))
        .map(|other| other.place.clone())
        .collect()
}

/// Puts into a `step` the errors of the model without the effects of `others`, where that can be fitted.
fn measure(
    step: &mut ImprovementStep,
    best: &Refined<'_>,
    others: &[ImprovementStep],
) -> Result<(), FitError> {
    let silent = best.work.silently();
    if let Some(without) = without_steps(best.model, others)
        && let alike = Alike::new(&without, best.measurements, &silent)?
        && let Ok((error, fitted)) = alike.refitted(&without, &silent)
    {
        step.nrmse_fit = alike.error_fit(&fitted, &silent)?;
        step.nrmse_test = error;
    }
    Ok(())
}
