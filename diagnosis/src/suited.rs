//! An effect of a model, suited to a recording: widths of signs, references, how fast and how far its channels move.

use loopsight_core::{Parameter, Place, Role};
use loopsight_model::model::{Attached, Model, Origin, unit_at};

use crate::commands::Commands;
use crate::ends::{Ends, limited};

/// Sets the smoothing width of the last effect of `model` to `sign_width` times the flow in the recording, and
/// what its sizes refer to: root mean squares `rms` of the signals, and the largest `commands`. Returns the root
/// mean square of the flow at its channels.
pub(crate) fn suit(model: &mut Model, rms: &[f64], commands: &Commands, sign_width: f64) -> f64 {
    let flow = last_rms(model, Role::Flow, rms);
    smooth(model, 1, sign_width * flow);
    refer(model, rms, &commands.largest);
    scale_efforts(model, commands);
    flow
}

/// Share of the largest command that is the least size of an effort: of 100 V that is the volt which plants declare.
const LEAST: f64 = 0.01;

/// Takes the size of the efforts of the effects of `model` from its commands, where what the plant declares for their channel is
/// more than the largest of these, or hardly a part of it. A mirror that a coil turns has no friction of 0.3 N m, and a press
/// that pushes with 100 kN has more than 0.3 N.
pub(crate) fn scale_efforts(model: &mut Model, commands: &Commands) {
    for k in 0..model.effects.len() {
        let effect = &model.effects[k];
        let own = effect.own();
        let channel = effect.at.first().copied();
        let effort = channel.filter(|c| matches!(c.place, Place::Effort(_)));
        let Some(channel) = effort else { continue };
        let command = commands.at(model, channel);
        let Some(command) = command.filter(|c| c.is_normal()) else {
            continue;
        };
        let size = channel.size.clamp(LEAST * command, command);
        let plant = model.plant;
        for parameter in &mut model.parameters[own] {
            let unit = parameter.declaration.unit;
            if unit.starts_with("channel") {
                parameter.size = unit_at(unit, channel, plant).1 * size / channel.size;
            }
        }
    }
}

/// Sets what the last effect of `model` refers its commands to, to two digits: the root mean square of the recording's,
/// where the plant's gain keeps its value and depends least on the effect, or the largest of them where no command can be
/// above it.
fn refer(model: &mut Model, rms: &[f64], largest: &[f64]) {
    let Some(effect) = model.effects.last() else {
        return;
    };
    let inputs = effect.at.iter().filter_map(|c| match c.place {
        Place::Input(i) => Some(i),
        _ => None,
    });
    let mut sizes = [0.0f64; 2];
    for i in inputs {
        let signal = (model.plant.inputs.get(i)).and_then(|input| model.find_signal(input.id).ok());
        let rms = signal.and_then(|signal| rms.get(signal));
        for (size, of) in sizes.iter_mut().zip([rms, largest.get(i)]) {
            *size = size.max(of.copied().unwrap_or(0.0));
        }
    }
    let first = effect.first_parameter;
    let references: Vec<(usize, f64)> = (effect.meta.parameters.iter().enumerate())
        .filter(|(_, declaration)| is_reference(declaration))
        .map(|(i, declaration)| (first + i, sizes[usize::from(declaration.bounds_channel)]))
        .filter(|(_, size)| size.is_normal())
        .collect();
    for (i, size) in references {
        model.parameters[i].value = format!("{size:.1e}").parse().ok();
    }
}

/// Whether a parameter is a value of the channel that the effect refers to, and no fit finds. Something is divided by
/// it, so it cannot be zero; a threshold can.
fn is_reference(declaration: &Parameter) -> bool {
    declaration.unit == "channel" && !declaration.estimated && !declaration.admits(0.0)
}

/// Root mean square of a signal, by its role, at the channels of the last effect; 0 where there is none.
pub(crate) fn last_rms(model: &Model, role: Role, rms: &[f64]) -> f64 {
    let last = model.effects.last();
    last.map_or(0.0, |effect| role_rms(model, effect, role, rms))
}

/// Where the position (or head) at the channels of the last effect ends; none where nothing limits it.
pub(crate) fn last_ends(model: &Model, ends: &[Ends]) -> Ends {
    let channels = model
        .effects
        .last()
        .into_iter()
        .flat_map(|effect| &effect.at);
    let all = channels.filter_map(|c| ends.get(limited(model, c)?));
    [0, 1].map(|side| all.clone().find_map(|ends| ends[side]))
}

/// Root mean square of a signal, by its role, at an effect's channels; 0 where there is none.
fn role_rms(model: &Model, effect: &Attached, role: Role, rms: &[f64]) -> f64 {
    let channels = effect.at.iter();
    channels
        .filter_map(|c| model.find_signal(c.read(role)?).ok())
        .filter_map(|i| rms.get(i).copied())
        .fold(0.0, f64::max)
}

/// The widths that suit the recording, of all effects that have one, by index of the parameter.
pub(crate) fn widths(model: &Model, rms: &[f64], sign_width: f64) -> Vec<(usize, f64)> {
    let of_effect = |effect: &Attached| {
        let width = sign_width * role_rms(model, effect, Role::Flow, rms);
        let declarations = effect.meta.parameters.iter().enumerate();
        let first = effect.first_parameter;
        declarations
            .filter(|(_, declaration)| declaration.is_width())
            .map(|(i, _)| (first + i, width))
            .collect::<Vec<_>>()
    };
    model.effects.iter().flat_map(of_effect).collect()
}

/// Whether a parameter is counted per way that the machine goes.
pub(crate) fn is_per_way(declaration: &Parameter) -> bool {
    declaration.unit == "1/position"
}

/// Sets the smoothing width of those of the last `count` effects of `model` that have one; whether any has.
pub(crate) fn smooth(model: &mut Model, count: usize, width: f64) -> bool {
    let mut has = false;
    for effect in model.effects.iter().rev().take(count) {
        for (i, declaration) in effect.meta.parameters.iter().enumerate() {
            if declaration.is_width() && width > 0.0 {
                let parameter = &mut model.parameters[effect.first_parameter + i];
                parameter.value = Some(width);
                parameter.origin = Origin::Log;
                has = true;
            }
        }
    }
    has
}
