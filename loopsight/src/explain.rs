//! Explanations of parts and of the tables of a model file.

mod tables;

use loopsight_core::{EffectMeta, Parameter, PlantMeta, Signal};
use loopsight_model::config::nearest;
use loopsight_model::model::{fitting_channels, misfit};
use loopsight_model::registry::{self, PartMeta, range_text};

use crate::answers::{
    ExplainAnswer, Explained, ExplainedChannel, ExplainedDerived, ExplainedHome,
    ExplainedParameter, ExplainedSet, ExplainedSignal,
};
use crate::error::{Error, Result};

/// Explains a plant, an effect, an estimator, a controller or a driver by its id: equation, parameters,
/// channels, reference, example. `log`, `fit` and `simulation` are the tables of a model file, with their keys. The role
/// may stand before the id, as in the file: of the two parts `expression`, `effect.expression` is the effect.
///
/// ```
/// let answer = loopsight::explain("coulomb_friction")?;
/// assert_eq!(answer.parts[0].role, "effect");
/// assert_eq!(answer.parts[0].parameters[0].id, "level");
/// let own = loopsight::explain("effect.expression")?;
/// assert_eq!((own.parts.len(), own.parts[0].role), (1, "effect"));
/// assert!(loopsight::explain("plant.coulomb_friction").is_err());
/// # Ok::<(), loopsight::Error>(())
/// ```
///
/// # Errors
///
/// Nothing has this id; the nearest one is named.
pub fn explain(id: &str) -> Result<ExplainAnswer> {
    let plants = registry::plants();
    let effects = registry::effects();
    let parts = registry::parts();
    if let Some(meta) = plants.iter().find(|m| m.id == id) {
        return Ok(ExplainAnswer::new(vec![plant(meta)]));
    }
    if let Some(meta) = effects.iter().find(|m| m.id == id) {
        return Ok(ExplainAnswer::new(vec![effect(meta)]));
    }
    if let Some(meta) = parts.iter().find(|m| m.id == id) {
        return Ok(ExplainAnswer::new(vec![part(meta)]));
    }
    // What a model file itself can define: a plant and an effect share their id.
    let written = registry::written();
    let found: Vec<Explained> = written
        .iter()
        .filter(|m| m.id == id)
        .map(|m| part(m))
        .collect();
    if !found.is_empty() {
        return Ok(ExplainAnswer::new(found));
    }
    if let Some(meta) = tables::TABLES.iter().find(|m| m.id == id) {
        return Ok(ExplainAnswer::new(vec![part(meta)]));
    }
    if let Some((role, id)) = id.split_once('.')
        && !id.contains('.')
        && let Ok(ExplainAnswer { parts, .. }) = explain(id)
    {
        let found: Vec<Explained> = parts.into_iter().filter(|p| p.role == role).collect();
        if !found.is_empty() {
            return Ok(ExplainAnswer::new(found));
        }
    }
    let mut ids: Vec<&str> = plants.iter().map(|m| m.id).collect();
    ids.extend(effects.iter().map(|m| m.id));
    ids.extend(parts.iter().map(|m| m.id));
    ids.push(written[0].id);
    ids.extend(tables::TABLES.iter().map(|m| m.id));
    let mut message = format!("nothing has the id `{id}`");
    match nearest(id, ids.iter().copied()) {
        Some(near) => message.push_str(&format!("; did you mean `{near}`?")),
        None => message.push_str(&format!("; known are {}", ids.join(", "))),
    }
    Err(Error::request(message))
}

fn parameters(list: &'static [Parameter]) -> Vec<ExplainedParameter> {
    let of = |p: &'static Parameter| ExplainedParameter {
        id: p.id,
        symbol: p.symbol,
        unit: p.unit,
        doc: p.doc,
        default: p.default,
        estimated: p.estimated,
        range: range_text(p),
    };
    list.iter().map(of).collect()
}

fn signals(list: &'static [Signal]) -> Vec<ExplainedSignal> {
    let of = |s: &'static Signal| ExplainedSignal {
        id: s.id,
        symbol: s.symbol,
        unit: s.unit,
        doc: s.doc,
    };
    list.iter().map(of).collect()
}

fn plant(meta: &'static PlantMeta) -> Explained {
    let effects = registry::effects();
    let fitting = |channel: &loopsight_core::Channel| -> Vec<&'static str> {
        let fit = effects.iter().filter(|e| misfit(channel, e).is_none());
        fit.map(|e| e.id).collect()
    };
    let channels = meta.channels.iter().map(|c| ExplainedChannel {
        id: c.id,
        place: c.place.kind().name(),
        unit: c.unit,
        equation: c.equation,
        effects: fitting(c),
    });
    let sets = meta.parameterizations.iter().map(|set| ExplainedSet {
        id: set.id,
        summary: set.summary,
        parameters: parameters(set.parameters),
    });
    let derived = registry::derived(meta.id);
    let derived = derived.iter().map(|d| ExplainedDerived {
        id: d.id,
        unit: d.unit,
        equation: d.equation,
        doc: d.doc,
    });
    Explained {
        assumptions: Some(meta.assumptions),
        states: signals(meta.states),
        inputs: signals(meta.inputs),
        outputs: signals(meta.outputs),
        parameters: parameters(meta.parameters),
        parameterizations: sets.collect(),
        derived: derived.collect(),
        channels: channels.collect(),
        ..Explained::new(
            "plant",
            [
                meta.id,
                meta.summary,
                meta.equation,
                meta.reference,
                meta.example,
            ],
        )
    }
}

fn effect(meta: &'static EffectMeta) -> Explained {
    let homes = registry::plants();
    let homes = homes.iter().map(|p| ExplainedHome {
        plant: p.id,
        channels: fitting_channels(p, meta),
    });
    Explained {
        symptom: Some(meta.symptom),
        remedy: Some(meta.remedy),
        parameters: parameters(meta.parameters),
        attaches_to: homes.filter(|home| !home.channels.is_empty()).collect(),
        ..Explained::new(
            "effect",
            [
                meta.id,
                meta.summary,
                meta.equation,
                meta.reference,
                meta.example,
            ],
        )
    }
}

fn part(meta: &'static PartMeta) -> Explained {
    let settings = meta.settings.iter().map(|s| ExplainedSignal {
        id: s.id,
        symbol: "",
        unit: s.unit,
        doc: s.doc,
    });
    Explained {
        settings: settings.collect(),
        ..Explained::new(
            meta.role,
            [
                meta.id,
                meta.summary,
                meta.equation,
                meta.reference,
                meta.example,
            ],
        )
    }
}
