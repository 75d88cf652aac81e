//! Effects bound to the channels of a plant.

use std::collections::BTreeMap;

use crate::config::{ConfigError, PathSegment, TomlSource, nearest};
use crate::model::{Attached, ModelParameter, Origin, signal_index, signals};
use crate::registry::{EffectPart, ReadyEffect};
use loopsight_core::{Channel, EffectMeta, Place, PlantMeta, Role};

/// Binds the effect `part`, the `index`-th of the file, to its channels and adds its parameters.
pub(crate) fn attach(
    plant: &'static PlantMeta,
    part: &dyn EffectPart,
    index: usize,
    parameters: &mut Vec<ModelParameter>,
    source: &TomlSource,
    effects: &[Attached],
) -> Result<Attached, Box<ConfigError>> {
    let base: [PathSegment; 3] = ["effect".into(), index.into(), part.meta().id.into()];
    let (ready, at) = placed(plant, part, &base, source, effects)?;
    let given = ready.given.clone();
    let attached = bind(plant, ready, at, &base, parameters);
    // A limit that the file does not give is not there, and a fuller form is one that the file gives.
    let own = &mut parameters[attached.first_parameter..];
    for (parameter, given) in own.iter_mut().zip(given) {
        parameter.free &= given.is_some() || !parameter.declaration.is_there_where_given();
    }
    Ok(attached)
}

/// The effect `part`, whose table stands at `base`, with its channels; it has to fit them, beside the `effects` that
/// are there.
pub(crate) fn placed(
    plant: &'static PlantMeta,
    part: &dyn EffectPart,
    base: &[PathSegment],
    source: &TomlSource,
    effects: &[Attached],
) -> Result<(ReadyEffect, Vec<&'static Channel>), Box<ConfigError>> {
    let meta = part.meta();
    let path =
        |more: &[PathSegment]| -> Vec<PathSegment> { base.iter().chain(more).cloned().collect() };
    if part.at().is_empty() {
        let fitting = fitting_channels(plant, meta);
        return Err(source.error(
            base,
            &format!("`{}` needs `at`: the channels it acts on", meta.id),
            Some(format!(
                "channels of `{}` where it fits: {}",
                plant.id,
                fitting.join(", ")
            )),
        ));
    }
    let mut at = Vec::new();
    for (i, id) in part.at().iter().enumerate() {
        let channel = plant
            .channels
            .iter()
            .find(|c| c.id == id.as_str())
            .ok_or_else(|| {
                let ids: Vec<&str> = plant.channels.iter().map(|c| c.id).collect();
                source.error(
                    &path(&[part.at_key().into(), i.into()]),
                    &format!(
                        "the plant `{}` has no channel `{id}`, expected one of {}",
                        plant.id,
                        ids.join(", ")
                    ),
                    nearest(id, ids).map(|n| format!("did you mean `{n}`?")),
                )
            })?;
        at.push(channel);
    }
    let ready = part
        .ready(plant, &at)
        .map_err(|mistake| source.mistake(base, mistake))?;
    for (i, channel) in at.iter().enumerate() {
        if let Some(why) = misfit(channel, ready.meta) {
            let fitting = fitting_channels(plant, ready.meta);
            return Err(source.error(
                &path(&[part.at_key().into(), i.into()]),
                &format!("`{}` cannot act on `{}`: {why}", meta.id, channel.id),
                Some(format!("channels where it fits: {}", fitting.join(", "))),
            ));
        }
    }
    if let Some((other, channel)) = shifted_already(effects, ready.meta, &at) {
        return Err(source.error(
            &path(&[part.at_key().into()]),
            &format!(
                "`{}` cannot act on `{channel}`: `{other}` shifts that input in time already",
                meta.id
            ),
            Some("one time is enough: keep one of the two".to_owned()),
        ));
    }
    Ok((ready, at))
}

/// Binds an effect to channels that it fits; its table stands at `base`.
pub(crate) fn bind(
    plant: &'static PlantMeta,
    ready: ReadyEffect,
    at: Vec<&'static Channel>,
    base: &[PathSegment],
    parameters: &mut Vec<ModelParameter>,
) -> Attached {
    let meta = ready.meta;
    let first_parameter = parameters.len();
    let declared = meta
        .parameters
        .iter()
        .zip(ready.given.iter().zip(ready.paths));
    for (declaration, (given, path)) in declared {
        let (unit, size) = at.first().map_or_else(
            || (declaration.unit.to_owned(), 1.0),
            |channel| unit_at(declaration.unit, channel, plant),
        );
        let acts =
            declaration.sides.is_empty() || at.iter().any(|c| declaration.sides.contains(&c.side));
        parameters.push(ModelParameter {
            name: format!("{}.{}", meta.id, declaration.id),
            declaration,
            unit,
            value: given.or(declaration.default.map(|d| d * size)),
            origin: Origin::of(*given),
            free: declaration.estimated && acts,
            per_run: false,
            size,
            path: base.iter().cloned().chain(path).collect(),
        });
    }
    let reads = at.iter().map(|channel| {
        let mut bound = [None; Role::COUNT];
        for role in meta.reads {
            bound[*role as usize] = channel.read(*role).and_then(|s| signal_index(plant, s));
        }
        bound
    });
    Attached {
        meta,
        reads: reads.collect(),
        at,
        first_parameter,
        physics: ready.physics,
        signals: ready.signals,
    }
}

/// The unit of an effect's parameter at a channel, and what 1 of its default and scale is there:
/// `channel`, `flow`, `position` and `head` are filled in.
///
/// `channel/flow^2` at a wheel is `V/(rad/s)^2`. Where a channel has no position, it is what the flow goes through in time.
pub fn unit_at(unit: &str, channel: &Channel, plant: &'static PlantMeta) -> (String, f64) {
    let read = |role| {
        let index = channel.read(role).and_then(|id| signal_index(plant, id));
        index.and_then(|i| signals(plant).nth(i))
    };
    let none = || ("1".to_owned(), 1.0);
    let signal = |role| read(role).map_or_else(none, |s| (s.unit.to_owned(), s.size));
    let position = || match (read(Role::Position), read(Role::Flow)) {
        (None, Some(flow)) => {
            let way = flow.unit.strip_suffix("/s").map(str::to_owned);
            (way.unwrap_or_else(|| format!("{} s", flow.unit)), flow.size)
        }
        _ => signal(Role::Position),
    };
    let mut filled = unit.to_owned();
    let mut total = 1.0;
    for (word, (unit_here, size)) in [
        ("channel", (channel.unit.to_owned(), channel.size)),
        ("flow", signal(Role::Flow)),
        ("position", position()),
        ("head", signal(Role::Head)),
    ] {
        let Some((before, after)) = unit.split_once(word) else {
            continue;
        };
        let power: i32 = after
            .strip_prefix('^')
            .and_then(|p| p.split([' ', '/']).next()?.parse().ok())
            .unwrap_or(1);
        let divides = before.ends_with('/');
        total *= size.powi(if divides { -power } else { power });
        let alone = !unit_here.contains(['/', ' ']) || (before.is_empty() && power == 1);
        filled = if alone {
            filled.replace(word, &unit_here)
        } else {
            filled.replace(word, &format!("({unit_here})"))
        };
    }
    (filled, total)
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
    if effect.sided && channel.side == 0 {
        return Some("it acts oppositely on two sides, and this channel has none".to_owned());
    }
    if let Some(role) = effect
        .yields_to
        .iter()
        .find(|r| channel.read(**r).is_some())
    {
        return Some(format!(
            "where there is a {} it is said more precisely without it",
            role.name()
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

/// The first of `effects` that shifts an input in time which an effect with memory at the channels `at` would shift as
/// well, and that input. Both would take the command as it was logged, and the second would undo the first.
pub(crate) fn shifted_already(
    effects: &[Attached],
    meta: &EffectMeta,
    at: &[&'static Channel],
) -> Option<(&'static str, &'static str)> {
    let shifts = |effect: &&Attached| meta.memory && effect.meta.memory;
    effects.iter().filter(shifts).find_map(|effect| {
        let here = |c: &&&Channel| {
            matches!(c.place, Place::Input(_)) && effect.at.iter().any(|other| other.id == c.id)
        };
        at.iter().find(here).map(|c| (effect.meta.id, c.id))
    })
}

/// The channels of a plant that an effect can act on.
pub fn fitting_channels(plant: &PlantMeta, effect: &EffectMeta) -> Vec<&'static str> {
    plant
        .channels
        .iter()
        .filter(|c| misfit(c, effect).is_none())
        .map(|c| c.id)
        .collect()
}

/// Two instances of one effect are told apart by their channels.
pub(crate) fn make_names_unique(parameters: &mut [ModelParameter], effects: &[Attached]) {
    let mut count: BTreeMap<&str, usize> = BTreeMap::new();
    for effect in effects {
        *count.entry(effect.meta.id).or_default() += 1;
    }
    for effect in effects {
        let channels: Vec<&str> = effect.at.iter().map(|c| c.id).collect();
        let alone = count.get(effect.meta.id) == Some(&1);
        for (i, declaration) in effect.meta.parameters.iter().enumerate() {
            parameters[effect.first_parameter + i].name = if alone {
                format!("{}.{}", effect.meta.id, declaration.id)
            } else {
                format!(
                    "{}@{}.{}",
                    effect.meta.id,
                    channels.join("+"),
                    declaration.id
                )
            };
        }
    }
}
