//! Models and recordings from files.

use std::path::{Path, PathBuf};

use loopsight_core::Signal;
use loopsight_core::unit;
use loopsight_model::config::{Source, nearest};
use loopsight_model::model::Model;
use loopsight_model::registry::BuildError;
use loopsight_model::run::Run;
use loopsight_recordings::{Fault, RecordingError, Severity};

use crate::cli::failure::{self, Failure};
use crate::cli::output;

/// A model with a recording mapped on it.
pub(crate) struct Loaded {
    pub(crate) model: Model,
    /// The model's text, with places.
    pub(crate) source: Source,
    /// The model file; none for a log that describes itself.
    pub(crate) model_path: Option<PathBuf>,
    pub(crate) log_path: PathBuf,
    pub(crate) runs: Vec<Run>,
    pub(crate) faults: Vec<Fault>,
}

/// Loads `[MODEL] LOG`.
pub(crate) fn model_and_log(files: &[PathBuf]) -> Result<Loaded, Failure> {
    match files {
        [model_path, log_path] => {
            let (mut model, source) = Model::load(model_path)?;
            let (runs, faults) = recording(&mut model, log_path)?;
            Ok(Loaded {
                model,
                source,
                model_path: Some(model_path.clone()),
                log_path: log_path.clone(),
                runs,
                faults,
            })
        }
        [log_path] => {
            if log_path.extension().is_some_and(|e| e == "toml") {
                return Err(Failure::request(format!(
                    "{} is a model file; a log is missing: expected MODEL LOG",
                    log_path.display()
                )));
            }
            let log = loopsight_recordings::read(log_path)
                .map_err(|e| failure::recording(log_path, &e))?;
            let Some(text) = log.model_toml() else {
                return Err(Failure::request(format!(
                    "{} does not describe itself: a model file is needed before it, as in `loopsight compare model.toml {}`",
                    log_path.display(),
                    log_path.display()
                )));
            };
            let name = format!("model made from {}", log_path.display());
            let (mut model, source) = Model::from_toml(&name, &text)?;
            let (runs, faults) = mapped(&mut model, &log, log_path)?;
            Ok(Loaded {
                model,
                source,
                model_path: None,
                log_path: log_path.clone(),
                runs,
                faults,
            })
        }
        _ => Err(Failure::request("expected a model file and a log")),
    }
}

/// Loads a log for `model`; signals the model does not list are found by name, and what is
/// measured is written into the model.
pub(crate) fn recording(model: &mut Model, path: &Path) -> Result<(Vec<Run>, Vec<Fault>), Failure> {
    let log = loopsight_recordings::read(path).map_err(|e| failure::recording(path, &e))?;
    mapped(model, &log, path)
}

/// Joins further recordings of the same machine to the log.
pub(crate) fn join(loaded: &mut Loaded, paths: &[PathBuf]) -> Result<(), Failure> {
    for path in paths {
        let runs = further(loaded, path)?;
        let file = path.file_stem().unwrap_or_default().to_string_lossy();
        loaded.runs.extend(runs.into_iter().map(|run| {
            let name = if run.name().is_empty() {
                file.to_string()
            } else {
                format!("{file} {}", run.name())
            };
            run.named(name)
        }));
    }
    Ok(())
}

/// The runs of a test recording.
pub(crate) fn test_runs(
    loaded: &mut Loaded,
    path: Option<&Path>,
) -> Result<Option<Vec<Run>>, Failure> {
    path.map(|path| further(loaded, path)).transpose()
}

/// The runs of another recording, which must measure what the log measures; its faults join those
/// of the log.
fn further(loaded: &mut Loaded, path: &Path) -> Result<Vec<Run>, Failure> {
    let mut model = loaded.model.clone();
    let (runs, faults) = recording(&mut model, path)?;
    if model.measured != loaded.model.measured {
        return Err(Failure::request(format!(
            "{} does not measure the same signals as {}",
            path.display(),
            loaded.log_path.display()
        )));
    }
    loaded.faults.extend(faults);
    Ok(runs)
}

fn mapped(
    model: &mut Model,
    log: &loopsight_recordings::Source,
    path: &Path,
) -> Result<(Vec<Run>, Vec<Fault>), Failure> {
    let recording = map(model, log).map_err(|e| failure::recording(path, &e))?;
    for (i, signal) in recording.measured.iter().enumerate() {
        let mut samples = recording
            .runs
            .iter()
            .flat_map(|run| (0..run.len()).map(move |k| run.sample(k)[i]));
        if !samples.any(f64::is_finite) {
            return Err(Failure::request(format!(
                "{}: `{}` has no sample: every value of its column is missing or absurd",
                path.display(),
                signal.id
            )));
        }
    }
    let measured: Vec<_> = recording
        .measured
        .iter()
        .map(|m| (m.id.clone(), m.sensor.clone()))
        .collect();
    model.measure(&measured).map_err(|(_, message, help)| {
        Failure::request(match help {
            Some(help) => format!("{message} ({help})"),
            None => message,
        })
    })?;
    Ok((recording.runs, recording.faults))
}

/// Maps a log on the signals of a model.
pub(crate) fn map(
    model: &Model,
    log: &loopsight_recordings::Source,
) -> Result<loopsight_recordings::Recording, RecordingError> {
    let measurable: Vec<Signal> = model
        .plant
        .states
        .iter()
        .chain(model.plant.outputs)
        .copied()
        .collect();
    loopsight_recordings::map(log, model.plant.inputs, &measurable, &model.log)
}

/// The column `name` (with or without its unit) of the table at `path` over its time, in SI units;
/// rows without a value are left out.
pub(crate) fn column(path: &Path, name: &str) -> Result<Vec<[f64; 2]>, BuildError> {
    let wrong = |key: &str, why: String| BuildError::at(key, format!("{}: {why}", path.display()));
    let log = loopsight_recordings::read(path).map_err(|e| wrong("path", e.to_string()))?;
    let table = log.table();
    let find = |name: &str, key: &str| {
        let found = table.columns.iter().position(|c| c.text == name);
        let found = found.or_else(|| table.columns.iter().position(|c| c.name == name));
        found.ok_or_else(|| {
            let texts = table.column_texts();
            let why = format!(
                "there is no column `{name}`, expected one of {}",
                texts.join(", ")
            );
            let error = wrong(key, why);
            match nearest(name, texts.iter().map(String::as_str)) {
                Some(near) => error.help(format!("did you mean `{near}`?")),
                None => error,
            }
        })
    };
    let factor = |at: usize| {
        let unit = table.columns[at].unit.as_deref().map(unit::parse);
        unit.and_then(Result::ok).map_or(1.0, |u| u.factor)
    };
    let (time, value) = (find("time", "path")?, find(name, "column")?);
    let (second, si) = (factor(time), factor(value));
    let rows = table
        .runs
        .iter()
        .flat_map(|run| run.rows.chunks_exact(table.columns.len().max(1)));
    Ok(rows
        .map(|row| [row[time] * second, row[value] * si])
        .filter(|[_, value]| value.is_finite())
        .collect())
}

/// A fit to a log with a fatal fault would mean nothing: refuses, with the reasons.
pub(crate) fn refuse_fatal(path: &Path, faults: &[Fault]) -> Result<(), Failure> {
    let fatal: Vec<String> = faults
        .iter()
        .filter(|f| f.severity() == Severity::Fatal)
        .map(|f| format!("  {f}"))
        .collect();
    if fatal.is_empty() {
        return Ok(());
    }
    Err(Failure::request(format!(
        "{}: a fit to this log would mean nothing:\n{}",
        path.display(),
        fatal.join("\n")
    )))
}

/// Writes a text file through a temporary name in the same folder.
pub(crate) fn save_text(path: &Path, text: &str) -> Result<(), Failure> {
    writable(path)?;
    loopsight_report::save(path, text)?;
    output::note(&format!("wrote {}", path.display()));
    Ok(())
}

/// Refuses a place that cannot be written before the work whose result it is for.
pub(crate) fn writable(path: &Path) -> Result<(), Failure> {
    beside(path).map(drop)
}

/// A temporary file in the folder of `path`, to become it.
fn beside(path: &Path) -> Result<tempfile::NamedTempFile, Failure> {
    if path.is_dir() {
        return Err(cannot_write(path, "it is a directory, expected a file"));
    }
    let folder = match (path.parent(), path.file_name()) {
        (Some(parent), Some(_)) if !parent.as_os_str().is_empty() => parent,
        (Some(_), Some(_)) => Path::new("."),
        _ => return Err(cannot_write(path, "expected the name of a file")),
    };
    if !folder.is_dir() {
        let why = format!("there is no directory {}", folder.display());
        return Err(cannot_write(path, &why));
    }
    tempfile::NamedTempFile::new_in(folder).map_err(|e| cannot_write(path, &e.to_string()))
}

fn cannot_write(path: &Path, why: &str) -> Failure {
    Failure::request(format!("cannot write `{}`: {why}", path.display()))
}
