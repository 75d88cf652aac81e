//! The missing force, where no effect of the library explains it: what it depends on, and a first expression for
//! it.

mod blocks;
mod dependence;
mod filter;
mod known;
mod linear;
mod place;
mod response;
mod select;
mod shape;
mod system;
mod words;

use loopsight_model::model::Model;
use loopsight_model::run::Run;
use nalgebra::DVector;
use serde::Serialize;

pub use dependence::{ForceBin, ForceCurve, ForceDependence};

use crate::compare::with_values;
use crate::error::CompareError;
use crate::measurements::Measurements;
use crate::prediction::{InitialStates, Solution};
use crate::progress::{Cancelled, Work};
use blocks::{Blocks, RIDGE};
use dependence::{Followed, dependences};
use filter::filter;
use place::{Group, Way, groups};
use response::{Column, Following, responses};
use select::{Chosen, select};
use system::System;
use words::{statement, written};

/// Most samples that are used: they are enough to show what a force depends on.
const MOST_SAMPLES: usize = 30_000;

/// A force that would make the model agree with the measurements.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ResidualForce {
    /// Channels it acts at.
    pub at: Vec<String>,
    /// Its unit.
    pub unit: String,
    /// What it depends on, in words.
    pub statement: String,
    /// Quantities it depends on, the most telling first.
    pub depends_on: Vec<ForceDependence>,
    /// A first expression; `null` where no term stands out from the noise.
    pub expression: Option<ForceExpression>,
}

/// A force as an expression, to be edited.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ForceExpression {
    /// The expression with its numbers.
    pub force: String,
    /// Share of the residual force's variance that it accounts for, on held-out blocks of time: of the whole force, or of what
    /// the model's own parameters cannot do, whichever is less.
    pub share_of_variance: f64,
    /// `[[effect]]` entries for the model file.
    pub toml: String,
    /// The model's own parameters beside it, where its law is linear: a fit with it may begin there.
    #[serde(skip)]
    pub beside: Vec<f64>,
    /// Free-run error on the validation data with it, where a fit was made with it. It was not enough to add it.
    #[serde(skip)]
    pub left: Option<f64>,
}

/// What force is missing from the fitted `model`.
///
/// A filter whose only unknown is a force makes the model follow the measurements. Its white innovations are
/// regressed on the exact derivatives by many possible forces and by the model's own parameters. The coefficients
/// have the units of the forces, and no measurement is differentiated. Terms and shares are judged on held-out
/// blocks of time, so chance explains nothing.
///
/// `None` where the plant has no channel for a force, or noise explains the innovations.
///
/// # Errors
///
/// [`CompareError`] when the model has no values, when the runs are not its own, and when the work was
/// cancelled.
pub fn residual_force(
    model: &Model,
    runs: &[Run],
    work: &Work<'_>,
) -> Result<Option<ResidualForce>, CompareError> {
    with_values(model)?;
    Measurements::new(runs).check(model)?;
    let values = model.values();
    let states = InitialStates::estimate(model, &values, runs, work)?.states;
    Ok(of_solution(
        model,
        &Solution { values, states },
        runs,
        false,
        work,
    )?)
}

/// As [`residual_force`], from known initial states. Where something is known to be `missing`, it may be a force that is too slow to
/// make innovations larger than noise does: it shows in that a filter that follows it is likelier.
pub(crate) fn of_solution(
    model: &Model,
    solution: &Solution,
    runs: &[Run],
    missing: bool,
    work: &Work<'_>,
) -> Result<Option<ResidualForce>, Cancelled> {
    let criteria = &work.criteria().force;
    let runs = &shortened(runs);
    let (filtered, force) = filter(model, solution, runs, work)?;
    let noise: f64 = filtered.iter().map(|f| f.noise).sum();
    let parameters: Vec<usize> = (0..model.parameters.len())
        .filter(|i| model.parameters[*i].free)
        .collect();
    let known: Vec<usize> = (0..parameters.len()).collect();
    let bend: Vec<Column> = parameters.iter().map(|i| Column::Parameter(*i)).collect();
    let mut following = Following {
        model,
        solution,
        runs,
        filtered: &filtered,
        system: None,
    };
    let bent = responses(&following, &bend, work)?;

    let spread = noise * (2.0 / bent.innovations.len().max(1) as f64).sqrt();
    let blocks = Blocks::new(&bent, runs, (known.len(), RIDGE), work)?;
    let plain: f64 = blocks.unseen(&known).iter().sum();
    let slow = missing && force > criteria.seen;
    let seen = plain - noise >= criteria.seen * spread;
    if !seen && !slow {
        return Ok(None);
    }

    let system = System::of(model, solution, runs, &filtered, work)?;
    following.system = system.as_ref();
    let mut best: Option<Found> = None;
    for group in groups(model, runs, &filtered) {
        let forces = responses(&following, &group.columns(), work)?;
        let blocks = Blocks::new(
            &group.joined(&bent, &forces),
            runs,
            (known.len(), RIDGE),
            work,
        )?;
        for way in group.ways.clone() {
            let choices = group.choices(way, known.len());
            let chosen = select(&blocks, &known, &choices, noise, work)?;
            let better = best.as_ref().is_none_or(|best| {
                let other = &best.chosen;
                if chosen.complexity < other.complexity {
                    chosen.explained > criteria.as_good * other.explained
                } else {
                    other.explained < criteria.as_good * chosen.explained
                }
            });
            if !better {
                continue;
            }
            let of_terms = chosen.terms.iter().flat_map(|t| &choices[*t].columns);
            let columns: Vec<usize> = known.iter().chain(of_terms).copied().collect();
            let Some(numbers) = sure(&blocks, known.len(), columns.clone(), criteria.sure) else {
                continue;
            };
            best = Some(Found {
                left: blocks.unseen(&columns).iter().sum(),
                group: group.clone(),
                way,
                chosen,
                numbers,
            });
        }
    }
    let Some(found) = best else { return Ok(None) };
    let (bending, numbers) = found.numbers.split_at(known.len());
    // The missing force is what the model's own parameters cannot explain, at their best values.
    let mut innovations = bent.innovations.clone();
    if !numbers.is_empty() {
        innovations -= &bent.columns * DVector::from_column_slice(bending);
    }
    let laws = match found.chosen.terms.as_slice() {
        [] => Vec::new(),
        terms => found.group.laws(found.way, terms, numbers),
    };
    let at = found.group.at(found.way);
    // A force that is slower than noise explains more than is beyond noise.
    let noise = if seen { noise } else { noise.min(found.left) };
    let followed = Followed {
        following,
        bent: &bent,
        innovations: &innovations,
        plain,
        noise,
    };
    let depends_on = dependences(&followed, &found.group, &at, &laws, work)?;
    let share = followed.share([found.left; 2]);
    let names: Vec<String> = at
        .iter()
        .map(|c| found.group.channels[*c].id.to_owned())
        .collect();
    let expression = (!laws.is_empty()).then(|| {
        let (toml, force) = written(model, &found.group, &laws);
        ForceExpression {
            force,
            share_of_variance: share,
            toml,
            beside: bent_by(model, solution, &parameters, bending),
            left: None,
        }
    });
    Ok(Some(ResidualForce {
        statement: statement(
            &names,
            &depends_on,
            expression.as_ref().map(|_| (&laws[..], share)),
            criteria.telling,
        ),
        unit: found.group.channels[at[0]].unit.to_owned(),
        at: names,
        depends_on,
        expression,
    }))
}

/// The values of a `solution`, its free `parameters` changed by `by` as far as their ranges allow.
fn bent_by(model: &Model, solution: &Solution, parameters: &[usize], by: &[f64]) -> Vec<f64> {
    let mut values = solution.values.clone();
    for (i, change) in parameters.iter().zip(by) {
        values[*i] = model.parameters[*i]
            .declaration
            .nearest(values[*i] + change);
    }
    values
}

/// The coefficients of `columns`. Those within the noise become zero, except for the first `known`.
fn sure(blocks: &Blocks, known: usize, columns: Vec<usize>, sure: f64) -> Option<Vec<f64>> {
    let all = blocks.solve(&columns)?;
    let stays: Vec<usize> = (0..columns.len())
        .filter(|i| *i < known || all[*i].0.abs() > sure * all[*i].1)
        .collect();
    let kept: Vec<usize> = stays.iter().map(|i| columns[*i]).collect();
    let mut numbers = vec![0.0; columns.len()];
    for (i, (number, _)) in stays.iter().zip(blocks.solve(&kept)?) {
        numbers[*i] = number;
    }
    Some(numbers)
}

/// The best way so far in which forces could act.
struct Found {
    group: Group,
    way: Way,
    chosen: Chosen,
    /// The changes of the known parameters, then the coefficients of the terms.
    numbers: Vec<f64>,
    /// Sum of squares left on held-out blocks.
    left: f64,
}

/// The first runs, up to so many samples that they tell enough.
fn shortened(runs: &[Run]) -> Vec<Run> {
    let mut left = MOST_SAMPLES;
    let mut all = Vec::new();
    for run in runs {
        let n = run.len().min(left);
        left -= n;
        all.push(run.part(0..n));
    }
    all
}
