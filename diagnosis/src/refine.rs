//! Corrections to a model once another effect was added to it.

use std::collections::BTreeSet;

use loopsight_model::model::{Attached, Model};
use rayon::prelude::*;

use crate::conclusion::{Diagnosis, Explanation};
use crate::effect_at::{EffectAt, instances};
use crate::error::FitError;
use crate::improvement::ImprovementStep;
use crate::measurements::Measurements;
use crate::progress::Work;
use crate::refined::{Alike, Refined};
use crate::sharpness::{sharpened, sharper_ones, softened};
use crate::simplify::{free, simpler, simplified};
use crate::split::split;

/// Corrects `model` after the last of `steps`:
///
/// * an effect that the last one made needless is removed, and its step with it;
/// * a simpler effect replaces one that contains it, where the error hardly grows; so do two with fewer parameters;
/// * an effect that the last of the `diagnoses` did not name is replaced by a twin, which the data could not tell from it when it
///   was added, where the error falls; by the same effect at fewer places only where nothing else is missing then;
/// * the sign of the last effect is made sharper while the error falls, and then those of the others; these are made softer
///   where little but noise is left.
///
/// The steps are changed with the model. If the work is cancelled, the two still agree. None where the last step is no
/// more than another name for an earlier one; then nothing is changed. Otherwise what was tried in place of the model that
/// remains: each fitted, with its error.
pub(crate) fn refine(
    model: &mut Model,
    steps: &mut Vec<ImprovementStep>,
    diagnoses: &[Diagnosis],
    measurements: &Measurements<'_>,
    work: &Work<'_>,
) -> Result<Option<Vec<(f64, Model)>>, FitError> {
    let mut best = Refined::new(model, measurements, work);
    // Mostly nothing is taken, so that what the next stages try is known.
    let fewer = with_fewer(best.model, steps);
    best.try_all(&fewer)?;
    if !needless(&mut best, steps)? {
        return Ok(None);
    }
    simplified(&mut best, steps)?;
    if is_named_before(steps) {
        return Ok(None);
    }
    split(&mut best, steps, diagnoses)?;
    let others = with_others(best.model, steps, diagnoses);
    best.try_all(&others)?;
    reconsidered(&mut best, steps, diagnoses)?;
    sharpened(&mut best, steps)?;
    let floor = diagnoses.last().map_or(0.0, |last| last.floor.nrmse);
    softened(&mut best, steps, floor)?;
    Ok(Some(best.fitted()))
}

/// The models without an effect, or with a simpler one. (What one may be split into is much, and comes last.)
fn with_fewer(model: &Model, steps: &[ImprovementStep]) -> Vec<Model> {
    let mut all: Vec<Model> = models(spared(model, steps)).collect();
    for place in steps.iter().filter_map(|step| step.added.as_ref()) {
        all.extend(models(simpler(model, place)));
    }
    all
}

/// The models with a twin in place of an effect, or with sharper signs.
fn with_others(model: &Model, steps: &[ImprovementStep], diagnoses: &[Diagnosis]) -> Vec<Model> {
    let twins = |step| models(twins_in(model, step, diagnoses));
    let earlier = steps.iter().filter(|step| is_earlier(step, diagnoses));
    let all = earlier.flat_map(twins);
    // The sharper signs take longest.
    let sharper = sharper_ones(model, steps).into_iter();
    sharper.chain(all).collect()
}

/// The models of some candidates.
fn models<T>(candidates: Vec<(T, Model)>) -> impl Iterator<Item = Model> {
    candidates.into_iter().map(|(_, model)| model)
}

/// The models without one of the earlier steps' effects, by the index of the step.
fn spared(model: &Model, steps: &[ImprovementStep]) -> Vec<(usize, Model)> {
    // The last effect was just found missing, so it stays.
    let earlier = steps.iter().enumerate().take(steps.len().saturating_sub(1));
    let models = earlier.filter_map(|(index, step)| Some((index, without_step(model, step)?)));
    models.collect()
}

/// Removes effects of earlier steps without which the error is the same: what looked like a dead zone may have
/// been part of the friction that was added after it.
///
/// Where the last step itself hardly lowered the error, it is another name for such an effect. What else is missing may
/// decide between the two then, so nothing is removed. Whether the last step stays.
fn needless(best: &mut Refined<'_>, steps: &mut Vec<ImprovementStep>) -> Result<bool, FitError> {
    let criteria = best.work.criteria();
    let (close, better) = (criteria.choice.close, criteria.improve.better);
    let hardly = match &steps[..] {
        [.., before, last] => last.nrmse_test >= better * before.nrmse_test,
        _ => false,
    };
    let all = best.model.clone();
    while let Some(index) = best.takes(spared(best.model, steps), |_| close)? {
        if hardly {
            *best.model = all;
            return Ok(false);
        }
        steps.remove(index);
    }
    Ok(true)
}

/// Whether the last of `steps` adds what an earlier one has: it took the place of that one, and is no more than it.
fn is_named_before(steps: &[ImprovementStep]) -> bool {
    let last = steps.split_last();
    last.is_some_and(|(last, earlier)| earlier.iter().any(|step| step.added == last.added))
}

/// The model without the effect of `step`; none where it has none of it.
pub(crate) fn without_step(model: &Model, step: &ImprovementStep) -> Option<Model> {
    let instances = instances(model, step.added.as_ref()?);
    (!instances.is_empty()).then(|| without(model, &instances))?
}

/// The model without the effects of some `steps`; none where it has none of one.
pub(crate) fn without_steps(model: &Model, steps: &[ImprovementStep]) -> Option<Model> {
    let mut added = steps.iter().filter(|step| step.added.is_some());
    added.try_fold(model.clone(), |model, step| without_step(&model, step))
}

/// The model without some of its effects.
fn without(model: &Model, effects: &[usize]) -> Option<Model> {
    effects
        .iter()
        .rev()
        .try_fold(model.clone(), |model, index| model.without_effect(*index))
}

/// Replaces added effects by ones that the data could not tell from them at first, where the error falls: once
/// friction is in the model, a late command can be told from a late sensor. Where that changes an earlier one, the last one was chosen
/// beside another effect, and is compared with its twins as well.
fn reconsidered(
    best: &mut Refined<'_>,
    steps: &mut [ImprovementStep],
    diagnoses: &[Diagnosis],
) -> Result<(), FitError> {
    let (mut earlier, mut last): (Vec<_>, Vec<_>) =
        (steps.iter_mut()).partition(|step| is_earlier(step, diagnoses));
    let mut changed = false;
    for step in &mut earlier {
        changed |= is_exchanged(best, step, diagnoses)?;
    }
    if changed {
        for step in &mut last {
            is_exchanged(best, step, diagnoses)?;
        }
    }
    Ok(())
}

/// Replaces the effect of a step by the best of its twins, where the error falls; whether it does.
fn is_exchanged(
    best: &mut Refined<'_>,
    step: &mut ImprovementStep,
    diagnoses: &[Diagnosis],
) -> Result<bool, FitError> {
    let Some(place) = step.added.as_ref() else {
        return Ok(false);
    };
    let criteria = best.work.criteria();
    let better = criteria.improve.better;
    let floor = diagnoses.last().map_or(0.0, |d| d.floor.nrmse);
    let twins = twins_in(best.model, step, diagnoses).into_iter();
    let (narrower, others): (Vec<_>, Vec<_>) =
        twins.partition(|(twin, _)| is_narrower(twin, place));
    let mut taken = best
        .takes_below(others, |_| better, f64::INFINITY)?
        .cloned();
    if taken.is_none() {
        // At one side it also stands for whatever else makes the sides differ, while that is missing.
        let most = criteria.missing.above_floor * floor;
        taken = best.takes_below(narrower, |_| better, most)?.cloned();
    }
    let Some(taken) = taken else {
        return Ok(false);
    };
    if let Some(other) = named(step, diagnoses, &taken) {
        (step.nrmse_fit, step.nrmse_test) = (other.nrmse_fit, other.nrmse);
    }
    step.added = Some(taken);
    Ok(true)
}

/// The models with what the data could not tell from the effect of a `step` in its place.
fn twins_in<'s>(
    model: &Model,
    step: &'s ImprovementStep,
    diagnoses: &[Diagnosis],
) -> Vec<(&'s EffectAt, Model)> {
    let Some(place) = step.added.as_ref() else {
        return Vec::new();
    };
    let twins = step.twins.iter().filter(|twin| *twin != place);
    let models = twins.filter_map(|twin| {
        let found = named(step, diagnoses, twin);
        Some((twin, exchanged(model, place, twin, found)?))
    });
    models.collect()
}

/// Whether the last of the `diagnoses` did not name the effect of a `step`: that has just compared it with its twins.
fn is_earlier(step: &ImprovementStep, diagnoses: &[Diagnosis]) -> bool {
    step.round.is_none_or(|round| round + 1 < diagnoses.len())
}

/// Whether an effect is another one at fewer of its places.
fn is_narrower(this: &EffectAt, other: &EffectAt) -> bool {
    let within = this.at.iter().all(|at| other.at.contains(at));
    this.effect == other.effect && within && this.at.len() < other.at.len()
}

/// For each of `steps`, the effects that the data still cannot tell from its own at the end. These are twins of its diagnosis:
/// with one in its place, the finished `model`, as that diagnosis fitted it or fitted again, is about as good. Its error then
/// is not larger by more than the ratio `improve.better`, which also makes [`refine`] exchange effects. A twin that no longer
/// fits into the model is left out.
///
/// Those that were `tried` in the last [`refine`], with the other effects that the model still has, are not fitted again.
pub(crate) fn still_open(
    model: &Model,
    steps: &[ImprovementStep],
    diagnoses: &[Diagnosis],
    tried: &[(f64, Model)],
    measurements: &Measurements<'_>,
    work: &Work<'_>,
) -> Result<Vec<Vec<EffectAt>>, FitError> {
    let candidates: Vec<(usize, &EffectAt, Model)> = steps
        .iter()
        .enumerate()
        .flat_map(|(index, step)| {
            let twins = twins_in(model, step, diagnoses).into_iter();
            twins.map(move |(twin, exchanged)| (index, twin, exchanged))
        })
        .collect();
    let mut open = vec![Vec::new(); steps.len()];
    if candidates.is_empty() {
        return Ok(open);
    }
    let silent = work.silently();
    let alike = Alike::new(model, measurements, &silent)?;
    let bar = match alike.error(model, &silent).map_err(FitError::from) {
        Err(FitError::Cancelled(cancelled)) => return Err(cancelled.into()),
        // Nothing can be told from a model whose free run diverges.
        Err(_) => return Ok(open),
        Ok(error) => error / work.criteria().improve.better,
    };
    let leaves = |model: &Model| alike.error(model, &silent);
    let good = |(index, twin, exchanged): &(usize, &EffectAt, Model)| {
        let same = |model: &Model| has_the_effects_of(model, exchanged);
        if let Some((error, _)) = tried.iter().find(|(_, model)| same(model)) {
            return *error <= bar;
        }
        let diagnosed = named(&steps[*index], diagnoses, twin).map(|twin| &twin.model);
        let diagnosed = diagnosed.filter(|model| same(model));
        // One that a diagnosis fitted needs no other fit.
        diagnosed.is_some_and(|model| leaves(model).is_ok_and(|error| error <= bar))
            || alike
                .refitted(diagnosed.unwrap_or(exchanged), &silent)
                .is_ok_and(|(error, _)| error <= bar)
    };
    let found: Vec<_> = candidates.into_par_iter().filter(good).collect();
    // After a cancellation some were not tried.
    work.go_on()?;
    for (index, twin, _) in found {
        open[index].push(twin.clone());
    }
    Ok(open)
}

/// What the diagnosis that named a `step` says of a twin of it.
fn named<'d>(
    step: &ImprovementStep,
    diagnoses: &'d [Diagnosis],
    twin: &EffectAt,
) -> Option<&'d Explanation> {
    diagnoses.get(step.round?)?.explanation(twin)
}

/// Whether two models have the same effects, with as many parameters that are fitted.
pub(crate) fn has_the_effects_of(model: &Model, other: &Model) -> bool {
    let effects = |model: &Model| -> BTreeSet<(&str, Vec<&str>)> {
        let of = |effect: &Attached| (effect.meta.id, effect.at.iter().map(|c| c.id).collect());
        model.effects.iter().map(of).collect()
    };
    effects(model) == effects(other) && free(model) == free(other)
}

/// The model with the effect of `other` in place of that of `place`. Parameters of the same name keep their
/// values, others begin as its diagnosis `found` them, or at a noticeable size.
fn exchanged(
    model: &Model,
    place: &EffectAt,
    other: &EffectAt,
    found: Option<&Explanation>,
) -> Option<Model> {
    let instances = instances(model, place);
    let (first, others) = instances.split_first()?;
    let known: Vec<&str> = model.effects[*first]
        .meta
        .parameters
        .iter()
        .map(|p| p.id)
        .collect();
    let at: Vec<&str> = other.at.iter().map(String::as_str).collect();
    let mut candidate = without(model, others)?.with_effect_replaced(*first, &other.effect, &at)?;
    let effect = &candidate.effects[*first];
    let own = effect.own();
    for parameter in &mut candidate.parameters[own] {
        if parameter.free && !known.contains(&parameter.declaration.id) {
            let neutral = parameter.value.unwrap_or(0.0);
            let found = found.and_then(|e| e.parameters.get(parameter.declaration.id));
            let found = found
                .map(|e| e.value)
                .filter(|found| found.is_finite() && *found != neutral);
            let start = found.unwrap_or(neutral + parameter.scale());
            parameter.value = Some(parameter.declaration.nearest(start));
        }
    }
    Some(candidate)
}

#[cfg(test)]
mod tests {
    use loopsight_plants as _;

    use std::collections::BTreeMap;

    use loopsight_model::model::ModelParameter;

    use super::*;
    use crate::estimate::{Estimate, ParameterVerdict};

    #[test]
    fn a_twin_begins_as_its_diagnosis_found_it() {
        let friction = Explanation::at_shaft("coulomb_friction", 0.05);
        let spring = Explanation::at_shaft("linear_stiffness", 0.05);
        let start = |stiffness: Option<f64>| {
            let estimate = |value| Estimate {
                value,
                unit: "V/rad".to_owned(),
                std_error: None,
                interval95: None,
                verdict: ParameterVerdict::Good,
            };
            let found = stiffness.map(|value| Explanation {
                parameters: BTreeMap::from([("stiffness".to_owned(), estimate(value))]),
                ..spring.clone()
            });
            let (model, place) = (&friction.model, &friction.place);
            let with = exchanged(model, place, &spring.place, found.as_ref()).unwrap();
            let named = |p: &&ModelParameter| p.name == "linear_stiffness.stiffness";
            with.parameters.iter().find(named).unwrap().value.unwrap()
        };
        let declared = start(None);
        assert!(declared > 0.0);
        assert_eq!(start(Some(0.0017)), 0.0017);
        // From nothing a fit may not come away.
        assert_eq!(start(Some(0.0)), declared);
    }

    #[test]
    fn an_effect_that_became_an_earlier_one_is_no_further_step() {
        let step = ImprovementStep::at_shaft;
        let steps = |names: &[Option<&str>]| names.iter().map(|name| step(*name)).collect();
        let is_named = |names: &[Option<&str>]| {
            let steps: Vec<ImprovementStep> = steps(names);
            is_named_before(&steps)
        };
        assert!(!is_named(&[None]));
        assert!(!is_named(&[
            None,
            Some("coulomb_friction"),
            Some("input_lead")
        ]));
        assert!(is_named(&[
            None,
            Some("coulomb_friction"),
            Some("coulomb_friction")
        ]));
    }
}
