//! `loopsight check`.

use std::path::Path;

use loopsight_model::config::{Source, read_text};
use loopsight_model::loop_file::LoopFile;
use loopsight_model::model::Model;

use crate::cli::arguments::CheckOptions;
use crate::cli::commands::run::compose;
use crate::cli::commands::simulate::Experiment;
use crate::cli::failure::{self, Failure};
use crate::cli::output;

pub(crate) fn run(options: &CheckOptions) -> Result<(), Failure> {
    let mut first: Option<Failure> = None;
    for path in &options.files {
        match check(path) {
            Ok(what) => output::result(&format!("{}: {what}", path.display())),
            Err(failure) => {
                if let Some(before) = first.replace(failure) {
                    before.print();
                }
            }
        }
    }
    first.map_or(Ok(()), Err)
}

/// What the file is, when it is right.
fn check(path: &Path) -> Result<String, Failure> {
    if path.extension().is_some_and(|e| e == "toml") {
        toml(path)
    } else {
        log(path)
    }
}

fn toml(path: &Path) -> Result<String, Failure> {
    let text = read_text(path)?;
    let file = path.display().to_string();
    let source = Source::parse(&file, &text)?;
    // What kind of file it is shows in the tables it has.
    if source.has("driver") || source.has("controller") {
        let parsed = LoopFile::parse(&source)?;
        let composed = compose(path, &source, &parsed)?;
        return Ok(format!(
            "a loop at {} Hz: driver `{}`, controller `{}`{}, references for {}",
            output::number(1.0 / parsed.period_s),
            parsed.driver.meta().id,
            parsed.controller.meta().id,
            parsed
                .estimator
                .as_ref()
                .map_or_else(String::new, |e| format!(", estimator `{}`", e.meta().id)),
            composed
                .1
                .controlled
                .iter()
                .map(|s| s.id)
                .collect::<Vec<_>>()
                .join(", ")
        ));
    }
    if source.has("duration_s") || source.has("inputs") {
        let experiment = Experiment::parse(&source)?;
        return Ok(format!(
            "an experiment of {} s at {} Hz with {} inputs",
            experiment.duration_s,
            output::number(1.0 / experiment.period_s),
            experiment.inputs.len()
        ));
    }
    let (model, _) = Model::from_toml(&file, &text)?;
    let missing = model.missing_values();
    Ok(format!(
        "a model: plant `{}`, {} effects, {} parameters ({} estimated in a fit){}",
        model.plant.id,
        model.effects.len(),
        model.parameters.len(),
        model.parameters.iter().filter(|p| p.free).count(),
        if missing.is_empty() {
            String::new()
        } else {
            format!("; without a value: {}", missing.join(", "))
        }
    ))
}

fn log(path: &Path) -> Result<String, Failure> {
    let log = loopsight_recordings::read(path).map_err(|e| failure::recording(path, &e))?;
    let table = log.table();
    let columns: Vec<&str> = table.columns.iter().map(|c| c.text.as_str()).collect();
    let rows: usize = table
        .runs
        .iter()
        .map(|r| r.rows.len() / columns.len().max(1))
        .sum();
    let mut text = format!(
        "a log of {rows} rows in {} runs, columns {}",
        table.runs.len(),
        columns.join(", ")
    );
    if let Some(toml) = log.model_toml() {
        let name = format!("model made from {}", path.display());
        let (model, _) = Model::from_toml(&name, &toml)?;
        let recording =
            crate::cli::load::map(&model, &log).map_err(|e| failure::recording(path, &e))?;
        text.push_str(&format!("; describes itself as a `{}`", model.plant.id));
        let faults = output::faults(&recording.faults);
        if !faults.is_empty() {
            text.push('\n');
            text.push_str(faults.trim_end());
        }
    }
    Ok(text)
}
