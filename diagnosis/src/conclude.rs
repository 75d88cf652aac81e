//! What follows from the candidates: whether an effect is missing, and which.

use crate::advice::advice;
use crate::choose::choose;
use crate::conclusion::{Conclusion, Diagnosis, Explanation};
use crate::fit::{Estimate, Verdict};
use crate::judge::{Losses, advantage, nrmse};
use crate::trial::{Judged, Nominal};

/// Explanations that are reported.
pub(crate) const REPORTED: usize = 12;
/// An explanation must beat the plain model by so many standard errors on data neither saw. There
/// are about a hundred candidates: a chance of 1e-4 each is one of 1 % for all.
const BEATS: f64 = 3.7;
/// It must be so many standard errors from doing nothing.
pub(crate) const SIGNIFICANT: f64 = 4.0;
/// With so many it need not shine on unseen data, only leave no more there than the plain model: an
/// effect that shows in transients alone leaves few samples to be judged by.
const CERTAIN: f64 = 5.0;
/// What it explains must be so large beside the floor, as a share of it, to matter.
const MATTERS: f64 = 0.2;
/// Explanations whose losses differ by fewer standard errors than this are not told apart.
pub(crate) const SAME: f64 = 2.0;
/// Errors within this ratio are the same for all that can be done with them.
pub(crate) const CLOSE: f64 = 1.01;
/// An explanation that leaves less than this multiple of the floor explains everything.
const COMPLETE: f64 = 1.2;
/// Least share of the standard deviation that an explanation must account for.
pub(crate) const LEAST: f64 = 0.004;
/// A standard error of so many times the value: the log says nothing of it.
const UNDETERMINED: f64 = 10.0;
/// Below this multiple of the floor a log explains itself.
const BLIND: f64 = 1.3;
/// Above this multiple of the floor something must be missing.
const ABOVE_FLOOR: f64 = 1.5;

/// What candidates are weighed by.
pub(crate) struct Evidence<'a> {
    pub(crate) nominal: &'a Nominal<'a>,
    /// Losses of the plain model on what no fit saw.
    pub(crate) unseen: &'a Losses,
    /// Its error on what it was fitted to.
    pub(crate) nominal_fit: f64,
    /// What noise alone would leave of what judges, and of what was fitted to.
    pub(crate) floor: f64,
    pub(crate) floor_fit: f64,
    /// Least share of the standard deviation that an explanation must account for.
    pub(crate) least: f64,
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
    let chosen = choose(explanations, finalists, evidence.floor, &earned);
    diagnosis.missing = chosen.and_then(|chosen| {
        let best = explanations.first()?;
        evidence
            .is_missing(&finalists[chosen.finalist], best)
            .then(|| best.place.clone())
    });
    let explained = evidence.explains_log_alone(explanations);
    let verdict = match &diagnosis.missing {
        Some(_) => Conclusion::EffectMissing,
        None if evidence.blind(explained.is_some()) => Conclusion::DataInsufficient,
        None if evidence.above_floor(evidence.error()) => Conclusion::UnknownEffect,
        None => Conclusion::NothingMissing,
    };
    let model = evidence.nominal.model;
    diagnosis.advice = advice(model, verdict, explanations.first(), explained);
    explanations.truncate(REPORTED);
    verdict
}

impl Evidence<'_> {
    /// Error of the plain model on what no fit saw.
    fn error(&self) -> f64 {
        nrmse(self.unseen)
    }

    fn above_floor(&self, error: f64) -> bool {
        error > ABOVE_FLOOR * self.floor
    }

    /// Whether a candidate does better than the plain model on data that neither saw.
    fn earned(&self, judged: &Judged, explanation: &Explanation) -> bool {
        let unseen = advantage(self.unseen, &judged.losses);
        unseen > BEATS || (unseen > 0.0 && explanation.significance > CERTAIN)
    }

    /// Whether the chosen explanation is what is missing: better than nothing beyond doubt, by enough to
    /// matter, and determined by the log.
    fn is_missing(&self, judged: &Judged, explanation: &Explanation) -> bool {
        let left = nrmse(&judged.rank);
        let explained = (nrmse(self.nominal.rank).powi(2) - left.powi(2))
            .max(0.0)
            .sqrt();
        // Down to the noise, or a good part of what there was to explain.
        let complete = left < COMPLETE * self.floor && explained > MATTERS * self.floor;
        let matters = complete || explained > (MATTERS * self.floor).max(self.least);
        self.earned(judged, explanation)
            && explanation.significance > SIGNIFICANT
            && matters
            && determined(explanation)
    }

    /// An explanation with which the log is explained and the test recording is not: what is missing did
    /// not show in the log so that it could be told from something else.
    fn explains_log_alone<'e>(&self, explanations: &'e [Explanation]) -> Option<&'e Explanation> {
        explanations
            .iter()
            .find(|e| e.nrmse_fit < BLIND * self.floor_fit && self.above_floor(e.nrmse))
            .filter(|_| self.nominal_fit >= BLIND * self.floor_fit)
    }

    /// Whether the test recording shows something that the log cannot tell of.
    fn blind(&self, explained: bool) -> bool {
        self.nominal.holdout.test.is_some()
            && self.above_floor(self.error())
            && (self.nominal_fit < BLIND * self.floor_fit || explained)
    }
}

/// Whether the log determines anything of the effect: what it cannot tell from the plant's own
/// parameters is not found, however well a test recording speaks of it.
fn determined(explanation: &Explanation) -> bool {
    let says_nothing = |p: &Estimate| match p.verdict {
        Verdict::Flat | Verdict::Dead | Verdict::Held | Verdict::Unfinished => true,
        Verdict::NotPinned => p.std_error.is_none_or(|e| e > UNDETERMINED * p.value.abs()),
        Verdict::Good | Verdict::AtBound => false,
    };
    !explanation.parameters.values().all(says_nothing)
}
