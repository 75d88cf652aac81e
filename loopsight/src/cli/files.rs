//! Files that the commands read and write.

use std::path::{Path, PathBuf};

use super::output;
use crate::error::{Error, Result};
use crate::{Log, Model, Session, Written, files};

/// Refuses outputs that cannot be written, that this command reads, or that are one and the same, before its work.
pub(crate) fn check<'p>(
    outputs: impl IntoIterator<Item = &'p PathBuf>,
    inputs: &[&[PathBuf]],
) -> Result<()> {
    let outputs: Vec<&Path> = outputs.into_iter().map(PathBuf::as_path).collect();
    for path in &outputs {
        files::check(path)?;
        apart(path, inputs)?;
    }
    Ok(files::distinct(outputs)?)
}

/// Refuses an output that is one of the inputs.
pub(crate) fn apart(path: &Path, inputs: &[&[PathBuf]]) -> Result<()> {
    let inputs = inputs.iter().copied().flatten();
    Ok(files::apart(path, inputs.map(PathBuf::as_path))?)
}

/// `[MODEL] LOG`, without some of its runs, with further logs and one to judge on; none of them is one of
/// the `outputs`, which can be written.
pub(crate) fn session<'p>(
    outputs: impl IntoIterator<Item = &'p PathBuf>,
    names: &[PathBuf],
    also: &[PathBuf],
    without: &[String],
    test: Option<&PathBuf>,
) -> Result<Session> {
    check(
        outputs,
        &[names, also, test.map_or(&[], std::slice::from_ref)],
    )?;
    let read = |log: &PathBuf| -> Result<Log> {
        let runs: Vec<&str> = without.iter().map(String::as_str).collect();
        Log::read(log)?.without_runs(&runs)
    };
    let mut session = match names {
        [model, log] => {
            let model = model_file(model, log)?;
            Session::new(model, read(log)?)?
        }
        [log] if files::is_toml(log) => {
            return Err(Error::request(format!(
                "{} is a model file; a log is missing: expected MODEL LOG",
                log.display()
            )));
        }
        [log] => Session::of_log(read(log)?)?,
        _ => return Err(Error::request("expected a model file and a log")),
    };
    for log in also {
        session = session.also(Log::read(log)?)?;
    }
    if let Some(log) = test {
        session = session.test(Log::read(log)?)?;
    }
    Ok(session)
}

/// The model in a file that stands before a log; another log there is said to be one.
fn model_file(path: &Path, log: &Path) -> Result<Model> {
    let model = Model::from_file(path);
    if model.is_ok() || files::is_toml(path) || Log::read(path).is_err() {
        return model;
    }
    let (first, second) = (path.display(), log.display());
    let help = match files::is_toml(log) {
        true => "the model file comes first".to_owned(),
        false => format!(
            "`fit`, `diagnose` and `improve` take a further recording of the same machine as `--also {second}`"
        ),
    };
    Err(Error::request(format!(
        "{first} is a log, and no model file: expected MODEL LOG; {help}"
    )))
}

/// Writes a page where one is wanted; `make` makes it of the command for its foot.
pub(crate) fn page(path: Option<&PathBuf>, make: impl FnOnce(&str) -> String) -> Result<()> {
    match path {
        Some(path) => save(path, &make(&output::command_line())),
        None => Ok(()),
    }
}

/// Writes a text file, and says so, and whether it replaced one.
pub(crate) fn save(path: &Path, text: &str) -> Result<()> {
    wrote(&files::save(path, text)?);
    Ok(())
}

/// Where nothing was fitted: writes the model that a log brought which describes itself, so that a sign, a
/// unit or a length can be put right in it.
pub(crate) fn save_described(path: &Path, session: &Session) -> Result<()> {
    if !session.described {
        return Ok(());
    }
    let written = files::save(path, session.model().to_toml())?;
    output::note(&format!(
        "{written}, the model as the log describes it: what is wrong with the log can be put right there \
         (`scale = -1` turns a signal's sign), and the file given before the log"
    ));
    Ok(())
}

/// Says that a file was written.
pub(crate) fn wrote(written: &Written) {
    output::note(&written.to_string());
}
