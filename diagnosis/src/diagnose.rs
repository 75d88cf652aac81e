//! Which effect is missing.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicU64, Ordering};

use loopsight_core::model::Model;
use loopsight_core::run::Run;
use loopsight_recordings::{Fault, Severity};
use rayon::prelude::*;
use serde::Serialize;

use crate::advice::{self, Advice};
use crate::candidates::{Candidate, candidates};
use crate::fit::{Estimate, Fit, FitError, FitSettings, Verdict};
use crate::floor::floor;
use crate::holdout::Holdout;
use crate::judge::{Losses, advantage, nrmse, significance};
use crate::prediction::signal_rms;
use crate::problem::{Effort, Problem, Solution};
use crate::sufficiency;
use crate::where_it_fails::{Statement, where_it_fails};

/// An error, as the contract has it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Level {
    /// Free-run error relative to the standard deviation.
    pub nrmse: f64,
}

/// What a diagnosis concludes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Conclusion {
    /// An effect of the library explains what the model does not.
    EffectMissing,
    /// The model explains the measurements as far as their noise lets tell.
    NothingMissing,
    /// Something is missing, and nothing in the library is it.
    UnknownEffect,
    /// The recording cannot carry the model.
    DataInsufficient,
    /// The recording is at fault.
    LogFaulty,
}

/// An effect at its channels.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Place {
    /// Id of the effect.
    pub effect: String,
    /// Ids of the channels.
    pub at: Vec<String>,
}

/// One way to explain what the model does not.
#[derive(Clone, Debug, Serialize)]
pub struct Explanation {
    /// The effect and where.
    #[serde(flatten)]
    pub place: Place,
    /// Free-run error with it, on data it was not fitted to.
    pub nrmse: f64,
    /// The effect's parameters, by their ids.
    pub parameters: BTreeMap<String, Estimate>,
    /// How many standard errors it is from doing nothing: root of the likelihood ratio on all
    /// samples that are independent of each other.
    pub significance: f64,
    /// Candidates that these data cannot tell from it.
    pub indistinguishable_from: Vec<Place>,
    /// What to know about it.
    pub note: String,
    /// The model with it, fitted.
    #[serde(skip)]
    pub model: Model,
    /// Free-run error on what it was fitted to.
    #[serde(skip)]
    pub nrmse_fit: f64,
}

/// The result of [`diagnose`].
#[derive(Clone, Debug, Serialize)]
pub struct Diagnosis {
    /// The model as it is, all its parameters refitted.
    pub nominal: Level,
    /// What noise and resolution alone would leave.
    pub floor: Level,
    /// The conclusion.
    pub verdict: Conclusion,
    /// The missing effect.
    pub missing: Option<Place>,
    /// Explanations, best first.
    pub candidates: Vec<Explanation>,
    /// Where the model fails, in words.
    pub where_it_fails: Vec<Statement>,
    /// Faults of the log.
    pub faults: Vec<Fault>,
    /// Experiments that would tell more.
    pub advice: Vec<Advice>,
    /// The nominal model, fitted.
    #[serde(skip)]
    pub model: Option<Model>,
    /// Its error on what it was fitted to.
    #[serde(skip)]
    pub nominal_fit: f64,
}

/// Explanations that are reported.
const REPORTED: usize = 12;
/// Candidates that are fitted to the end.
const FINALISTS: usize = 10;
/// Starts of candidates that promise most and are looked at.
const LOOKED_AT: usize = 40;
/// Places of one effect among the finalists.
const SIBLINGS: usize = 2;
/// Effort of a first look at a candidate.
const LOOK: Effort = Effort {
    iterations: 10,
    tolerance: 1e-3,
};
/// Effort of a finalist.
const FINAL: Effort = Effort {
    iterations: 25,
    tolerance: 1e-6,
};
/// An explanation must beat the plain model by so many standard errors on data neither saw. There
/// are about a hundred candidates: a chance of 1e-4 each is one of 1 % for all.
const BEATS: f64 = 3.7;
/// It must be so many standard errors from doing nothing.
const SIGNIFICANT: f64 = 4.0;
/// With so many it need not shine on unseen data, only not fail there: an effect that shows in
/// transients alone leaves few samples to be judged by.
const CERTAIN: f64 = 5.0;
/// What it explains must be so large beside the floor, as a share of it, to matter.
const MATTERS: f64 = 0.2;
/// Explanations whose losses differ by fewer standard errors than this are not told apart.
const SAME: f64 = 2.0;
/// Errors within this ratio are the same for all that can be done with them.
const CLOSE: f64 = 1.01;
/// An explanation that leaves less than this multiple of the floor explains everything.
const COMPLETE: f64 = 1.2;
/// Least share of the standard deviation that an explanation must account for.
pub(crate) const LEAST: f64 = 0.004;
/// Share of what the best explanation leaves above the floor by which a smaller one may be worse.
const BLUR: f64 = 0.3;
/// Below this multiple of the floor a log explains itself.
const BLIND: f64 = 1.3;
/// Above this multiple of the floor something must be missing.
const ABOVE_FLOOR: f64 = 1.5;

/// Longest integration step of a first look, s: far below what any sensor sees.
const LOOK_STEP: f64 = 0.005;

#[derive(Clone)]
struct Judged {
    candidate: Candidate,
    solution: Solution,
    /// On what no fit saw.
    losses: Losses,
    /// What candidates are ranked by.
    rank: Losses,
}

/// Adds every effect of the library to `model` at every place it fits, refits all parameters each
/// time, and judges by the free run on data that the fits did not see.
pub fn diagnose(
    model: &Model,
    runs: &[Run],
    test: Option<&[Run]>,
    faults: &[Fault],
    progress: &(dyn Fn(u64, u64) + Sync),
) -> Result<Diagnosis, FitError> {
    diagnose_above(model, runs, test, faults, LEAST, progress)
}

/// As [`diagnose`]; an explanation must account for `least` of the standard deviation.
pub(crate) fn diagnose_above(
    model: &Model,
    runs: &[Run],
    test: Option<&[Run]>,
    faults: &[Fault],
    least: f64,
    progress: &(dyn Fn(u64, u64) + Sync),
) -> Result<Diagnosis, FitError> {
    if faults.iter().any(|f| f.severity() == Severity::Fatal) {
        return Ok(refused(Conclusion::LogFaulty, faults, Vec::new()));
    }
    let reasons = sufficiency::reasons(model, runs);
    if !reasons.is_empty() {
        return Ok(refused(Conclusion::DataInsufficient, faults, reasons));
    }
    let holdout = Holdout::new(model, runs, test);
    let seen = holdout.seen.as_deref();
    let quiet = |_: u64, _: f64| {};

    let mut problem = Problem::with(model, runs, seen, None, &quiet)?;
    let start = problem.start(&FitSettings::default())?;
    let start = problem.balance(start);
    let nominal = problem.finish(&start, FINAL)?;
    let nominal_losses = holdout.judge(model, &nominal);
    let nominal_rank = holdout.rank(model, &nominal, &nominal_losses);
    let nominal_error = nrmse(&nominal_losses);
    let nominal_fit = nrmse(&holdout.fitted(model, &nominal));
    let mut fitted_nominal = model.clone();
    fitted_nominal.set_values(&nominal.values);

    let rms = signal_rms(model, &nominal.values, &nominal.states, runs);
    let all = candidates(&fitted_nominal, &rms);
    let done = AtomicU64::new(0);
    let duration = runs.iter().map(Run::duration).fold(0.0, f64::max);
    let attempts: Vec<(usize, Vec<f64>)> = all
        .iter()
        .enumerate()
        .flat_map(|(i, c)| {
            starts(c, &nominal, duration)
                .into_iter()
                .map(move |start| (i, start))
        })
        .collect();
    let total = (attempts.len() + LOOKED_AT) as u64;
    let mut promising: Vec<(f64, usize)> = attempts
        .par_iter()
        .enumerate()
        .filter_map(|(k, (i, start))| {
            let promise = promise(&all[*i], start, &holdout, &nominal);
            progress(done.fetch_add(1, Ordering::Relaxed) + 1, total);
            Some((promise?, k))
        })
        .collect();
    promising.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    promising.truncate(LOOKED_AT);
    let mut looked: Vec<(usize, Judged)> = promising
        .par_iter()
        .filter_map(|(_, k)| {
            let (i, start) = &attempts[*k];
            let found = look(&all[*i], start, &holdout, &nominal);
            progress(done.fetch_add(1, Ordering::Relaxed) + 1, total);
            Some((*i, found?))
        })
        .collect();
    looked.sort_by(|a, b| nrmse(&a.1.rank).total_cmp(&nrmse(&b.1.rank)));
    let mut judged: Vec<Judged> = Vec::new();
    for k in 0..looked.len() {
        let (i, found) = &looked[k];
        let id = found.candidate.meta.id;
        // Of several starts of one candidate the best counts, and of an effect and its special case
        // the special case, unless it is worse.
        let again = looked[..k].iter().any(|(j, _)| i == j);
        let close = |other: &Judged| nrmse(&other.rank) < CLOSE * nrmse(&found.rank);
        let needless = looked.iter().any(|(_, other)| {
            let special = found
                .candidate
                .meta
                .simpler
                .contains(&other.candidate.meta.id)
                && found.candidate.at == other.candidate.at;
            // On a straight run one wheel stands for both: then both.
            let wider = other.candidate.meta.id == id
                && found
                    .candidate
                    .at
                    .iter()
                    .all(|c| other.candidate.at.contains(c))
                && other.candidate.at.len() > found.candidate.at.len();
            (special || wider) && close(other)
        });
        let siblings = judged.iter().filter(|j| j.candidate.meta.id == id).count();
        if !again && !needless && siblings < SIBLINGS && judged.len() < FINALISTS {
            judged.push(found.clone());
        }
    }

    let mut finalists: Vec<(Judged, Fit)> = judged
        .into_par_iter()
        .filter_map(|first| finish(first, &holdout, &nominal))
        .collect();
    finalists.sort_by(|a, b| nrmse(&a.0.rank).total_cmp(&nrmse(&b.0.rank)));

    let floor = floor(model, test.unwrap_or(runs));
    let mut explanations = explain(&finalists, &nominal_rank, &holdout);
    let chosen = choose(&mut explanations, &finalists, floor);
    let missing = chosen.and_then(|i| {
        let (judged, _) = &finalists[i.finalist];
        let of = |plain: &Losses, with: &Losses| {
            (nrmse(plain).powi(2) - nrmse(with).powi(2)).max(0.0).sqrt()
        };
        let explained = of(&nominal_rank, &judged.rank);
        let unseen = advantage(&nominal_losses, &judged.losses);
        let significance = explanations[0].significance;
        let earned = unseen > BEATS || (unseen > -SAME && significance > CERTAIN);
        // Down to the noise, or a good part of what there was to explain.
        let complete = nrmse(&judged.rank) < COMPLETE * floor && explained > MATTERS * floor;
        let matters = complete || explained > (MATTERS * floor).max(least);
        (earned && significance > SIGNIFICANT && matters).then(|| explanations[0].place.clone())
    });
    // The log explains itself and the test does not: what is missing never showed in the log.
    let floor_fit = self::floor(model, runs);
    let blind =
        test.is_some() && nominal_fit < BLIND * floor_fit && nominal_error > ABOVE_FLOOR * floor;
    let verdict = match &missing {
        Some(_) => Conclusion::EffectMissing,
        None if blind => Conclusion::DataInsufficient,
        None if nominal_error > ABOVE_FLOOR * floor => Conclusion::UnknownEffect,
        None => Conclusion::NothingMissing,
    };
    let statements = where_it_fails(&fitted_nominal, &nominal, runs);
    let advice = advice::advice(&fitted_nominal, verdict, explanations.first());
    explanations.truncate(REPORTED);
    Ok(Diagnosis {
        nominal: Level {
            nrmse: nominal_error,
        },
        floor: Level { nrmse: floor },
        verdict,
        missing,
        candidates: explanations,
        where_it_fails: statements,
        faults: faults.to_vec(),
        advice,
        model: Some(fitted_nominal),
        nominal_fit,
    })
}

fn refused(verdict: Conclusion, faults: &[Fault], advice: Vec<Advice>) -> Diagnosis {
    Diagnosis {
        nominal: Level { nrmse: f64::NAN },
        floor: Level { nrmse: f64::NAN },
        verdict,
        missing: None,
        candidates: Vec::new(),
        where_it_fails: Vec::new(),
        faults: faults.to_vec(),
        advice,
        model: None,
        nominal_fit: f64::NAN,
    }
}

/// Shares of the flow that a speed to be estimated starts from.
const FLOW_STARTS: [f64; 3] = [0.03, 0.1, 0.3];

/// Values to start a candidate from: the nominal ones, and its own a noticeable step from neutral.
fn starts(candidate: &Candidate, nominal: &Solution, duration: f64) -> Vec<Vec<f64>> {
    let mut all = vec![nominal.values.clone()];
    for i in candidate.own() {
        let parameter = &candidate.model.parameters[i];
        let nearest = |value: f64| parameter.declaration.nearest(value);
        let neutral = parameter.value.unwrap_or(0.0);
        let listed = parameter.starts(duration);
        let values: Vec<f64> = if !parameter.free {
            vec![neutral]
        } else if parameter.declaration.unit == "flow" && candidate.flow > 0.0 {
            FLOW_STARTS
                .iter()
                .map(|s| nearest(s * candidate.flow))
                .collect()
        } else if listed.is_empty() {
            vec![nearest(neutral + parameter.scale())]
        } else {
            listed.into_iter().map(nearest).collect()
        };
        all = all
            .iter()
            .flat_map(|start| {
                values.iter().map(move |value| {
                    let mut start = start.clone();
                    start.push(*value);
                    start
                })
            })
            .collect();
    }
    all
}

/// The model of a candidate for a first look: coarser steps, far below what a sensor sees.
fn coarse(candidate: &Candidate) -> Model {
    let mut model = candidate.model.clone();
    model.max_step = model.max_step.max(LOOK_STEP);
    model
}

/// What a candidate promises to leave of the cost, from one start.
fn promise(
    candidate: &Candidate,
    start: &[f64],
    holdout: &Holdout<'_>,
    nominal: &Solution,
) -> Option<f64> {
    let model = coarse(candidate);
    let (seen, states) = (holdout.seen.as_deref(), nominal.states.clone());
    Problem::with(&model, holdout.runs, seen, Some(states.clone()), &|_, _| {})
        .ok()?
        .promise(start, &states)
}

/// A quick fit of a candidate from one start, with the nominal initial states.
fn look(
    candidate: &Candidate,
    start: &[f64],
    holdout: &Holdout<'_>,
    nominal: &Solution,
) -> Option<Judged> {
    let model = coarse(candidate);
    let (seen, states) = (holdout.seen.as_deref(), nominal.states.clone());
    let solution = Problem::with(&model, holdout.runs, seen, Some(states.clone()), &|_, _| {})
        .ok()?
        .solve_from(start, &states, LOOK)
        .ok()?;
    let losses = holdout.judge(&model, &solution);
    let rank = holdout.rank(&model, &solution, &losses);
    nrmse(&rank).is_finite().then(|| Judged {
        candidate: candidate.clone(),
        solution,
        losses,
        rank,
    })
}

/// The full fit of a finalist, initial states included, with intervals.
fn finish(first: Judged, holdout: &Holdout<'_>, nominal: &Solution) -> Option<(Judged, Fit)> {
    let quiet = |_: u64, _: f64| {};
    let model = &first.candidate.model;
    let mut problem =
        Problem::with(model, holdout.runs, holdout.seen.as_deref(), None, &quiet).ok()?;
    let start = problem.pack(&first.solution.values, &nominal.states);
    let start = problem.balance(start);
    let found = problem.solve(&start, FINAL).ok()?;
    let fit = problem.result(&found);
    let solution = problem.solution(&found);
    let losses = holdout.judge(model, &solution);
    let rank = holdout.rank(model, &solution, &losses);
    nrmse(&rank).is_finite().then_some((
        Judged {
            candidate: first.candidate,
            solution,
            losses,
            rank,
        },
        fit,
    ))
}

fn place(candidate: &Candidate) -> Place {
    Place {
        effect: candidate.meta.id.to_owned(),
        at: candidate.at.iter().map(|c| (*c).to_owned()).collect(),
    }
}

fn explain(
    finalists: &[(Judged, Fit)],
    nominal_rank: &Losses,
    holdout: &Holdout<'_>,
) -> Vec<Explanation> {
    finalists
        .iter()
        .map(|(judged, fit)| {
            let candidate = &judged.candidate;
            let mut parameters = BTreeMap::new();
            for i in candidate.own() {
                let parameter = &candidate.model.parameters[i];
                let Some(estimate) = fit.parameters.get(&parameter.name) else {
                    continue;
                };
                if parameter.free {
                    parameters.insert(parameter.declaration.id.to_owned(), estimate.clone());
                }
            }
            Explanation {
                place: place(candidate),
                nrmse: nrmse(&judged.losses),
                parameters,
                significance: significance(nominal_rank, &judged.rank).min(1e6),
                indistinguishable_from: Vec::new(),
                note: note(fit, candidate),
                model: fit.model.clone(),
                nrmse_fit: nrmse(&holdout.fitted(&candidate.model, &judged.solution)),
            }
        })
        .collect()
}

/// What to know about a fitted explanation.
fn note(fit: &Fit, candidate: &Candidate) -> String {
    let mut words = vec![candidate.meta.symptom.to_owned()];
    for (name, estimate) in &fit.parameters {
        if matches!(
            estimate.verdict,
            Verdict::AtBound | Verdict::Flat | Verdict::NotPinned
        ) {
            words.push(format!("{name}: {}", estimate.verdict.text()));
        }
    }
    words.join("; ")
}

struct Chosen {
    finalist: usize,
}

/// Puts the smallest explanation that is not significantly worse than the best one first, with
/// those that cannot be told from it.
fn choose(
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
