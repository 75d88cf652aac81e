//! Starting values of candidates.

use std::collections::BTreeMap;

use loopsight_core::{Channel, Place, Shows};
use loopsight_model::model::{Model, ModelParameter, Proposed};
use loopsight_model::run::{Run, shortest_period};

use crate::arrive::Starts;
use crate::candidates::Candidate;
use crate::judge::nrmse;
use crate::problem::Problem;
use crate::settings::FitSettings;
use crate::trial::{FINAL, Judged, Nominal};
use crate::unfold::unfolded;

/// Starting values of a speed that is estimated, as shares of the flow.
const FLOW_STARTS: [f64; 3] = [0.03, 0.1, 0.3];

/// What a recording can show in time.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Extent {
    /// Of the longest run, s.
    duration: f64,
    /// The shortest time between samples, s.
    pub(crate) period: f64,
}

impl Extent {
    pub(crate) fn of(runs: &[Run]) -> Self {
        let longest = runs.iter().map(Run::duration).fold(0.0, f64::max);
        Self {
            duration: longest,
            period: shortest_period(runs),
        }
    }

    /// The values that a parameter lists to start from, frequencies beyond the recording left out.
    fn starts(self, parameter: &ModelParameter) -> Vec<f64> {
        let mut listed = parameter.starts(self.duration);
        if parameter.declaration.unit == "rad/s" {
            // What swings faster than half the rate of the samples shows as something slower.
            let fastest = std::f64::consts::PI / self.period;
            listed.retain(|frequency| *frequency < fastest);
        }
        listed
    }
}

/// Starting values of a candidate: those of the `nominal` model. Where the candidate replaces an effect, parameters
/// of the same name start at that effect's values.
pub(crate) fn first_starts(
    candidate: &Candidate,
    nominal: &Model,
    extent: Extent,
) -> Vec<Vec<f64>> {
    let mut base = nominal.values();
    // Of a file's own effect its author knows where to begin.
    let own = |c: &&Proposed| c.meta().id == candidate.meta.id;
    let proposed = nominal.candidates.iter().find(own);
    let given = proposed.into_iter().flat_map(Proposed::given);
    let mut known: BTreeMap<&str, f64> = given.filter_map(|(id, v)| Some((id, v?))).collect();
    if let Some((_, gone)) = &candidate.replaces {
        for parameter in &nominal.parameters[gone.clone()] {
            if let (true, Some(value)) = (parameter.free, parameter.value) {
                known.insert(parameter.declaration.id, value);
            }
        }
        base.drain(gone.clone());
    }
    starts(candidate, &base, &known, extent)
}

/// Starting values of a candidate that have nothing to do with what the plain model was fitted to, where that fit got
/// lost: those of the model as it was given. A pendulum without friction swings on, and a fit to it ends anywhere.
///
/// A sensor that does not know the sign turns half of the motion round. It begins with a fit to the log with the sign that
/// each input suggests, too.
pub(crate) fn fresh_starts(
    candidate: &Candidate,
    nominal: &Nominal<'_>,
    extent: Extent,
) -> Vec<Vec<f64>> {
    let lost = nrmse(nominal.rank) > nominal.work.criteria().start.lost;
    let given = nominal.given;
    if !lost || candidate.replaces.is_some() {
        return Vec::new();
    }
    let folded = candidate.meta.shows == Shows::NeverNegative;
    if !folded && !given.missing_values().is_empty() {
        return Vec::new();
    }
    let mut bases = vec![given.declared_values()];
    let inputs = if folded { given.plant.inputs.len() } else { 0 };
    for input in 0..inputs {
        let mut runs = nominal.holdout.runs.to_vec();
        for signal in measured_at(given, &candidate.at) {
            runs = unfolded(&runs, signal, input);
        }
        bases.extend(fitted_to(given, &runs, nominal));
    }
    let known = BTreeMap::new();
    let of = |base: &Vec<f64>| starts(candidate, base, &known, extent);
    bases.iter().flat_map(of).collect()
}

/// Values of a `model` fitted to `runs` in place of those of the diagnosis; none where no fit gets anywhere.
fn fitted_to(model: &Model, runs: &[Run], nominal: &Nominal<'_>) -> Option<Vec<f64>> {
    let seen = nominal.holdout.seen.as_deref();
    let work = nominal.work.silently();
    let mut problem = Problem::with(model, runs, seen, None, work).ok()?;
    let arrived = problem
        .arrive(&FitSettings::default(), Starts::All, FINAL)
        .ok()?;
    Some(problem.solution(&arrived.solution).values)
}

/// The measured signals at some channels.
fn measured_at(model: &Model, at: &[&str]) -> Vec<usize> {
    let channels = model.plant.channels.iter().filter(|c| at.contains(&c.id));
    let signal = |c: &Channel| match c.place {
        Place::Output(index) => model.measured_index(index),
        _ => None,
    };
    channels.filter_map(signal).collect()
}

/// Values to start a candidate from where another one ended, whose parameters of the same id mean the same.
pub(crate) fn starts_from(candidate: &Candidate, other: &Judged, extent: Extent) -> Vec<Vec<f64>> {
    let own = other.candidate.own();
    let values = &other.solution.values;
    let parameters = &other.candidate.model.parameters[own.clone()];
    let known = (parameters.iter().zip(&values[own.clone()]))
        .take(other.candidate.meta.parameters.len())
        .filter(|(parameter, _)| !parameter.is_left_out())
        .map(|(parameter, value)| (parameter.declaration.id, *value))
        .collect();
    starts(candidate, &values[..own.start], &known, extent)
}

/// Starting values of a candidate: `base` for the rest of the model, `known` for its own parameters, and a
/// noticeable size where these are not known. None where the recording is too slow for all that it lists.
fn starts(
    candidate: &Candidate,
    base: &[f64],
    known: &BTreeMap<&str, f64>,
    extent: Extent,
) -> Vec<Vec<f64>> {
    let mut all = vec![base.to_vec()];
    let regressed = candidate.shape().is_some();
    for i in candidate.own() {
        let parameter = &candidate.model.parameters[i];
        let nearest = |value: f64| parameter.declaration.nearest(value);
        let neutral = parameter.value.unwrap_or(0.0);
        let listed = extent.starts(parameter);
        if listed.is_empty() && !parameter.declaration.starts.is_empty() {
            return Vec::new();
        }
        let limits = parameter.declaration.limits.filter(|_| parameter.free);
        let at_end = limits.and_then(|end| candidate.ends[end as usize]);
        let values: Vec<f64> = if parameter.is_left_out() {
            vec![neutral]
        } else if let Some(value) = known.get(parameter.declaration.id) {
            vec![*value]
        } else if let Some(end) = at_end {
            end.starts.map(nearest).to_vec()
        } else if !parameter.free && listed.is_empty() {
            vec![neutral]
        } else if parameter.free
            && parameter.declaration.unit == "flow"
            && candidate.moves.flow > 0.0
        {
            FLOW_STARTS
                .iter()
                .map(|s| nearest(s * candidate.moves.flow))
                .collect()
        } else if listed.is_empty() {
            // Where the position is measured, the linear parameters are found by regression.
            let neutral_first = regressed && parameter.declaration.linear;
            let step = if neutral_first {
                0.0
            } else {
                candidate.moves.first_step(parameter)
            };
            vec![nearest(neutral + step)]
        } else {
            // What is counted per way or per speed depends on how far and how fast the machine goes.
            let unit = match parameter.declaration.unit {
                "1/position" if candidate.moves.reach > 0.0 => candidate.moves.reach,
                "1/flow" if candidate.moves.flow > 0.0 => candidate.moves.flow,
                // Ways on which something happens are those of so many seconds.
                "position" if candidate.moves.flow > 0.0 => 1.0 / candidate.moves.flow,
                _ => 1.0,
            };
            listed.into_iter().map(|v| nearest(v / unit)).collect()
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
