//! `loopsight explain`.

use crate::answers::{Explained, ExplainedParameter, ExplainedSignal};
use crate::cli::arguments::ExplainArguments;
use crate::cli::output::{self, columns};
use crate::error::Result;
use crate::explain;

pub(crate) fn run(arguments: &ExplainArguments) -> Result<()> {
    let answer = explain(&arguments.id)?;
    let texts: Vec<String> = answer.parts.iter().map(text).collect();
    output::answer(&answer, texts.join("\n").trim_end(), arguments.json)
}

fn text(part: &Explained) -> String {
    let mut text = format!(
        "{} ({}): {}\n\n    {}\n",
        part.id,
        part.role,
        part.summary,
        part.equation.replace('\n', "\n    ")
    );
    text.push_str(&match part.role {
        "plant" if part.assumptions.is_some() => plant(part),
        "effect" if part.symptom.is_some() => effect(part),
        _ => settings(part),
    });
    let example = part.example.lines().map(|l| format!("    {l}\n"));
    text.push_str(&format!(
        "\nReference: {}\n\nExample:\n{}",
        part.reference,
        example.collect::<String>()
    ));
    text
}

/// A row of texts.
fn row<const N: usize>(cells: [&str; N]) -> Vec<String> {
    cells.map(str::to_owned).to_vec()
}

/// A table under a title.
fn titled(title: &str, head: &[&str], rows: &[Vec<String>]) -> String {
    format!("\n{title}\n{}\n", columns(head, rows))
}

fn parameters(title: &str, list: &[ExplainedParameter]) -> String {
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
                format!("{}; {}", p.doc, p.range),
            ]
        })
        .collect();
    titled(
        title,
        &["name", "unit", "default", "in a fit", "what"],
        &rows,
    )
}

fn signals(title: &str, list: &[ExplainedSignal]) -> String {
    if list.is_empty() {
        return String::new();
    }
    let rows: Vec<Vec<String>> = list
        .iter()
        .map(|s| row([&format!("{} ({})", s.id, s.symbol), s.unit, s.doc]))
        .collect();
    titled(title, &["name", "unit", "what"], &rows)
}

fn plant(part: &Explained) -> String {
    let mut text = format!("\nAssumptions: {}\n", part.assumptions.unwrap_or_default());
    text.push_str(&signals("States", &part.states));
    text.push_str(&signals("Inputs", &part.inputs));
    text.push_str(&signals("Further signals", &part.outputs));
    text.push_str(&parameters("Parameters", &part.parameters));
    for set in &part.parameterizations {
        let title = format!(
            "Parameters in [plant.{}.{}]: {}",
            part.id, set.id, set.summary
        );
        text.push_str(&parameters(&title, &set.parameters));
    }
    if !part.derived.is_empty() {
        let rows: Vec<Vec<String>> = part
            .derived
            .iter()
            .map(|d| row([d.id, d.unit, d.equation, d.doc]))
            .collect();
        let head = ["name", "unit", "equation", "what"];
        text.push_str(&titled(
            "What follows from them, shown with a fit",
            &head,
            &rows,
        ));
    }
    let rows: Vec<Vec<String>> = part
        .channels
        .iter()
        .map(|c| row([c.id, c.place, c.unit, c.equation, &c.effects.join(", ")]))
        .collect();
    let head = ["name", "place", "unit", "equation", "effects that fit"];
    text.push_str(&titled("Channels, where effects attach", &head, &rows));
    text
}

fn effect(part: &Explained) -> String {
    let mut text = format!(
        "\nSymptom: {}\nRemedy: {}\n",
        part.symptom.unwrap_or_default(),
        part.remedy.unwrap_or_default()
    );
    text.push_str(&parameters("Parameters", &part.parameters));
    let rows: Vec<Vec<String>> = part
        .attaches_to
        .iter()
        .map(|home| row([home.plant, &home.channels.join(", ")]))
        .collect();
    text.push_str(&titled("Where it attaches", &["plant", "channels"], &rows));
    text
}

fn settings(part: &Explained) -> String {
    let rows: Vec<Vec<String>> = part
        .settings
        .iter()
        .map(|s| row([s.id, s.unit, s.doc]))
        .collect();
    titled("Settings", &["name", "unit", "what"], &rows)
}
