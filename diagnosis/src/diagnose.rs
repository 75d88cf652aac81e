//! Which effect is missing.

use std::borrow::Cow;

use loopsight_model::model::{Model, Origin};
use loopsight_model::run::Run;
use loopsight_recordings::{Fault, Severity};

use crate::arrive::Starts;
use crate::candidates::{Seen, candidates};
use crate::conclude::{Evidence, REPORTED, conclude};
use crate::conclusion::{Conclusion, Diagnosis, Level};
use crate::criteria::Criteria;
use crate::discover::discovered;
use crate::early::Finding;
use crate::ending::{Read, finalists_on_all, plain_on_all};
use crate::ends::ends;
use crate::error::FitError;
use crate::explain::explain_look;
use crate::floor::floor;
use crate::holdout::{Holdout, Judgement};
use crate::judge::{Losses, nrmse};
use crate::measurements::Measurements;
use crate::observer::{Correction, attach_same_observer};
use crate::output_error::{Unaided, prepare};
use crate::pace::Paced;
use crate::pairs::pair;
use crate::prediction::{Solution, moves_starts, signal_rms};
use crate::problem::Problem;
use crate::progress::{Cancelled, Stage, Work};
use crate::residual_force;
use crate::search::{Found, Search};
use crate::settings::FitSettings;
use crate::signs::{self, SoFar};
use crate::stamps;
use crate::starts::Extent;
use crate::sufficiency;
use crate::telling::held_to_measurements;
use crate::trial::{FINAL, Judged, Nominal};
use crate::untried::untried;
use crate::where_it_fails::{predictable, where_it_fails};

/// Tries every effect of the library at every channel of `model` that it fits. One Gauss–Newton step says what each promises.
/// Those that promise most are fitted, with all parameters of the model, and judged by their free run on validation data.
/// Once one of them explains the log, what promises next to nothing beside it is left out.
///
/// Where no effect explains what the model does not, the best of them are tried in pairs.
///
/// The search reads windows of a long log; everything that was measured has the last word.
///
/// A diagnosis that is cancelled says so ([`Conclusion::Cancelled`]). It has what was found until then: the
/// fitted model, where it fails, and the candidates that were judged.
///
/// # Errors
///
/// [`FitError`] when the model as it is cannot be fitted.
pub fn diagnose(
    model: &Model,
    measurements: &Measurements<'_>,
    work: &Work<'_>,
) -> Result<Diagnosis, FitError> {
    let paced = Paced::of(model, measurements.runs, work);
    let (model, work) = (&paced.model, &paced.work(work));
    let aim = Aim {
        worth: 0.0,
        discover: Discover::Never,
        force: true,
        unaided: Unaided::Sought,
        leaves: f64::INFINITY,
    };
    let mut diagnosis = diagnose_for(model, measurements, aim, work)?;
    match pair(&diagnosis, 0, measurements, aim, work) {
        Ok(Some(pair)) => diagnosis.lacks(&pair),
        Ok(None) => {}
        Err(Cancelled) => diagnosis.verdict = Conclusion::Cancelled,
    }
    Ok(diagnosis)
}

/// What a diagnosis is for.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Aim {
    /// Least share of the standard deviation that an explanation must account for to be worth its while.
    pub(crate) worth: f64,
    pub(crate) discover: Discover,
    /// Whether it says what force is missing where no effect explains the rest.
    pub(crate) force: bool,
    /// Whether it first looks for values with which the model needs no observer.
    pub(crate) unaided: Unaided,
    /// The validation error below which an effect must come to be of use.
    pub(crate) leaves: f64,
}

/// When an expression for the residual force is a candidate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Discover {
    Never,
    /// Where none of them explains the rest.
    Last,
    /// It is the only candidate.
    Only,
}

/// As [`diagnose`], for an aim.
pub(crate) fn diagnose_for(
    model: &Model,
    measurements: &Measurements<'_>,
    aim: Aim,
    work: &Work<'_>,
) -> Result<Diagnosis, FitError> {
    measurements.check(model)?;
    // Each step adds what it finds. The verdict stays `Cancelled` until the last step is done.
    let mut diagnosis = Diagnosis::begun(measurements.faults);
    if refused(&mut diagnosis, model, measurements, work.criteria()) {
        return Ok(diagnosis);
    }
    match steps(&mut diagnosis, model, measurements, aim, work)
        .and_then(|()| Ok(turned(&mut diagnosis, model, measurements, aim, work)?))
    {
        Ok(()) | Err(FitError::Cancelled(Cancelled)) => Ok(diagnosis),
        Err(error) => Err(error),
    }
}

/// Adds the signal that counts the other way, where the model leaves much because one does.
fn turned(
    diagnosis: &mut Diagnosis,
    model: &Model,
    measurements: &Measurements<'_>,
    aim: Aim,
    work: &Work<'_>,
) -> Result<(), Cancelled> {
    let left = diagnosis.nominal.nrmse;
    if !aim.force || left.is_nan() || left < work.criteria().start.stands {
        return Ok(());
    }
    let best = diagnosis.candidates.first();
    let so_far = SoFar {
        error: best.map_or(left, |best| best.nrmse.min(left)),
        horizon: diagnosis.observer.as_ref().map(|o| o.horizon_s),
    };
    let silent = work.silently();
    let aim = Aim {
        force: false,
        ..aim
    };
    let diagnosed = |runs: &[Run]| {
        let mut other = Diagnosis::begun(&[]);
        match steps(&mut other, model, &Measurements::new(runs), aim, &silent) {
            Err(FitError::Cancelled(cancelled)) => Err(cancelled),
            _ if other.verdict != Conclusion::EffectMissing
                || !so_far.allows(other.observer.as_ref()) =>
            {
                Ok(f64::INFINITY)
            }
            _ => Ok(other
                .candidates
                .first()
                .map_or(f64::INFINITY, |best| best.nrmse)),
        }
    };
    let fitted = diagnosis.model.as_ref();
    let model = fitted.map_or(Cow::Borrowed(model), |fitted| {
        Cow::Owned(with_widths_of(model, fitted))
    });
    let advice = signs::advice(&model, measurements.runs, so_far, &diagnosed, work)?;
    diagnosis.advice.splice(0..0, advice);
    Ok(())
}

/// `model` with the widths that the log gave the signs of the `fitted` one: they need not be found again.
fn with_widths_of(model: &Model, fitted: &Model) -> Model {
    let mut model = model.clone();
    for (own, found) in model.parameters.iter_mut().zip(&fitted.parameters) {
        if found.origin == Origin::Log && found.name == own.name {
            (own.origin, own.value) = (found.origin, found.value);
        }
    }
    model
}

impl Diagnosis {
    /// A diagnosis that has found nothing yet.
    pub(crate) fn begun(faults: &[Fault]) -> Self {
        Self {
            nominal: Level { nrmse: f64::NAN },
            floor: Level { nrmse: f64::NAN },
            verdict: Conclusion::Cancelled,
            missing: None,
            candidates: Vec::new(),
            not_tried: Vec::new(),
            where_it_fails: Vec::new(),
            residual_force: None,
            faults: faults.to_vec(),
            advice: Vec::new(),
            observer: None,
            model: None,
            nominal_fit: f64::NAN,
            set_aside: None,
        }
    }

    /// Tells what the fitted model leaves.
    fn tell_compared(&self, work: &Work<'_>) {
        work.know(|| Finding::Compared {
            nrmse: self.nominal.nrmse,
            floor: self.floor.nrmse,
        });
    }
}

/// Whether the log is faulty or too short to fit a model to. If so, that is the diagnosis.
fn refused(
    diagnosis: &mut Diagnosis,
    model: &Model,
    measurements: &Measurements<'_>,
    criteria: &Criteria,
) -> bool {
    let fatal = |fault: &Fault| fault.severity() == Severity::Fatal;
    if measurements.faults.iter().any(fatal) {
        diagnosis.verdict = Conclusion::LogFaulty;
        return true;
    }
    diagnosis.advice = sufficiency::reasons(model, measurements.runs, &criteria.log);
    if !diagnosis.advice.is_empty() {
        diagnosis.verdict = Conclusion::DataInsufficient;
        return true;
    }
    false
}

/// Everything of a diagnosis, one step after the other.
fn steps(
    diagnosis: &mut Diagnosis,
    model: &Model,
    measurements: &Measurements<'_>,
    aim: Aim,
    work: &Work<'_>,
) -> Result<(), FitError> {
    let silent = work.silently();
    let read = Read::of(model, measurements);
    let prepared = prepare(
        model,
        read.runs(),
        &FitSettings::default(),
        aim.unaided,
        &silent,
    )?;
    let (model, runs) = (&*prepared.model, &*prepared.runs);
    let test = (read.test()).map(|test| attach_same_observer(model, test, runs, work));
    let test = test.transpose()?;
    let criteria = work.criteria();
    let holdout = Holdout::new(model, runs, test.as_deref(), &criteria.holdout);
    diagnosis.observer = Correction::of(runs);
    diagnosis.floor.nrmse = floor(model, &holdout.judging(), &criteria.log);

    let plain = fit_plain(diagnosis, model, &holdout, work)?;
    diagnosis.tell_compared(work);
    let moves = moves_starts(&plain.model, &plain.solution, runs, work)?;
    let nominal = Nominal {
        given: prepared.given(),
        model: &plain.model,
        solution: &plain.solution,
        cost: plain.cost,
        rank: &plain.judgement.rank,
        floor: floor(model, &holdout.fitting(), &criteria.log),
        held: (!moves).then_some(&plain.solution.states),
        holdout: &holdout,
        work: &silent,
    };
    diagnosis.where_it_fails = where_it_fails(&plain.model, &plain.solution, runs, work)?;
    let finalists = match aim.discover {
        Discover::Only => Vec::new(),
        Discover::Never | Discover::Last => {
            search(diagnosis, &nominal, read.parts_of_one(), aim, work)?
        }
    };
    let Some(first) = read.first() else {
        let unseen = &plain.judgement.losses;
        return conclude_from(diagnosis, &nominal, unseen, finalists, aim, work);
    };
    // Everything that was measured has the last word.
    let all = attach_same_observer(model, measurements.runs, runs, work)?;
    let test = (measurements.test).map(|test| attach_same_observer(model, test, runs, work));
    let test = test.transpose()?;
    let holdout = Holdout::new(model, &all, test.as_deref(), &criteria.holdout);
    diagnosis.floor.nrmse = floor(model, &holdout.judging(), &criteria.log);
    let plain = plain_on_all(diagnosis, &nominal, &holdout, &first)?;
    diagnosis.tell_compared(work);
    let nominal = Nominal {
        model: &plain.model,
        solution: &plain.solution,
        rank: &plain.judgement.rank,
        floor: floor(model, &holdout.fitting(), &criteria.log),
        holdout: &holdout,
        ..nominal
    };
    diagnosis.where_it_fails = where_it_fails(&plain.model, &plain.solution, &all, work)?;
    let finalists = finalists_on_all(diagnosis, &nominal, finalists, &first, work)?;
    let unseen = &plain.judgement.losses;
    conclude_from(diagnosis, &nominal, unseen, finalists, aim, work)
}

/// What follows from the finalists and the plain model.
fn conclude_from(
    diagnosis: &mut Diagnosis,
    nominal: &Nominal<'_>,
    unseen: &Losses,
    mut finalists: Vec<Judged>,
    aim: Aim,
    work: &Work<'_>,
) -> Result<(), FitError> {
    let runs = nominal.holdout.runs;
    let discovers = aim.discover != Discover::Never;
    // In the order of the finalists, which a conclusion changes.
    let mut explanations = if discovers {
        diagnosis.candidates.clone()
    } else {
        Vec::new()
    };
    let evidence = Evidence {
        nominal,
        unseen,
        nominal_fit: diagnosis.nominal_fit,
        floor: diagnosis.floor.nrmse,
        predictable: predictable(nominal.model, nominal.solution, runs, work)?,
        worth: aim.worth,
    };
    let mut verdict = conclude(diagnosis, &finalists, &evidence);
    if verdict == Conclusion::UnknownEffect && aim.force {
        work.tell(Stage::ResidualForce, 0, 1);
        let mut force =
            residual_force::of_solution(nominal.model, nominal.solution, runs, true, work)?;
        let expression = force.as_mut().and_then(|f| f.expression.as_mut());
        if let Some(expression) = expression.filter(|_| discovers)
            && let Some((judged, explanation)) = discovered(expression, nominal)
        {
            expression.left = Some(explanation.nrmse);
            let better = |other: &Judged| other.error() > judged.error();
            let place = finalists.iter().position(better).unwrap_or(finalists.len());
            finalists.insert(place, judged);
            explanations.insert(place, explanation);
            diagnosis.candidates = explanations;
            verdict = conclude(diagnosis, &finalists, &evidence);
        }
        diagnosis.residual_force = force.filter(|_| verdict == Conclusion::UnknownEffect);
        work.go_on()?;
    }
    diagnosis
        .advice
        .extend(sufficiency::notes(nominal.given, runs));
    diagnosis.verdict = verdict;
    Ok(())
}

/// The model without any candidate, fitted and judged.
struct Plain {
    model: Model,
    solution: Solution,
    cost: f64,
    judgement: Judgement,
}

/// Fits the model as it is, and judges it.
fn fit_plain(
    diagnosis: &mut Diagnosis,
    model: &Model,
    holdout: &Holdout<'_>,
    work: &Work<'_>,
) -> Result<Plain, FitError> {
    let seen = holdout.seen.as_deref();
    let mut problem = Problem::with(model, holdout.runs, seen, None, work.clone())?;
    problem.keeps = true;
    let with = |values: &[f64]| {
        let mut fitted = model.clone();
        fitted.set_values(values);
        Some(fitted)
    };
    match solve_plain(&mut problem, holdout, work) {
        Ok((plain, fitted)) => {
            diagnosis.nominal.nrmse = nrmse(&plain.judgement.losses);
            diagnosis.nominal_fit = nrmse(&fitted);
            diagnosis.model = with(&plain.solution.values);
            Ok(plain)
        }
        Err(FitError::Cancelled(cancelled)) => {
            if let Some((error, best)) = problem.best() {
                diagnosis.nominal.nrmse = error;
                diagnosis.nominal_fit = error;
                diagnosis.model = with(&best.values);
            }
            Err(cancelled.into())
        }
        Err(error) => Err(error),
    }
}

/// The solution of a problem, judged; and its losses on what the fit saw.
fn solve_plain(
    problem: &mut Problem<'_>,
    holdout: &Holdout<'_>,
    work: &Work<'_>,
) -> Result<(Plain, Losses), FitError> {
    let model = problem.model;
    let arrived = problem.arrive(&FitSettings::default(), Starts::All, FINAL)?;
    let solution = problem.solution(&arrived.solution);
    let scaled = problem.pack(&solution.values, &solution.states);
    let cost = problem.residual_vector(&scaled)?.norm_squared();
    let known = problem.runs_of(&solution);
    let judgement = holdout.judge(model, &solution, known.as_deref(), work)?;
    let fitted = holdout.fitted(model, &solution, &judgement.rank, work)?;
    let mut model = model.clone();
    model.set_values(&solution.values);
    let plain = Plain {
        model,
        solution,
        cost,
        judgement,
    };
    Ok((plain, fitted))
}

/// Root mean squares of the plant's signals, which say how fast and how far it goes. Where the inputs alone do not explain half of what is
/// measured, they are those of the machine, as an observer sees it.
fn rms(nominal: &Nominal<'_>, work: &Work<'_>) -> Result<Vec<f64>, Cancelled> {
    let (model, solution) = (nominal.model, nominal.solution);
    let runs = nominal.holdout.runs;
    let lost = nrmse(nominal.rank) >= work.criteria().start.stands;
    let runs = if lost {
        held_to_measurements(model, &solution.values, runs, work)?
    } else {
        Cow::Borrowed(runs)
    };
    signal_rms(model, &solution.values, &solution.states, &runs, work)
}

/// The candidates that explain most, fitted. The diagnosis lists them, the best first. What the search reads may be
/// windows, `parts_of_one` run.
fn search(
    diagnosis: &mut Diagnosis,
    nominal: &Nominal<'_>,
    parts_of_one: bool,
    aim: Aim,
    work: &Work<'_>,
) -> Result<Vec<Judged>, Cancelled> {
    let rms = rms(nominal, work)?;
    let ends = ends(
        nominal.model,
        &nominal.solution.values,
        &nominal.solution.states,
        nominal.holdout.runs,
        work,
    )?;
    let seen = Seen {
        runs: nominal.holdout.runs,
        rms: &rms,
        ends: &ends,
        observed: diagnosis.observer.is_some(),
        parts_of_one,
    };
    let criteria = &work.criteria().search;
    let all = candidates(nominal.model, &seen, criteria);
    diagnosis.not_tried = untried(nominal.model, &seen, criteria);
    let search = Search {
        all: &all,
        nominal,
        work,
        extent: Extent::of(nominal.holdout.runs),
        shift: stamps::shift(nominal.holdout.runs),
        leaves: aim.leaves / diagnosis.nominal.nrmse,
    };
    let Found { finalists, looked } = search.run();
    let (finalists, mut explanations): (Vec<Judged>, Vec<_>) = finalists.into_iter().unzip();
    if work.is_cancelled() {
        explanations.extend(looked.iter().map(explain_look));
        explanations.truncate(REPORTED);
    }
    diagnosis.candidates = explanations;
    work.go_on()?;
    Ok(finalists)
}
