//! Diagnose, add, refit, until nothing more is missing.

use loopsight_core::model::{Attached, Model};
use loopsight_core::run::Run;
use loopsight_recordings::Fault;
use serde::Serialize;

use crate::candidates::{is_width, smooth};
use crate::conclusion::{Conclusion, Diagnosis, Place};
use crate::diagnose::{LEAST, diagnose_above};
use crate::fit::{Fit, FitError, FitSettings, fit};

/// One step of an improvement.
#[derive(Clone, Debug, Serialize)]
pub struct Step {
    /// What was added, under the name that it has in the best model; `null` for the model as it was.
    pub added: Option<Place>,
    /// Free-run error on what the model was fitted to.
    pub nrmse_fit: f64,
    /// Free-run error on what it was not fitted to.
    pub nrmse_test: f64,
}

/// The result of [`improve`].
#[derive(Debug, Serialize)]
pub struct Improvement {
    /// The model as it was, then each addition.
    pub steps: Vec<Step>,
    /// What the last diagnosis concludes.
    pub verdict: Conclusion,
    /// The diagnoses, one per round.
    #[serde(skip)]
    pub diagnoses: Vec<Diagnosis>,
    /// The best model, fitted to all of the log; none where a diagnosis was refused.
    #[serde(skip)]
    pub best: Option<Fit>,
}

/// Share of the first error that a further effect must account for: beyond it a library finds
/// something for every wiggle.
const WORTH: f64 = 0.04;
/// Most effects that are added: beyond that a library is fitting, not explaining.
const MOST: usize = 6;

/// Repeats [`diagnose`](crate::diagnose()), adding what it finds missing, until it finds nothing more.
///
/// `progress` gets the round, and the candidates done and in all.
pub fn improve(
    model: &Model,
    runs: &[Run],
    test: Option<&[Run]>,
    faults: &[Fault],
    progress: &(dyn Fn(usize, u64, u64) + Sync),
) -> Result<Improvement, FitError> {
    let mut present = model.clone();
    let mut steps: Vec<Step> = Vec::new();
    let mut diagnoses = Vec::new();
    let mut first = None;
    let verdict = loop {
        let round = diagnoses.len();
        let least = first.map_or(LEAST, |nrmse: f64| (WORTH * nrmse).max(LEAST));
        let diagnosis = diagnose_above(&present, runs, test, faults, least, &|done, total| {
            progress(round, done, total);
        })?;
        let verdict = diagnosis.verdict;
        if let Some(fitted) = &diagnosis.model
            && steps.is_empty()
        {
            first = Some(diagnosis.nominal.nrmse);
            steps.push(Step {
                added: None,
                nrmse_fit: diagnosis.nominal_fit,
                nrmse_test: diagnosis.nominal.nrmse,
            });
            present = fitted.clone();
        }
        let next = match (&diagnosis.missing, diagnosis.candidates.first()) {
            (Some(_), Some(best)) if round < MOST => Some(best.clone()),
            _ => None,
        };
        diagnoses.push(diagnosis);
        let Some(best) = next else { break verdict };
        steps.push(Step {
            added: Some(best.place.clone()),
            nrmse_fit: best.nrmse_fit,
            nrmse_test: best.nrmse,
        });
        present = sharpened(
            simplified(best.model, &mut steps, runs, test, faults)?,
            runs,
            test,
            faults,
        )?;
    };
    let best = match verdict {
        Conclusion::LogFaulty | Conclusion::DataInsufficient => None,
        _ => Some(fit(
            &present,
            runs,
            test,
            faults,
            &FitSettings::default(),
            &|_, _| {},
        )?),
    };
    Ok(Improvement {
        steps,
        verdict,
        diagnoses,
        best,
    })
}

/// A simpler effect takes the place of an added one that contains it where the error hardly grows:
/// what looked like breakaway friction may have been friction with a delay that was still missing.
/// The step that added it is then one that added the simpler effect.
fn simplified(
    model: Model,
    steps: &mut [Step],
    runs: &[Run],
    test: Option<&[Run]>,
    faults: &[Fault],
) -> Result<Model, FitError> {
    let error = |m: &Model| refitted(m, runs, test, faults);
    let mut best = model;
    let mut least = None;
    for place in steps.iter_mut().filter_map(|step| step.added.as_mut()) {
        let instances = instances(&best, place);
        let Some(meta) = instances.first().map(|index| best.effects[*index].meta) else {
            continue;
        };
        for id in meta.simpler {
            let candidate = instances.iter().try_fold(best.clone(), |model, index| {
                model.with_effect_replaced(*index, id)
            });
            let Some(candidate) = candidate else {
                continue;
            };
            let now = match least {
                Some(now) => now,
                None => error(&best)?.0,
            };
            least = Some(now);
            let (after, fitted) = error(&candidate)?;
            if after < SIMPLER * now {
                best = fitted;
                least = Some(after);
                (*id).clone_into(&mut place.effect);
                break;
            }
        }
    }
    Ok(best)
}

/// Where the effect of a step stands among those of `model`: once, or once for each of its channels;
/// nowhere when another has taken its place.
fn instances(model: &Model, place: &Place) -> Vec<usize> {
    let of_place = |e: &Attached| {
        e.meta.id == place.effect && e.at.iter().all(|c| place.at.iter().any(|at| at == c.id))
    };
    (0..model.effects.len())
        .filter(|index| of_place(&model.effects[*index]))
        .collect()
}

/// How much the error may grow for a simpler explanation.
const SIMPLER: f64 = 1.02;

/// The error of a model after a short fit, and the fitted model.
fn refitted(
    model: &Model,
    runs: &[Run],
    test: Option<&[Run]>,
    faults: &[Fault],
) -> Result<(f64, Model), FitError> {
    let settings = FitSettings {
        max_iterations: 20,
        ..FitSettings::default()
    };
    let fitted = fit(model, runs, test, faults, &settings, &|_, _| {})?;
    Ok((fitted.comparison.nrmse, fitted.model))
}

/// How much the error must fall for a sign to be smoothed over half as much.
const SHARPER: f64 = 0.99;
/// Most halvings.
const HALVINGS: usize = 3;

/// The sign of the effect added last is smoothed over less and less while the error falls by it.
fn sharpened(
    model: Model,
    runs: &[Run],
    test: Option<&[Run]>,
    faults: &[Fault],
) -> Result<Model, FitError> {
    let mut best = model;
    let mut error = None;
    for _ in 0..HALVINGS {
        let mut candidate = best.clone();
        let Some(effect) = candidate.effects.last() else {
            break;
        };
        let (meta, first) = (effect.meta, effect.first_parameter);
        let added = candidate.effects.iter().rev();
        let count = added.take_while(|e| e.meta.id == meta.id).count();
        let width = (0..meta.parameters.len())
            .find(|i| is_width(&meta.parameters[*i]))
            .and_then(|i| candidate.parameters[first + i].value);
        let Some(width) = width else { break };
        smooth(&mut candidate, count, 0.5 * width);
        let now = match error {
            Some(now) => now,
            None => refitted(&best, runs, test, faults)?.0,
        };
        let (after, fitted) = refitted(&candidate, runs, test, faults)?;
        if after.is_nan() || after > SHARPER * now {
            break;
        }
        (best, error) = (fitted, Some(after));
    }
    Ok(best)
}
