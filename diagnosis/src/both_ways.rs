//! Whether an effect that tells the directions of motion apart needs to.

use crate::candidates::Candidate;
use crate::conclusion::Explanation;
use crate::criteria::Criteria;
use crate::estimate::Estimate;

/// Whether an effect has the same parameters in both directions, at each of its channels. It then stands in for another
/// one: friction that differs from wheel to wheel, in a log of turning, where one wheel runs forwards while the other runs
/// backwards.
///
/// Two of them are the same if they differ by less than two standard errors, or by a small share of the larger one.
pub(crate) fn is_the_same_both_ways(
    candidate: &Candidate,
    explanation: &Explanation,
    criteria: &Criteria,
) -> bool {
    let own = candidate.own();
    let each = candidate.meta.parameters.len();
    let instance = |i: usize| (i - own.start) / each;
    let declared = |i: usize| candidate.model.parameters[i].declaration;
    let estimate = |i: usize| explanation.parameters.get(&candidate.name(i));
    let pairs = own.clone().filter_map(|i| {
        let opposite = declared(i).opposite?;
        let j =
            (own.clone()).find(|j| instance(*j) == instance(i) && declared(*j).id == opposite)?;
        Some((estimate(i)?, estimate(j)?))
    });
    let mut alike = pairs.map(|(a, b)| are_alike(a, b, criteria)).peekable();
    alike.peek().is_some() && alike.all(|alike| alike)
}

/// Whether two directions are the same.
fn are_alike(a: &Estimate, b: &Estimate, criteria: &Criteria) -> bool {
    let apart = (a.value - b.value).abs();
    let error = a.std_error.zip(b.std_error).map(|(a, b)| a.hypot(b));
    let unsure = error.is_some_and(|error| apart < criteria.choice.same * error);
    unsure || apart < criteria.search.alike * a.value.abs().max(b.value.abs())
}

#[cfg(test)]
mod tests {
    use crate::estimate::ParameterVerdict;

    use super::*;

    fn level(value: f64, std_error: Option<f64>) -> Estimate {
        Estimate {
            value,
            unit: "V".to_owned(),
            std_error,
            interval95: None,
            verdict: ParameterVerdict::Good,
        }
    }

    #[test]
    fn directions_differ_by_more_than_is_known_and_more_than_wheels_do() {
        let criteria = &Criteria::default();
        let alike = |a, b, error| are_alike(&level(a, error), &level(b, error), criteria);
        assert!(!alike(0.6, 1.1, Some(0.01)) && !alike(0.6, 1.1, None));
        // A log of turning, whose wheels differ in damping.
        assert!(alike(0.2138, 0.2148, Some(0.0008)) && alike(0.0527, 0.0526, None));
        // Told apart by many standard errors, but too little to be called a direction.
        assert!(alike(0.500, 0.505, Some(1e-5)) && !alike(0.50, 0.52, Some(1e-5)));
        // Far apart, and not known.
        assert!(alike(0.2, 0.4, Some(0.1)));
    }
}
