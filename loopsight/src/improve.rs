//! Improving a model: diagnose, add the missing effect, refit, until nothing more is missing.

use loopsight_diagnosis::{
    CompareError, ImproveSettings, Improvement, ImprovementStep, Measurements, Work, compare,
    improve,
};
use loopsight_model::config::{PathSegment, TomlSource};
use loopsight_model::model::{Model as Composed, ModelParameter, Origin};

use crate::answers::{ImproveAnswer, Reported};
use crate::error::Result;
use crate::model::Model;
use crate::session::{Data, Session};
use crate::watch::{Watch, heard, watched};

/// How a model is improved.
#[derive(Clone, Debug, Default)]
#[non_exhaustive]
pub struct ImproveOptions {
    /// Whether, where no effect of the library explains the rest, an expression for the missing force is added as an
    /// effect of the model file's own; by default it is only shown.
    pub discover: bool,
    /// Whether the answer has the series of numbers, sample by sample; by default it has not.
    pub series: bool,
    /// Who gets the progress, and what stops the work.
    pub watch: Watch,
}

watched!(ImproveOptions);
heard!(ImproveOptions);

impl ImproveOptions {
    /// Whether an expression is added where no effect of the library explains the rest.
    #[must_use]
    pub fn discover(mut self, discover: bool) -> Self {
        self.discover = discover;
        self
    }

    /// Whether the answer has the series of numbers, sample by sample.
    #[must_use]
    pub fn series(mut self, series: bool) -> Self {
        self.series = series;
        self
    }
}

impl Session {
    /// Repeats [`diagnose`](Session::diagnose), adds what is missing and refits, until nothing more is
    /// missing. The answer has the model that came of it.
    ///
    /// # Errors
    ///
    /// As [`Session::diagnose`].
    pub fn improve(&self, options: &ImproveOptions) -> Result<ImproveAnswer> {
        let data = self.data()?;
        let work = options.watch.work();
        let settings = ImproveSettings {
            discover: options.discover,
        };
        let engine = improve(&data.model, &data.measurements(), &settings, &work)?;
        let model = match &engine.best {
            Some(best) => {
                let source = self.model.source()?;
                let text = improved_text(&source, &data.model, &best.model, &engine.steps);
                Some(Model::from_toml(&self.model.file, &text)?)
            }
            None => None,
        };
        let reported = reported(&engine, data, &work)?;
        Ok(ImproveAnswer::new(
            engine,
            model,
            reported,
            self.about(data),
            data.shown(),
            options.series,
        ))
    }
}

/// The error of the best model on the log that is left for it; none where there is none, or the work was cancelled.
fn reported(engine: &Improvement, data: &Data, work: &Work<'_>) -> Result<Option<Reported>> {
    let (Some(best), Some((log, runs))) = (&engine.best, &data.report) else {
        return Ok(None);
    };
    match compare(&best.model, &Measurements::new(runs), work) {
        Err(CompareError::Cancelled(_)) => Ok(None),
        found => Ok(Some(Reported::new(log, &found?))),
    }
}

/// The text of a model with exactly the effects of `best` and all fitted values. `steps` have the entries of effects
/// that the library does not have.
fn improved_text(
    source: &TomlSource,
    before: &Composed,
    best: &Composed,
    steps: &[ImprovementStep],
) -> String {
    let mut text = source.text.clone();
    let mut edit = |change: &dyn Fn(&TomlSource) -> String| {
        if let Ok(present) = TomlSource::parse(&source.file, &text) {
            text = change(&present);
        }
    };
    for (index, effect) in before.effects.iter().enumerate().rev() {
        if !best.effects.iter().any(|e| e.is_same(effect)) {
            edit(&|present| present.without_effect(index));
        }
    }
    let mut written: Vec<&str> = Vec::new();
    for effect in &best.effects {
        if before.effects.iter().any(|e| e.is_same(effect)) {
            continue;
        }
        let id = effect.meta.id;
        let named = |step: &&ImprovementStep| step.added.as_ref().is_some_and(|a| a.effect == id);
        if let Some(entries) = steps.iter().find(named).and_then(|s| s.entries.as_deref()) {
            // One for all of its channels, or one for each: written at the first of them.
            if !written.contains(&id) {
                edit(&|present| present.with_entries(entries));
                written.push(id);
            }
            continue;
        }
        if before.candidates.iter().any(|c| c.meta().id == id) {
            edit(&|present| present.with_candidate(id));
            continue;
        }
        let at: Vec<&str> = effect.at.iter().map(|c| c.id).collect();
        let own = best.parameters.iter().skip(effect.first_parameter);
        let parameters: Vec<(&str, f64)> = own
            .zip(effect.meta.parameters)
            // A limit that was not found is not there, nor is a fuller form.
            .filter(|(parameter, declaration)| {
                parameter.free || !declaration.is_there_where_given()
            })
            .filter_map(|(parameter, declaration)| Some((declaration.id, parameter.value?)))
            .collect();
        edit(&|present| present.with_effect(effect.meta.id, &at, &parameters));
    }
    // Where they stand now.
    let Ok((model, present)) = Composed::from_toml(&source.file, &text) else {
        return text;
    };
    let mut pairs: Vec<(&ModelParameter, &ModelParameter)> = Vec::new();
    let n = |m: &Composed| {
        m.effects
            .first()
            .map_or(m.parameters.len(), |e| e.first_parameter)
    };
    let plant = model.parameters.iter().take(n(&model));
    pairs.extend(plant.zip(best.parameters.iter().take(n(best))));
    for effect in &model.effects {
        if let Some(found) = best.effects.iter().find(|e| e.is_same(effect)) {
            let to = model.parameters.iter().skip(effect.first_parameter);
            let from = best.parameters.iter().skip(found.first_parameter);
            pairs.extend(to.zip(from).take(effect.meta.parameters.len()));
        }
    }
    let is_tied = best.tied_names();
    let values: Vec<(Vec<PathSegment>, f64)> = pairs
        .into_iter()
        .filter(|(_, from)| {
            let tied = is_tied.contains(&from.name.as_str());
            from.free || from.per_run || tied || from.origin == Origin::Log
        })
        .filter_map(|(to, from)| Some((to.path.clone(), from.value?)))
        .collect();
    let text = present.with_values(&values);
    match TomlSource::parse(&source.file, &text) {
        Ok(valued) if !is_tied.is_empty() => valued.with_tied(&is_tied),
        _ => text,
    }
}
