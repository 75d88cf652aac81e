//! `loopsight explain`.

use loopsight_core::{EffectMeta, Parameter, PlantMeta, Signal};
use loopsight_model::config::nearest;
use loopsight_model::model::misfit;
use loopsight_model::registry::{self, PartMeta, range_text};

use crate::cli::arguments::ExplainOptions;
use crate::cli::failure::Failure;
use crate::cli::output::{self, columns};

pub(crate) fn run(options: &ExplainOptions) -> Result<(), Failure> {
    let id = options.id.as_str();
    let text = if let Some(meta) = registry::plants().into_iter().find(|m| m.id == id) {
        plant(meta)
    } else if let Some(meta) = registry::effects().into_iter().find(|m| m.id == id) {
        effect(meta)
    } else if let Some(meta) = registry::parts().into_iter().find(|m| m.id == id) {
        part(meta)
    } else if let Some(text) = written(id) {
        text
    } else {
        let mut ids: Vec<&str> = registry::plants().iter().map(|m| m.id).collect();
        ids.extend(registry::effects().iter().map(|m| m.id));
        ids.extend(registry::parts().iter().map(|m| m.id));
        ids.push(registry::written()[0].id);
        let mut message = format!("nothing is known by the id `{id}`");
        match nearest(id, ids.iter().copied()) {
            Some(near) => message.push_str(&format!("; did you mean `{near}`?")),
            None => message.push_str(&format!("; known are {}", ids.join(", "))),
        }
        return Err(Failure::request(message));
    };
    output::result(text.trim_end());
    Ok(())
}

fn head(role: &str, id: &str, summary: &str, equation: &str) -> String {
    let equation = equation.replace(";  ", "\n    ");
    format!("{id} ({role}): {summary}\n\n    {equation}\n")
}

fn tail(reference: &str, example: &str) -> String {
    let example: String = example.lines().map(|l| format!("    {l}\n")).collect();
    format!("\nReference: {reference}\n\nExample:\n{example}")
}

fn parameters(title: &str, list: &[Parameter]) -> String {
    let rows: Vec<Vec<String>> = list
        .iter()
        .map(|p| {
            let default = p.default.map_or_else(|| "-".to_owned(), |d| format!("{d}"));
            let estimated = if p.estimated { "estimated" } else { "known" };
            vec![
                format!("{} ({})", p.id, p.symbol),
                p.unit.to_owned(),
                default,
                estimated.to_owned(),
                format!("{}; {}", p.doc, range_text(p)),
            ]
        })
        .collect();
    format!(
        "\n{title}\n{}\n",
        columns(&["name", "unit", "default", "in a fit", "what"], &rows)
    )
}

fn signals(title: &str, list: &[Signal]) -> String {
    if list.is_empty() {
        return String::new();
    }
    let rows: Vec<Vec<String>> = list
        .iter()
        .map(|s| {
            vec![
                format!("{} ({})", s.id, s.symbol),
                s.unit.to_owned(),
                s.doc.to_owned(),
            ]
        })
        .collect();
    format!("\n{title}\n{}\n", columns(&["name", "unit", "what"], &rows))
}

fn plant(meta: &PlantMeta) -> String {
    let mut text = head("plant", meta.id, meta.summary, meta.equation);
    text.push_str(&format!("\nAssumptions: {}\n", meta.assumptions));
    text.push_str(&signals("States", meta.states));
    text.push_str(&signals("Inputs", meta.inputs));
    text.push_str(&signals("Further signals", meta.outputs));
    text.push_str(&parameters("Parameters", meta.parameters));
    for set in meta.parameterizations {
        let title = format!(
            "Parameters in [plant.{}.{}]: {}",
            meta.id, set.id, set.summary
        );
        text.push_str(&parameters(&title, set.parameters));
    }
    let derived = registry::derived(meta.id);
    if !derived.is_empty() {
        let rows: Vec<Vec<String>> = derived
            .iter()
            .map(|d| {
                [d.id, d.unit, d.equation, d.doc]
                    .map(str::to_owned)
                    .to_vec()
            })
            .collect();
        let head = columns(&["name", "unit", "equation", "what"], &rows);
        text.push_str(&format!(
            "\nWhat follows from them, shown with a fit\n{head}\n"
        ));
    }
    let effects = registry::effects();
    let rows: Vec<Vec<String>> = meta
        .channels
        .iter()
        .map(|c| {
            let fitting: Vec<&str> = effects
                .iter()
                .filter(|e| misfit(c, e).is_none())
                .map(|e| e.id)
                .collect();
            vec![
                c.id.to_owned(),
                c.place.kind().name().to_owned(),
                c.unit.to_owned(),
                c.equation.to_owned(),
                fitting.join(", "),
            ]
        })
        .collect();
    text.push_str(&format!(
        "\nChannels, where effects attach\n{}\n",
        columns(
            &["name", "place", "unit", "equation", "effects that fit"],
            &rows
        )
    ));
    text.push_str(&tail(meta.reference, meta.example));
    text
}

fn effect(meta: &EffectMeta) -> String {
    let mut text = head("effect", meta.id, meta.summary, meta.equation);
    text.push_str(&format!(
        "\nSymptom: {}\nRemedy: {}\n",
        meta.symptom, meta.remedy
    ));
    text.push_str(&parameters("Parameters", meta.parameters));
    let rows: Vec<Vec<String>> = registry::plants()
        .iter()
        .map(|p| {
            let channels: Vec<&str> = p
                .channels
                .iter()
                .filter(|c| misfit(c, meta).is_none())
                .map(|c| c.id)
                .collect();
            vec![p.id.to_owned(), channels.join(", ")]
        })
        .filter(|r| !r[1].is_empty())
        .collect();
    text.push_str(&format!(
        "\nWhere it attaches\n{}\n",
        columns(&["plant", "channels"], &rows)
    ));
    text.push_str(&tail(meta.reference, meta.example));
    text
}

/// What a model file itself can define: a plant and an effect share their id.
fn written(id: &str) -> Option<String> {
    let found = registry::written().into_iter().filter(|m| m.id == id);
    let texts: Vec<String> = found.map(part).collect();
    (!texts.is_empty()).then(|| texts.join("\n"))
}

fn part(meta: &PartMeta) -> String {
    let mut text = head(meta.role, meta.id, meta.summary, meta.equation);
    let rows: Vec<Vec<String>> = meta
        .settings
        .iter()
        .map(|s| vec![s.id.to_owned(), s.unit.to_owned(), s.doc.to_owned()])
        .collect();
    text.push_str(&format!(
        "\nSettings\n{}\n",
        columns(&["name", "unit", "what"], &rows)
    ));
    text.push_str(&tail(meta.reference, meta.example));
    text
}
