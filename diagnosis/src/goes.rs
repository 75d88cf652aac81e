//! Whether the last step of an improvement stays once it is fitted to all of the log.

use loopsight_model::model::ModelParameter;

use crate::criteria::Criteria;
use crate::effect_at::instances;
use crate::estimate::{Estimate, ParameterVerdict, stands_in, strength_is_determined};
use crate::fitted::Fit;
use crate::improvement::ImprovementStep;

/// Why a last step may go.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Goes {
    /// The log does not say how strong its effect is and the unseen error hardly fell with it: there is some effect for every
    /// imperfection, and it would take their values from the parameters that the log does determine. Or the log leaves open most of
    /// its parameters, or one of them is at an end of where it is searched, and it explains no large part: it stands in for
    /// another effect.
    Idle,
    /// Something is missing with it, too, and it explains no large part. It goes if it blurs what the log said of an earlier effect.
    IfItBlurs,
}

impl Goes {
    /// Why the last of `steps` may go from the `fit` of all of them, where noise leaves an error of `floor`; none where it stays.
    pub(crate) fn of(
        fit: &Fit,
        steps: &[ImprovementStep],
        floor: f64,
        criteria: &Criteria,
    ) -> Option<Self> {
        let [.., before, last] = steps else {
            return None;
        };
        let Criteria {
            improve, missing, ..
        } = criteria;
        let fell_to = last.nrmse_test / before.nrmse_test;
        let hardly = fell_to >= improve.better;
        let incomplete = last.nrmse_test > missing.above_floor * floor;
        let tradeable = fell_to >= improve.worth_blurring;
        let is_a_stand_in = || {
            is_mostly_open(fit, last) || stands_in(estimated(fit, last).into_iter().map(|(_, e)| e))
        };
        if hardly && is_undetermined(fit, last, missing.undetermined)
            || tradeable && is_a_stand_in()
        {
            Some(Self::Idle)
        } else {
            (incomplete && tradeable).then_some(Self::IfItBlurs)
        }
    }

    /// Whether the step goes from the fit `with` it, where the same data gave the fit `alone` without it.
    pub(crate) fn from(self, with: &Fit, alone: &Fit, criteria: &Criteria) -> bool {
        let Criteria {
            improve, missing, ..
        } = criteria;
        self == Self::Idle || blurs(alone, with, missing.undetermined, improve.blurs)
    }
}

/// Whether the log does not say how strong the effect of `step` is.
fn is_undetermined(fit: &Fit, step: &ImprovementStep, undetermined: f64) -> bool {
    !strength_is_determined(estimated(fit, step).into_iter(), undetermined)
}

/// Whether the log leaves open most of what is fitted of the effect of `step`: then it is a shape that suits the rest of the
/// error, and not what is behind it.
fn is_mostly_open(fit: &Fit, step: &ImprovementStep) -> bool {
    let own = estimated(fit, step);
    let fitted = own.iter().filter(|(parameter, _)| parameter.free);
    let open = fitted
        .clone()
        .filter(|(_, e)| e.verdict != ParameterVerdict::Good);
    2 * open.count() > fitted.count()
}

/// The parameters of the effect of `step`, with their estimates.
fn estimated<'f>(fit: &'f Fit, step: &ImprovementStep) -> Vec<(&'f ModelParameter, &'f Estimate)> {
    let model = &fit.model;
    let instances = step.added.iter().flat_map(|place| instances(model, place));
    let of_effect = |i: usize| {
        let effect = &model.effects[i];
        let own = effect.own();
        model.parameters[own].iter()
    };
    (instances.flat_map(of_effect))
        .filter_map(|p| Some((p, fit.parameters.get(&p.name)?)))
        .collect()
}

/// Whether an added effect takes from the log what it said of another one: a parameter of an effect that was determined
/// in the fit `alone` has at least `times` the standard error in the fit `with` the added one.
fn blurs(alone: &Fit, with: &Fit, undetermined: f64, times: f64) -> bool {
    let effects = alone.model.effects.iter();
    let mut names = effects.flat_map(|effect| &alone.model.parameters[effect.own()]);
    names.any(|parameter| {
        let estimates = [alone, with].map(|fit| fit.parameters.get(&parameter.name));
        let [Some(before), Some(after)] = estimates else {
            return false;
        };
        let Some(error) = before
            .std_error
            .filter(|_| before.is_determined(undetermined))
        else {
            return false;
        };
        after
            .std_error
            .is_none_or(|blurred| blurred >= times * error)
    })
}
