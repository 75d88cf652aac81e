//! What a simpler effect was preferred to.
//!
//! While much is missing, a small difference between two effects may come from what else is missing, so the simpler one is
//! added ([`choose`](crate::choose)). Where nothing else is found then, that was no reason.

use crate::conclusion::{Diagnosis, Explanation};
use crate::criteria::Criteria;
use crate::improvement::ImprovementStep;
use crate::worth::worth_adding;

/// What the diagnosis that named the `last` step set aside for it, where that leaves less by enough to matter, and that
/// diagnosis by its round: it names it then.
pub(crate) fn set_aside(
    diagnoses: &[Diagnosis],
    last: &ImprovementStep,
    criteria: &Criteria,
) -> Option<(Explanation, usize, Diagnosis)> {
    let round = last.round?;
    let mut diagnosis = diagnoses.get(round)?.clone();
    let better = diagnosis.set_aside.take()?;
    let most = criteria.improve.better * last.nrmse_test;
    if diagnosis.missing != last.added || better.nrmse >= most {
        return None;
    }
    diagnosis.name(better);
    let best = worth_adding(&diagnosis, round, criteria).ok()?;
    Some((best, round, diagnosis))
}

#[cfg(test)]
mod tests {
    use loopsight_plants as _;

    use super::*;
    use crate::conclusion::Conclusion;

    /// A diagnosis that names dry friction in place of a Stribeck curve, and one that names nothing.
    fn diagnoses() -> Vec<Diagnosis> {
        let mut first = Diagnosis::begun(&[]);
        (first.nominal.nrmse, first.nominal_fit) = (0.2, 0.2);
        first.floor.nrmse = 0.01;
        let friction = Explanation::at_shaft("coulomb_friction", 0.05);
        first.missing = Some(friction.place.clone());
        first.candidates = vec![friction];
        first.set_aside = Some(Explanation::at_shaft("stribeck_friction", 0.04));
        let mut last = first.clone();
        (last.verdict, last.missing, last.set_aside) = (Conclusion::UnknownEffect, None, None);
        vec![first, last]
    }

    #[test]
    fn what_was_set_aside_comes_where_nothing_else_is_found() {
        let criteria = Criteria::default();
        let mut step = ImprovementStep::at_shaft(Some("coulomb_friction"));
        (step.round, step.nrmse_test) = (Some(0), 0.05);

        let (better, round, named) = set_aside(&diagnoses(), &step, &criteria).unwrap();
        assert_eq!(
            (better.place.effect.as_str(), round),
            ("stribeck_friction", 0)
        );
        assert_eq!(named.missing.as_ref(), Some(&better.place));
        assert_eq!(named.candidates.len(), 2);
        // Once only.
        step.added = Some(better.place);
        assert!(set_aside(&[named], &step, &criteria).is_none());

        // Not where it leaves hardly less than what there is now, nor for a step that another diagnosis named.
        let none = |effect: &str, round: Option<usize>, nrmse: f64| {
            let mut step = ImprovementStep::at_shaft(Some(effect));
            (step.round, step.nrmse_test) = (round, nrmse);
            assert!(set_aside(&diagnoses(), &step, &criteria).is_none());
        };
        none("coulomb_friction", Some(0), 0.041);
        none("viscous_friction", Some(0), 0.05);
        none("coulomb_friction", None, 0.05);
    }
}
