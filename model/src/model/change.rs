//! A composed model with effects added, replaced or removed.

use loopsight_core::Channel;
use serde::Deserialize;

use super::{Attached, Model, ModelParameter};
use crate::attach::{attach, bind, make_names_unique, misfit, shifted_already};
use crate::config::{ConfigError, PathSegment, TomlSource};
use crate::expression::EFFECT_PART;
use crate::registry::{self, EffectPart};

/// `[[effect]]` entries alone.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Entries {
    effect: Vec<Box<dyn EffectPart>>,
}

impl Model {
    /// The model with the effect `id` added at the channels `at`: one of the library with its default
    /// parameters and in its usual form, or a [candidate](Self::candidates) of the file with those that it gives. `None` when there is no such
    /// effect or it does not fit one of the channels.
    pub fn with_effect(&self, id: &str, at: &[&str]) -> Option<Model> {
        let own = self.candidates.iter().find(|c| c.is(id, at));
        let part = if own.is_some() { EFFECT_PART.id } else { id };
        let ready = match own {
            Some(proposed) => proposed.ready.clone(),
            None => registry::effect(id)?,
        };
        let channels: Option<Vec<&'static Channel>> = at
            .iter()
            .map(|name| self.plant.channels.iter().find(|c| c.id == *name))
            .collect();
        let channels = channels?;
        let fits = |c: &&'static Channel| misfit(c, ready.meta).is_none();
        let shifted = shifted_already(&self.effects, ready.meta, &channels).is_some();
        if channels.is_empty() || shifted || !channels.iter().all(fits) {
            return None;
        }
        let mut model = self.clone();
        let base: [PathSegment; 3] = ["effect".into(), model.effects.len().into(), part.into()];
        let attached = bind(self.plant, ready, channels, &base, &mut model.parameters);
        for parameter in &mut model.parameters[attached.first_parameter..] {
            parameter.free &= !parameter.declaration.further;
        }
        model.scale_times_from(attached.first_parameter);
        model.effects.push(attached);
        make_names_unique(&mut model.parameters, &model.effects);
        model.hold_unshown();
        Some(model)
    }

    /// The model with the effects of `[[effect]]` entries added; `entries` is their TOML.
    ///
    /// # Errors
    ///
    /// [`ConfigError`] where the text has anything else, or an effect that does not fit the plant.
    pub fn with_entries(&self, entries: &str) -> Result<Model, Box<ConfigError>> {
        let source = TomlSource::parse("the added effects", entries)?;
        let parsed: Entries = source.read()?;
        let mut model = self.clone();
        for (index, part) in parsed.effect.iter().enumerate() {
            let first = model.parameters.len();
            let parameters = &mut model.parameters;
            let attached = attach(
                self.plant,
                part.as_ref(),
                index,
                parameters,
                &source,
                &model.effects,
            )?;
            // They stand behind the effects that the model has.
            for parameter in &mut model.parameters[first..] {
                if let Some(place) = parameter.path.get_mut(1) {
                    *place = model.effects.len().into();
                }
            }
            model.effects.push(attached);
        }
        make_names_unique(&mut model.parameters, &model.effects);
        Ok(model)
    }

    /// The model with its `index`-th effect replaced by the effect `id` at the channels `at`;
    /// parameters of the same name keep their values, and where they are from.
    pub fn with_effect_replaced(&self, index: usize, id: &str, at: &[&str]) -> Option<Model> {
        self.with_effect_changed(index, |model, old| {
            let first = model.parameters.len();
            let mut model = model.with_effect(id, at)?;
            for new in &mut model.parameters[first..] {
                if let Some(from) = old.iter().find(|p| p.declaration.id == new.declaration.id) {
                    new.value = from.value;
                    new.free = from.free;
                    new.origin = from.origin;
                }
            }
            Some(model)
        })
    }

    /// The model without its `index`-th effect.
    pub fn without_effect(&self, index: usize) -> Option<Model> {
        self.with_effect_changed(index, |model, _| Some(model))
    }

    /// The model with what `change` makes, in the place of its `index`-th effect, of the model up to
    /// there and the effect's parameters.
    fn with_effect_changed(
        &self,
        index: usize,
        change: impl Fn(Model, &[ModelParameter]) -> Option<Model>,
    ) -> Option<Model> {
        self.effects.get(index)?;
        let mut model = self.clone();
        model.effects.clear();
        model.parameters.truncate(self.n_plant_parameters);
        for (k, effect) in self.effects.iter().enumerate() {
            let own = &self.parameters[effect.own()];
            if k == index {
                model = change(model, own)?;
            } else {
                model.keep(effect, own);
            }
        }
        make_names_unique(&mut model.parameters, &model.effects);
        Some(model)
    }

    /// Takes an effect of another model over, with its parameters.
    fn keep(&mut self, effect: &Attached, own: &[ModelParameter]) {
        let mut kept = effect.clone();
        kept.first_parameter = self.parameters.len();
        self.parameters.extend_from_slice(own);
        self.effects.push(kept);
    }
}
