//! The channels at which an effect could be added to a model.

use loopsight_core::{Channel, EffectMeta, Place};
use loopsight_model::model::{Model, misfit};
use loopsight_model::sensor::Sensor;

use crate::equivalent::{equivalent, preferred};

/// Whether an effect at a channel is the same as one that the model has at an equivalent channel, or as another
/// candidate at an equivalent channel in the unit of an input.
pub(crate) fn has_another_name(model: &Model, meta: &'static EffectMeta, at: &[&str]) -> bool {
    let [id] = at else {
        return false;
    };
    let channels = || model.plant.channels.iter();
    let Some(channel) = channels().find(|c| c.id == *id) else {
        return false;
    };
    let has = |other: &Channel| {
        let mut effects = model.effects.iter().filter(|e| e.meta.id == meta.id);
        effects.any(|e| e.at.iter().any(|c| c.id == other.id))
    };
    // Where a part of the plant is tied because the log does not show it, an effort on the whole is one at its
    // inputs.
    let tied = !model.tied_names().is_empty();
    let same = |other: &Channel| {
        let efforts = [channel, other].map(|c| matches!(c.place, Place::Effort(_)));
        let whole = tied && efforts == [true; 2] && preferred(model, other, channel);
        whole || equivalent(model, channel, other)
    };
    channels()
        .filter(|other| misfit(other, meta).is_none() && same(other))
        .any(|other| has(other) || preferred(model, other, channel))
}

/// The part of the plant that an effect at the channels `at` acts on, if it is tied because the log does not show it.
pub(crate) fn unshown_part(model: &Model, at: &[&str]) -> Option<&'static str> {
    let mut parts = model.tied_parts();
    parts
        .find(|part| part.channels.iter().any(|channel| at.contains(channel)))
        .map(|part| part.what)
}

/// The sets of channels at which an effect is tried: each that it fits, and all of a family.
pub(crate) fn channel_sets(model: &Model, meta: &'static EffectMeta) -> Vec<Vec<&'static str>> {
    let fitting: Vec<&'static Channel> = model
        .plant
        .channels
        .iter()
        .filter(|c| misfit(c, meta).is_none() && is_seen(model, meta, c))
        .collect();
    let mut families: Vec<(&str, Vec<&'static Channel>)> = Vec::new();
    for channel in fitting {
        let family = channel.id.split('.').next().unwrap_or(channel.id);
        match families.iter_mut().find(|(name, _)| *name == family) {
            Some((_, members)) => members.push(channel),
            None => families.push((family, vec![channel])),
        }
    }
    // Parameters in the channel's unit mean the same at channels of one unit only.
    let in_unit_of_channel = meta.parameters.iter().any(|p| p.unit.contains("channel"));
    // Each place has a limit of its own.
    let limits = meta.parameters.iter().any(|p| p.limits.is_some());
    let mut sets = Vec::new();
    for (_, members) in families {
        let alike = members.len() > 1
            && !limits
            && (!in_unit_of_channel || members.iter().all(|c| c.unit == members[0].unit));
        if alike || meta.shared_only {
            sets.push(members.iter().map(|c| c.id).collect());
        }
        if !meta.shared_only {
            sets.extend(
                members
                    .iter()
                    .filter(|_| members.len() > 1 || !alike)
                    .map(|c| vec![c.id]),
            );
        }
    }
    sets
}

/// Whether what happens at a channel can show in what is measured.
fn is_seen(model: &Model, meta: &EffectMeta, channel: &Channel) -> bool {
    let Place::Output(index) = channel.place else {
        return true;
    };
    model.measured.iter().any(|m| {
        m.index == index
            // The model knows the present angle of an encoder, but not its past.
            || !meta.memory && matches!(&m.sensor, Sensor::EncoderCounts(encoder)
                if encoder.of.keys().any(|s| model.find_signal(s) == Ok(index)))
    })
}
