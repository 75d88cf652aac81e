//! Starting values of candidates.

use std::collections::BTreeMap;

use loopsight_core::Shows;
use loopsight_model::model::Model;

use crate::candidates::Candidate;
use crate::judge::nrmse;
use crate::problem::declared;
use crate::trial::{Judged, Nominal};

/// Starting values of a speed that is estimated, as shares of the flow.
const FLOW_STARTS: [f64; 3] = [0.03, 0.1, 0.3];

/// Starting values of a candidate: those of the `nominal` model. Where the candidate replaces an effect, parameters
/// of the same name start at that effect's values.
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

/// Starting values of a candidate that has nothing to do with what the plain model was fitted to, where that fit got
/// lost: a sensor that does not know the sign turns half of the motion round. They are those of the model as it was
/// given, and others scattered around them.
pub(crate) fn fresh_starts(
    candidate: &Candidate,
    nominal: &Nominal<'_>,
    duration: f64,
) -> Vec<Vec<f64>> {
    let lost = nrmse(nominal.rank) > nominal.work.criteria().start.lost;
    if candidate.meta.shows != Shows::NeverNegative || !lost {
        return Vec::new();
    }
    let known = BTreeMap::new();
    let given = declared(nominal.given);
    let begun = starts(candidate, &given, &known, duration);
    let scattered = begun.first().and_then(|first| {
        let mut model = candidate.model.clone();
        let parameters = model.parameters.iter_mut();
        for (parameter, given) in parameters.zip(&nominal.given.parameters) {
            parameter.value = given.value;
        }
        for i in candidate.own() {
            model.parameters[i].free = false;
            model.parameters[i].value = Some(first[i]);
        }
        let problem = nominal.problem(&model, Some(&nominal.solution.states))?;
        problem.scattered_values(first).ok()
    });
    begun
        .into_iter()
        .chain(scattered.into_iter().flatten())
        .collect()
}

/// Values to start a candidate from where `simpler` ended.
pub(crate) fn grown_starts(
    candidate: &Candidate,
    simpler: &Judged,
    duration: f64,
) -> Vec<Vec<f64>> {
    let own = simpler.candidate.own();
    let values = &simpler.solution.values;
    let declarations = simpler.candidate.meta.parameters.iter();
    let known = declarations
        .map(|declaration| declaration.id)
        .zip(values[own.clone()].iter().copied())
        .collect();
    starts(candidate, &values[..own.start], &known, duration)
}

/// Starting values of a candidate: `base` for the rest of the model, `known` for its own parameters, and a
/// noticeable size where these are not known.
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
            // Where the position is measured, the linear parameters are found by regression.
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
