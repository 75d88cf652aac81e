//! `[[candidate]]`: effects of a model file's own that are not in the model, and that a diagnosis tries.

use loopsight_core::{Channel, EffectMeta, PlantMeta};

use super::Attached;
use crate::attach::placed;
use crate::config::{ConfigError, PathSegment, TomlSource};
use crate::expression::EFFECT_PART;
use crate::registry::{EffectPart, ReadyEffect};

/// An effect that a model file proposes.
#[derive(Clone)]
pub struct Proposed {
    /// The channels it acts on, all with the same parameters.
    pub at: Vec<&'static Channel>,
    pub(crate) ready: ReadyEffect,
}

impl Proposed {
    /// What it is.
    pub fn meta(&self) -> &'static EffectMeta {
        self.ready.meta
    }

    /// The name of each parameter with the value that the file gives: where a fit begins.
    pub fn given(&self) -> impl Iterator<Item = (&'static str, Option<f64>)> + '_ {
        let ids = self.ready.meta.parameters.iter().map(|p| p.id);
        ids.zip(self.ready.given.iter().copied())
    }

    /// Whether it is the effect `id` at the channels `at`.
    pub(super) fn is(&self, id: &str, at: &[&str]) -> bool {
        self.ready.meta.id == id && self.at.iter().map(|c| c.id).eq(at.iter().copied())
    }
}

/// The candidates of a file, beside the `effects` of its model.
pub(super) fn proposed(
    plant: &'static PlantMeta,
    parts: &[Box<dyn EffectPart>],
    effects: &[Attached],
    source: &TomlSource,
) -> Result<Vec<Proposed>, Box<ConfigError>> {
    let mut all: Vec<Proposed> = Vec::new();
    for (index, part) in parts.iter().enumerate() {
        let id = part.meta().id;
        let base: [PathSegment; 3] = ["candidate".into(), index.into(), id.into()];
        if id != EFFECT_PART.id {
            return Err(source.error(
                &base,
                &format!(
                    "`{id}` is an effect of the library, expected `{}`",
                    EFFECT_PART.id
                ),
                Some("a diagnosis tries every effect of the library without being told".to_owned()),
            ));
        }
        let (ready, at) = placed(plant, part.as_ref(), &base, source, effects)?;
        let name = ready.meta.id;
        let below = |more: &[PathSegment]| [&base[..], more].concat();
        if name == EFFECT_PART.id {
            let message =
                "a candidate needs a `name`: reports and the model that has it call it so";
            return Err(source.error(&base, message, None));
        }
        if all.iter().any(|other| other.meta().id == name) {
            let message = format!("`{name}` is the name of another candidate");
            return Err(source.error(&below(&["name".into()]), &message, None));
        }
        let declared = ready.meta.parameters.iter();
        for ((parameter, given), path) in declared.zip(&ready.given).zip(&ready.paths) {
            let found = parameter.linear && parameter.estimated;
            if given.is_none() && !found {
                let message = format!(
                    "`{}` has no value: a fit has to begin somewhere",
                    parameter.id
                );
                return Err(source.error(&below(path), &message, None));
            }
        }
        all.push(Proposed { at, ready });
    }
    Ok(all)
}
