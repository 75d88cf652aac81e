//! `loopsight add`.

use loopsight_model::config::nearest;
use loopsight_model::model::{Model, misfit};
use loopsight_model::registry;

use crate::cli::arguments::AddOptions;
use crate::cli::failure::Failure;
use crate::cli::load::save_text;
use crate::cli::output;

pub(crate) fn run(options: &AddOptions) -> Result<(), Failure> {
    let (model, source) = Model::load(&options.model)?;
    let effects = registry::effects();
    let id = options.effect.as_str();
    let Some(meta) = effects.iter().find(|m| m.id == id) else {
        let mut message = format!("there is no effect `{id}`");
        match nearest(id, effects.iter().map(|m| m.id)) {
            Some(near) => message.push_str(&format!("; did you mean `{near}`?")),
            None => message.push_str("; `loopsight list effects` shows them"),
        }
        return Err(Failure::request(message));
    };
    let fitting: Vec<_> = model
        .plant
        .channels
        .iter()
        .filter(|c| misfit(c, meta).is_none())
        .collect();
    let at: Vec<&str> = if options.at.is_empty() {
        // All channels of the family of the first: both wheels, all inputs.
        let Some(first) = fitting.first() else {
            return Err(Failure::request(format!(
                "`{id}` fits no channel of the plant `{}`",
                model.plant.id
            )));
        };
        let family = first.id.split('.').next().unwrap_or(first.id);
        fitting
            .iter()
            .filter(|c| c.id.split('.').next() == Some(family))
            .map(|c| c.id)
            .collect()
    } else {
        options.at.iter().map(String::as_str).collect()
    };
    for channel in &at {
        check(
            &model,
            meta,
            channel,
            &fitting.iter().map(|c| c.id).collect::<Vec<_>>(),
        )?;
    }
    let Some(with) = model.with_effect(id, &at) else {
        return Err(Failure::request(format!(
            "`{id}` does not fit {}",
            at.join(", ")
        )));
    };
    // The model knows what the defaults come to at these channels.
    let own = &with.parameters[model.parameters.len()..];
    let parameters: Vec<(&str, f64)> = own
        .iter()
        .filter_map(|p| Some((p.declaration.id, p.value?)))
        .collect();
    let text = source.with_effect(id, &at, &parameters);
    // What was written must read.
    Model::from_toml(&options.output.display().to_string(), &text)?;
    save_text(&options.output, &text)?;
    output::result(&format!(
        "{id} added at {}; a fit finds its parameters",
        at.join(", ")
    ));
    Ok(())
}

fn check(
    model: &Model,
    meta: &loopsight_core::EffectMeta,
    channel: &str,
    fitting: &[&str],
) -> Result<(), Failure> {
    let Some(found) = model.plant.channels.iter().find(|c| c.id == channel) else {
        let ids: Vec<&str> = model.plant.channels.iter().map(|c| c.id).collect();
        let near = nearest(channel, ids.iter().copied())
            .map_or_else(String::new, |n| format!("; did you mean `{n}`?"));
        return Err(Failure::request(format!(
            "the plant `{}` has no channel `{channel}`, expected one of {}{near}",
            model.plant.id,
            ids.join(", ")
        )));
    };
    match misfit(found, meta) {
        None => Ok(()),
        Some(why) => Err(Failure::request(format!(
            "`{}` cannot act on `{channel}`: {why}; it fits {}",
            meta.id,
            fitting.join(", ")
        ))),
    }
}
