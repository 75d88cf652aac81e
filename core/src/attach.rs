//! Effects bound to the channels of a plant.

use std::collections::BTreeMap;

use crate::config::{ConfigError, Source, Step, nearest};
use crate::model::{Attached, ModelParameter, signal_index};
use crate::registry::EffectPart;
use crate::{Channel, EffectMeta, PlantMeta, Role};

/// Binds the effect `part`, the `index`-th of the file, to its channels and adds its parameters.
pub(crate) fn attach(
    plant: &'static PlantMeta,
    part: &dyn EffectPart,
    index: usize,
    parameters: &mut Vec<ModelParameter>,
    source: &Source,
) -> Result<Attached, Box<ConfigError>> {
    let meta = part.meta();
    let base: Vec<Step> = vec!["effect".into(), index.into(), meta.id.into()];
    let path = |more: &[Step]| -> Vec<Step> { base.iter().chain(more).cloned().collect() };
    if part.at().is_empty() {
        let fitting = fitting_channels(plant, meta);
        return Err(source.error(
            &base,
            &format!("`{}` needs `at`: the channels it acts on", meta.id),
            Some(format!(
                "channels of `{}` where it fits: {}",
                plant.id,
                fitting.join(", ")
            )),
        ));
    }
    let mut at = Vec::new();
    let mut reads = Vec::new();
    for (i, id) in part.at().iter().enumerate() {
        let channel = plant
            .channels
            .iter()
            .find(|c| c.id == id.as_str())
            .ok_or_else(|| {
                let ids: Vec<&str> = plant.channels.iter().map(|c| c.id).collect();
                source.error(
                    &path(&["at".into(), i.into()]),
                    &format!(
                        "the plant `{}` has no channel `{id}`, expected one of {}",
                        plant.id,
                        ids.join(", ")
                    ),
                    nearest(id, ids).map(|n| format!("did you mean `{n}`?")),
                )
            })?;
        if let Some(why) = misfit(channel, meta) {
            let fitting = fitting_channels(plant, meta);
            return Err(source.error(
                &path(&["at".into(), i.into()]),
                &format!("`{}` cannot act on `{id}`: {why}", meta.id),
                Some(format!("channels where it fits: {}", fitting.join(", "))),
            ));
        }
        let mut bound = [None; Role::COUNT];
        for role in meta.reads {
            bound[*role as usize] = channel.read(*role).and_then(|s| signal_index(plant, s));
        }
        at.push(channel);
        reads.push(bound);
    }
    let first_parameter = parameters.len();
    for (declaration, given) in meta.parameters.iter().zip(&part.values().given) {
        parameters.push(ModelParameter {
            name: format!("{}.{}", meta.id, declaration.id),
            declaration,
            unit: declaration
                .unit
                .replace("channel", at.first().map_or("1", |c| c.unit)),
            value: given.or(declaration.default),
            free: declaration.estimated,
            path: path(&[declaration.id.into()]),
        });
    }
    Ok(Attached {
        meta,
        at,
        first_parameter,
        physics: part.physics(),
        reads,
    })
}

/// Why an effect cannot act on a channel; `None` when it can.
pub fn misfit(channel: &Channel, effect: &EffectMeta) -> Option<String> {
    let kind = channel.place.kind();
    if !effect.places.contains(&kind) {
        let kinds: Vec<&str> = effect.places.iter().map(|p| p.name()).collect();
        return Some(format!(
            "it is a place of kind `{}`, expected `{}`",
            kind.name(),
            kinds.join("` or `")
        ));
    }
    effect
        .reads
        .iter()
        .find(|role| channel.read(**role).is_none())
        .map(|role| {
            format!(
                "the effect reads the {}, which this channel does not offer",
                role.name()
            )
        })
}

fn fitting_channels(plant: &PlantMeta, effect: &EffectMeta) -> Vec<&'static str> {
    plant
        .channels
        .iter()
        .filter(|c| misfit(c, effect).is_none())
        .map(|c| c.id)
        .collect()
}

/// Two instances of one effect are told apart by their channels.
pub(crate) fn make_names_unique(
    parameters: &mut [ModelParameter],
    effects: &[Attached],
    first: usize,
) {
    let mut count: BTreeMap<String, usize> = BTreeMap::new();
    for parameter in &parameters[first..] {
        *count.entry(parameter.name.clone()).or_default() += 1;
    }
    for effect in effects {
        for (i, declaration) in effect.meta.parameters.iter().enumerate() {
            let parameter = &mut parameters[effect.first_parameter + i];
            if count.get(&parameter.name).copied().unwrap_or(0) > 1 {
                let channels: Vec<&str> = effect.at.iter().map(|c| c.id).collect();
                parameter.name = format!(
                    "{}@{}.{}",
                    effect.meta.id,
                    channels.join("+"),
                    declaration.id
                );
            }
        }
    }
}
