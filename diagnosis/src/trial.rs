//! One candidate at a time: where to start it, a first look, the full fit.

use std::collections::BTreeMap;

use loopsight_core::model::Model;
use rayon::prelude::*;

use crate::candidates::Candidate;
use crate::fit::Fit;
use crate::holdout::{Holdout, Judgement};
use crate::judge::{Losses, nrmse};
use crate::positions::Positions;
use crate::problem::{Effort, Problem, Solution};

/// Effort of a first look at a candidate.
const LOOK: Effort = Effort {
    iterations: 7,
    tolerance: 1e-3,
};
/// Effort of a finalist.
pub(crate) const FINAL: Effort = Effort {
    iterations: 16,
    tolerance: 1e-6,
};
/// Longest integration steps of a promise and of a first look, in those of the plant. Where a position
/// is read the short one serves both: cogs run by.
const PROMISE_STEPS: f64 = 4.0;
const LOOK_STEPS: f64 = 2.0;

/// Most starts of a candidate that is looked at from where a simpler one ended.
const GROWN: usize = 3;
/// A simpler candidate that leaves more than so many times the least that was seen is not grown: what it
/// leaves is not what the larger one adds.
const WORTH_GROWING: f64 = 2.0;
/// An effect at several channels alike is tried at each with its own parameters where it leaves less
/// than this share of the error.
const WORTH_DIVIDING: f64 = 0.8;
/// A candidate, fitted and judged.
#[derive(Clone)]
pub(crate) struct Judged {
    pub(crate) candidate: Candidate,
    pub(crate) solution: Solution,
    /// On what no fit saw.
    pub(crate) losses: Losses,
    /// What candidates are ranked by.
    pub(crate) rank: Losses,
}

impl Judged {
    /// Judges the solution of `model`, a candidate's; none where its free run leaves the finite numbers.
    fn of(
        candidate: Candidate,
        model: &Model,
        solution: Solution,
        holdout: &Holdout<'_>,
    ) -> Option<Self> {
        let Judgement { losses, rank } = holdout.judge(model, &solution);
        nrmse(&rank).is_finite().then_some(Self {
            candidate,
            solution,
            losses,
            rank,
        })
    }
}

/// Shares of the flow that a speed to be estimated starts from.
const FLOW_STARTS: [f64; 3] = [0.03, 0.1, 0.3];

/// Looks at candidates that contain a simpler one from where the simpler one ended: strong
/// breakaway friction is found from dry friction, not from none, and two levels from one for both.
pub(crate) fn grown(
    all: &[Candidate],
    looked: &[(usize, Judged)],
    holdout: &Holdout<'_>,
    nominal: &Solution,
    nominal_rank: &Losses,
    duration: f64,
) -> Vec<(usize, Judged)> {
    let mut attempts: Vec<(usize, Vec<f64>)> = Vec::new();
    let errors = looked.iter().map(|(_, found)| nrmse(&found.rank));
    let least = errors.fold(f64::INFINITY, f64::min);
    for (i, candidate) in all.iter().enumerate() {
        let simpler = looked
            .iter()
            .filter(|(_, found)| nrmse(&found.rank) < WORTH_GROWING * least)
            .filter(|(j, found)| {
                let other = &all[*j];
                let contains = candidate.meta.simpler.contains(&other.meta.id);
                let divides = candidate.separate
                    && candidate.meta.id == other.meta.id
                    && nrmse(&found.rank) < WORTH_DIVIDING * nrmse(nominal_rank);
                (contains && !candidate.separate && candidate.replaces.is_none() || divides)
                    && candidate.at == other.at
                    && !other.separate
            })
            .min_by(|a, b| nrmse(&a.1.rank).total_cmp(&nrmse(&b.1.rank)));
        let Some((j, found)) = simpler else { continue };
        let own = all[*j].own();
        let values = &found.solution.values;
        let known: BTreeMap<&str, f64> = all[*j]
            .meta
            .parameters
            .iter()
            .zip(&values[own.clone()])
            .map(|(declaration, value)| (declaration.id, *value))
            .collect();
        let starts = starts(candidate, &values[..own.start], &known, duration);
        if starts.len() <= GROWN {
            attempts.extend(starts.into_iter().map(|start| (i, start)));
        }
    }
    attempts
        .par_iter()
        .filter_map(|(i, start)| Some((*i, look(&all[*i].chosen(start), start, holdout, nominal)?)))
        .collect()
}

/// Values to start a candidate from: the `nominal` model's, without those of an effect that it takes
/// the place of; what has the same name begins where that one was.
pub(crate) fn first_starts(candidate: &Candidate, nominal: &Model, duration: f64) -> Vec<Vec<f64>> {
    let mut base = nominal.values();
    let mut known = BTreeMap::new();
    if let Some((_, gone)) = &candidate.replaces {
        for parameter in &nominal.parameters[gone.clone()] {
            if let (true, Some(value)) = (parameter.free, parameter.value) {
                known.insert(parameter.declaration.id, value);
            }
        }
        base.drain(gone.clone());
    }
    starts(candidate, &base, &known, duration)
}

/// Values to start a candidate from: those of the rest of the model from `base`, its own as `known`,
/// else a noticeable step from neutral.
fn starts(
    candidate: &Candidate,
    base: &[f64],
    known: &BTreeMap<&str, f64>,
    duration: f64,
) -> Vec<Vec<f64>> {
    let mut all = vec![base.to_vec()];
    let regressed = candidate.shape().is_some();
    for i in candidate.own() {
        let parameter = &candidate.model.parameters[i];
        let nearest = |value: f64| parameter.declaration.nearest(value);
        let neutral = parameter.value.unwrap_or(0.0);
        let listed = parameter.starts(duration);
        let values: Vec<f64> = if let Some(value) = known.get(parameter.declaration.id) {
            vec![*value]
        } else if !parameter.free && listed.is_empty() {
            vec![neutral]
        } else if parameter.free && parameter.declaration.unit == "flow" && candidate.flow > 0.0 {
            FLOW_STARTS
                .iter()
                .map(|s| nearest(s * candidate.flow))
                .collect()
        } else if listed.is_empty() {
            // Where the position is measured, what is linear in the effect is regressed.
            let neutral_first = regressed && parameter.declaration.linear;
            let step = if neutral_first {
                0.0
            } else {
                parameter.scale()
            };
            vec![nearest(neutral + step)]
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

/// The model of a candidate with coarser steps, and with softened signs where it begins with a
/// regression. A file that asks for finer steps than usual has lags
/// that no longer ones stand.
fn coarse(candidate: &Candidate, steps: f64) -> Model {
    let mut model = match candidate.shape() {
        Some(_) => candidate.softened(),
        None => candidate.model.clone(),
    };
    let usual = model.usual_step();
    if model.max_step >= usual {
        model.max_step = model.max_step.max(steps * usual);
    }
    model
}

/// Share of the cost that a regression must promise to leave less than: others begin a step away from
/// the plain model, and may do worse at first.
const PROMISING: f64 = 0.99;

/// Share of the plain model's cost below which measured positions tell all there is, as where the
/// position is what is measured.
const TOLD: f64 = 0.1;

/// What a candidate promises to leave of the cost, from one start; the plain model leaves `plain`.
pub(crate) fn promise(
    candidate: &Candidate,
    start: &[f64],
    holdout: &Holdout<'_>,
    nominal: &Solution,
    plain: f64,
) -> Option<f64> {
    let steps = if Positions::matter_to(candidate.meta) {
        LOOK_STEPS
    } else {
        PROMISE_STEPS
    };
    let mut model = coarse(candidate, steps);
    // While what is linear in it is neutral, its shape says nothing: a pass of derivatives less.
    let shape = candidate.shape();
    for index in shape.iter().flatten() {
        model.parameters[*index].free = false;
        model.parameters[*index].value = Some(start[*index]);
    }
    let (seen, states) = (holdout.seen.as_deref(), nominal.states.clone());
    let mut problem =
        Problem::with(&model, holdout.runs, seen, Some(states.clone()), &|_, _| {}).ok()?;
    problem.positions = positions(candidate, start);
    let (before, after) = problem.promise(start, &states)?;
    match shape {
        // With measured positions also the plain model leaves less than in its free run; where they leave
        // hardly anything, the regression says nothing.
        Some(_) => {
            let promising = after < PROMISING * before || before < TOLD * plain;
            promising.then(|| plain * after / before)
        }
        None => Some(after),
    }
}

/// Where the candidate reads a position it is first tried at the measured ones.
fn positions(candidate: &Candidate, start: &[f64]) -> Option<Positions> {
    Positions::matter_to(candidate.meta)
        .then(|| Positions::of(&candidate.model, start))
        .flatten()
}

/// A quick fit of a candidate from one start, with the nominal initial states.
pub(crate) fn look(
    candidate: &Candidate,
    start: &[f64],
    holdout: &Holdout<'_>,
    nominal: &Solution,
) -> Option<Judged> {
    let model = coarse(candidate, LOOK_STEPS);
    let (seen, states) = (holdout.seen.as_deref(), nominal.states.clone());
    let problem = || Problem::with(&model, holdout.runs, seen, Some(states.clone()), &|_, _| {});
    let mut start = start.to_vec();
    if let Some(measured) = positions(candidate, &start) {
        let mut problem = problem().ok()?;
        problem.positions = Some(measured);
        // What is linear in the effect begins where a regression has it: a ripple against the true
        // one makes a machine stick that does not.
        if let Some(shape) = candidate.shape() {
            start = problem.stride(&start, &states, &shape).unwrap_or(start);
        }
        start = problem.solve_from(&start, &states, LOOK).ok()?.values;
    }
    let solution = problem().ok()?.solve_from(&start, &states, LOOK).ok()?;
    Judged::of(candidate.clone(), &model, solution, holdout)
}

/// The full fit of a finalist, initial states included, with intervals: where it has a sign, as sharply
/// as it can be, unless the machine does not stick so; then as softly as it is.
pub(crate) fn finish(
    first: Judged,
    holdout: &Holdout<'_>,
    nominal: &Solution,
) -> Option<(Judged, Fit)> {
    // The sharpest that can be.
    let sharp = SHARP.iter().find_map(|share| {
        let sharp = Judged {
            candidate: first.candidate.smoothed(*share)?,
            ..first.clone()
        };
        fully(sharp, holdout, nominal, WILD)
    });
    let broad = fully(first, holdout, nominal, f64::INFINITY);
    let error = |found: &(Judged, Fit)| nrmse(&found.0.rank);
    let of = |found: &Option<(Judged, Fit)>| found.as_ref().map_or(f64::INFINITY, error);
    let soft =
        (of(&broad) < of(&sharp)).then(|| softer(broad.as_ref()?.0.clone(), holdout, nominal));
    sharp
        .into_iter()
        .chain(broad)
        .chain(soft.flatten())
        .min_by(|a, b| error(a).total_cmp(&error(b)))
}

/// Fits also the width over which the sign is smoothed, from where a fit without it ended: what is softer
/// than usual would else be taken for another effect. None without a sign.
fn softer(mut first: Judged, holdout: &Holdout<'_>, nominal: &Solution) -> Option<(Judged, Fit)> {
    let widths = first.candidate.own_widths();
    widths.first()?;
    for i in &widths {
        first.candidate.model.parameters[*i].free = true;
    }
    let (mut judged, mut fit) = fully(first, holdout, nominal, f64::INFINITY)?;
    // From here on they are known, as other widths are.
    for model in [&mut judged.candidate.model, &mut fit.model] {
        for i in &widths {
            let parameter = &mut model.parameters[*i];
            parameter.free = false;
            parameter.value = Some(judged.solution.values[*i]);
        }
    }
    Some((judged, fit))
}

/// Shares of the flow over which a sign is smoothed in a final fit, which starts near its end: what
/// sticks, sticks.
const SHARP: [f64; 2] = [0.004, 0.01];
/// Where the steepest row of a Jacobian is so many times the one in the middle, the steps of the
/// integrator are too long for what is to stick.
const WILD: f64 = 1e4;

/// The full fit; none where its derivatives run wild or the effect is none of its own.
fn fully(
    first: Judged,
    holdout: &Holdout<'_>,
    nominal: &Solution,
    wild: f64,
) -> Option<(Judged, Fit)> {
    let quiet = |_: u64, _: f64| {};
    let model = &first.candidate.model;
    let mut problem =
        Problem::with(model, holdout.runs, holdout.seen.as_deref(), None, &quiet).ok()?;
    let start = problem.pack(&first.solution.values, &nominal.states);
    if problem.steepness(&start) > wild {
        return None;
    }
    let start = problem.balance(start);
    let found = problem.solve(&start, FINAL).ok()?;
    if problem.steepness(&found) > wild {
        return None;
    }
    let solution = problem.solution(&found);
    if first.candidate.drowns(&solution.values) {
        return None;
    }
    let fit = problem.result(&found);
    let judged = Judged::of(first.candidate.clone(), model, solution, holdout)?;
    Some((judged, fit))
}
