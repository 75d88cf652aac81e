//! The expression for a residual force as a candidate.

use crate::candidates::Candidate;
use crate::conclusion::Explanation;
use crate::explain::explain;
use crate::moves::Moves;
use crate::residual_force::ForceExpression;
use crate::trial::{Judged, Nominal, finish, look};

/// Most fits after the first one.
const PASSES: usize = 6;

/// The `expression`, added to the nominal model, fitted with it and judged as any other candidate. None where no fit
/// succeeds, or the work was cancelled.
pub(crate) fn discovered(
    expression: &ForceExpression,
    nominal: &Nominal<'_>,
) -> Option<(Judged, Explanation)> {
    let candidate = candidate(expression, nominal)?;
    let own = candidate.own();
    let first = candidate.model.parameters[own].iter().map(|p| p.value);
    let first = first.collect::<Option<Vec<f64>>>()?;
    // Where the model was fitted alone, and where the expression says that its parameters are beside it.
    let starts = [&nominal.solution.values, &expression.beside];
    let looked = starts.into_iter().filter_map(|beside| {
        let start: Vec<f64> = beside.iter().chain(&first).copied().collect();
        look(&candidate, &start, nominal, f64::INFINITY)
    });
    let (looked, _) = looked.min_by(|a, b| a.1.total_cmp(&b.1))?;
    let (mut judged, mut fit) = finish(looked, nominal, f64::INFINITY)?;
    // There is one candidate, and it is far from the model alone: it has the time to arrive.
    let further = nominal.work.criteria().start.further;
    for _ in 0..PASSES {
        let (before, again) = (
            judged.error(),
            finish(judged.clone(), nominal, f64::INFINITY),
        );
        match again.filter(|(again, _)| again.error() < further * before) {
            Some(better) => (judged, fit) = better,
            None => break,
        }
    }
    let explanation = explain(&judged, &fit, nominal).ok()?;
    Some((judged, explanation))
}

/// The nominal model with the effects of the `expression`: one for all channels, or one for each.
fn candidate(expression: &ForceExpression, nominal: &Nominal<'_>) -> Option<Candidate> {
    let model = nominal.model.with_entries(&expression.toml).ok()?;
    let added = model.effects.get(nominal.model.effects.len()..)?;
    let meta = added.first()?.meta;
    Some(Candidate {
        meta,
        at: added.iter().flat_map(|e| &e.at).map(|c| c.id).collect(),
        separate: added.len() > 1,
        further: false,
        replaces: None,
        moves: Moves {
            flow: 0.0,
            reach: 0.0,
            command: None,
        },
        ends: [None; 2],
        by_position: false,
        widths: Vec::new(),
        entries: Some(expression.toml.clone()),
        model,
    })
}
