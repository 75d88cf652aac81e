//! Progress of long work, and how to stop it.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use serde::Serialize;

use crate::criteria::Criteria;
use crate::early::{Early, Finding};

/// What long work is doing.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum Stage {
    /// Simulating the model over the measurements.
    Comparing,
    /// Fitting the model as it is.
    Fitting,
    /// Predicting for every candidate what one Gauss–Newton step gains.
    Promises,
    /// Fitting the most promising candidates with a few iterations.
    FirstLooks,
    /// Fitting the best candidates to the end.
    Finalists,
    /// Looking for the force that no effect of the library explains.
    ResidualForce,
    /// Simplifying the improved model, and fitting it again.
    Refining,
    /// Trying experiments in simulation.
    Experiments,
}

impl Stage {
    /// In words, as on a progress bar.
    pub fn text(self) -> &'static str {
        match self {
            Stage::Comparing => "comparing",
            Stage::Fitting => "fitting the model",
            Stage::Promises => "ranking candidates",
            Stage::FirstLooks => "trying candidates",
            Stage::Finalists => "fitting the best",
            Stage::ResidualForce => "looking for a residual force",
            Stage::Refining => "refining the model",
            Stage::Experiments => "trying experiments",
        }
    }
}

/// How far long work is.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Progress {
    /// Round of an [`improve`](crate::improve()), from 0; 0 in any other work.
    pub round: usize,
    /// What is being done.
    pub stage: Stage,
    /// How much of the stage is done: candidates, iterations, samples, runs.
    pub done: u64,
    /// How much there is to do in the stage. It may grow while the stage runs. The stage may end before `done`
    /// reaches it: for a fit it is the greatest number of iterations.
    pub total: u64,
    /// The present error of a fit: that of the free run, relative to the standard deviation.
    pub error: Option<f64>,
}

/// Stops long work. Clones stop the same work.
///
/// A token stays cancelled: give each piece of work a new one.
#[derive(Clone, Debug, Default)]
pub struct CancelToken(Arc<AtomicBool>);

impl CancelToken {
    /// A token that is not cancelled.
    pub fn new() -> Self {
        Self::default()
    }

    /// Asks the work to stop. It stops within a few samples of a simulation, and returns what it has found.
    pub fn cancel(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    /// Whether it was cancelled.
    pub fn is_cancelled(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

/// Work was cancelled before it had anything to return.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("cancelled before there was a result")]
pub struct Cancelled;

type Report<'a> = &'a (dyn Fn(&Progress) + Sync);
type Hear<'a> = &'a (dyn Fn(&Early) + Sync);

/// How much some work has simulated, in samples: a measure of what it cost that depends neither on the machine nor on the
/// number of threads. Divided by the samples of the log it is a number of runs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct Simulated {
    /// Samples of predictions.
    pub plain: u64,
    /// Samples of predictions with derivatives, each pass over the unknowns counted.
    pub differentiated: u64,
}

/// What is counted while work is done.
#[derive(Debug, Default)]
struct Counts {
    plain: AtomicU64,
    differentiated: AtomicU64,
}

/// How long work is done: who gets its progress, what stops it, and which criteria it decides by.
///
/// ```
/// use loopsight_diagnosis::{CancelToken, Work};
///
/// let token = CancelToken::new();
/// let report = |p: &loopsight_diagnosis::Progress| eprintln!("{} {}/{}", p.stage.text(), p.done, p.total);
/// let work = Work::reporting(&report).stopped_by(&token);
/// # drop(work);
/// ```
#[derive(Clone)]
pub struct Work<'a> {
    report: Option<Report<'a>>,
    hear: Option<Hear<'a>>,
    token: CancelToken,
    counts: Arc<Counts>,
    round: usize,
    criteria: &'a Criteria,
}

impl Default for Work<'_> {
    fn default() -> Self {
        Self {
            report: None,
            hear: None,
            token: CancelToken::new(),
            counts: Arc::default(),
            round: 0,
            criteria: &Criteria::DEFAULT,
        }
    }
}

impl std::fmt::Debug for Work<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Work")
            .field("reports", &self.report.is_some())
            .field("tells", &self.hear.is_some())
            .field("token", &self.token)
            .field("round", &self.round)
            .finish()
    }
}

impl<'a> Work<'a> {
    /// Work without reports of progress that goes on to its end.
    pub fn quiet() -> Self {
        Self::default()
    }

    /// Work that calls `report` from time to time, from any of its threads.
    pub fn reporting(report: &'a (dyn Fn(&Progress) + Sync)) -> Self {
        Self {
            report: Some(report),
            ..Self::default()
        }
    }

    /// The same work, which calls `hear` with what is known before it ends, from any of its threads.
    #[must_use]
    pub fn telling(mut self, hear: &'a (dyn Fn(&Early) + Sync)) -> Self {
        self.hear = Some(hear);
        self
    }

    /// The same work, stopped by `token`.
    #[must_use]
    pub fn stopped_by(mut self, token: &CancelToken) -> Self {
        self.token = token.clone();
        self
    }

    /// The same work, decided by other `criteria` than the default ones.
    #[must_use]
    pub fn decided_by(mut self, criteria: &'a Criteria) -> Self {
        self.criteria = criteria;
        self
    }

    /// The criteria it decides by.
    pub fn criteria(&self) -> &'a Criteria {
        self.criteria
    }

    /// How much it has simulated so far, in all its parts.
    pub fn simulated(&self) -> Simulated {
        Simulated {
            plain: self.counts.plain.load(Ordering::Relaxed),
            differentiated: self.counts.differentiated.load(Ordering::Relaxed),
        }
    }

    /// Counts so many samples of a prediction.
    pub(crate) fn count_plain(&self, samples: usize) {
        self.counts
            .plain
            .fetch_add(samples as u64, Ordering::Relaxed);
    }

    /// Counts so many samples of a prediction with derivatives.
    pub(crate) fn count_differentiated(&self, samples: usize) {
        let counted = &self.counts.differentiated;
        counted.fetch_add(samples as u64, Ordering::Relaxed);
    }

    /// Whether it was cancelled.
    pub fn is_cancelled(&self) -> bool {
        self.token.is_cancelled()
    }

    /// A part of the work that tells nothing; the same token stops it.
    pub(crate) fn silently(&self) -> Self {
        Self {
            report: None,
            hear: None,
            ..self.clone()
        }
    }

    /// A round of the work.
    pub(crate) fn in_round(&self, round: usize) -> Self {
        Self {
            round,
            ..self.clone()
        }
    }

    /// An error where the work was cancelled. It is cheap, because it is called at every sample.
    pub(crate) fn go_on(&self) -> Result<(), Cancelled> {
        if self.is_cancelled() {
            Err(Cancelled)
        } else {
            Ok(())
        }
    }

    /// Tells what is known already.
    pub(crate) fn know(&self, finding: impl FnOnce() -> Finding) {
        if let Some(hear) = self.hear {
            let round = self.round;
            hear(&Early {
                round,
                finding: finding(),
            });
        }
    }

    /// Reports how far a stage is.
    pub(crate) fn tell(&self, stage: Stage, done: u64, total: u64) {
        self.tell_error(stage, done, total, None);
    }

    /// As [`Work::tell`], with the present error of a fit.
    pub(crate) fn tell_error(&self, stage: Stage, done: u64, total: u64, error: Option<f64>) {
        if let Some(report) = self.report {
            report(&Progress {
                round: self.round,
                stage,
                done,
                total,
                error,
            });
        }
    }
}
