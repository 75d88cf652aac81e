//! `loopsight send`.

use loopsight_model::config::{Source, read_text};
use loopsight_model::loop_file::{LoopFile, placed};
use loopsight_model::model::{Attached, Model};
use loopsight_onboard::{Acknowledged, Attachment, SendError};
use serde::Serialize;

use crate::cli::arguments::SendOptions;
use crate::cli::commands::run::model_of;
use crate::cli::failure::Failure;
use crate::cli::output;

pub(crate) fn run(options: &SendOptions) -> Result<(), Failure> {
    let text = read_text(&options.file)?;
    let source = Source::parse(&options.file.display().to_string(), &text)?;
    let file = LoopFile::parse(&source)?;
    let model = model_of(&options.file, &source, &file)?;
    let told = loopsight_onboard::send(&file, &model, options.line.as_deref());
    let told = told.map_err(|error| match error {
        SendError::Table(error) => {
            let id = file.controller.meta().id;
            placed(&source, &["controller".into(), id.into()], error).into()
        }
        SendError::NotAboard { .. } => {
            let message = error.to_string();
            source.error(&["controller".into()], &message, None).into()
        }
        SendError::NoLine => Failure::request(error.to_string()),
        _ => Failure::work(error.to_string()),
    })?;
    output::people(&words(&told, &model), options.json);
    if options.json {
        output::json(&Told::new(&told, &model))?;
    }
    Ok(())
}

/// What `--json` says.
#[derive(Serialize)]
struct Told {
    line: String,
    plant: String,
    period_s: f64,
    runs: bool,
    interrupted: bool,
    parameters: Vec<Named>,
    effects: Vec<Effect>,
    learns: bool,
}

#[derive(Serialize)]
struct Named {
    name: String,
    unit: String,
    value: f32,
}

#[derive(Serialize)]
struct Effect {
    id: String,
    at: Vec<&'static str>,
    parameters: Vec<Named>,
}

fn named<'p>(declared: impl Iterator<Item = (&'p str, &'p str)>, values: &[f32]) -> Vec<Named> {
    let of = |((name, unit), value): ((&str, &str), &f32)| Named {
        name: name.to_owned(),
        unit: unit.to_owned(),
        value: *value,
    };
    declared.zip(values).map(of).collect()
}

impl Told {
    fn new(told: &Acknowledged, model: &Model) -> Self {
        let configuration = &told.configuration;
        let effects = configuration.effects.iter().zip(&model.effects);
        let effect = |(sent, own): (&Attachment, &Attached)| {
            // Units are those of the channels that it acts on.
            let parameters = &model.parameters[own.first_parameter..];
            let declared = own.meta.parameters.iter().zip(parameters);
            Effect {
                id: own.meta.id.to_owned(),
                at: own.at.iter().map(|channel| channel.id).collect(),
                parameters: named(declared.map(|(d, p)| (d.id, p.unit.as_str())), &sent.values),
            }
        };
        let declared = model.plant.parameters.iter().map(|p| (p.id, p.unit));
        Self {
            line: told.line.clone(),
            plant: told.plant.clone(),
            period_s: told.period_s,
            runs: told.runs,
            interrupted: told.interrupted,
            parameters: named(declared, &configuration.parameters),
            effects: effects.map(effect).collect(),
            learns: configuration.learning.is_some(),
        }
    }
}

fn list(parameters: &[Named]) -> String {
    let of = |p: &Named| {
        // The shortest digits that make the number which was sent.
        let text = format!("{} {} {}", p.name, p.value, p.unit);
        text.trim_end_matches(" 1").trim_end().to_owned()
    };
    parameters.iter().map(of).collect::<Vec<_>>().join(", ")
}

fn words(told: &Acknowledged, model: &Model) -> String {
    let said = Told::new(told, model);
    let ends = match (told.runs, told.interrupted) {
        (true, _) => "drives on with it",
        (false, true) => "took it; it was driving, and came to rest",
        (false, false) => "took it, and is at rest",
    };
    let mut text = format!(
        "the robot at {} ({}, every {} s) {ends}\n  model: {}",
        said.line,
        said.plant,
        output::number(said.period_s),
        list(&said.parameters)
    );
    for effect in &said.effects {
        let (id, at) = (&effect.id, effect.at.join(", "));
        text.push_str(&format!("\n  {id} at {at}: {}", list(&effect.parameters)));
    }
    if said.effects.is_empty() {
        text.push_str("\n  no effects");
    }
    text.push_str(if said.learns {
        "\n  it learns"
    } else {
        "\n  it learns nothing"
    });
    text
}
