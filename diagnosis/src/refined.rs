//! A model, and corrections to it that are tried.

use std::borrow::Cow;

use loopsight_model::model::Model;
use loopsight_model::run::Run;
use rayon::prelude::*;

use crate::commands::Commands;
use crate::compare::{error_over, free_run_error};
use crate::error::{CompareError, FitError};
use crate::in_place::Motion;
use crate::measurements::Measurements;
use crate::observer::{attach_observer, attach_same_observer};
use crate::output_error::{Unaided, fitted_values};
use crate::prediction::{InitialStates, signal_rms};
use crate::progress::{Cancelled, Stage, Work};
use crate::solve::Effort;

/// A model, and others that may take its place.
pub(crate) struct Refined<'a> {
    pub(crate) model: &'a mut Model,
    pub(crate) measurements: &'a Measurements<'a>,
    pub(crate) work: &'a Work<'a>,
    /// What it and the others are refitted to, once one was.
    alike: Option<Alike<'a>>,
    /// Its error after a short fit, once it was computed.
    error: Option<f64>,
    /// What was tried in its place.
    tried: Vec<Tried>,
    /// How many were tried so far.
    changes: u64,
}

/// A model that was tried.
struct Tried {
    /// Where its fit began.
    begun: Model,
    /// Its error after a short fit, and itself then; none where it cannot be fitted.
    fitted: Option<(f64, Model)>,
}

impl<'a> Refined<'a> {
    /// One of which nothing was tried yet.
    pub(crate) fn new(
        model: &'a mut Model,
        measurements: &'a Measurements<'a>,
        work: &'a Work<'a>,
    ) -> Self {
        Self {
            model,
            measurements,
            work,
            alike: None,
            error: None,
            tried: Vec::new(),
            changes: 0,
        }
    }

    /// Takes the best of the fitted `candidates` whose error is below their `share` of the present one. Candidates
    /// that cannot be fitted, because their free run diverges, do not count.
    pub(crate) fn takes<T>(
        &mut self,
        candidates: Vec<(T, Model)>,
        share: impl Fn(&Model) -> f64,
    ) -> Result<Option<T>, FitError> {
        self.takes_below(candidates, share, f64::INFINITY)
    }

    /// As [`Refined::takes`], of those whose error is at `most` so large.
    pub(crate) fn takes_below<T>(
        &mut self,
        candidates: Vec<(T, Model)>,
        share: impl Fn(&Model) -> f64,
        most: f64,
    ) -> Result<Option<T>, FitError> {
        if candidates.is_empty() {
            return Ok(None);
        }
        let (what, begun): (Vec<T>, Vec<Model>) = candidates.into_iter().unzip();
        self.try_all(&begun)?;
        let now = self.error.unwrap_or(f64::INFINITY);
        let good = |model: &Model, error: f64| error <= (share(model) * now).min(most);
        let best = (what.into_iter().zip(&begun))
            .filter_map(|(what, begun)| Some((what, self.tried(begun)?.fitted.as_ref()?)))
            .filter(|(_, (error, model))| good(model, *error))
            .min_by(|(_, a), (_, b)| a.0.total_cmp(&b.0));
        let Some((what, (error, model))) = best else {
            return Ok(None);
        };
        (self.error, *self.model) = (Some(*error), model.clone());
        self.tried.clear();
        Ok(Some(what))
    }

    /// Makes the short fits of those of some models that were not tried yet, and of the present one, all at once.
    pub(crate) fn try_all(&mut self, models: &[Model]) -> Result<(), FitError> {
        let new = models.iter().filter(|model| self.tried(model).is_none());
        let new: Vec<Model> = new.cloned().collect();
        if new.is_empty() {
            return Ok(());
        }
        self.changes += new.len() as u64;
        self.work.tell(Stage::Refining, self.changes, self.changes);
        let silent = self.work.silently();
        let alike = self.take_alike(&silent)?;
        let refit = |model: &Model| -> Result<_, Cancelled> {
            match alike.refitted(model, &silent) {
                Err(FitError::Cancelled(cancelled)) => Err(cancelled),
                found => Ok(found.ok()),
            }
        };
        let (present, known): (&Model, _) = (self.model, self.error);
        let (now, tried) = rayon::join(
            || match known {
                Some(now) => Ok(now),
                None => match refit(present)? {
                    Some((error, _)) => Ok(error),
                    None => match alike.error(present, &silent) {
                        Err(CompareError::Cancelled(cancelled)) => Err(cancelled),
                        // Any other model is better than one whose free run diverges.
                        found => Ok(found.unwrap_or(f64::INFINITY)),
                    },
                },
            },
            || {
                let tried = new.into_par_iter().map(|begun| {
                    let fitted = refit(&begun)?;
                    Ok(Tried { begun, fitted })
                });
                tried.collect::<Result<Vec<Tried>, Cancelled>>()
            },
        );
        self.alike = Some(alike);
        self.error = Some(now?);
        self.tried.extend(tried?);
        Ok(())
    }

    /// What models are refitted to, to be put back. The present model says how where nothing was fitted yet.
    fn take_alike(&mut self, work: &Work<'_>) -> Result<Alike<'a>, Cancelled> {
        match self.alike.take() {
            Some(alike) => Ok(alike),
            None => Alike::new(self.model, self.measurements, work),
        }
    }

    /// How fast and how far it moves: root mean squares of its signals; what drives it; and its motion.
    pub(crate) fn moves(&mut self) -> Result<(Vec<f64>, Commands, Motion), FitError> {
        let silent = self.work.silently();
        let alike = self.take_alike(&silent)?;
        let model: &Model = self.model;
        let (values, runs) = (model.values(), &alike.runs);
        let states = InitialStates::estimate(model, &values, runs, &silent)?.states;
        let rms = signal_rms(model, &values, &states, runs, &silent)?;
        let motion = Motion::of(model, &states, runs, &silent)?;
        let commands = Commands::of(model, runs);
        self.alike = Some(alike);
        Ok((rms, commands, motion))
    }

    /// The error of the present model after a short fit, once it was computed.
    pub(crate) fn error(&self) -> Option<f64> {
        self.error
    }

    /// A model that was tried in place of the present one.
    fn tried(&self, begun: &Model) -> Option<&Tried> {
        self.tried.iter().find(|tried| is_same(&tried.begun, begun))
    }

    /// What was tried in place of the present model: each fitted, with its error.
    pub(crate) fn fitted(self) -> Vec<(f64, Model)> {
        let fitted = self.tried.into_iter().filter_map(|tried| tried.fitted);
        fitted.collect()
    }
}

/// Whether two models that came of the same one are the same: their effects and parameters are.
fn is_same(a: &Model, b: &Model) -> bool {
    let mut effects = a.effects.iter().zip(&b.effects);
    a.effects.len() == b.effects.len()
        && effects.all(|(a, b)| a.is_same(b))
        && a.parameters == b.parameters
}

/// Effort of a short fit: errors are compared that differ by percents. (With a tolerance of 1e-4 the present model, where it
/// converges slowly, ends so much higher that a simpler one takes its place.)
const CORRECTION: Effort = Effort {
    iterations: 20,
    tolerance: 1e-6,
    worth: None,
};

/// Recordings that models are refitted to, and judged on under the observer that one of them needs: an observer that corrects
/// sooner leaves less, so that errors are only compared under the same.
pub(crate) struct Alike<'a> {
    /// Those to refit to, each model with the observer that it needs.
    fitting: &'a [Run],
    /// Those to judge on.
    judging: &'a [Run],
    /// Those to fit to, under one observer.
    runs: Cow<'a, [Run]>,
    /// The validation runs under it, where there are any.
    test: Option<Cow<'a, [Run]>>,
}

impl<'a> Alike<'a> {
    /// The `measurements` under the observer that `model` needs.
    pub(crate) fn new(
        model: &Model,
        measurements: &Measurements<'a>,
        work: &Work<'_>,
    ) -> Result<Self, Cancelled> {
        let fitting = measurements.runs;
        let runs = attach_observer(model, &model.values(), fitting, work)?;
        let test = measurements.test;
        let test = test.map(|test| attach_same_observer(model, test, &runs, work));
        let test = test.transpose()?;
        Ok(Self {
            fitting,
            judging: measurements.test.unwrap_or(fitting),
            runs,
            test,
        })
    }

    /// The error of a model on what it is judged on.
    pub(crate) fn error(&self, model: &Model, work: &Work<'_>) -> Result<f64, CompareError> {
        error_over(model, self.test.as_ref().unwrap_or(&self.runs), work)
    }

    /// That error, or what it leaves with no other observer than it needs itself, if that is more: a slow model that an observer
    /// draws along does not stand by itself.
    fn error_of(&self, model: &Model, work: &Work<'_>) -> Result<f64, CompareError> {
        let error = self.error(model, work)?;
        if self.runs.iter().all(|run| run.observer().is_none()) {
            return Ok(error);
        }
        let own = free_run_error(model, &Measurements::new(self.judging), work)?;
        Ok(error.max(own))
    }

    /// The error of a model on what it is fitted to.
    pub(crate) fn error_fit(&self, model: &Model, work: &Work<'_>) -> Result<f64, CompareError> {
        error_over(model, &self.runs, work)
    }

    /// The error of a model after a short fit, and the fitted model.
    pub(crate) fn refitted(
        &self,
        model: &Model,
        work: &Work<'_>,
    ) -> Result<(f64, Model), FitError> {
        let begun = model.clone().with_steps_by_motion();
        let mut fitted = fitted_values(&begun, self.fitting, Unaided::Known, CORRECTION, work)?;
        let error = self.error_of(&fitted, work)?;
        fitted.by_motion = false;
        Ok((error, fitted))
    }
}

#[cfg(test)]
mod tests {
    use loopsight_plants as _;

    use super::*;
    use crate::swing::swing;

    fn axis(level: f64) -> Model {
        let text = format!(
            "[plant.dc_axis]\nK_A = -2.0\nK_C = 8.0\n[log.measured.speed]\n\
             [[effect]]\n[effect.coulomb_friction]\nat = [\"shaft\"]\nlevel = {level}\n"
        );
        Model::from_toml("axis.toml", &text).unwrap().0
    }

    #[test]
    fn what_was_tried_in_place_of_a_model_is_not_fitted_again() {
        let runs = [swing(&axis(0.8), 400)];
        let measurements = Measurements::new(&runs);
        let work = Work::quiet();
        let mut present = axis(0.8);
        let without = present.without_effect(0).unwrap();
        let candidates = || vec![("without", without.clone())];

        let mut best = Refined::new(&mut present, &measurements, &work);
        best.try_all(std::slice::from_ref(&without)).unwrap();
        let once = work.simulated();
        assert_eq!(best.takes(candidates(), |_| 1.01).unwrap(), None);
        assert_eq!(work.simulated(), once);
        let tried = best.fitted();
        assert_eq!(tried.len(), 1);
        assert!(tried[0].0 > 0.01, "without friction {}", tried[0].0);

        // What is taken is the present model; what was tried in place of another one says nothing of it.
        let mut best = Refined::new(&mut present, &measurements, &work);
        let taken = best.takes(candidates(), |_| f64::INFINITY).unwrap();
        assert_eq!(taken, Some("without"));
        assert!(best.model.effects.is_empty());
        assert!(best.fitted().is_empty());
        assert_eq!(present.values(), tried[0].1.values());
    }
}
