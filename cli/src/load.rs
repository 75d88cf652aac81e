//! Models and recordings from files.

use std::path::{Path, PathBuf};

use loopsight_core::Signal;
use loopsight_core::config::Source;
use loopsight_core::model::Model;
use loopsight_core::run::Run;
use loopsight_recordings::{Fault, RecordingError, Severity};

use crate::failure::{self, Failure};
use crate::output;

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

fn mapped(
    model: &mut Model,
    log: &loopsight_recordings::Source,
    path: &Path,
) -> Result<(Vec<Run>, Vec<Fault>), Failure> {
    let recording = map(model, log).map_err(|e| failure::recording(path, &e))?;
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
    let folder = match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    let wrong = |why: String| Failure::request(format!("cannot write {}: {why}", path.display()));
    if path.is_dir() {
        return Err(wrong("it is a directory, expected a file".to_owned()));
    }
    if !folder.is_dir() {
        return Err(wrong(format!("there is no directory {}", folder.display())));
    }
    let mut file = tempfile::NamedTempFile::new_in(folder).map_err(|e| wrong(e.to_string()))?;
    std::io::Write::write_all(&mut file, text.as_bytes()).map_err(|e| wrong(e.to_string()))?;
    make_readable(&file);
    file.persist(path).map_err(|e| wrong(e.error.to_string()))?;
    output::note(&format!("wrote {}", path.display()));
    Ok(())
}

/// Temporary files are private; a result is not.
#[cfg(unix)]
fn make_readable(file: &tempfile::NamedTempFile) {
    use std::os::unix::fs::PermissionsExt as _;
    // Worst case the file stays private: no reason to lose it.
    let _ = file
        .as_file()
        .set_permissions(std::fs::Permissions::from_mode(0o644));
}

#[cfg(not(unix))]
fn make_readable(_file: &tempfile::NamedTempFile) {}
