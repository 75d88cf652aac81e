//! Improving a model: diagnose, add the missing effect, refit, until nothing more is missing.

use crate::conclusion::{Conclusion, Diagnosis, Explanation};
use crate::criteria::Criteria;
use crate::diagnose::{Aim, Discover, diagnose_for};
use crate::early::Finding;
use crate::error::FitError;
use crate::fit::fit_for;
use crate::fitted::Fit;
use crate::goes::Goes;
use crate::improvement::{Improvement, ImprovementStep};
use crate::measurements::Measurements;
use crate::output_error::Unaided;
use crate::pace::Paced;
use crate::pairs::pair;
use crate::progress::{Cancelled, Work};
use crate::refine::{has_the_effects_of, refine, still_open, without_step};
use crate::set_aside::set_aside;
use crate::settings::{FitSettings, ImproveSettings, Method};
use crate::split::second_anew;
use crate::worth::worth_adding;
use loopsight_model::model::Model;

/// Repeats [`diagnose`](crate::diagnose()), adding what it finds missing, until it finds nothing more.
///
/// Where no effect of the library explains the rest, and `settings` say so, an expression for the residual force is a
/// candidate as well: its coefficients are fitted with the model's, and it is judged on the same data by the same rules.
///
/// An improvement that is cancelled has the finished steps, the model of the last of them as the best one, and
/// the verdict [`Conclusion::Cancelled`].
///
/// # Errors
///
/// [`FitError`] when the model as it is, or one of the improved models, cannot be fitted.
pub fn improve(
    model: &Model,
    measurements: &Measurements<'_>,
    settings: &ImproveSettings,
    work: &Work<'_>,
) -> Result<Improvement, FitError> {
    let paced = Paced::of(model, measurements.runs, work);
    let (model, work) = (&paced.model, &paced.work(work));
    if !settings.discover {
        return improve_with(model, measurements, Discover::Never, work);
    }
    let found = improve_with(model, measurements, Discover::Last, work)?;
    let stood_in = found.verdict == Conclusion::UnknownEffect && found.steps.len() > 1;
    if !stood_in {
        return Ok(found);
    }
    // Effects of the library that took a part of the error may have stood in for what it does not have.
    let other = improve_with(model, measurements, Discover::Only, work)?;
    let left = |found: &Improvement| found.steps.last().map_or(f64::INFINITY, |s| s.nrmse_test);
    let better = left(&other) < work.criteria().improve.better * left(&found);
    Ok(if better { other } else { found })
}

/// [`improve`] with or without expressions.
fn improve_with(
    model: &Model,
    measurements: &Measurements<'_>,
    discover: Discover,
    work: &Work<'_>,
) -> Result<Improvement, FitError> {
    let mut state = State::new(model, discover);
    // The diagnosis of the next round, where it is known already.
    let mut known = None;
    let verdict = loop {
        let mut diagnosis = match known.take() {
            Some(diagnosis) => diagnosis,
            None => match state.diagnose(measurements, work) {
                // A step with which the free run diverges was none.
                Err(error) if error.is_divergence() && state.take_back() => {
                    break Conclusion::UnknownEffect;
                }
                done => done?,
            },
        };
        let round = state.diagnoses.len();
        let beside = work.in_round(round + 1);
        match pair(&diagnosis, round, measurements, state.aim(work), &beside) {
            Ok(None) => {}
            Ok(Some(pair)) => {
                diagnosis.lacks(&pair);
                state.diagnoses.push(diagnosis);
                state.step(pair.first, round, work);
                known = Some(pair.second);
                continue;
            }
            Err(Cancelled) => {
                state.diagnoses.push(diagnosis);
                break Conclusion::Cancelled;
            }
        }
        let next = worth_adding(&diagnosis, round, work.criteria());
        state.diagnoses.push(diagnosis);
        let (best, round) = match next {
            Ok(best) => (best, round),
            Err(verdict) => match state.set_aside(verdict, measurements, work) {
                Err(FitError::Cancelled(Cancelled)) => break Conclusion::Cancelled,
                better => match better? {
                    Some(better) => better,
                    None => break verdict,
                },
            },
        };
        match state.add(best, round, measurements, work) {
            Err(FitError::Cancelled(Cancelled)) => break Conclusion::Cancelled,
            // It is another name for what the model has, so nothing more is named.
            Ok(false) => break Conclusion::NothingMissing,
            Ok(true) => {}
            Err(error) => return Err(error),
        }
        known = match state.second_anew(round + 1, measurements, work) {
            Err(FitError::Cancelled(Cancelled)) => break Conclusion::Cancelled,
            found => found?,
        };
    };
    state.finish(verdict, measurements, work)
}

/// An improvement in progress.
struct State {
    present: Model,
    /// When an expression is a candidate.
    discover: Discover,
    /// What it was before each step, and its steps then. What a step changed in earlier ones goes with it.
    before: Vec<(Model, Vec<ImprovementStep>)>,
    steps: Vec<ImprovementStep>,
    diagnoses: Vec<Diagnosis>,
    /// Whether the last step changed earlier ones, so that its errors are not those of the present model.
    corrected: bool,
    /// What was tried in place of the present model, fitted, with its error.
    tried: Vec<(f64, Model)>,
    /// The present model fitted to all of the log, where that was done beside its diagnosis.
    fitted: Option<Fit>,
    /// The same, and no last step is to go.
    settled: Option<Fit>,
}

impl State {
    fn new(model: &Model, discover: Discover) -> Self {
        Self {
            present: model.clone(),
            discover,
            before: Vec::new(),
            steps: Vec::new(),
            diagnoses: Vec::new(),
            corrected: false,
            tried: Vec::new(),
            fitted: None,
            settled: None,
        }
    }

    /// Whether a fit looks for values with which the model needs no observer: not where it needed one in the last diagnosis.
    fn unaided(&self) -> Unaided {
        let observer = self.diagnoses.last().and_then(|d| d.observer.as_ref());
        Unaided::Sought.after(observer)
    }

    /// What the next diagnosis is for.
    fn aim(&self, work: &Work<'_>) -> Aim {
        let first = self.diagnoses.first().map(|d| d.nominal.nrmse);
        let worth = work.criteria().improve.worth;
        Aim {
            worth: first.map_or(0.0, |nrmse| worth * nrmse),
            discover: self.discover,
            force: true,
            unaided: self.unaided(),
            leaves: f64::INFINITY,
        }
    }

    /// Diagnoses the present model. The first diagnosis also fits it, and that fit is the first step.
    fn diagnose(
        &mut self,
        measurements: &Measurements<'_>,
        work: &Work<'_>,
    ) -> Result<Diagnosis, FitError> {
        let round = self.diagnoses.len();
        let aim = self.aim(work);
        let settings = FitSettings::default();
        let (unaided, silent) = (aim.unaided, work.silently());
        let last = || fit_for(&self.present, measurements, &settings, unaided, &silent);
        let (diagnosis, fitted) = rayon::join(
            || diagnose_for(&self.present, measurements, aim, &work.in_round(round)),
            || self.is_complete(work.criteria()).then(last),
        );
        let diagnosis = diagnosis?;
        self.measured(&diagnosis);
        self.fitted = fitted.and_then(Result::ok).filter(|fit| !fit.cancelled);
        if let Some(fitted) = &diagnosis.model
            && self.steps.is_empty()
        {
            self.steps.push(ImprovementStep {
                added: None,
                entries: None,
                round: Some(round),
                nrmse_fit: diagnosis.nominal_fit,
                nrmse_test: diagnosis.nominal.nrmse,
                twins: Vec::new(),
                still_open: Vec::new(),
            });
            self.present = fitted.clone();
        }
        Ok(diagnosis)
    }

    /// Gives a last step that came of the correction of another one, or corrected another one, the errors that the next diagnosis
    /// begins with.
    fn measured(&mut self, diagnosis: &Diagnosis) {
        let corrected = std::mem::take(&mut self.corrected);
        let last = self.steps.last_mut();
        if let Some(last) = last.filter(|step| step.round.is_none() || corrected) {
            last.nrmse_fit = diagnosis.nominal_fit;
            last.nrmse_test = diagnosis.nominal.nrmse;
        }
    }

    /// Whether the last step left hardly more than noise. Then the next diagnosis mostly finds nothing.
    fn is_complete(&self, criteria: &Criteria) -> bool {
        match (&self.steps[..], self.diagnoses.last()) {
            ([_, .., last], Some(diagnosis)) => {
                last.nrmse_test <= criteria.missing.complete * diagnosis.floor.nrmse
            }
            _ => false,
        }
    }

    /// Adds what the diagnosis of a `round` named.
    fn step(&mut self, best: Explanation, round: usize, work: &Work<'_>) {
        work.in_round(round).know(|| Finding::Added((&best).into()));
        let steps = self.steps.clone();
        let mut twins = best.indistinguishable_from;
        twins.insert(0, best.place.clone());
        self.steps.push(ImprovementStep {
            added: Some(best.place),
            entries: best.entries,
            round: Some(round),
            nrmse_fit: best.nrmse_fit,
            nrmse_test: best.nrmse,
            twins,
            still_open: Vec::new(),
        });
        let before = std::mem::replace(&mut self.present, best.model);
        self.before.push((before, steps));
        self.fitted = None;
    }

    /// Adds what the diagnosis of a `round` named, and corrects earlier steps where that changes them. Whether it stays.
    fn add(
        &mut self,
        best: Explanation,
        round: usize,
        measurements: &Measurements<'_>,
        work: &Work<'_>,
    ) -> Result<bool, FitError> {
        self.step(best, round, work);
        let added = self.present.clone();
        let tried = refine(
            &mut self.present,
            &mut self.steps,
            &self.diagnoses[..=round],
            measurements,
            &work.in_round(round),
        )?;
        let stays = tried.is_some();
        self.corrected = stays && !has_the_effects_of(&self.present, &added);
        self.tried = tried.unwrap_or_default();
        Ok(stays || !self.take_back())
    }

    /// Takes the second back of two steps that one was made into, where another effect that is worth adding does better. Then that
    /// diagnosis is the next one.
    fn second_anew(
        &mut self,
        round: usize,
        measurements: &Measurements<'_>,
        work: &Work<'_>,
    ) -> Result<Option<Diagnosis>, FitError> {
        let (aim, now) = (self.aim(work), work.in_round(round));
        let before = self.before.last().map_or(&[][..], |(_, steps)| steps);
        let found = second_anew(&self.present, &self.steps, before, aim, measurements, &now)?;
        let is_added = |d: &Diagnosis| worth_adding(d, round, work.criteria()).is_ok();
        let found = found.filter(|(_, _, diagnosis)| is_added(diagnosis));
        Ok(found.map(|(remain, without, diagnosis)| {
            self.steps.truncate(remain);
            (self.present, self.fitted) = (without, None);
            self.tried.clear();
            diagnosis
        }))
    }

    /// Says of each step what the data still cannot tell from its effect in the finished `model`.
    fn tell_open(
        &mut self,
        model: &Model,
        measurements: &Measurements<'_>,
        work: &Work<'_>,
    ) -> Result<(), FitError> {
        let (steps, tried) = (&self.steps, &self.tried);
        let open = still_open(model, steps, &self.diagnoses, tried, measurements, work)?;
        for (step, open) in self.steps.iter_mut().zip(open) {
            step.still_open = open;
        }
        Ok(())
    }

    /// The present model fitted to all of the log, without last steps that do not stay there.
    fn settled(
        &mut self,
        measurements: &Measurements<'_>,
        work: &Work<'_>,
    ) -> Result<Fit, FitError> {
        if let Some(settled) = self.settled.take() {
            return Ok(settled);
        }
        let settings = &FitSettings::default();
        let floor = self.diagnoses.last().map_or(0.0, |d| d.floor.nrmse);
        let mut present = loop {
            let known = self.fitted.take().map(Ok);
            match known.unwrap_or_else(|| {
                fit_for(&self.present, measurements, settings, self.unaided(), work)
            }) {
                Err(error) if error.is_divergence() && self.take_back() => {}
                done => break done?,
            }
        };
        loop {
            let goes = Goes::of(&present, &self.steps, floor, work.criteria());
            let Some(goes) = goes.filter(|_| !present.cancelled) else {
                return Ok(present);
            };
            let Some(without) = self.without_last(&present.model) else {
                return Ok(present);
            };
            let alone = fit_for(&without, measurements, settings, self.unaided(), work)?;
            if !goes.from(&present, &alone, work.criteria()) {
                return Ok(present);
            }
            if self.is_divided() {
                self.steps.pop();
                self.present = without;
            } else {
                self.take_back();
            }
            present = alone;
        }
    }

    /// Where something is still missing, takes the last step that stays back for what does better and was set aside for it. That and its round.
    fn set_aside(
        &mut self,
        verdict: Conclusion,
        measurements: &Measurements<'_>,
        work: &Work<'_>,
    ) -> Result<Option<(Explanation, usize)>, FitError> {
        let none = self.diagnoses.iter().all(|d| d.set_aside.is_none());
        if none || self.concluded(verdict, work) != Conclusion::UnknownEffect {
            return Ok(None);
        }
        let fit = self.settled(measurements, &work.silently())?;
        work.go_on()?;
        let last = self.steps.last();
        let better = last.and_then(|last| set_aside(&self.diagnoses, last, work.criteria()));
        let Some((better, round, diagnosis)) = better.filter(|_| self.take_back()) else {
            self.settled = Some(fit);
            return Ok(None);
        };
        self.diagnoses.splice(round.., [diagnosis]);
        Ok(Some((better, round)))
    }

    /// Whether the last step is the second of two that one was made into.
    fn is_divided(&self) -> bool {
        let before = self.before.last();
        let last = self.steps.last().filter(|last| last.round.is_none());
        last.is_some() && before.is_some_and(|(_, before)| before.len() + 1 < self.steps.len())
    }

    /// What there is without the last step; of two that one was made into, without the second of them in `model`.
    fn without_last(&self, model: &Model) -> Option<Model> {
        match self.steps.last().filter(|_| self.is_divided()) {
            Some(second) => without_step(model, second),
            None => Some(self.before.last()?.0.clone()),
        }
    }

    /// Takes back what the last round added. Whether there was something.
    fn take_back(&mut self) -> bool {
        let before = self.before.pop();
        before.is_some_and(|(without, steps)| {
            (self.present, self.steps) = (without, steps);
            self.fitted = None;
            true
        })
    }

    /// The verdict on the steps that remain: that nothing is missing was said with all of them.
    fn concluded(&self, verdict: Conclusion, work: &Work<'_>) -> Conclusion {
        let above_floor = work.criteria().missing.above_floor;
        match (verdict, self.steps.last(), self.diagnoses.last()) {
            (Conclusion::NothingMissing, Some(last), Some(diagnosis))
                if last.nrmse_test > above_floor * diagnosis.floor.nrmse =>
            {
                Conclusion::UnknownEffect
            }
            _ => verdict,
        }
    }

    /// Fits the best model to all of the log, and says what is still open; a cancelled one stays as it is.
    fn finish(
        mut self,
        verdict: Conclusion,
        measurements: &Measurements<'_>,
        work: &Work<'_>,
    ) -> Result<Improvement, FitError> {
        let (best, verdict) = match verdict {
            Conclusion::LogFaulty
            | Conclusion::DataInsufficient
            | Conclusion::NotFitted
            | Conclusion::Cancelled => (None, verdict),
            _ => match self.settled(measurements, &work.silently()) {
                Err(FitError::Cancelled(Cancelled)) => (None, Conclusion::Cancelled),
                Ok(fit) if fit.cancelled => (Some(fit), Conclusion::Cancelled),
                Err(error) => return Err(error),
                Ok(fit) => match self.tell_open(&fit.model, measurements, work) {
                    Err(FitError::Cancelled(Cancelled)) => (Some(fit), Conclusion::Cancelled),
                    Err(error) => return Err(error),
                    Ok(()) => (Some(fit), self.concluded(verdict, work)),
                },
            },
        };
        let best = match verdict {
            Conclusion::Cancelled => best.or_else(|| {
                let error = self.steps.last()?.nrmse_test;
                Some(Fit::cancelled(self.present, Method::OutputError, error, 0))
            }),
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

#[cfg(test)]
mod tests {
    use loopsight_plants as _;

    use super::*;

    #[test]
    fn a_step_that_leads_nowhere_is_taken_back() {
        let of = |gain: f64| {
            let text = format!("[plant.dc_axis]\nK_A = -2.0\nK_C = {gain}\n[log.measured.speed]\n");
            Model::from_toml("axis.toml", &text).unwrap().0
        };
        let step = ImprovementStep::at_shaft;
        let mut state = State::new(&of(8.0), Discover::Never);
        let with = |gain| {
            of(gain)
                .with_effect("coulomb_friction", &["shaft"])
                .unwrap()
        };
        state.steps = vec![step(None), step(Some("coulomb_friction"))];
        let before = std::mem::replace(&mut state.present, with(1e9));
        state.before = vec![(before, vec![step(None)])];
        // Of two that one was made into, the second goes alone.
        state.steps.push(step(Some("end_stop")));
        let both = with(8.0).with_effect("end_stop", &["shaft"]).unwrap();
        let left = |state: &State| state.without_last(&both).unwrap().effects.len();
        assert_eq!(left(&state), 0);
        state.steps[2].round = None;
        assert_eq!(left(&state), 1);
        assert!(state.take_back());
        assert_eq!((state.steps.len(), state.present.effects.len()), (1, 0));
        assert_eq!(state.present.values(), of(8.0).values());
        assert!(!state.take_back(), "the model as it is is no step");

        // What each had changed in an earlier step is as before.
        for name in ["lugre_friction", "coulomb_friction", "end_stop"] {
            let before = (state.present.clone(), state.steps.clone());
            state.before.push(before);
            state.present = of(8.0).with_effect(name, &["shaft"]).unwrap();
            state.steps = vec![step(None), step(Some(name)), step(Some("end_stop"))];
        }
        for name in ["coulomb_friction", "lugre_friction"] {
            assert!(state.take_back());
            assert_eq!(state.steps[1].added, step(Some(name)).added);
            assert_eq!(state.present.effects[0].meta.id, name);
        }
    }
}
