//! What follows from the candidates: whether an effect is missing, and which.

use loopsight_core::{EffectMeta, PlaceKind};

use crate::advice::advice;
use crate::candidates::Candidate;
use crate::choose::choose;
use crate::conclusion::{Conclusion, Diagnosis, Explanation};
use crate::criteria::{Criteria, MissingCriteria};
use crate::estimate::strength_is_determined;
use crate::judge::{Losses, advantage, nrmse};
use crate::trial::{Judged, Nominal};

/// Explanations that are reported.
pub(crate) const REPORTED: usize = 12;
/// What decides among the candidates.
pub(crate) struct Evidence<'a> {
    pub(crate) nominal: &'a Nominal<'a>,
    /// Losses of the plain model on the validation data.
    pub(crate) unseen: &'a Losses,
    /// Its error on what it was fitted to.
    pub(crate) nominal_fit: f64,
    /// The error that noise alone would leave on the validation data; [`Nominal::floor`] is that on the fitted data.
    pub(crate) floor: f64,
    /// A quantity of the model predicts the residuals, on blocks that it was not chosen by.
    pub(crate) predictable: bool,
    /// See [`Aim`](crate::diagnose::Aim).
    pub(crate) worth: f64,
}

/// Puts the explanations of the diagnosis, those of the `finalists`, in order, says which of them is
/// missing, gives advice, and returns the verdict.
pub(crate) fn conclude(
    diagnosis: &mut Diagnosis,
    finalists: &[Judged],
    evidence: &Evidence<'_>,
) -> Conclusion {
    let explanations = &mut diagnosis.candidates;
    let earned = |i: usize, explanation: &Explanation| evidence.earned(&finalists[i], explanation);
    let criteria = evidence.criteria();
    let chosen = choose(explanations, finalists, evidence.floor, &earned, criteria);
    let leader = chosen.as_ref().map(|chosen| &finalists[chosen.finalist]);
    diagnosis.missing = chosen.as_ref().and_then(|chosen| {
        let best = explanations.first()?;
        evidence
            .is_missing(&finalists[chosen.finalist], best)
            .then(|| best.place.clone())
    });
    let set_aside = chosen.and_then(|chosen| chosen.set_aside);
    let set_aside = set_aside.filter(|(i, best)| evidence.is_missing(&finalists[*i], best));
    diagnosis.set_aside = set_aside.map(|(_, best)| best);
    let believed = leader.filter(|_| diagnosis.missing.is_some());
    if evidence.not_fitted(believed) {
        diagnosis.missing = None;
    }
    let explained = evidence.explains_log_alone(explanations);
    let verdict = match &diagnosis.missing {
        _ if evidence.not_fitted(believed) => Conclusion::NotFitted,
        Some(_) => Conclusion::EffectMissing,
        None if evidence.blind(explained.is_some()) => Conclusion::DataInsufficient,
        None if evidence.above_floor(evidence.error()) || evidence.predictable => {
            Conclusion::UnknownEffect
        }
        None => Conclusion::NothingMissing,
    };
    let model = evidence.nominal.model;
    diagnosis.advice = advice(model, verdict, explanations.first(), explained);
    once_each(explanations);
    explanations.truncate(REPORTED);
    verdict
}

/// Of an effect in its usual form and in its fuller one the better of both: they have the same parameters.
fn once_each(explanations: &mut Vec<Explanation>) {
    let mut kept: Vec<Explanation> = Vec::new();
    for explanation in explanations.drain(..) {
        let again = |other: &Explanation| {
            other.place == explanation.place
                && other.together_with == explanation.together_with
                && other.parameters.keys().eq(explanation.parameters.keys())
        };
        if !kept.iter().any(again) {
            kept.push(explanation);
        }
    }
    *explanations = kept;
}

impl Evidence<'_> {
    fn criteria(&self) -> &Criteria {
        self.nominal.work.criteria()
    }

    fn missing(&self) -> &MissingCriteria {
        &self.criteria().missing
    }

    /// Error of the plain model on the validation data.
    fn error(&self) -> f64 {
        nrmse(self.unseen)
    }

    /// Whether a candidate leaves no more than this `share` of that.
    fn leaves(&self, judged: &Judged, share: f64) -> bool {
        nrmse(&judged.losses) <= share * self.error()
    }

    fn above_floor(&self, error: f64) -> bool {
        error > self.missing().above_floor * self.floor
    }

    /// Whether the plain model leaves as much as a constant would, and the accepted effect does not lower that
    /// by much.
    fn not_fitted(&self, believed: Option<&Judged>) -> bool {
        let hopeless = self.criteria().start.hopeless;
        let left = believed.map_or(f64::INFINITY, |judged| nrmse(&judged.rank));
        nrmse(self.nominal.rank) >= hopeless && left > self.missing().rescued * hopeless
    }

    /// Whether a candidate does better than the plain model on the validation data, with parameters that the log
    /// determines and that can be what they say.
    fn earned(&self, judged: &Judged, explanation: &Explanation) -> bool {
        let criteria = self.missing();
        let unseen = advantage(self.unseen, &judged.losses, &self.criteria().window);
        let better = unseen > criteria.beats
            || (unseen > 0.0
                && explanation.significance > criteria.certain
                && !self.reshapes(judged))
            || self.shown_by_starts(judged, explanation);
        let determined = determined(&judged.candidate, explanation, criteria.undetermined);
        better && (determined || self.switches(judged)) && explanation.implausible.is_none()
    }

    /// Whether one parameter, of whatever size, takes nearly all of the error away. A current that acts from its own line of a log on, on a
    /// voltage that is read with it, has a lead of any part of a period.
    fn switches(&self, judged: &Judged) -> bool {
        let candidate = &judged.candidate;
        let own = candidate.own().map(|i| &candidate.model.parameters[i]);
        let one = own.filter(|p| p.free).count() == 1;
        one && self.leaves(judged, self.missing().most_left.powi(2))
    }

    /// Whether the effect depends on what went before, in a model where something is late already. In the few steps of a log
    /// it would only give what is late another shape, and has room for whatever else is missing; so where it acts alike
    /// in the rest of the log, steps are no evidence. Another shape does not take most of the error away, though.
    fn reshapes(&self, judged: &Judged) -> bool {
        let effects = self.nominal.model.effects.iter();
        let rest = !self.leaves(judged, self.missing().most_left);
        rest && judged.candidate.meta.is_dynamic() && effects.map(|e| e.meta).any(is_late)
    }

    /// Whether the starts of the runs show the effect. They are not validation data, because the initial state
    /// is estimated from them. But they often have the only steps, so an effect that acts there need not improve
    /// the validation error. It must not make it worse, and that error must be more than noise.
    ///
    /// One effect may be named by the starts alone for what is late there, and no second one, see [`Self::reshapes`].
    fn shown_by_starts(&self, judged: &Judged, explanation: &Explanation) -> bool {
        let criteria = self.missing();
        let explained = explained(self.nominal_fit, explanation.nrmse_fit);
        !self.reshapes(judged)
            && self.nominal.holdout.test.is_none()
            && self.above_floor(self.error())
            && self.leaves(judged, criteria.no_worse)
            && explanation.significance > criteria.certain
            && explained
                > (criteria.matters * self.nominal.floor)
                    .max(self.least(self.nominal_fit, explanation.nrmse_fit))
    }

    /// Least share of the standard deviation that an explanation must account for where it lowers an `error` to what is
    /// `left`. What removes nearly all of a small error is no imperfection of a sensor: an angle that wanders by many turns has
    /// a large standard deviation, and whatever is missing a small share of it. Where hardly anything is left, it need not be
    /// a part of a first error that was several times as large either.
    fn least(&self, error: f64, left: f64) -> f64 {
        let criteria = self.missing();
        if left <= criteria.most_left.powi(2) * error {
            self.worth.min(criteria.least_share)
        } else if left <= criteria.most_left * error {
            self.worth
        } else {
            self.worth.max(criteria.least_share)
        }
    }

    /// Whether the chosen explanation is what is missing: significantly better than no effect, better by enough
    /// to matter, and determined by the log.
    fn is_missing(&self, judged: &Judged, explanation: &Explanation) -> bool {
        let criteria = self.missing();
        let left = nrmse(&judged.rank);
        let error = nrmse(self.nominal.rank);
        let explained = explained(error, left);
        // It leaves hardly more than noise, or it explains a good part of the error.
        let complete =
            left < criteria.complete * self.floor && explained > criteria.matters * self.floor;
        let matters =
            complete || explained > (criteria.matters * self.floor).max(self.least(error, left));
        self.earned(judged, explanation)
            && explanation.significance > criteria.significant
            && (matters || self.shown_by_starts(judged, explanation))
    }

    /// An explanation that explains the log but not the test recording: the log shows that something is
    /// missing, but cannot tell what.
    fn explains_log_alone<'e>(&self, explanations: &'e [Explanation]) -> Option<&'e Explanation> {
        let enough = self.missing().explained * self.nominal.floor;
        explanations
            .iter()
            .find(|e| e.nrmse_fit < enough && self.above_floor(e.nrmse))
            .filter(|_| self.nominal_fit >= enough)
    }

    /// Whether the test recording shows something that the log cannot identify.
    fn blind(&self, explained: bool) -> bool {
        self.nominal.holdout.test.is_some()
            && self.above_floor(self.error())
            && (self.nominal_fit < self.missing().explained * self.nominal.floor || explained)
    }
}

/// The part of an error that an explanation removes when it leaves `left`: squared errors add up.
pub(crate) fn explained(error: f64, left: f64) -> f64 {
    (error.powi(2) - left.powi(2)).max(0.0).sqrt()
}

/// Whether an effect makes an input or a sensor answer later, or over some time.
fn is_late(meta: &EffectMeta) -> bool {
    let between = |place: &PlaceKind| matches!(place, PlaceKind::Input | PlaceKind::Output);
    meta.is_dynamic() && meta.places.iter().all(between)
}

/// Whether the log determines how strong the effect is. An effect that cannot be told from the plant's own
/// parameters counts as not found, even if a test recording agrees with it.
fn determined(candidate: &Candidate, explanation: &Explanation, undetermined: f64) -> bool {
    let own = candidate.own().filter_map(|i| {
        let estimate = explanation.parameters.get(&candidate.name(i))?;
        Some((&candidate.model.parameters[i], estimate))
    });
    strength_is_determined(own, undetermined)
}
