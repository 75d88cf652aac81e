//! Observers with horizons over which a model tells something.

use std::borrow::Cow;

use loopsight_model::model::Model;
use loopsight_model::run::{Run, shortest_period};

use crate::growth::Growth;
use crate::observer::{SHORTEST, attach_observer_for};
use crate::prediction::InitialStates;
use crate::problem::Problem;
use crate::progress::{Cancelled, Work};
use crate::solve::Effort;

/// How a model is fitted anew over each horizon.
pub(crate) struct Fitted {
    pub(crate) effort: Effort,
    /// What it begins with, and how errors grow there: a fit over a horizon that was too long may have led far away.
    pub(crate) values: Vec<f64>,
    pub(crate) growth: Growth,
}

/// `runs` with the observer that suits `growth`, or with one that forgets sooner, and the values of `model` that go with it.
///
/// A horizon says after what time an error of the state has grown too large. A model that lacks something drifts away sooner:
/// what pushes a mass without a spring by a little more than the model says moves it by the square of the horizon. Over a horizon
/// with which the model leaves as much as a constant would (`start.hopeless`) it tells nothing, so the horizon is halved until it
/// leaves less.
///
/// Where the model is `fitted`, it must leave less than `start.stands`, and is fitted anew over each horizon, from where it
/// began: over a horizon that was too long a fit makes the pole of an upright pendulum so heavy that it no longer falls, and
/// does not come back from there.
pub(crate) fn attach_telling<'r>(
    model: &Model,
    values: Vec<f64>,
    runs: &'r [Run],
    growth: &Growth,
    fitted: Option<&Fitted>,
    work: &Work<'_>,
) -> Result<(Cow<'r, [Run]>, Vec<f64>), Cancelled> {
    let effort = fitted.map(|fitted| fitted.effort);
    let start = &work.criteria().start;
    let most = fitted.map_or(start.hopeless, |_| start.stands);
    let shortest = SHORTEST * shortest_period(runs);
    let (mut growth, mut values) = (growth.clone(), values);
    loop {
        let observed = attach_observer_for(model, &values, runs, &growth, work)?;
        let left = left(model, &mut values, &observed, effort, work)?;
        let tells = left < most;
        if tells || growth.horizon <= shortest || matches!(observed, Cow::Borrowed(_)) {
            return Ok((observed, values));
        }
        let horizon = growth.horizon;
        if let Some(fitted) = fitted {
            (growth, values) = (fitted.growth.clone(), fitted.values.clone());
        }
        growth.horizon = shortest.max(0.5 * horizon.min(growth.horizon));
    }
}

/// `runs` with an observer that forgets as soon as one may, for a `model` whose free runs say nothing of how the machine moves: that
/// of a motor whose gain a fit has made small stands still.
pub(crate) fn held_to_measurements<'r>(
    model: &Model,
    values: &[f64],
    runs: &'r [Run],
    work: &Work<'_>,
) -> Result<Cow<'r, [Run]>, Cancelled> {
    if runs.iter().any(|run| run.observer().is_some()) {
        return Ok(Cow::Borrowed(runs));
    }
    let soonest = Growth {
        horizon: SHORTEST * shortest_period(runs),
        doubling: None,
        observed: (0..model.n_states()).collect(),
    };
    attach_observer_for(model, values, runs, &soonest, work)
}

/// What the model leaves of `runs`, as a share of the signals' deviations, with some `values`, or those that are fitted with an
/// `effort` from them.
fn left(
    model: &Model,
    values: &mut Vec<f64>,
    runs: &[Run],
    effort: Option<Effort>,
    work: &Work<'_>,
) -> Result<f64, Cancelled> {
    let Ok(mut problem) = Problem::new(model, runs, work.silently()) else {
        return Ok(0.0);
    };
    let states = match effort {
        Some(_) => InitialStates::guess(model, values, runs).states,
        None => InitialStates::estimate(model, values, runs, work)?.states,
    };
    let mut at = problem.pack(values, &states);
    if let Some(effort) = effort
        && let Ok(solution) = problem.solve_from(values, &states, effort)
    {
        at = problem.pack(&solution.values, &solution.states);
        values.clone_from(&solution.values);
    }
    Ok(problem.residual_vector(&at)?.norm())
}
