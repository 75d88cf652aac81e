//! Comparing a model with measurements: free run and one-step prediction.

use std::borrow::Cow;

use loopsight_model::model::Model;
use loopsight_model::run::Run;
use loopsight_model::simulate::{Simulator, try_follow};
use loopsight_recordings::Fault;
use nalgebra::DVector;
use serde::Serialize;

use crate::error::CompareError;
use crate::measurements::Measurements;
use crate::observer::{Correction, attach_observer};
use crate::pace::Paced;
use crate::prediction::{InitialStates, Solution, for_each_run, one_step, predict};
use crate::progress::{Cancelled, Stage, Work};
use crate::score::{SignalScore, Tally, overall};
use crate::where_it_fails::{Statement, where_it_fails};

/// The result of [`compare`].
#[derive(Clone, Debug, Serialize)]
pub struct Comparison {
    /// Free-run error over all signals: root mean square of the signals' `nrmse`.
    pub nrmse: f64,
    /// `100 (1 - nrmse)`.
    pub fit_percent: f64,
    /// Errors of each measured signal.
    pub signals: Vec<SignalScore>,
    /// Faults of the log.
    pub faults: Vec<Fault>,
    /// How an observer corrected the free run by the measurements. Absent where the run is simulated from the
    /// inputs alone.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub observer: Option<Correction>,
    /// Where the free run fails, the most telling first.
    #[serde(skip)]
    pub where_it_fails: Vec<Statement>,
    /// Everything a picture needs.
    #[serde(skip)]
    pub runs: Vec<RunTrace>,
}

impl Comparison {
    /// A comparison with nothing but its error: the work was cancelled before the rest was computed.
    pub(crate) fn of_error(nrmse: f64) -> Self {
        Self {
            nrmse,
            fit_percent: 100.0 * (1.0 - nrmse),
            signals: Vec::new(),
            faults: Vec::new(),
            observer: None,
            where_it_fails: Vec::new(),
            runs: Vec::new(),
        }
    }
}

/// One run: what was applied, measured and predicted.
#[derive(Clone, Debug)]
pub struct RunTrace {
    /// Name of the run; may be empty.
    pub name: String,
    /// Time stamps since the start of the run, s.
    pub time: Vec<f64>,
    /// Inputs by signal: id, unit, values.
    pub inputs: Vec<(String, String, Vec<f64>)>,
    /// Measured signals.
    pub signals: Vec<SignalTrace>,
    /// The estimated initial state of the plant.
    pub initial_state: Vec<f64>,
}

/// One measured signal of one run; all series are as long as the run's time.
#[derive(Clone, Debug)]
pub struct SignalTrace {
    /// The signal.
    pub id: String,
    /// Its unit.
    pub unit: String,
    /// What was measured (NaN: missing).
    pub measured: Vec<f64>,
    /// The model simulated from the inputs alone, or corrected by an [observer](Comparison::observer).
    pub free_run: Vec<f64>,
    /// The model's prediction from the previous sample.
    pub one_step: Vec<f64>,
}

/// Simulates `model` over `runs` from the inputs alone, and predicts each sample from the one before. The
/// initial state of each run is estimated.
///
/// The free run of a model that is unstable or integrates drifts away. There an observer corrects it by the
/// measurements, as slowly as possible, and [`Comparison::observer`] describes it.
///
/// # Errors
///
/// [`CompareError`] when the model has no values or measures nothing, when there is no sample, when the
/// simulation diverges, and when the work was cancelled.
pub fn compare(
    model: &Model,
    measurements: &Measurements<'_>,
    work: &Work<'_>,
) -> Result<Comparison, CompareError> {
    let paced = Paced::of(model, measurements.runs, work);
    compare_paced(&paced.model, measurements, &paced.work(work))
}

/// As [`compare`], with a model and criteria that are [`Paced`].
pub(crate) fn compare_paced(
    model: &Model,
    measurements: &Measurements<'_>,
    work: &Work<'_>,
) -> Result<Comparison, CompareError> {
    let Measurements { runs, faults, .. } = *measurements;
    check(model, measurements)?;
    work.tell(Stage::Comparing, 0, runs.len() as u64);
    let (runs, solution) = started(model, runs, work)?;
    let Solution { values, states } = &solution;
    let mut tallies = vec![Tally::default(); model.measured.len()];
    let mut traces = Vec::with_capacity(runs.len());
    for (run, x0) in runs.iter().zip(states) {
        traces.push(trace(model, values, run, x0, &mut tallies, work)?);
        work.tell(Stage::Comparing, traces.len() as u64, runs.len() as u64);
    }
    let signals = scores(model, &tallies);
    let nrmse = overall(&signals);
    Ok(Comparison {
        nrmse,
        fit_percent: 100.0 * (1.0 - nrmse),
        signals,
        faults: faults.to_vec(),
        observer: Correction::of(&runs),
        where_it_fails: where_it_fails(model, &solution, &runs, work)?,
        runs: traces,
    })
}

/// The error that [`compare`] finds, and nothing else of it.
///
/// # Errors
///
/// As [`compare`].
pub(crate) fn free_run_error(
    model: &Model,
    measurements: &Measurements<'_>,
    work: &Work<'_>,
) -> Result<f64, CompareError> {
    check(model, measurements)?;
    let runs = attach_observer(model, &model.values(), measurements.runs, work)?;
    error_over(model, &runs, work)
}

/// The error of the free run over `runs` as they are: corrected by the observer that they have, if any.
///
/// # Errors
///
/// [`CompareError`] when the simulation diverges, and when the work was cancelled.
pub(crate) fn error_over(
    model: &Model,
    runs: &[Run],
    work: &Work<'_>,
) -> Result<f64, CompareError> {
    let values = model.values();
    let states = InitialStates::estimate(model, &values, runs, work)?.states;
    let predicted = for_each_run(runs, &states, |run, x0| {
        predict(model, &values, x0, run, work)
    })?;
    let width = model.measured.len();
    let mut tallies = vec![Tally::default(); width];
    for (run, predicted) in runs.iter().zip(&predicted) {
        if let Some(row) = predicted.iter().position(|v| !v.is_finite()) {
            return Err(diverged(run, row / width));
        }
        for (measured, predicted) in run.measured().chunks(width).zip(predicted.chunks(width)) {
            for (tally, (y, p)) in tallies.iter_mut().zip(measured.iter().zip(predicted)) {
                tally.add(*y, *p);
            }
        }
    }
    Ok(overall(&scores(model, &tallies)))
}

/// Whether there is something to compare.
fn check(model: &Model, measurements: &Measurements<'_>) -> Result<(), CompareError> {
    with_values(model)?;
    if model.measured.is_empty() {
        return Err(CompareError::NothingMeasured);
    }
    measurements.check(model)?;
    if measurements.runs.iter().all(Run::is_empty) {
        return Err(CompareError::NoSamples);
    }
    Ok(())
}

/// The `runs` as they are compared with the values of `model`, and these with the initial states.
fn started<'a>(
    model: &Model,
    runs: &'a [Run],
    work: &Work<'_>,
) -> Result<(Cow<'a, [Run]>, Solution), Cancelled> {
    let values = model.values();
    let runs = attach_observer(model, &values, runs, work)?;
    let states = InitialStates::estimate(model, &values, &runs, work)?.states;
    Ok((runs, Solution { values, states }))
}

/// The scores of the measured signals.
fn scores(model: &Model, tallies: &[Tally]) -> Vec<SignalScore> {
    let signals = tallies.iter().zip(&model.measured);
    signals
        .map(|(tally, m)| tally.score(m.signal.id, m.signal.unit))
        .collect()
}

/// The free run over `run` diverges, at the latest at sample `k`.
fn diverged(run: &Run, k: usize) -> CompareError {
    CompareError::Diverged {
        run: run.name().to_owned(),
        time: run.time()[k],
    }
}

/// Whether every parameter has a value.
pub(crate) fn with_values(model: &Model) -> Result<(), CompareError> {
    let missing = model.missing_values();
    if missing.is_empty() {
        return Ok(());
    }
    let names = missing.iter().map(|name| (*name).to_owned());
    Err(CompareError::MissingValues(names.collect()))
}

fn trace(
    model: &Model,
    values: &[f64],
    run: &Run,
    x0: &DVector<f64>,
    tallies: &mut [Tally],
    work: &Work<'_>,
) -> Result<RunTrace, CompareError> {
    let n = run.len();
    let column = |of: &dyn Fn(usize) -> f64| (0..n).map(of).collect::<Vec<f64>>();
    let mut signals: Vec<SignalTrace> = model
        .measured
        .iter()
        .enumerate()
        .map(|(i, m)| SignalTrace {
            id: m.signal.id.to_owned(),
            unit: m.signal.unit.to_owned(),
            measured: column(&|k| run.sample(k)[i]),
            free_run: Vec::with_capacity(n),
            one_step: vec![f64::NAN; n],
        })
        .collect();
    let mut simulator = Simulator::new(model, values);
    let mut first_lost = None;
    try_follow(&mut simulator, x0.as_slice(), run, |k, predicted, _| {
        for (signal, value) in signals.iter_mut().zip(predicted) {
            signal.free_run.push(*value);
        }
        if first_lost.is_none() && predicted.iter().any(|v| !v.is_finite()) {
            first_lost = Some(k);
        }
        work.go_on()
    })?;
    if let Some(k) = first_lost {
        return Err(diverged(run, k));
    }
    one_step(model, values, run, x0.as_slice(), work, |k, predicted| {
        for (signal, value) in signals.iter_mut().zip(predicted) {
            signal.one_step[k] = *value;
        }
    })?;
    for (tally, signal) in tallies.iter_mut().zip(&signals) {
        for k in 0..n {
            tally.add(signal.measured[k], signal.free_run[k]);
            tally.add_one_step(signal.measured[k], signal.one_step[k]);
        }
    }
    let inputs = model
        .plant
        .inputs
        .iter()
        .enumerate()
        .map(|(i, s)| {
            (
                s.id.to_owned(),
                s.unit.to_owned(),
                column(&|k| run.input(k)[i]),
            )
        })
        .collect();
    Ok(RunTrace {
        name: run.name().to_owned(),
        time: run.time().to_vec(),
        inputs,
        signals,
        initial_state: x0.iter().copied().collect(),
    })
}
