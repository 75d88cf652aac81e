//! What a force depends on: its mean over each quantity, and the share of its variance that this explains.

use std::f64::consts::TAU;

use loopsight_core::Role;
use nalgebra::DVector;
use rayon::prelude::*;
use serde::Serialize;

use super::blocks::Blocks;
use super::place::{Group, Law};
use super::response::{Column, Following, Responses, responses};
use super::shape::Variable;
use crate::progress::{Cancelled, Work};

/// Bins of a quantity.
const BINS: usize = 16;
/// Share of the samples beyond either end of the bins.
const TAIL: f64 = 0.01;

/// Weight of a mean of zero, as a share of the weight of all samples of a bin.
const RIDGE_OF_MEANS: f64 = 1e-3;

/// How a force depends on one quantity.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ForceDependence {
    /// The quantity, by its name in an expression.
    pub quantity: String,
    /// Its unit.
    pub unit: String,
    /// One turn, where the quantity is an angle that makes turns. The angle is reduced to it.
    pub period: Option<f64>,
    /// Share of the force's variance that its mean over the quantity accounts for, on held-out blocks of time: of the whole
    /// force, or of what the model's own parameters cannot do, whichever is less.
    pub share_of_variance: f64,
    /// The mean force over the quantity: one curve for each direction of motion, or one for all.
    pub curves: Vec<ForceCurve>,
}

/// A mean force over a quantity.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ForceCurve {
    /// `forwards`, `backwards`, or `all`.
    pub direction: &'static str,
    /// In the order of the quantity.
    pub bins: Vec<ForceBin>,
}

/// An interval of a quantity.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ForceBin {
    /// Mean of the quantity.
    pub center: f64,
    /// Mean force.
    pub mean: f64,
    /// Standard error of the mean.
    pub std_error: f64,
    /// Number of samples.
    pub count: usize,
    /// Mean of the expression over the same samples.
    pub expression: Option<f64>,
}

/// The model as the filter followed it through the measurements.
pub(super) struct Followed<'a> {
    pub(super) following: Following<'a>,
    /// White innovations, and their derivatives by the model's own parameters.
    pub(super) bent: &'a Responses,
    /// White innovations at the parameters that are best beside a force.
    pub(super) innovations: &'a DVector<f64>,
    /// Sums of squares that the model's own parameters leave on held-out blocks, and that noise alone would leave.
    pub(super) plain: f64,
    pub(super) noise: f64,
}

impl Followed<'_> {
    /// The share of a force's variance that was explained where these sums of squares are `left`: of the whole force, and of that
    /// which is beyond the model's own parameters. The smaller one counts. The whole force says little where a parameter can
    /// do nearly what the force does: both may then be large, and what moves one moves the other. What is beyond the parameters
    /// says little of the shape of the rest.
    pub(super) fn share(&self, left: [f64; 2]) -> f64 {
        let whole = self.innovations.norm_squared();
        let shares = [(whole, left[0]), (self.plain, left[1])]
            .map(|(before, after)| (before - after) / (before - self.noise));
        // A force that does not vary has no variance to account for.
        let share = shares[0].min(shares[1]);
        if share.is_finite() {
            share.clamp(0.0, 1.0)
        } else {
            0.0
        }
    }
}

/// Samples of some channels, by bin.
struct Sorted {
    /// By channel and sample, the bin.
    bin: Vec<Vec<Option<usize>>>,
    center: Vec<f64>,
    count: Vec<usize>,
}

/// How the force at the channels `at` of `group` depends on each quantity there, the most telling
/// first.
pub(super) fn dependences(
    followed: &Followed<'_>,
    group: &Group,
    at: &[usize],
    laws: &[Law],
    work: &Work<'_>,
) -> Result<Vec<ForceDependence>, Cancelled> {
    let mut all: Vec<ForceDependence> = (0..group.quantities.len())
        .into_par_iter()
        .filter_map(|q| dependence(followed, group, at, laws, q, work).transpose())
        .collect::<Result<_, Cancelled>>()?;
    all.sort_by(|a, b| b.share_of_variance.total_cmp(&a.share_of_variance));
    Ok(all)
}

fn dependence(
    followed: &Followed<'_>,
    group: &Group,
    at: &[usize],
    laws: &[Law],
    quantity: usize,
    work: &Work<'_>,
) -> Result<Option<ForceDependence>, Cancelled> {
    let of = &group.quantities[quantity];
    let flow = group
        .quantities
        .iter()
        .position(|q| q.variable == Variable::Role(Role::Flow))
        .filter(|flow| *flow != quantity);
    let directions: &[(&'static str, f64)] = match flow {
        Some(_) => &[("forwards", 1.0), ("backwards", -1.0)],
        None => &[("all", 0.0)],
    };
    let mut columns = Vec::new();
    let mut sorted = Vec::new();
    for (_, sign) in directions {
        let goes =
            |c: usize, k: usize| flow.is_none_or(|flow| group.series[c][flow][k] * sign > 0.0);
        let Some(part) = sort(group, at, quantity, &goes) else {
            return Ok(None);
        };
        for bin in 0..part.center.len() {
            let forces = at
                .iter()
                .zip(&part.bin)
                .map(|(c, bins)| {
                    let inside = bins.iter().map(|b| f64::from(u8::from(*b == Some(bin))));
                    (group.channels[*c].place, inside.collect())
                })
                .collect();
            columns.push(Column::Force(forces));
        }
        sorted.push(part);
    }
    let forces = responses(&followed.following, &columns, work)?.columns;
    let runs = followed.following.runs;
    let own = followed.bent.columns.ncols();
    let mut both = followed.bent.columns.clone();
    both.extend(forces.column_iter());
    let beside = Responses {
        innovations: followed.bent.innovations.clone(),
        columns: both,
    };
    let every: Vec<usize> = (0..own + columns.len()).collect();
    let beside = Blocks::new(&beside, runs, (own, RIDGE_OF_MEANS), work)?.unseen(&every);
    let whole = Responses {
        innovations: followed.innovations.clone(),
        columns: forces,
    };
    let every: Vec<usize> = (0..columns.len()).collect();
    let whole = Blocks::new(&whole, runs, (0, RIDGE_OF_MEANS), work)?;
    let Some(means) = whole.solve(&every) else {
        return Ok(None);
    };
    let left = [whole.unseen(&every), beside].map(|left| left.iter().sum());
    let mut means = means.into_iter();
    let curves = directions
        .iter()
        .zip(&sorted)
        .map(|((direction, _), part)| ForceCurve {
            direction,
            bins: (0..part.center.len())
                .filter_map(|bin| {
                    let (mean, std_error) = means.next()?;
                    (part.count[bin] >= work.criteria().force.fewest).then(|| ForceBin {
                        center: part.center[bin],
                        mean,
                        std_error,
                        count: part.count[bin],
                        expression: (!laws.is_empty()).then(|| of_laws(group, at, laws, part, bin)),
                    })
                })
                .collect(),
        })
        .filter(|curve| !curve.bins.is_empty())
        .collect();
    Ok(Some(ForceDependence {
        quantity: of.variable.name().to_owned(),
        unit: of.unit.clone(),
        period: of.turns.then_some(TAU),
        share_of_variance: followed.share(left),
        curves,
    }))
}

/// Sorts the samples of the channels `at` into bins of equal width; `None` where all are alike.
fn sort(
    group: &Group,
    at: &[usize],
    quantity: usize,
    goes: &dyn Fn(usize, usize) -> bool,
) -> Option<Sorted> {
    let of = &group.quantities[quantity];
    let value = |c: usize, k: usize| {
        let x = group.series[c][quantity][k];
        if of.turns { x.rem_euclid(TAU) } else { x }
    };
    let mut values: Vec<f64> = at
        .iter()
        .flat_map(|c| (0..group.samples()).map(move |k| (*c, k)))
        .map(|(c, k)| value(c, k))
        .collect();
    values.sort_by(f64::total_cmp);
    let last = values.len().checked_sub(1)?;
    let (low, high) = if of.turns {
        (0.0, TAU)
    } else {
        let quantile = |share: f64| values[(share * last as f64).round() as usize];
        (quantile(TAIL), quantile(1.0 - TAIL))
    };
    if high <= low || !(high - low).is_finite() {
        return None;
    }
    let mut sorted = Sorted {
        bin: Vec::new(),
        center: vec![0.0; BINS],
        count: vec![0; BINS],
    };
    for c in at {
        let bins = (0..group.samples())
            .map(|k| {
                if !goes(*c, k) {
                    return None;
                }
                let x = value(*c, k);
                let bin = ((x - low) / (high - low) * BINS as f64).floor();
                let bin = bin.clamp(0.0, (BINS - 1) as f64) as usize;
                sorted.center[bin] += x;
                sorted.count[bin] += 1;
                Some(bin)
            })
            .collect();
        sorted.bin.push(bins);
    }
    for (center, count) in sorted.center.iter_mut().zip(&sorted.count) {
        *center /= (*count).max(1) as f64;
    }
    Some(sorted)
}

/// The mean of `laws` over the samples of a bin.
fn of_laws(group: &Group, at: &[usize], laws: &[Law], sorted: &Sorted, bin: usize) -> f64 {
    let mut sum = 0.0;
    for (c, bins) in at.iter().zip(&sorted.bin) {
        for (k, of) in bins.iter().enumerate() {
            if *of == Some(bin) {
                sum += group.force(laws, *c, k);
            }
        }
    }
    sum / sorted.count[bin].max(1) as f64
}
