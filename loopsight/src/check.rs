//! Whether a file is right, and what it is.

use std::path::Path;

use loopsight_model::config::{TomlSource, read_text};
use loopsight_model::model::Model as Composed;

use crate::answers::{CheckAnswer, Checked, FileKind, LogFault, Mistake};
use crate::error::Result;
use crate::files::is_toml;
use crate::log::Log;
use crate::run::Loop;
use crate::session::map;
use crate::simulate::Experiment;
use crate::words;

/// Checks model, loop and experiment files (TOML) and logs. What is wrong stands in the answer.
///
/// ```
/// # let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../examples/twil");
/// let answer = loopsight::check([format!("{folder}/model.toml"), format!("{folder}/prbs.csv")]);
/// assert!(answer.right);
/// ```
pub fn check<P: AsRef<Path>>(files: impl IntoIterator<Item = P>) -> CheckAnswer {
    let files = files.into_iter();
    CheckAnswer::new(files.map(|path| one(path.as_ref())).collect())
}

fn one(path: &Path) -> Checked {
    let file = path.display().to_string();
    let found = if is_toml(path) { toml(path) } else { log(path) };
    found.unwrap_or_else(|error| Checked {
        right: false,
        mistake: Some(Mistake::new(error.clone())),
        ..Checked::right(&file, None, error.to_string())
    })
}

fn toml(path: &Path) -> Result<Checked> {
    let text = read_text(path)?;
    let file = path.display().to_string();
    let source = TomlSource::parse(&file, &text)?;
    // What kind of file it is shows in the tables it has.
    if source.has("driver") || source.has("controller") {
        let looped = Loop::from_file(path)?;
        let model = looped.model()?;
        let summary = looped.described(&model)?;
        return Ok(Checked::right(&file, Some(FileKind::Loop), summary));
    }
    if source.has("duration_s") || source.has("inputs") {
        let experiment = Experiment::from_toml(&file, &text)?;
        let summary = format!(
            "an experiment of {} s at {} Hz with {} inputs",
            experiment.duration_s(),
            words::number(1.0 / experiment.period_s()),
            experiment.written.inputs.len()
        );
        return Ok(Checked::right(&file, Some(FileKind::Experiment), summary));
    }
    let (model, _) = Composed::from_toml(&file, &text)?;
    let missing = model.missing_values();
    let candidates = match model.candidates.len() {
        0 => String::new(),
        n => format!(" and {n} for a diagnosis to try"),
    };
    let summary = format!(
        "a model: plant `{}`, {} effects{candidates}, {} parameters ({} estimated in a fit){}",
        model.plant.id,
        model.effects.len(),
        model.parameters.len(),
        model
            .parameters
            .iter()
            .filter(|p| p.free || p.per_run)
            .count(),
        if missing.is_empty() {
            String::new()
        } else {
            format!("; without a value: {}", missing.join(", "))
        }
    );
    Ok(Checked {
        without_value: missing.into_iter().map(str::to_owned).collect(),
        ..Checked::right(&file, Some(FileKind::Model), summary)
    })
}

fn log(path: &Path) -> Result<Checked> {
    let log = Log::read(path)?;
    let columns = log.columns();
    let mut summary = format!(
        "a log of {} rows in {} runs, columns {}",
        log.rows(),
        log.runs(),
        columns.join(", ")
    );
    let mut faults = Vec::new();
    if let Some(model) = log.model() {
        let model = model?;
        let recording = map(&model.composed, &log.source).map_err(|error| log.wrong(&error))?;
        summary.push_str(&format!("; describes itself as a `{}`", model.plant()));
        faults = recording.faults;
        let said = words::faults(&faults);
        if !said.is_empty() {
            summary.push('\n');
            summary.push_str(said.trim_end());
        }
    }
    Ok(Checked {
        columns,
        faults: faults.iter().map(LogFault::from).collect(),
        ..Checked::right(log.name(), Some(FileKind::Log), summary)
    })
}
