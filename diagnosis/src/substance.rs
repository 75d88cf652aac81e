//! Whether a fitted effect is there at all, and is itself.

use crate::candidates::Candidate;
use crate::conclusion::Explanation;
use crate::effect_at::instances;
use crate::estimate::ParameterVerdict;

/// Whether an effect has any size: a parameter whose neutral value is zero is above the share `least` of its
/// noticeable size, which for a coefficient is that at the speeds of the recording, a time above `shift` (s). Where it has none,
/// any parameter must be as far from its neutral value.
pub(crate) fn does_something(
    candidate: &Candidate,
    explanation: &Explanation,
    least: f64,
    shift: f64,
) -> bool {
    let model = &explanation.model;
    let instances = instances(model, &explanation.place);
    let free: Vec<_> = (instances.iter())
        .flat_map(|i| &model.parameters[model.effects[*i].own()])
        .filter(|p| p.free)
        .collect();
    let has_size = free.iter().any(|p| p.declaration.default == Some(0.0));
    free.iter()
        .filter(|p| !has_size || p.declaration.default == Some(0.0))
        .any(|p| {
            let away = p.value.zip(p.declaration.default);
            let shift = if p.is_time() { shift } else { 0.0 };
            let enough = shift.max(least * candidate.moves.first_step(p));
            away.is_none_or(|(value, neutral)| (value - neutral).abs() > enough)
        })
}

/// Share of a sample in which a way is gone through at the usual speed, below which no log shows it: a signal that changes
/// within a hundredth of a sample is told from a step by a hundredth of what the step adds to one sample.
const SHORTEST: f64 = 0.01;

/// Whether a log with this `period` (s) does not show what makes an effect more than a simpler one: it does not determine it,
/// or it is a way too short to be seen.
pub(crate) fn is_a_simpler_one(
    candidate: &Candidate,
    explanation: &Explanation,
    period: f64,
) -> bool {
    let vanishing = |i: &usize| {
        let parameter = &candidate.model.parameters[*i];
        parameter.free && parameter.declaration.vanishing
    };
    candidate.own().filter(vanishing).any(|i| {
        let is_way = candidate.model.parameters[i].declaration.unit == "position";
        let least = if is_way {
            SHORTEST * period * candidate.moves.flow
        } else {
            0.0
        };
        let estimate = explanation.parameters.get(&candidate.name(i));
        estimate.is_some_and(|e| e.verdict != ParameterVerdict::Good || e.value.abs() < least)
    })
}
