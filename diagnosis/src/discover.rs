//! The expression for a residual force as a candidate.

use crate::candidates::Candidate;
use crate::conclusion::Explanation;
use crate::explain::explain;
use crate::residual_force::ForceExpression;
use crate::trial::{Judged, Nominal, finish, look};

/// The `expression`, added to the nominal model, fitted with it and judged as any other candidate. None where no fit
/// succeeds, or the work was cancelled.
pub(crate) fn discovered(
    expression: &ForceExpression,
    nominal: &Nominal<'_>,
) -> Option<(Judged, Explanation)> {
    let candidate = candidate(expression, nominal)?;
    let own = candidate.own();
    let first = candidate.model.parameters[own].iter().map(|p| p.value);
    let mut start = nominal.solution.values.clone();
    start.extend(first.collect::<Option<Vec<f64>>>()?);
    let (looked, _) = look(&candidate, &start, nominal, f64::INFINITY)?;
    let (judged, fit) = finish(looked, nominal)?;
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
        replaces: None,
        flow: 0.0,
        reach: 0.0,
        ends: [None; 2],
        by_position: false,
        widths: Vec::new(),
        entries: Some(expression.toml.clone()),
        model,
    })
}
