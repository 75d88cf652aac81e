//! What a diagnosis searches, and how it ends on everything that was measured.
//!
//! A search of a long log reads [windows](crate::excerpt) of it. The plain model and the finalists are then
//! [taken on](crate::whole) to all samples and judged on all of them, so that a verdict never rests on a part.

use loopsight_model::model::Model;
use loopsight_model::run::Run;
use nalgebra::DVector;
use rayon::prelude::*;

use crate::conclusion::{Diagnosis, Explanation};
use crate::early::Finding;
use crate::error::FitError;
use crate::excerpt::Excerpt;
use crate::explain::explain;
use crate::holdout::{Holdout, Judgement};
use crate::judge::nrmse;
use crate::measurements::Measurements;
use crate::prediction::Solution;
use crate::progress::{Stage, Work};
use crate::trial::{Judged, Nominal};
use crate::whole::taken_on;

/// What a search reads of some measurements.
pub(crate) struct Read<'a> {
    all: &'a Measurements<'a>,
    runs: Option<Excerpt>,
    test: Option<Excerpt>,
}

impl<'a> Read<'a> {
    pub(crate) fn of(model: &Model, all: &'a Measurements<'a>) -> Self {
        Self {
            all,
            runs: Excerpt::of(model, all.runs),
            test: all.test.and_then(|test| Excerpt::of(model, test)),
        }
    }

    /// What it fits to.
    pub(crate) fn runs(&self) -> &[Run] {
        let windows = self.runs.as_ref().map(|excerpt| &*excerpt.windows);
        windows.unwrap_or(self.all.runs)
    }

    /// What it is judged on, where there is a test recording.
    pub(crate) fn test(&self) -> Option<&[Run]> {
        let test = self.all.test?;
        let windows = self.test.as_ref().map(|excerpt| &*excerpt.windows);
        Some(windows.unwrap_or(test))
    }

    /// Whether these are windows of one run.
    pub(crate) fn parts_of_one(&self) -> bool {
        self.runs.is_some() && self.all.runs.len() == 1
    }

    /// By run of the measurements: the one that the search read and that begins where it does. None where the
    /// search reads everything.
    pub(crate) fn first(&self) -> Option<Vec<usize>> {
        match &self.runs {
            Some(excerpt) => Some(excerpt.first.clone()),
            None => self
                .test
                .is_some()
                .then(|| (0..self.all.runs.len()).collect()),
        }
    }
}

/// The plain model on everything.
pub(crate) struct OnAll {
    pub(crate) model: Model,
    pub(crate) solution: Solution,
    pub(crate) judgement: Judgement,
}

/// A solution of what the search read, as a start for everything.
fn begun(solution: &Solution, first: &[usize]) -> Solution {
    let state = |window: &usize| solution.states.get(*window).cloned();
    Solution {
        values: solution.values.clone(),
        states: first
            .iter()
            .filter_map(state)
            .collect::<Vec<DVector<f64>>>(),
    }
}

/// Fits the plain model to everything, from where it ended in the search.
pub(crate) fn plain_on_all(
    diagnosis: &mut Diagnosis,
    nominal: &Nominal<'_>,
    holdout: &Holdout<'_>,
    first: &[usize],
) -> Result<OnAll, FitError> {
    let (model, work) = (nominal.given, nominal.work);
    let start = begun(nominal.solution, first);
    let Some((solution, fit)) = taken_on(model, &start, holdout, work)? else {
        let why = "the free run over the whole log diverges, where that over parts of it does not";
        return Err(FitError::Solver(why.to_owned()));
    };
    let judgement = holdout.judge(model, &solution, None, work)?;
    let fitted = holdout.fitted(model, &solution, &judgement.rank, work)?;
    diagnosis.nominal.nrmse = nrmse(&judgement.losses);
    diagnosis.nominal_fit = nrmse(&fitted);
    diagnosis.model = Some(fit.model.clone());
    Ok(OnAll {
        model: fit.model,
        solution,
        judgement,
    })
}

/// Fits the finalists of a search to everything. The diagnosis lists them, the best first.
pub(crate) fn finalists_on_all(
    diagnosis: &mut Diagnosis,
    nominal: &Nominal<'_>,
    finalists: Vec<Judged>,
    first: &[usize],
    work: &Work<'_>,
) -> Result<Vec<Judged>, FitError> {
    let of = finalists.len() as u64;
    work.tell(Stage::Finalists, 0, of);
    let mut ended: Vec<(Judged, Explanation)> = finalists
        .into_par_iter()
        .filter_map(|found| {
            let start = begun(&found.solution, first);
            let model = &found.candidate.model;
            let (solution, fit) = taken_on(model, &start, nominal.holdout, nominal.work).ok()??;
            let judged = Judged::of(found.candidate.clone(), model, solution, None, nominal)?;
            let explanation = explain(&judged, &fit, nominal).ok()?;
            work.know(|| Finding::Finalist((&explanation).into()));
            Some((judged, explanation))
        })
        .collect();
    // After a cancellation some are missing; the diagnosis keeps those of the search.
    work.go_on()?;
    ended.sort_by(|a, b| a.0.error().total_cmp(&b.0.error()));
    let (finalists, explanations) = ended.into_iter().unzip();
    diagnosis.candidates = explanations;
    Ok(finalists)
}
