//! `model.toml` of a new robot, from what its plant declares.

use loopsight_core::{Parameter, PlaceKind, PlantMeta, Signal};
use loopsight_model::config::PathSegment;
use loopsight_model::model::{Model, misfit};
use loopsight_model::registry::{self, range_text};

use super::texts::{program, quoted};
use crate::pace::Pace;

/// A text in lines that begin with `# `.
fn comment(text: &str) -> String {
    text.lines().map(|l| format!("# {l}\n")).collect()
}

fn described(parameter: &Parameter) -> String {
    let fitted = if parameter.estimated {
        "a fit finds it"
    } else {
        "frozen in a fit"
    };
    format!(
        "# {}, {}: {}; {}; {fitted}\n",
        parameter.symbol,
        parameter.unit,
        parameter.doc,
        range_text(parameter).trim_end()
    )
}

pub(super) fn model_text(
    name: &str,
    meta: &PlantMeta,
    model: &Model,
    measured: &[&Signal],
    pace: Pace,
) -> String {
    let mut text = format!(
        "# {}, a `{}`: {}.\n# `{} explain {}` tells more: signals, channels, effects that fit.\nname = {}\n\n",
        name,
        meta.id,
        meta.summary,
        program(),
        meta.id,
        quoted(name)
    );
    text.push_str(&comment(&meta.equation.replace(";  ", "\n")));
    text.push_str(&comment(&format!("Assumed: {}.", meta.assumptions)));
    text.push_str("# The values are those of an example: put your own in their place.\n");
    let path = model.parameters.first().map_or(&[][..], |p| &p.path[..]);
    let table: Vec<&str> = path
        .split_last()
        .map_or(&[][..], |(_, table)| table)
        .iter()
        .filter_map(|step| match step {
            PathSegment::Key(key) => Some(key.as_str()),
            PathSegment::Index(_) => None,
        })
        .collect();
    let table = if table.is_empty() {
        format!("plant.{}", meta.id)
    } else {
        table.join(".")
    };
    text.push_str(&format!("[{table}]\n"));
    for parameter in &model.parameters {
        text.push_str(&described(parameter.declaration));
        if let Some(value) = parameter.value {
            text.push_str(&format!("{} = {value:?}\n", parameter.declaration.id));
        }
    }
    let own = format!("plant.{}", meta.id);
    let sets = std::iter::once((
        own.clone(),
        "the equations' own parameters",
        meta.parameters,
    ));
    let sets = sets.chain(
        meta.parameterizations
            .iter()
            .map(|set| (format!("{own}.{}", set.id), set.summary, set.parameters)),
    );
    for (other, summary, parameters) in sets.filter(|s| s.0 != table) {
        text.push_str(&format!(
            "\n# Or in another way, instead of [{table}]: {summary}.\n# [{other}]\n"
        ));
        for parameter in parameters {
            text.push_str(&described(parameter));
            let default = parameter.default.map(|d| format!("{d:?}"));
            let value = default.unwrap_or_default();
            text.push_str(format!("# {} = {value}", parameter.id).trim_end());
            text.push('\n');
        }
    }
    text.push_str(&effect_hint(meta));
    text.push_str(
        "\n# What is measured; a column of the log is found by the signal's name and unit.\n",
    );
    for signal in measured {
        let column = loopsight_recordings::header(signal);
        text.push_str(&format!("[log.measured.{}]   # `{column}`\n", signal.id));
    }
    let others: Vec<&str> = meta
        .states
        .iter()
        .chain(meta.outputs)
        .map(|s| s.id)
        .filter(|id| measured.iter().all(|m| m.id != *id))
        .collect();
    if !others.is_empty() {
        text.push_str(&format!(
            "# A sensor could read as well: {}.\n",
            others.join(", ")
        ));
    }
    text.push_str(&format!(
        "\n[simulation]\nmax_step_s = {:?}   # longest integration step\n",
        pace.model_step()
    ));
    text
}

/// How an effect would be added: the commonest that fits, as a comment.
fn effect_hint(meta: &PlantMeta) -> String {
    let mut effects = registry::effects();
    effects.sort_by_key(|e| e.rarity);
    let places = [PlaceKind::Effort, PlaceKind::Input];
    let places = places.iter().flat_map(|kind| {
        meta.channels
            .iter()
            .filter(move |c| c.place.kind() == *kind)
    });
    let mut found = places.filter_map(|channel| {
        let effect = effects.iter().find(|e| misfit(channel, e).is_none())?;
        Some((channel, effect))
    });
    found.next().map_or_else(String::new, |(channel, effect)| {
        let family = |id: &'static str| id.split('.').next();
        let at: Vec<String> = meta
            .channels
            .iter()
            .filter(|c| family(c.id) == family(channel.id) && misfit(c, effect).is_none())
            .map(|c| quoted(c.id))
            .collect();
        format!(
            "\n# Physics that the plain model lacks; `loopsight diagnose` says which.\n\
             # [[effect]]\n# [effect.{}]\n# at = [{}]\n",
            effect.id,
            at.join(", ")
        )
    })
}
