//! Which effect is missing.

use std::collections::BTreeMap;

use loopsight_model::model::Model;
use loopsight_model::run::Run;
use loopsight_recordings::{Fault, Severity};

use crate::advice::{self, Advice};
use crate::candidates::{Candidate, candidates};
use crate::choose::choose;
use crate::conclusion::{Conclusion, Diagnosis, Explanation, Level, Place};
use crate::fit::{Estimate, Fit, FitError, FitSettings, Verdict};
use crate::floor::floor;
use crate::holdout::{Holdout, Judgement};
use crate::judge::{Losses, advantage, nrmse, significance};
use crate::observer::{Held, hold_alike};
use crate::output_error::prepare;
use crate::prediction::signal_rms;
use crate::problem::Problem;
use crate::residual_force;
use crate::search::Search;
use crate::sufficiency;
use crate::trial::{FINAL, Judged};
use crate::where_it_fails::where_it_fails;

/// Explanations that are reported.
const REPORTED: usize = 12;
/// An explanation must beat the plain model by so many standard errors on data neither saw. There
/// are about a hundred candidates: a chance of 1e-4 each is one of 1 % for all.
const BEATS: f64 = 3.7;
/// It must be so many standard errors from doing nothing.
pub(crate) const SIGNIFICANT: f64 = 4.0;
/// With so many it need not shine on unseen data, only leave no more there than the plain model: an
/// effect that shows in transients alone leaves few samples to be judged by.
const CERTAIN: f64 = 5.0;
/// What it explains must be so large beside the floor, as a share of it, to matter.
const MATTERS: f64 = 0.2;
/// Explanations whose losses differ by fewer standard errors than this are not told apart.
pub(crate) const SAME: f64 = 2.0;
/// Errors within this ratio are the same for all that can be done with them.
pub(crate) const CLOSE: f64 = 1.01;
/// An explanation that leaves less than this multiple of the floor explains everything.
const COMPLETE: f64 = 1.2;
/// Least share of the standard deviation that an explanation must account for.
pub(crate) const LEAST: f64 = 0.004;
/// A standard error of so many times the value: the log says nothing of it.
const UNDETERMINED: f64 = 10.0;
/// Below this multiple of the floor a log explains itself.
const BLIND: f64 = 1.3;
/// Above this multiple of the floor something must be missing.
const ABOVE_FLOOR: f64 = 1.5;

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
    let prepared = prepare(model, runs, &FitSettings::default())?;
    let (model, runs) = (&*prepared.model, &*prepared.runs);
    let test = test.map(|test| hold_alike(model, test, runs));
    let test = test.as_deref();
    let holdout = Holdout::new(model, runs, test);
    let seen = holdout.seen.as_deref();
    let quiet = |_: u64, _: f64| {};

    let mut problem = Problem::with(model, runs, seen, None, &quiet)?;
    let start = problem.start(&FitSettings::default())?;
    let start = problem.balance(start);
    let nominal = problem.finish(&start, FINAL)?;
    let plain = problem
        .residual_vector(&problem.pack(&nominal.values, &nominal.states))
        .norm_squared();
    let Judgement {
        losses: nominal_losses,
        rank: nominal_rank,
    } = holdout.judge(model, &nominal);
    let nominal_error = nrmse(&nominal_losses);
    let nominal_fit = nrmse(&holdout.fitted(model, &nominal));
    let mut fitted_nominal = model.clone();
    fitted_nominal.set_values(&nominal.values);

    let rms = signal_rms(model, &nominal.values, &nominal.states, runs);
    let held = runs.iter().any(|run| run.observer.is_some());
    let all = candidates(&fitted_nominal, &rms, held);
    let search = Search {
        all: &all,
        holdout: &holdout,
        model: &fitted_nominal,
        nominal: &nominal,
        cost: plain,
        rank: &nominal_rank,
    };
    let finalists = search.finalists(progress);

    let floor = floor(model, test.unwrap_or(runs));
    let mut explanations = explain(&finalists, &nominal_rank, &holdout);
    let earned = |i: usize, explanation: &Explanation| {
        let unseen = advantage(&nominal_losses, &finalists[i].0.losses);
        unseen > BEATS || (unseen > 0.0 && explanation.significance > CERTAIN)
    };
    let chosen = choose(&mut explanations, &finalists, floor, &earned);
    let missing = chosen.and_then(|i| {
        let (judged, _) = &finalists[i.finalist];
        let of = |plain: &Losses, with: &Losses| {
            (nrmse(plain).powi(2) - nrmse(with).powi(2)).max(0.0).sqrt()
        };
        let explained = of(&nominal_rank, &judged.rank);
        let significance = explanations[0].significance;
        // Down to the noise, or a good part of what there was to explain.
        let complete = nrmse(&judged.rank) < COMPLETE * floor && explained > MATTERS * floor;
        let matters = complete || explained > (MATTERS * floor).max(least);
        let earned = earned(i.finalist, &explanations[0]);
        (earned && significance > SIGNIFICANT && matters && determined(&explanations[0]))
            .then(|| explanations[0].place.clone())
    });
    // The log is explained and the test is not: what is missing did not show in the log, or not so
    // that it could be told from something else.
    let floor_fit = self::floor(model, runs);
    let explained = explanations
        .iter()
        .find(|e| e.nrmse_fit < BLIND * floor_fit && e.nrmse > ABOVE_FLOOR * floor)
        .filter(|_| nominal_fit >= BLIND * floor_fit);
    let blind = test.is_some()
        && nominal_error > ABOVE_FLOOR * floor
        && (nominal_fit < BLIND * floor_fit || explained.is_some());
    let verdict = match &missing {
        Some(_) => Conclusion::EffectMissing,
        None if blind => Conclusion::DataInsufficient,
        None if nominal_error > ABOVE_FLOOR * floor => Conclusion::UnknownEffect,
        None => Conclusion::NothingMissing,
    };
    let statements = where_it_fails(&fitted_nominal, &nominal, runs);
    let residual_force = (verdict == Conclusion::UnknownEffect)
        .then(|| residual_force::of_solution(&fitted_nominal, &nominal, runs))
        .flatten();
    let advice = advice::advice(&fitted_nominal, verdict, explanations.first(), explained);
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
        residual_force,
        faults: faults.to_vec(),
        advice,
        observer: Held::of(runs),
        model: Some(fitted_nominal),
        nominal_fit,
    })
}

/// Whether the log determines anything of the effect: what it cannot tell from the plant's own
/// parameters is not found, however well a test recording speaks of it.
fn determined(explanation: &Explanation) -> bool {
    let says_nothing = |p: &Estimate| match p.verdict {
        Verdict::Flat | Verdict::Dead | Verdict::Held => true,
        Verdict::NotPinned => p.std_error.is_none_or(|e| e > UNDETERMINED * p.value.abs()),
        _ => false,
    };
    !explanation.parameters.values().all(says_nothing)
}

fn refused(verdict: Conclusion, faults: &[Fault], advice: Vec<Advice>) -> Diagnosis {
    Diagnosis {
        nominal: Level { nrmse: f64::NAN },
        floor: Level { nrmse: f64::NAN },
        verdict,
        missing: None,
        candidates: Vec::new(),
        where_it_fails: Vec::new(),
        residual_force: None,
        faults: faults.to_vec(),
        advice,
        observer: None,
        model: None,
        nominal_fit: f64::NAN,
    }
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
                // What was tried counts as found: a number of teeth is not fitted but chosen.
                if parameter.free || !parameter.declaration.starts.is_empty() {
                    parameters.insert(candidate.name(i), estimate.clone());
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
    if let Some((simpler, _)) = &candidate.replaces {
        words.push(format!("in place of {simpler}, which it contains"));
    }
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
