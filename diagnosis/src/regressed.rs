//! Candidates by regressions, away from where the fit of the plain model ended.

use loopsight_model::model::Model;
use loopsight_model::regression::Scheme;
use loopsight_model::run::Run;
use rayon::prelude::*;

use crate::arrive::SPANS;
use crate::candidates::Candidate;
use crate::conclusion::Explanation;
use crate::judge::nrmse;
use crate::prediction::{InitialStates, Solution};
use crate::progress::Work;
use crate::regression::{Regression, normal_equations};
use crate::search::{Search, least};
use crate::speeds::Speeds;
use crate::starts::first_starts;
use crate::trial::{Judged, Nominal, look};

/// Candidates by each regression that get a short fit.
const MOST: usize = 4;
/// Samples of a regression at most, and of one of its windows: a handful of parameters needs no more.
const SAMPLES: usize = 1000;
const WINDOW: usize = 125;
/// Floors beyond which what the best finalist leaves is no matter of a shape that the library has not quite.
const STRAY: f64 = 30.0;
/// Share of what the best finalist leaves below which that one was led astray: a fit that begins elsewhere finds a tenth less
/// of a shape that the library has not quite as well.
const ASTRAY: f64 = 0.5;

impl Search<'_> {
    /// What does better than any of the `finalists` when it begins from a regression that holds the effect.
    ///
    /// A free run that lacks an effect makes up for it with everything else: two masses and a spring without the friction of
    /// the motor end with a spring thirty times too soft, and a joint without its weight and its friction with a damping a
    /// hundred times too large. A regression looks from one sample to the next, where what is missing adds an error and leads
    /// nowhere. Where the best finalist still leaves much, each effect that enters the rates is put into the regression, at
    /// once with all parameters that enter linearly, and those that lower its residual most begin there.
    pub(crate) fn regressed(
        &self,
        finalists: &[(Judged, Explanation)],
    ) -> Vec<(Judged, Explanation)> {
        let plain = nrmse(self.nominal.rank);
        let left = least(finalists.iter().map(|(found, _)| found)).min(plain);
        let stray = STRAY * self.nominal.floor;
        if left <= self.work.criteria().start.poor.min(stray) {
            return Vec::new();
        }
        let looked = (SPANS.iter()).flat_map(|span| self.by_regression(*span, left));
        let astray = ASTRAY * left;
        let better: Vec<Judged> = looked.filter(|found| found.error() < left).collect();
        (better.into_par_iter())
            .filter_map(|found| self.finished(found, f64::INFINITY))
            .filter(|(found, _)| found.error() < astray)
            .collect()
    }

    /// Short fits of the candidates that lower the residual of a regression over `span` most, from its values.
    fn by_regression(&self, span: f64, left: f64) -> Vec<Judged> {
        let runs = thinned(self.nominal.holdout.runs, span);
        let Some(plain) = regress(self.nominal.given, &runs, span, 2, self.work) else {
            return Vec::new();
        };
        let mut given = self.nominal.given.clone();
        given.set_values(&plain.values);
        let simple = |c: &&Candidate| !c.separate && !c.further && c.replaces.is_none();
        let starts = (self.all.iter().filter(simple)).flat_map(|candidate| {
            let starts = first_starts(candidate, &given, self.extent);
            starts.into_iter().map(move |start| (candidate, start))
        });
        let starts: Vec<(&Candidate, Vec<f64>)> = starts.collect();
        let mut found: Vec<(f64, &Candidate, Vec<f64>)> = (starts.into_par_iter())
            .filter_map(|(candidate, start)| {
                let mut model = candidate.chosen(&start).model;
                model.set_values(&start);
                if Regression::left_out(&model).contains(&candidate.meta.id) {
                    return None;
                }
                let with = regress(&model, &runs, span, 1, self.work)?;
                Some((with.share_of(&plain)?, candidate, with.values))
            })
            .collect();
        found.sort_by(|a, b| a.0.total_cmp(&b.0));
        found.truncate(MOST);
        (found.into_par_iter())
            .filter_map(|(_, candidate, start)| {
                let mut model = candidate.chosen(&start).model;
                model.set_values(&start);
                let again = regress(&model, &runs, span, 1, self.work)?;
                self.look_from(candidate, &again.values, left)
            })
            .collect()
    }

    /// A short fit from there, where a Gauss–Newton step promises to leave less than what was found.
    fn look_from(&self, candidate: &Candidate, start: &[f64], left: f64) -> Option<Judged> {
        let own = candidate.own().start;
        let values = start[..own].to_vec();
        let mut model = self.nominal.model.clone();
        model.set_values(&values);
        let states = InitialStates::guess(&model, &values, self.nominal.holdout.runs).states;
        let solution = Solution { values, states };
        let nominal = Nominal {
            held: self.nominal.held.map(|_| &*solution.states),
            model: &model,
            solution: &solution,
            ..*self.nominal
        };
        let chosen = candidate.chosen(start);
        let problem = nominal.problem(&chosen.model, nominal.held)?;
        let (_, promised) = problem.promise(start, &solution.states).ok()??;
        if promised.sqrt() >= self.work.criteria().start.further * left {
            return None;
        }
        let (found, _) = look(&chosen, start, &nominal, self.criteria().behind * left)?;
        Some(found)
    }
}

/// A regression, and what it leaves.
struct Regressed {
    values: Vec<f64>,
    /// Sum of squares by state.
    left: Vec<(usize, f64)>,
}

impl Regressed {
    /// What it leaves as a share of what the `plain` model leaves, the mean of all rates that both have.
    fn share_of(&self, plain: &Self) -> Option<f64> {
        let shares = self.left.iter().filter_map(|(state, left)| {
            let before = plain.left.iter().find(|(other, _)| other == state)?;
            (before.1 > 0.0).then(|| left / before.1)
        });
        let (sum, n) = shares.fold((0.0, 0usize), |(sum, n), share| (sum + share, n + 1));
        (n > 0)
            .then(|| sum / n as f64)
            .filter(|share| share.is_finite())
    }
}

/// Some Gauss–Newton steps of a regression of `model` with its effects, from its values.
fn regress(
    model: &Model,
    runs: &[Run],
    span: f64,
    steps: usize,
    work: &Work<'_>,
) -> Option<Regressed> {
    let mut linear = model.shared().into_owned();
    for parameter in &mut linear.parameters {
        let size = parameter.declaration.nearest(parameter.scale());
        parameter.value = parameter.value.or(Some(size));
        parameter.free &= parameter.declaration.linear;
    }
    let mut values = linear.values();
    let mut left = Vec::new();
    for _ in 0..steps {
        linear.set_values(&values);
        let speeds = Speeds::of(&linear);
        let period = runs.first()?.median_period().max(span);
        let mut regression =
            Regression::with_effects_of_all(&speeds.model, Scheme::default(), period).ok()?;
        let normals = normal_equations(&mut regression, &speeds, runs, span, work).ok()?;
        left.clear();
        let mut told = vec![0.0; values.len()];
        for (row, normal) in normals.iter().enumerate() {
            let parameters = regression.parameters(row);
            let mut theta = normal.solution()?;
            for (value, j) in theta.iter_mut().zip(parameters) {
                *value = linear.parameters[*j].declaration.nearest(*value);
            }
            normal.tell(&theta, parameters, &mut told, &mut values);
            left.push((regression.state(row), normal.left(&theta)));
        }
    }
    let all = values.iter().all(|value| value.is_finite());
    all.then_some(Regressed { values, left })
}

/// Windows of `runs` over their whole length, of no more samples together than a regression over `span` needs.
fn thinned(runs: &[Run], span: f64) -> Vec<Run> {
    let rows = |run: &Run| (run.duration() / run.median_period().max(span)) as usize;
    let total: usize = runs.iter().map(rows).sum();
    if total <= SAMPLES {
        return runs.to_vec();
    }
    let mut windows = Vec::new();
    for run in runs.iter().filter(|run| run.len() > 1) {
        let wanted = (SAMPLES * rows(run) / total / WINDOW).max(1);
        // Samples of a window: as many rows, each over a span.
        let length = (WINDOW * run.len() / rows(run).max(1)).clamp(2, run.len());
        for k in 0..wanted {
            let last = run.len() - length;
            let first = last * k / (wanted - 1).max(1);
            windows.push(run.part(first..first + length));
        }
    }
    windows
}
