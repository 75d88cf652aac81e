//! A few terms that explain a force, chosen one after the other.

use super::blocks::{Blocks, gain};
use crate::progress::{Cancelled, Work};

/// Share of its square from which a term is one of its own: a force that is held over a sample is about a thousandth of itself away
/// from one that is not.
const OWN: f64 = 1e-6;

/// A term that may be chosen.
#[derive(Clone, Debug)]
pub(super) struct Choice {
    /// Its columns.
    pub(super) columns: Vec<usize>,
    /// Its complexity.
    pub(super) complexity: usize,
}

/// What was chosen.
#[derive(Clone, Debug)]
pub(super) struct Chosen {
    /// Indices among the choices.
    pub(super) terms: Vec<usize>,
    /// By how much they reduce the sum of squares on held-out blocks, beyond what the known parameters can.
    pub(super) explained: f64,
    /// Their complexity together.
    pub(super) complexity: usize,
}

/// Chooses terms while one more helps on held-out blocks, then drops those that later ones made needless. The
/// columns `known` always take part: they are the model's own parameters.
pub(super) fn select(
    blocks: &Blocks,
    known: &[usize],
    choices: &[Choice],
    noise: f64,
    work: &Work<'_>,
) -> Result<Chosen, Cancelled> {
    let criteria = &work.criteria().force;
    let certain = criteria.certain;
    let columns = |terms: &[usize]| -> Vec<usize> {
        let chosen = terms
            .iter()
            .flat_map(|t| choices[*t].columns.iter().copied());
        known.iter().copied().chain(chosen).collect()
    };
    let plain = blocks.unseen(known);
    let base: f64 = plain.iter().sum();
    // With white residuals of variance 1 a term reduces the sum of squares by the square of its coefficient in
    // standard errors.
    let worth = (criteria.worth * (base - noise)).max(certain * certain);
    // What the model's own parameters do is no term: only how long a sample is would tell the two apart.
    let own: Vec<bool> = choices
        .iter()
        .map(|choice| {
            let mut columns = choice.columns.iter();
            columns.any(|c| blocks.own_share(*c, known) > OWN)
        })
        .collect();
    let mut terms: Vec<usize> = Vec::new();
    let mut losses = plain.clone();
    while terms.len() < criteria.most {
        let mut tried: Vec<(usize, f64, f64)> = (0..choices.len())
            .filter(|t| own[*t] && !terms.contains(t))
            .map(|t| {
                work.go_on()?;
                let with: Vec<usize> = terms.iter().copied().chain([t]).collect();
                let (sum, errors) = gain(&losses, &blocks.unseen(&columns(&with)));
                Ok((t, sum, errors))
            })
            .collect::<Result<_, Cancelled>>()?;
        tried.retain(|(_, sum, errors)| *sum > worth && *errors > certain);
        let best = tried.iter().map(|t| t.1).fold(0.0, f64::max);
        let simplest = tried
            .iter()
            .filter(|t| t.1 >= criteria.as_good * best)
            .min_by_key(|t| choices[t.0].complexity);
        let Some((term, ..)) = simplest else {
            break;
        };
        terms.push(*term);
        losses = blocks.unseen(&columns(&terms));
    }
    let mut at = 0;
    while at + 1 < terms.len() {
        let mut without = terms.clone();
        without.remove(at);
        let fewer = blocks.unseen(&columns(&without));
        let (sum, errors) = gain(&fewer, &losses);
        if sum > worth && errors > certain {
            at += 1;
        } else {
            terms = without;
            losses = fewer;
        }
    }
    Ok(Chosen {
        explained: base - losses.iter().sum::<f64>(),
        complexity: terms.iter().map(|t| choices[*t].complexity).sum(),
        terms,
    })
}
