//! Signs as sharp as the motion in a recording asks for, where a model file leaves that open.

use std::borrow::Cow;

use loopsight_model::model::{Model, Origin};
use loopsight_model::run::Run;

use crate::arrive::Starts;
use crate::error::FitError;
use crate::output_error::{Unaided, prepare};
use crate::prediction::signal_rms;
use crate::problem::Problem;
use crate::progress::Work;
use crate::settings::FitSettings;
use crate::solve::Effort;
use crate::suited::widths;

/// How often a width may be the one that suits a recording. A mass on a spring with dry friction has its level within 0.3 %
/// there, within 3 % at four times the width, and 62 % too high at forty times.
const WIDER: f64 = 2.0;
/// Most halvings.
const HALVINGS: i32 = 3;
/// Effort of a fit that shows how fast the machine moves.
const SHORT: Effort = Effort {
    iterations: 12,
    tolerance: 1e-4,
    worth: None,
};

/// `model` with narrower signs, where its file says no width and the default is too wide for a machine that moves as slowly as
/// in `runs`. None where no width is left open or too wide.
///
/// A sign is smoothed as `tanh(flow/width)`, so dry friction of a machine that never moves faster than the width is viscous
/// friction. The width is set to the share of the flow's root mean square that a diagnosis takes (`search.sign_width`), as a
/// short fit of the model with its defaults has that flow, and halved while that lowers the error, as `improve` does with an
/// effect that it adds. What the file says stays, and so does what is estimated.
pub(crate) fn narrowed(
    model: &Model,
    runs: &[Run],
    unaided: Unaided,
    work: &Work<'_>,
) -> Result<Option<Model>, FitError> {
    let open: Vec<usize> = (0..model.parameters.len())
        .filter(|i| {
            let parameter = &model.parameters[*i];
            parameter.declaration.is_width()
                && !parameter.free
                && !parameter.per_run
                && parameter.origin == Origin::Declaration
        })
        .collect();
    if open.is_empty() {
        return Ok(None);
    }
    let mut narrower = model.clone();
    for i in &open {
        narrower.parameters[*i].origin = Origin::Log;
    }
    match narrowed_if_wide(narrower, &open, runs, unaided, &work.silently()) {
        Err(FitError::Cancelled(cancelled)) => Err(cancelled.into()),
        // The fit itself will say why.
        Err(_) => Ok(None),
        Ok(narrower) => Ok(narrower),
    }
}

/// `model` with the `open` widths that suit it.
fn narrowed_if_wide(
    mut model: Model,
    open: &[usize],
    runs: &[Run],
    unaided: Unaided,
    work: &Work<'_>,
) -> Result<Option<Model>, FitError> {
    let criteria = work.criteria();
    let first = short_fit(&model, runs, unaided, work)?;
    let rms = first.rms;
    let suits = widths(&model, &rms, criteria.search.sign_width);
    let wide = |(i, suits): &(usize, f64)| {
        let value = model.parameters[*i].value;
        open.contains(i) && suits.is_normal() && value.is_some_and(|v| v > WIDER * suits)
    };
    let wide: Vec<(usize, f64)> = suits.into_iter().filter(wide).collect();
    if wide.is_empty() {
        return Ok(None);
    }
    let set = |model: &mut Model, share: f64| {
        for (i, suits) in &wide {
            model.parameters[*i].value = format!("{:.1e}", share * suits).parse().ok();
        }
    };
    set(&mut model, 1.0);
    let unaided = match first.aided {
        true => Unaided::Known,
        false => unaided,
    };
    let mut least = short_fit(&model, runs, unaided, work)?.error;
    for halvings in 1..=HALVINGS {
        let mut sharper = model.clone();
        set(&mut sharper, 0.5f64.powi(halvings));
        let error = short_fit(&sharper, runs, unaided, work)?.error;
        if error.is_nan() || error >= criteria.improve.sharper * least {
            break;
        }
        (model, least) = (sharper, error);
    }
    Ok(Some(model))
}

/// A short fit.
struct Short {
    /// Root of the cost.
    error: f64,
    /// Root mean squares of the signals.
    rms: Vec<f64>,
    /// Whether an observer corrects the free run.
    aided: bool,
}

/// A short fit of `model`.
fn short_fit(
    model: &Model,
    runs: &[Run],
    unaided: Unaided,
    work: &Work<'_>,
) -> Result<Short, FitError> {
    let settings = FitSettings::default();
    let prepared = prepare(model, runs, &settings, unaided, work)?;
    let mut problem = Problem::new(&prepared.model, &prepared.runs, work.clone())?;
    let arrived = problem.arrive(&settings, Starts::Best, SHORT)?;
    let error = problem.residual_vector(&arrived.solution)?.norm();
    let found = problem.solution(&arrived.solution);
    let rms = signal_rms(
        problem.model,
        &found.values,
        &found.states,
        &prepared.runs,
        work,
    )?;
    let aided = matches!(prepared.runs, Cow::Owned(_));
    Ok(Short { error, rms, aided })
}
