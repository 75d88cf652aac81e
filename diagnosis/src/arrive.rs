//! A fit from several starting points, and whether it converged.

use serde::Serialize;

use nalgebra::DVector;

use crate::error::FitError;
use crate::prediction::{InitialStates, Solution, estimated_states};
use crate::problem::Problem;
use crate::regression::batch;
use crate::settings::FitSettings;
use crate::solve::Effort;

/// Spans of the regressions that a fit may start from, s.
pub(crate) const SPANS: [f64; 3] = [0.0, 0.05, 0.2];
/// Most other starts that are tried, the best first.
pub(crate) const OTHERS: usize = 6;
/// Effort spent on each start but the first.
const SHORT: Effort = Effort {
    iterations: 12,
    tolerance: 1e-4,
    worth: None,
};

/// Where a fit began, and the error it ended with.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Tried {
    /// What the start was made of.
    pub from: String,
    /// Free-run error at its end, relative to the standard deviation.
    pub nrmse: f64,
}

/// Whether a fit converged.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Convergence {
    /// The error falls no further, and the model leaves less than a constant would.
    pub converged: bool,
    /// Why not, in words.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
    /// The starts that were tried, the most promising first.
    pub starts: Vec<Tried>,
}

/// Which starts a fit follows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Starts {
    /// Where the best one leaves much, the others as well.
    All,
    /// The best one alone: the model was fitted before, and one of its parts was exchanged.
    Best,
}

/// Where a problem's solution lies, and how it was found.
pub(crate) struct Arrived {
    /// Scaled unknowns.
    pub(crate) solution: DVector<f64>,
    pub(crate) settled: bool,
    pub(crate) tried: Vec<Tried>,
}

/// Values to begin with.
pub(crate) struct Start {
    pub(crate) from: String,
    pub(crate) values: Vec<f64>,
    pub(crate) states: Vec<DVector<f64>>,
    pub(crate) cost: f64,
}

/// A start that was followed.
struct Attempt {
    solution: Solution,
    error: f64,
    settled: bool,
}

impl Convergence {
    /// The verdict on a fit that left `nrmse`, and whether its error had `settled`.
    pub(crate) fn of(nrmse: f64, settled: bool, starts: Vec<Tried>, hopeless: f64) -> Self {
        let reason = if nrmse.is_nan() || nrmse >= hopeless {
            Some("the fitted model leaves as much as a constant would, or more".to_owned())
        } else if !settled {
            Some("the error was still falling at the last iteration".to_owned())
        } else {
            None
        };
        Self {
            converged: reason.is_none(),
            reason,
            starts,
        }
    }
}

impl Problem<'_> {
    /// Solves from the most promising start: the file's values, or those of a regression over one of several
    /// spans. If the error stays large, other starts are tried. If it stays very large, scattered starts are
    /// among them. The start that led to the least error is solved to the end.
    pub(crate) fn arrive(
        &mut self,
        settings: &FitSettings,
        starting: Starts,
        effort: Effort,
    ) -> Result<Arrived, FitError> {
        let criteria = self.work.criteria().start;
        let mut starts = self.starts(settings)?;
        let mut tried = Vec::new();
        let mut best = None;
        // The first that the solver gets anywhere from.
        while best.is_none() && !starts.is_empty() {
            let start = starts.remove(0);
            best = self.attempt(&start, effort, &mut tried)?;
        }
        let Some(mut best) = best else {
            return Err(FitError::Solver(
                "the free run diverges from every starting point".to_owned(),
            ));
        };
        if best.error > criteria.poor && starting == Starts::All {
            starts.truncate(OTHERS);
            if best.error > criteria.lost {
                // Not around where it went astray.
                starts.extend(self.scattered(&self.model.declared_values())?);
            }
            let mut furthest: Option<Attempt> = None;
            for start in &starts {
                let Some(other) = self.attempt(start, SHORT, &mut tried)? else {
                    continue;
                };
                if furthest.as_ref().is_none_or(|f| other.error < f.error) {
                    furthest = Some(other);
                }
            }
            if let Some(other) = furthest.filter(|f| f.error < criteria.further * best.error) {
                let Solution { values, states } = &other.solution;
                let further = self.follow(values, states, effort)?;
                best = if further.error < other.error {
                    further
                } else {
                    other
                };
            }
        }
        let Solution { values, states } = &best.solution;
        let scaled = self.pack(values, states);
        Ok(Arrived {
            solution: self.balance(scaled)?,
            settled: best.settled,
            tried,
        })
    }

    /// Solves from one start and records the result; none where the solver gives up.
    fn attempt(
        &mut self,
        start: &Start,
        effort: Effort,
        tried: &mut Vec<Tried>,
    ) -> Result<Option<Attempt>, FitError> {
        let attempt = match self.follow(&start.values, &start.states, effort) {
            Ok(attempt) => attempt,
            Err(FitError::Cancelled(cancelled)) => return Err(cancelled.into()),
            Err(_) => return Ok(None),
        };
        tried.push(Tried {
            from: start.from.clone(),
            nrmse: attempt.error,
        });
        Ok(attempt.error.is_finite().then_some(attempt))
    }

    fn follow(
        &mut self,
        values: &[f64],
        states: &[DVector<f64>],
        effort: Effort,
    ) -> Result<Attempt, FitError> {
        let start = self.pack(values, states);
        let start = self.balance(start)?;
        let (scaled, settled) = self.solve_and_tell(&start, effort)?;
        let error = self.residual_vector(&scaled)?.norm();
        Ok(Attempt {
            solution: self.solution(&scaled),
            error,
            settled,
        })
    }

    /// The file's values and those of regressions, the one whose free run is closest to the data first. Where
    /// there is neither, the typical sizes that the declarations give.
    fn starts(&self, settings: &FitSettings) -> Result<Vec<Start>, FitError> {
        let mut starts = Vec::new();
        if self.model.missing_values().is_empty() {
            starts.extend(self.start("the file's values", self.model.values())?);
            self.settle(&mut starts)?;
        }
        let mut failure = None;
        for span in SPANS {
            match batch(self.model, self.runs, settings.scheme, span, &self.work) {
                Ok(values) => {
                    let from = format!("a regression over spans of {span} s");
                    starts.extend(self.start(&from, values)?);
                }
                Err(FitError::Cancelled(cancelled)) => return Err(cancelled.into()),
                Err(error) => failure = Some(error),
            }
        }
        if starts.is_empty() {
            match failure {
                Some(FitError::NoRegression(_)) | None => {}
                Some(error) => return Err(error),
            }
        }
        if !self.model.missing_values().is_empty() || starts.is_empty() {
            let from = "the sizes of the declarations";
            starts.extend(self.start(from, self.model.declared_values())?);
        }
        starts.sort_by(|a, b| a.cost.total_cmp(&b.cost));
        if starts.is_empty() {
            return self.scattered(&self.model.declared_values());
        }
        Ok(starts)
    }

    /// A start with the initial states that its values suggest; none where its free run diverges.
    pub(crate) fn start(&self, from: &str, values: Vec<f64>) -> Result<Option<Start>, FitError> {
        let states = match &self.known_states {
            Some(states) => states.clone(),
            None => InitialStates::guess(self.model, &values, self.runs).states,
        };
        let cost = self
            .residual_vector(&self.pack(&values, &states))?
            .norm_squared();
        Ok(cost.is_finite().then(|| Start {
            from: from.to_owned(),
            values,
            states,
            cost,
        }))
    }

    /// Gives the start with the file's values the initial states that suit them, where that lowers its cost. A state that no
    /// sensor reads begins anywhere else, and from there values that were right may go astray.
    fn settle(&self, starts: &mut [Start]) -> Result<(), FitError> {
        let (model, runs) = (self.model, self.runs);
        let [start] = starts else { return Ok(()) };
        let states = estimated_states(model, &start.values, runs).len();
        if self.known_states.is_some() || states <= model.measured.len() {
            return Ok(());
        }
        let states = InitialStates::estimate(model, &start.values, runs, &self.work)?.states;
        let at = self.pack(&start.values, &states);
        let cost = self.residual_vector(&at)?.norm_squared();
        if cost < start.cost {
            (start.states, start.cost) = (states, cost);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fit_that_leaves_more_than_a_constant_has_not_arrived() {
        let of = |nrmse, settled| Convergence::of(nrmse, settled, Vec::new(), 1.0);
        assert!(of(0.2, true).converged);
        for (nrmse, settled) in [(1.8, true), (f64::NAN, true), (0.2, false)] {
            let verdict = of(nrmse, settled);
            assert!(!verdict.converged && verdict.reason.is_some());
        }
    }
}
