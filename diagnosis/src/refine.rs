//! Corrections to a model once another effect was added to it.

use std::collections::BTreeSet;

use loopsight_model::model::{Attached, Model, ModelParameter};
use rayon::prelude::*;

use crate::compare::free_run_error;
use crate::conclusion::Diagnosis;
use crate::effect_at::EffectAt;
use crate::error::FitError;
use crate::estimate::{Estimate, ParameterVerdict, strength_is_determined};
use crate::fitted::Fit;
use crate::improvement::ImprovementStep;
use crate::measurements::Measurements;
use crate::output_error::fitted_values;
use crate::progress::{Cancelled, Stage, Work};
use crate::solve::Effort;
use crate::split::split;
use crate::suited::smooth;

/// Corrects `model` after the last of `steps`:
///
/// * an effect that the last one made needless is removed, and its step with it;
/// * a simpler effect replaces one that contains it, where the error hardly grows; so do two with fewer parameters;
/// * an effect that the data could not tell from an earlier one replaces it, where the error falls (the
///   `diagnoses` of the earlier steps name them); the same effect at fewer places only where nothing else is missing
///   then;
/// * the sign of the last effect is made sharper while the error falls.
///
/// The steps are changed with the model. If the work is cancelled, the two still agree. False where the last step is no
/// more than another name for an earlier one; then nothing is changed.
pub(crate) fn refine(
    model: &mut Model,
    steps: &mut Vec<ImprovementStep>,
    diagnoses: &[Diagnosis],
    measurements: &Measurements<'_>,
    work: &Work<'_>,
) -> Result<bool, FitError> {
    let mut best = Refined {
        model,
        error: None,
        measurements,
        work,
        changes: 0,
    };
    if !needless(&mut best, steps)? {
        return Ok(false);
    }
    simplified(&mut best, steps)?;
    split(&mut best, steps)?;
    reconsidered(&mut best, steps, diagnoses)?;
    sharpened(&mut best)?;
    Ok(true)
}

/// The models without one of the earlier steps' effects, by the index of the step.
fn spared(best: &Refined<'_>, steps: &[ImprovementStep]) -> Vec<(usize, Model)> {
    // The last effect was just found missing, so it stays.
    let earlier = steps.iter().enumerate().take(steps.len().saturating_sub(1));
    let models = earlier.filter_map(|(index, step)| {
        let instances = instances(best.model, step.added.as_ref()?);
        instances.first()?;
        Some((index, without(best.model, &instances)?))
    });
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
    while let Some(index) = best.takes(spared(best, steps), |_| close)? {
        if hardly {
            *best.model = all;
            return Ok(false);
        }
        steps.remove(index);
    }
    Ok(true)
}

/// Whether the log does not say how strong the effect of `step` is.
pub(crate) fn is_undetermined(fit: &Fit, step: &ImprovementStep, undetermined: f64) -> bool {
    !strength_is_determined(estimated(fit, step).into_iter(), undetermined)
}

/// Whether the log leaves open most of what is fitted of the effect of `step`: then it is a shape that suits the rest of the
/// error, and not what is behind it.
pub(crate) fn is_mostly_open(fit: &Fit, step: &ImprovementStep) -> bool {
    let own = estimated(fit, step);
    let fitted = own.iter().filter(|(parameter, _)| parameter.free);
    let open = fitted
        .clone()
        .filter(|(_, e)| e.verdict != ParameterVerdict::Good);
    2 * open.count() > fitted.count()
}

/// The parameters of the effect of `step`, with their estimates.
pub(crate) fn estimated<'f>(
    fit: &'f Fit,
    step: &ImprovementStep,
) -> Vec<(&'f ModelParameter, &'f Estimate)> {
    let model = &fit.model;
    let instances = step.added.iter().flat_map(|place| instances(model, place));
    let of_effect = |i: usize| {
        let effect = &model.effects[i];
        let own = effect.first_parameter..effect.first_parameter + effect.meta.parameters.len();
        model.parameters[own].iter()
    };
    (instances.flat_map(of_effect))
        .filter_map(|p| Some((p, fit.parameters.get(&p.name)?)))
        .collect()
}

/// Whether an added effect takes from the log what it said of another one: a parameter of an effect that was determined
/// in the fit `alone` has at least `times` the standard error in the fit `with` the added one.
pub(crate) fn blurs(alone: &Fit, with: &Fit, undetermined: f64, times: f64) -> bool {
    let effects = alone.model.effects.iter();
    let mut names = effects.flat_map(|effect| {
        let parameters = alone.model.parameters.iter().skip(effect.first_parameter);
        parameters.take(effect.meta.parameters.len())
    });
    names.any(|parameter| {
        let estimates = [alone, with].map(|fit| fit.parameters.get(&parameter.name));
        let [Some(before), Some(after)] = estimates else {
            return false;
        };
        let Some(error) = before
            .std_error
            .filter(|_| before.is_determined(undetermined))
        else {
            return false;
        };
        after
            .std_error
            .is_none_or(|blurred| blurred >= times * error)
    })
}

/// The model without the effect of `step`; none where it has none of it.
pub(crate) fn without_step(model: &Model, step: &ImprovementStep) -> Option<Model> {
    let instances = instances(model, step.added.as_ref()?);
    (!instances.is_empty()).then(|| without(model, &instances))?
}

/// The model without some of its effects.
fn without(model: &Model, effects: &[usize]) -> Option<Model> {
    effects
        .iter()
        .rev()
        .try_fold(model.clone(), |model, index| model.without_effect(*index))
}

/// Parameters that are fitted.
pub(crate) fn free(model: &Model) -> usize {
    model.parameters.iter().filter(|p| p.free).count()
}

/// Replaces an added effect by a simpler one that it contains, where the error hardly grows: what looked like
/// breakaway friction may have been friction with a delay that was still missing. The step then names the
/// simpler effect.
fn simplified(best: &mut Refined<'_>, steps: &mut [ImprovementStep]) -> Result<(), FitError> {
    let criteria = &best.work.criteria().choice;
    for place in steps.iter_mut().filter_map(|step| step.added.as_mut()) {
        let instances = instances(best.model, place);
        let Some(effect) = instances.first().map(|i| &best.model.effects[*i]) else {
            continue;
        };
        let simpler = effect.meta.simpler.iter().filter_map(|id| {
            let candidate = instances.iter().try_fold(best.model.clone(), |model, i| {
                let at: Vec<&str> = model.effects[*i].at.iter().map(|c| c.id).collect();
                model.with_effect_replaced(*i, id, &at)
            });
            Some((*id, candidate?))
        });
        let many = free(best.model);
        let share = |model: &Model| criteria.allowance(many, free(model));
        if let Some(id) = best.takes(simpler.collect(), share)? {
            id.clone_into(&mut place.effect);
        }
    }
    Ok(())
}

/// Replaces an added effect by one that the data could not tell from it at first, where the error falls: once
/// friction is in the model, a late command can be told from a late sensor.
fn reconsidered(
    best: &mut Refined<'_>,
    steps: &mut [ImprovementStep],
    diagnoses: &[Diagnosis],
) -> Result<(), FitError> {
    let criteria = best.work.criteria();
    let better = criteria.improve.better;
    let floor = diagnoses.last().map_or(0.0, |d| d.floor.nrmse);
    for step in steps {
        let others = twins(step, diagnoses);
        let Some(place) = step.added.as_mut() else {
            continue;
        };
        let (narrower, others): (Vec<_>, Vec<_>) = others
            .into_iter()
            .partition(|other| is_narrower(other, place));
        for (others, most) in [
            (others, f64::INFINITY),
            // At one side it also stands for whatever else makes the sides differ, while that is missing.
            (narrower, criteria.missing.above_floor * floor),
        ] {
            let candidates = others.into_iter();
            let candidates = candidates
                .filter_map(|other| Some((other, exchanged(best.model, place, other)?)))
                .collect();
            if let Some(other) = best.takes_below(candidates, |_| better, most)? {
                *place = other.clone();
                break;
            }
        }
    }
    Ok(())
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
pub(crate) fn still_open(
    model: &Model,
    steps: &[ImprovementStep],
    diagnoses: &[Diagnosis],
    measurements: &Measurements<'_>,
    work: &Work<'_>,
) -> Result<Vec<Vec<EffectAt>>, FitError> {
    let candidates: Vec<((usize, &EffectAt), Model)> = steps
        .iter()
        .enumerate()
        .filter_map(|(index, step)| Some((index, step.added.as_ref()?, twins(step, diagnoses))))
        .flat_map(|(index, place, twins)| twins.into_iter().map(move |twin| (index, place, twin)))
        .filter_map(|(index, place, twin)| {
            let exchanged = exchanged(model, place, twin)?;
            let known = diagnosed(&steps[index], diagnoses, twin, &exchanged);
            Some(((index, twin), known.unwrap_or(exchanged)))
        })
        .collect();
    let mut open = vec![Vec::new(); steps.len()];
    if candidates.is_empty() {
        return Ok(open);
    }
    let silent = work.silently();
    let judging = Measurements::new(measurements.judging());
    let bar = match free_run_error(model, &judging, &silent).map_err(FitError::from) {
        Err(FitError::Cancelled(cancelled)) => return Err(cancelled.into()),
        // Nothing can be told from a model whose free run diverges.
        Err(_) => return Ok(open),
        Ok(error) => error / work.criteria().improve.better,
    };
    let good = |model: &Model| {
        // One that a diagnosis fitted needs no other fit.
        let begins = free_run_error(model, &judging, &silent);
        begins.is_ok_and(|error| error <= bar)
            || refitted(model, measurements, &silent).is_ok_and(|(error, _)| error <= bar)
    };
    let found: Vec<_> = (candidates.into_par_iter())
        .filter(|(_, model)| good(model))
        .map(|(of, _)| of)
        .collect();
    // After a cancellation some were not tried.
    work.go_on()?;
    for (index, twin) in found {
        open[index].push(twin.clone());
    }
    Ok(open)
}

/// The model that the diagnosis of a `step` fitted with the `twin` of its effect, where it has the effects of `exchanged`:
/// nothing else was changed since.
fn diagnosed(
    step: &ImprovementStep,
    diagnoses: &[Diagnosis],
    twin: &EffectAt,
    exchanged: &Model,
) -> Option<Model> {
    let candidates = &diagnoses.get(step.round?)?.candidates;
    let effects = |model: &Model| -> BTreeSet<(&str, Vec<&str>)> {
        let of = |effect: &Attached| (effect.meta.id, effect.at.iter().map(|c| c.id).collect());
        model.effects.iter().map(of).collect()
    };
    let model = &candidates.iter().find(|c| c.place == *twin)?.model;
    let same = effects(model) == effects(exchanged) && free(model) == free(exchanged);
    same.then(|| model.clone())
}

/// What the data could not tell from the effect of a step when it was added.
fn twins<'a>(step: &ImprovementStep, diagnoses: &'a [Diagnosis]) -> Vec<&'a EffectAt> {
    let named = (step.round).and_then(|round| diagnoses.get(round)?.candidates.first());
    let class = named
        .iter()
        .flat_map(|n| std::iter::once(&n.place).chain(&n.indistinguishable_from));
    class.filter(|p| step.added.as_ref() != Some(p)).collect()
}

/// The model with the effect of `other` in place of that of `place`. Parameters of the same name keep their
/// values, others begin at a noticeable size.
fn exchanged(model: &Model, place: &EffectAt, other: &EffectAt) -> Option<Model> {
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
    let own = effect.first_parameter..effect.first_parameter + effect.meta.parameters.len();
    for parameter in &mut candidate.parameters[own] {
        if parameter.free && !known.contains(&parameter.declaration.id) {
            let start = parameter.value.unwrap_or(0.0) + parameter.scale();
            parameter.value = Some(parameter.declaration.nearest(start));
        }
    }
    Some(candidate)
}

/// A model, and others that may take its place.
pub(crate) struct Refined<'a> {
    pub(crate) model: &'a mut Model,
    /// Its error, once it was computed.
    error: Option<f64>,
    pub(crate) measurements: &'a Measurements<'a>,
    pub(crate) work: &'a Work<'a>,
    /// Changes that were tried.
    changes: u64,
}

impl Refined<'_> {
    /// Takes the best of the fitted `candidates` whose error is below their `share` of the present one. Candidates
    /// that cannot be fitted, because their free run diverges, do not count.
    pub(crate) fn takes<T: Send>(
        &mut self,
        candidates: Vec<(T, Model)>,
        share: impl Fn(&Model) -> f64 + Sync,
    ) -> Result<Option<T>, FitError> {
        self.takes_below(candidates, share, f64::INFINITY)
    }

    /// As [`Refined::takes`], of those whose error is at `most` so large.
    fn takes_below<T: Send>(
        &mut self,
        candidates: Vec<(T, Model)>,
        share: impl Fn(&Model) -> f64 + Sync,
        most: f64,
    ) -> Result<Option<T>, FitError> {
        if candidates.is_empty() {
            return Ok(None);
        }
        self.changes += candidates.len() as u64;
        self.work.tell(Stage::Refining, self.changes, self.changes);
        let silent = self.work.silently();
        let (now, fitted) = rayon::join(
            || match self.error {
                Some(now) => Ok(now),
                // Any other model is better than one whose free run diverges.
                None => match refitted(self.model, self.measurements, &silent) {
                    Err(FitError::Cancelled(cancelled)) => Err(cancelled),
                    found => Ok(found.map_or(f64::INFINITY, |(error, _)| error)),
                },
            },
            || all_refitted(candidates, self.measurements, &silent),
        );
        let now = now?;
        self.error = Some(now);
        let good = |model: &Model, error: f64| error <= (share(model) * now).min(most);
        let best = (fitted?.into_iter())
            .filter(|(_, error, model)| good(model, *error))
            .min_by(|a, b| a.1.total_cmp(&b.1));
        Ok(best.map(|(what, error, model)| {
            *self.model = model;
            self.error = Some(error);
            what
        }))
    }
}

/// Indices of a step's effect in `model`: one, or one for each of its channels; none when another effect has
/// replaced it.
pub(crate) fn instances(model: &Model, place: &EffectAt) -> Vec<usize> {
    let of_place = |e: &Attached| {
        e.meta.id == place.effect && e.at.iter().all(|c| place.at.iter().any(|at| at == c.id))
    };
    (0..model.effects.len())
        .filter(|index| of_place(&model.effects[*index]))
        .collect()
}

/// The `candidates` after a short fit each, with their errors, in their order. Those that cannot be fitted, because their free
/// run diverges, are not among them.
fn all_refitted<T: Send>(
    candidates: Vec<(T, Model)>,
    measurements: &Measurements<'_>,
    work: &Work<'_>,
) -> Result<Vec<(T, f64, Model)>, Cancelled> {
    let refit = |(what, model)| {
        let (error, model) = refitted(&model, measurements, work).ok()?;
        Some((what, error, model))
    };
    let fitted = candidates.into_par_iter().filter_map(refit).collect();
    // After a cancellation some were not tried.
    work.go_on()?;
    Ok(fitted)
}

/// Effort of a short fit: errors are compared that differ by percents. (With a tolerance of 1e-4 the present model, where it
/// converges slowly, ends so much higher that a simpler one takes its place.)
const CORRECTION: Effort = Effort {
    iterations: 20,
    tolerance: 1e-6,
    worth: None,
};

/// The error of a model after a short fit, and the fitted model.
pub(crate) fn refitted(
    model: &Model,
    measurements: &Measurements<'_>,
    work: &Work<'_>,
) -> Result<(f64, Model), FitError> {
    let fitted = fitted_values(model, measurements.runs, CORRECTION, work)?;
    let judging = Measurements::new(measurements.judging());
    let error = free_run_error(&fitted, &judging, work)?;
    Ok((error, fitted))
}

/// Most halvings.
const HALVINGS: usize = 3;

/// Halves the smoothing width of the effect added last while that lowers the error.
fn sharpened(best: &mut Refined<'_>) -> Result<(), FitError> {
    let criteria = &best.work.criteria().improve;
    for _ in 0..HALVINGS {
        let mut candidate = best.model.clone();
        let Some(effect) = candidate.effects.last() else {
            break;
        };
        let (meta, first) = (effect.meta, effect.first_parameter);
        let added = candidate.effects.iter().rev();
        let count = added.take_while(|e| e.meta.id == meta.id).count();
        let width = (0..meta.parameters.len())
            .find(|i| meta.parameters[*i].is_width())
            .and_then(|i| candidate.parameters[first + i].value);
        let Some(width) = width else { break };
        smooth(&mut candidate, count, 0.5 * width);
        if best
            .takes(vec![((), candidate)], |_| criteria.sharper)?
            .is_none()
        {
            break;
        }
    }
    Ok(())
}
