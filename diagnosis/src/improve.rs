//! Diagnose, add, refit, until nothing more is missing.

use loopsight_model::model::Model;
use loopsight_model::run::Run;
use loopsight_recordings::Fault;
use serde::Serialize;

use crate::conclusion::{Conclusion, Diagnosis, Place};
use crate::diagnose::{LEAST, diagnose_above};
use crate::fit::{Fit, FitError, FitSettings, fit};
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

/// Share of the first error that a further effect must account for: beyond it a library finds
/// something for every wiggle.
const WORTH: f64 = 0.04;
/// Most effects that are added: beyond that a library is fitting, not explaining.
const MOST: usize = 6;

/// Repeats [`diagnose`](crate::diagnose()), adding what it finds missing, until it finds nothing more.
///
/// `progress` gets the round, and the candidates done and in all.
pub fn improve(
    model: &Model,
    runs: &[Run],
    test: Option<&[Run]>,
    faults: &[Fault],
    progress: &(dyn Fn(usize, u64, u64) + Sync),
) -> Result<Improvement, FitError> {
    let mut present = model.clone();
    let mut steps: Vec<Step> = Vec::new();
    let mut diagnoses = Vec::new();
    let mut first = None;
    let verdict = loop {
        let round = diagnoses.len();
        let least = first.map_or(LEAST, |nrmse: f64| (WORTH * nrmse).max(LEAST));
        let diagnosis = diagnose_above(&present, runs, test, faults, least, &|done, total| {
            progress(round, done, total);
        })?;
        let verdict = diagnosis.verdict;
        if let Some(fitted) = &diagnosis.model
            && steps.is_empty()
        {
            first = Some(diagnosis.nominal.nrmse);
            steps.push(Step {
                added: None,
                round,
                nrmse_fit: diagnosis.nominal_fit,
                nrmse_test: diagnosis.nominal.nrmse,
            });
            present = fitted.clone();
        }
        let next = match (&diagnosis.missing, diagnosis.candidates.first()) {
            (Some(_), Some(best)) if round < MOST => Some(best.clone()),
            _ => None,
        };
        diagnoses.push(diagnosis);
        let Some(best) = next else { break verdict };
        steps.push(Step {
            added: Some(best.place.clone()),
            round,
            nrmse_fit: best.nrmse_fit,
            nrmse_test: best.nrmse,
        });
        present = refine(best.model, &mut steps, &diagnoses[..round], runs, test)?;
    };
    let best = match verdict {
        Conclusion::LogFaulty | Conclusion::DataInsufficient => None,
        _ => Some(fit(
            &present,
            runs,
            test,
            faults,
            &FitSettings::default(),
            &|_, _| {},
        )?),
    };
    Ok(Improvement {
        steps,
        verdict,
        diagnoses,
        best,
    })
}
