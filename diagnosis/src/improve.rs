//! Diagnose, add, refit, until nothing more is missing.

use loopsight_model::model::Model;
use serde::Serialize;

use crate::conclusion::{Conclusion, Diagnosis, Explanation, Place};
use crate::diagnose::diagnose_above;
use crate::error::FitError;
use crate::fit::{Fit, FitSettings, Method, fit};
use crate::measurements::Measurements;
use crate::progress::{Cancelled, Work};
use crate::refine::refine;

/// One step of an improvement.
#[derive(Clone, Debug, Serialize)]
pub struct Step {
    /// What was added, under the name that it has in the best model; `null` for the model as it was.
    pub added: Option<Place>,
    /// The round whose diagnosis named it: its place among [`Improvement::diagnoses`].
    #[serde(skip)]
    pub round: usize,
    /// Free-run error on what the model was fitted to.
    pub nrmse_fit: f64,
    /// Free-run error on what it was not fitted to.
    pub nrmse_test: f64,
}

/// The result of [`improve`].
#[derive(Debug, Serialize)]
pub struct Improvement {
    /// The model as it was, then each addition.
    pub steps: Vec<Step>,
    /// What the last diagnosis concludes.
    pub verdict: Conclusion,
    /// The diagnoses, one per round.
    #[serde(skip)]
    pub diagnoses: Vec<Diagnosis>,
    /// The best model, fitted to all of the log; none where a diagnosis was refused.
    #[serde(skip)]
    pub best: Option<Fit>,
}

impl Improvement {
    /// What the data could not tell from the effect of a step when it was added.
    pub fn not_told_from(&self, step: &Step) -> Vec<&Place> {
        let named = self
            .diagnoses
            .get(step.round)
            .and_then(|d| d.candidates.first());
        let (Some(added), Some(named)) = (&step.added, named) else {
            return Vec::new();
        };
        std::iter::once(&named.place)
            .chain(&named.indistinguishable_from)
            .filter(|place| *place != added)
            .collect()
    }
}

/// Repeats [`diagnose`](crate::diagnose()), adding what it finds missing, until it finds nothing more.
///
/// An improvement that is cancelled has the steps that were finished, the model of the last one as the
/// best, and the verdict [`Conclusion::Cancelled`].
///
/// # Errors
///
/// [`FitError`] when the model as it is, or one of the improved models, cannot be fitted.
pub fn improve(
    model: &Model,
    measurements: &Measurements<'_>,
    work: &Work<'_>,
) -> Result<Improvement, FitError> {
    let mut state = State::new(model);
    let verdict = loop {
        let diagnosis = state.diagnose(measurements, work)?;
        let verdict = diagnosis.verdict;
        let round = state.diagnoses.len();
        let next = match (&diagnosis.missing, diagnosis.candidates.first()) {
            (Some(_), Some(best)) if round < work.criteria().improve.most => Some(best.clone()),
            _ => None,
        };
        state.diagnoses.push(diagnosis);
        let Some(best) = next else { break verdict };
        match state.add(best, round, measurements, work) {
            Err(FitError::Cancelled(Cancelled)) => break Conclusion::Cancelled,
            done => done?,
        }
    };
    state.finish(verdict, measurements, work)
}

/// An improvement on its way.
struct State {
    present: Model,
    steps: Vec<Step>,
    diagnoses: Vec<Diagnosis>,
}

impl State {
    fn new(model: &Model) -> Self {
        Self {
            present: model.clone(),
            steps: Vec::new(),
            diagnoses: Vec::new(),
        }
    }

    /// Diagnoses the present model; the first time it is fitted by that, and the first step.
    fn diagnose(
        &mut self,
        measurements: &Measurements<'_>,
        work: &Work<'_>,
    ) -> Result<Diagnosis, FitError> {
        let round = self.diagnoses.len();
        let first = self.diagnoses.first().map(|d| d.nominal.nrmse);
        let criteria = work.criteria();
        let (worth, least) = (criteria.improve.worth, criteria.missing.least_share);
        let least = first.map_or(least, |nrmse| (worth * nrmse).max(least));
        let diagnosis = diagnose_above(&self.present, measurements, least, &work.in_round(round))?;
        if let Some(fitted) = &diagnosis.model
            && self.steps.is_empty()
        {
            self.steps.push(Step {
                added: None,
                round,
                nrmse_fit: diagnosis.nominal_fit,
                nrmse_test: diagnosis.nominal.nrmse,
            });
            self.present = fitted.clone();
        }
        Ok(diagnosis)
    }

    /// Adds what the diagnosis of a `round` named, and puts right what that changes.
    fn add(
        &mut self,
        best: Explanation,
        round: usize,
        measurements: &Measurements<'_>,
        work: &Work<'_>,
    ) -> Result<(), FitError> {
        self.steps.push(Step {
            added: Some(best.place),
            round,
            nrmse_fit: best.nrmse_fit,
            nrmse_test: best.nrmse,
        });
        self.present = best.model;
        let earlier = &self.diagnoses[..round];
        let work = work.in_round(round);
        refine(
            &mut self.present,
            &mut self.steps,
            earlier,
            measurements,
            &work,
        )
    }

    /// Fits the best model to all of the log; a cancelled one stays as it is.
    fn finish(
        self,
        verdict: Conclusion,
        measurements: &Measurements<'_>,
        work: &Work<'_>,
    ) -> Result<Improvement, FitError> {
        let settings = FitSettings::default();
        let unfitted = |model: Model, step: &Step| {
            let error = step.nrmse_test;
            Fit::cancelled(model, Method::OutputError, error, 0)
        };
        let (best, verdict) = match verdict {
            Conclusion::LogFaulty | Conclusion::DataInsufficient => (None, verdict),
            Conclusion::Cancelled => (None, verdict),
            _ => match fit(&self.present, measurements, &settings, &work.silently()) {
                Err(FitError::Cancelled(Cancelled)) => (None, Conclusion::Cancelled),
                Ok(fit) if fit.cancelled => (Some(fit), Conclusion::Cancelled),
                done => (Some(done?), verdict),
            },
        };
        let best = match verdict {
            Conclusion::Cancelled => {
                best.or_else(|| self.steps.last().map(|step| unfitted(self.present, step)))
            }
            _ => best,
        };
        Ok(Improvement {
            steps: self.steps,
            verdict,
            diagnoses: self.diagnoses,
            best,
        })
    }
}
