//! Whether a signal counts the other way than the model.

use loopsight_model::model::Model;
use loopsight_model::run::Run;
use rayon::prelude::*;

use crate::compare::free_run_error;
use crate::conclusion::Advice;
use crate::error::FitError;
use crate::measurements::Measurements;
use crate::observer::{Correction, attach_observer};
use crate::output_error::{Unaided, fitted_values};
use crate::progress::{Cancelled, Work};
use crate::solve::Effort;

/// Effort of each fit: enough to see whether it gets anywhere.
const EFFORT: Effort = Effort {
    iterations: 16,
    tolerance: 1e-4,
    worth: None,
};

/// Share of what is left so far that may be left: a wrong sign is no matter of a few per cent.
const LESS: f64 = 0.75;
/// Share of it that another signal must be better by, where turning either does: a log that is turned as a whole is the same to
/// many machines.
const BETTER: f64 = 0.98;

/// What is left of a recording as it is.
#[derive(Clone, Copy)]
pub(crate) struct SoFar {
    pub(crate) error: f64,
    /// Time within which an observer forgets, s; none without one.
    pub(crate) horizon: Option<f64>,
}

impl SoFar {
    /// Whether an error with this `observer` can be compared with it: one that corrects sooner leaves less.
    pub(crate) fn allows(&self, observer: Option<&Correction>) -> bool {
        let horizon = |observer: &Correction| observer.horizon_s;
        let (now, before) = (observer.map_or(f64::INFINITY, horizon), self.horizon);
        now >= before.unwrap_or(f64::INFINITY)
    }
}

/// A column of a recording.
#[derive(Clone, Copy)]
enum Signal {
    Input(usize),
    Measured(usize),
}

/// What a diagnosis makes of a recording: the error that the effect leaves which it names; infinite where it names none.
pub(crate) type Diagnosed<'d> = &'d (dyn Fn(&[Run]) -> Result<f64, Cancelled> + Sync);

/// Of a model that leaves much, and with the best effect `so_far`: the signal that it can be fitted with once it counts the
/// other way, which is the most frequent mistake in a model file. It is looked for with the model alone first. Where that could not
/// be fitted at all, it is looked for with the effect that a diagnosis names then, too: a cart without its friction goes anywhere,
/// whichever way its pole counts.
///
/// None where none leaves three quarters of that at most and as little as a model that needs no observer (`start.stands`), or with an
/// effect less than a constant does. Of signals that do as well, one whose scale is negative is named.
pub(crate) fn advice(
    model: &Model,
    runs: &[Run],
    so_far: SoFar,
    diagnosed: Diagnosed<'_>,
    work: &Work<'_>,
) -> Result<Option<Advice>, Cancelled> {
    let criteria = &work.criteria().start;
    let fitted = |runs: &[Run]| left(model, runs, so_far, work);
    let alone: (Diagnosed<'_>, f64) = (&fitted, criteria.stands.min(LESS * so_far.error));
    let with_effect = (so_far.error >= criteria.hopeless).then_some((diagnosed, criteria.hopeless));
    let ways = std::iter::once(alone).chain(with_effect);
    for (leaves, most) in ways {
        let measured = (0..model.measured.len()).map(Signal::Measured);
        let inputs = (0..model.plant.inputs.len()).map(Signal::Input);
        let mut best: Option<(Signal, f64)> = None;
        let mut signals: Vec<Signal> = measured.chain(inputs).collect();
        signals.sort_by_key(|signal| read(model, *signal).0 > 0.0);
        let left_with = |signal: &Signal| Ok((*signal, leaves(&turned(model, runs, *signal))?));
        let left = signals.par_iter().map(left_with);
        for (signal, left) in left.collect::<Result<Vec<_>, Cancelled>>()? {
            let better = best.is_none_or(|(_, least)| left < BETTER * least);
            if better && left < most {
                best = Some((signal, left));
            }
        }
        if let Some((signal, left)) = best {
            return Ok(Some(told(model, signal, left)));
        }
    }
    Ok(None)
}

/// What a fit of `model` leaves of `runs`; infinite where it is helped sooner than before.
fn left(model: &Model, runs: &[Run], so_far: SoFar, work: &Work<'_>) -> Result<f64, Cancelled> {
    let silent = work.silently();
    let fitted = match fitted_values(model, runs, Unaided::Sought, EFFORT, &silent) {
        Ok(fitted) => fitted,
        Err(FitError::Cancelled(cancelled)) => return Err(cancelled),
        Err(_) => return Ok(f64::INFINITY),
    };
    let observed = attach_observer(&fitted, &fitted.values(), runs, &silent)?;
    if !so_far.allows(Correction::of(&observed).as_ref()) {
        return Ok(f64::INFINITY);
    }
    let error = free_run_error(&fitted, &Measurements::new(runs), &silent);
    Ok(error.unwrap_or(f64::INFINITY))
}

/// `runs` with the sign of the scale of a `signal` the other way round; its offset stays.
fn turned(model: &Model, runs: &[Run], signal: Signal) -> Vec<Run> {
    let twice = 2.0 * read(model, signal).1;
    let turn = |values: &[f64], index: usize, width: usize| {
        let mut values = values.to_vec();
        for value in values.iter_mut().skip(index).step_by(width) {
            *value = twice - *value;
        }
        values
    };
    runs.iter()
        .map(|run| {
            let turned = match signal {
                Signal::Input(i) => {
                    let inputs: Vec<f64> =
                        (0..run.len()).flat_map(|k| run.input(k).to_vec()).collect();
                    run.clone().with_inputs(turn(&inputs, i, run.n_inputs()))
                }
                Signal::Measured(i) => {
                    let turned = turn(run.measured(), i, run.n_measured());
                    run.clone().with_measured(turned)
                }
            };
            turned.unwrap_or_else(|_| run.clone())
        })
        .collect()
}

/// The scale and the offset that a signal is read with.
fn read(model: &Model, signal: Signal) -> (f64, f64) {
    let found = match signal {
        Signal::Input(i) => {
            let column = model.log.inputs.get(model.plant.inputs[i].id);
            column.map(|c| (c.scale(), c.offset()))
        }
        Signal::Measured(i) => {
            let measured = model.log.measured.get(model.measured[i].signal.id);
            measured.map(|m| (m.scale.unwrap_or(1.0), m.offset.unwrap_or(0.0)))
        }
    };
    found.unwrap_or((1.0, 0.0))
}

fn told(model: &Model, signal: Signal, left: f64) -> Advice {
    let (table, id) = match signal {
        Signal::Input(i) => ("inputs", model.plant.inputs[i].id),
        Signal::Measured(i) => ("measured", model.measured[i].signal.id),
    };
    let scale = -read(model, signal).0;
    Advice {
        why: format!(
            "with `{id}` the other way round the model leaves {:.0} % or less: it may count against the model's direction",
            100.0 * left
        ),
        experiment: format!("turn the sign of `{id}`: `scale = {scale}` in [log.{table}.{id}]"),
    }
}
