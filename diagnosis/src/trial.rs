//! One candidate at a time: a short fit (the look), the full fit.

use loopsight_model::model::Model;
use nalgebra::DVector;

use crate::candidates::Candidate;
use crate::criteria::SearchCriteria;
use crate::fitted::Fit;
use crate::holdout::{Holdout, Judgement};
use crate::judge::{Losses, nrmse, significance};
use crate::positions::Positions;
use crate::prediction::Solution;
use crate::problem::Problem;
use crate::progress::Work;
use crate::solve::Effort;

/// Effort of the short fit of a candidate.
const LOOK: Effort = Effort {
    iterations: 9,
    tolerance: 1e-3,
    worth: None,
};
/// Effort of a finalist.
pub(crate) const FINAL: Effort = Effort {
    iterations: 16,
    tolerance: 1e-6,
    worth: None,
};
/// That of its second pass, which begins near its end.
const AGAIN: Effort = Effort {
    iterations: 5,
    tolerance: FINAL.tolerance,
    worth: None,
};
/// Longest integration steps of a look, in steps of the plant.
pub(crate) const LOOK_STEPS: f64 = 2.0;

/// A candidate, fitted and judged.
#[derive(Clone)]
pub(crate) struct Judged {
    pub(crate) candidate: Candidate,
    pub(crate) solution: Solution,
    /// On the validation data.
    pub(crate) losses: Losses,
    /// What candidates are ranked by.
    pub(crate) rank: Losses,
}

impl Judged {
    /// What candidates are ranked by, as one number.
    pub(crate) fn error(&self) -> f64 {
        nrmse(&self.rank)
    }

    /// Judges the solution of a candidate's `model`, whose free runs may be `known`; none where they diverge or the work was
    /// cancelled.
    pub(crate) fn of(
        candidate: Candidate,
        model: &Model,
        solution: Solution,
        known: Option<&[Vec<f64>]>,
        nominal: &Nominal<'_>,
    ) -> Option<Self> {
        let judged = (nominal.holdout).judge(model, &solution, known, nominal.work);
        let Judgement { losses, rank } = judged.ok()?;
        nrmse(&rank).is_finite().then_some(Self {
            candidate,
            solution,
            losses,
            rank,
        })
    }
}

/// The model of a candidate with longer integration steps, and with widely smoothed signs where it begins with a
/// regression. Steps that the file makes shorter than usual stay, because its lags need them.
pub(crate) fn coarse(candidate: &Candidate, steps: f64) -> Model {
    let mut model = match candidate.shape() {
        Some(_) => candidate.softened(),
        None => candidate.model.clone(),
    }
    .with_steps_by_motion();
    let usual = model.usual_step();
    if model.max_step >= usual {
        model.max_step = model.max_step.max(steps * usual);
    }
    model
}

/// The model without any candidate, fitted, and what every candidate is fitted to and judged on.
pub(crate) struct Nominal<'a> {
    /// It before it was fitted.
    pub(crate) given: &'a Model,
    pub(crate) model: &'a Model,
    pub(crate) solution: &'a Solution,
    /// Its cost.
    pub(crate) cost: f64,
    /// What candidates are ranked by.
    pub(crate) rank: &'a Losses,
    /// What noise and resolution alone leave of the fitting data.
    pub(crate) floor: f64,
    /// Its initial states, where a short fit holds them.
    pub(crate) held: Option<&'a [DVector<f64>]>,
    pub(crate) holdout: &'a Holdout<'a>,
    /// Reports no progress; stops each trial.
    pub(crate) work: &'a Work<'a>,
}

impl<'a> Nominal<'a> {
    pub(crate) fn criteria(&self) -> &'a SearchCriteria {
        &self.work.criteria().search
    }

    /// The problem of fitting `model` to the fitting data. Initial states that are not known are estimated. None
    /// where the work was cancelled.
    pub(crate) fn problem<'m>(
        &self,
        model: &'m Model,
        known: Option<&[DVector<f64>]>,
    ) -> Option<Problem<'m>>
    where
        'a: 'm,
    {
        let known = known.map(<[DVector<f64>]>::to_vec);
        let seen = self.holdout.seen.as_deref();
        let work = self.work.silently();
        let mut problem = Problem::with(model, self.holdout.runs, seen, known, work).ok()?;
        problem.keeps = true;
        Some(problem)
    }
}

/// Where the candidate reads a position it is first tried at the measured ones.
pub(crate) fn positions(candidate: &Candidate, start: &[f64]) -> Option<Positions> {
    Positions::matter_to(candidate.meta)
        .then(|| Positions::of(&candidate.model, start))
        .flatten()
}

/// A quick fit of a candidate from one start, with the nominal initial states where they can be held; and the root of the
/// cost that it ends with. It is given up where that cannot come below `worth`.
pub(crate) fn look(
    candidate: &Candidate,
    start: &[f64],
    nominal: &Nominal<'_>,
    worth: f64,
) -> Option<(Judged, f64)> {
    nominal.work.go_on().ok()?;
    let model = coarse(candidate, LOOK_STEPS);
    let states = &nominal.solution.states;
    let problem = || nominal.problem(&model, nominal.held);
    let worth = Some(worth);
    let effort = Effort { worth, ..LOOK };
    let mut start = start.to_vec();
    if let Some(measured) = positions(candidate, &start) {
        let mut problem = problem()?;
        problem.positions = Some(measured);
        // Linear parameters start at the values of a regression. A ripple of the wrong sign would make the model
        // stick where the machine does not.
        if let Some(shape) = candidate.shape() {
            let regressed = problem.stride(&start, states, &shape).ok()?;
            start = regressed.unwrap_or(start);
        }
        start = problem.solve_from(&start, states, effort).ok()?.values;
    }
    let mut problem = problem()?;
    let solution = problem.solve_from(&start, states, effort).ok()?;
    let (left, _) = problem.best()?;
    let known = problem.runs_of(&solution);
    let judged = Judged::of(
        candidate.clone(),
        &model,
        solution,
        known.as_deref(),
        nominal,
    )?;
    Some((judged, left))
}

/// The full fit of a finalist, initial states included, with intervals. A sign is as sharp as the integrator
/// allows. Where a softer one does better, its width is fitted as well.
///
/// None where every fit fails, where none promises a cost of at most `most`, or where the work was cancelled.
pub(crate) fn finish(first: Judged, nominal: &Nominal<'_>, most: f64) -> Option<(Judged, Fit)> {
    // With the sharpest sign possible.
    let criteria = nominal.criteria();
    let widths = [criteria.sharpest, criteria.sharp];
    let sharp = || {
        widths.iter().find_map(|share| {
            let sharp = Judged {
                candidate: first.candidate.smoothed(*share)?,
                ..first.clone()
            };
            fully(sharp, nominal, criteria.wild, most)
        })
    };
    let broad = || fully(first.clone(), nominal, f64::INFINITY, most);
    let (sharp, broad) = rayon::join(sharp, broad);
    let error = |found: &(Judged, Fit)| found.0.error();
    let of = |found: &Option<(Judged, Fit)>| found.as_ref().map_or(f64::INFINITY, error);
    // The width is one more parameter: it must explain significantly more.
    let soft = broad
        .as_ref()
        .filter(|_| of(&broad) < of(&sharp))
        .and_then(|(judged, _)| {
            let soft = softer(judged.clone(), nominal)?;
            let sure = significance(&judged.rank, &soft.0.rank, nominal.work).ok()?;
            (sure > nominal.work.criteria().missing.significant).then_some(soft)
        });
    // After a cancellation some of these fits are missing, so the best is not known.
    nominal.work.go_on().ok()?;
    sharp
        .into_iter()
        .chain(broad)
        .chain(soft)
        .min_by(|a, b| error(a).total_cmp(&error(b)))
}

/// Fits the smoothing width of the sign as well, from where the fit without it ended. Otherwise an unusually soft
/// sign would be taken for another effect. None where there is no sign, or none that the integrator can follow.
fn softer(mut first: Judged, nominal: &Nominal<'_>) -> Option<(Judged, Fit)> {
    let widths = first.candidate.own_widths();
    widths.first()?;
    for i in &widths {
        first.candidate.model.parameters[*i].free = true;
    }
    let (mut judged, mut fit) = fully(first, nominal, nominal.criteria().wild, f64::INFINITY)?;
    // From here on the widths are known parameters, as others are.
    for model in [&mut judged.candidate.model, &mut fit.model] {
        for i in &widths {
            let parameter = &mut model.parameters[*i];
            parameter.free = false;
            parameter.value = Some(judged.solution.values[*i]);
        }
    }
    Some((judged, fit))
}

/// The full fit, without limits that nothing came to. None where its derivatives exceed `wild`, where the cost that it
/// promises exceeds `most`, or where the effect only sharpens a sign.
fn fully(first: Judged, nominal: &Nominal<'_>, wild: f64, most: f64) -> Option<(Judged, Fit)> {
    let model = first.candidate.model.clone().with_steps_by_motion();
    let mut problem = nominal.problem(&model, None)?;
    let start = problem.pack(&first.solution.values, &nominal.solution.states);
    if problem.steepness(&start).ok()? > wild {
        return None;
    }
    let start = problem.balance(start).ok()?;
    if most < f64::INFINITY {
        let promise = problem.promise_at(&start).ok()?;
        if promise.is_some_and(|(_, after)| after > most) {
            return None;
        }
    }
    let mut found = problem.solve(&start, FINAL).ok()?;
    if problem.reweigh_starts(&found).ok()? {
        found = problem.solve(&found, AGAIN).ok()?;
    }
    if problem.steepness(&found).ok()? > wild {
        return None;
    }
    let solution = problem.solution(&found);
    let (values, criteria) = (&solution.values, nominal.criteria());
    if first.candidate.drowns(values, criteria) || first.candidate.has_no_way(values, criteria) {
        return None;
    }
    let mut fit = problem.result(&found).ok()?;
    fit.model.by_motion = false;
    if let Some(without) = first.candidate.without_unmet(&fit) {
        let again = Judged {
            candidate: without,
            solution,
            ..first
        };
        return fully(again, nominal, wild, f64::INFINITY);
    }
    let (candidate, known) = (first.candidate.clone(), problem.runs_of(&solution));
    let judged = Judged::of(candidate, &model, solution, known.as_deref(), nominal)?;
    Some((judged, fit))
}
