//! Files that the commands read and write.

use std::path::{Path, PathBuf};

use super::output;
use crate::error::{Error, Result};
use crate::{Log, Model, Session, files};

/// Refuses outputs that cannot be written, or that this command reads, before its work.
pub(crate) fn check<'p>(
    outputs: impl IntoIterator<Item = &'p PathBuf>,
    inputs: &[&[PathBuf]],
) -> Result<()> {
    for output in outputs {
        files::writable(output)?;
        files::apart(
            output,
            inputs.iter().copied().flatten().map(PathBuf::as_path),
        )?;
    }
    Ok(())
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
            let model = Model::from_file(model)?;
            Session::new(model, read(log)?)?
        }
        [log] if log.extension().is_some_and(|e| e == "toml") => {
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

/// Writes a page where one is wanted; `make` makes it of the command for its foot.
pub(crate) fn page(path: Option<&PathBuf>, make: impl FnOnce(&str) -> String) -> Result<()> {
    match path {
        Some(path) => save(path, &make(&output::command_line())),
        None => Ok(()),
    }
}

/// Writes a text file, and says so, and whether it replaced one.
pub(crate) fn save(path: &Path, text: &str) -> Result<()> {
    let replaced = path.exists();
    files::save(path, text)?;
    if replaced {
        let shown = path.display();
        output::note(&format!(
            "wrote {shown} in place of the file that was there"
        ));
    } else {
        wrote(path);
    }
    Ok(())
}

/// Where nothing was fitted: writes the model that a log brought which describes itself, so that a sign, a
/// unit or a length can be put right in it.
pub(crate) fn save_described(path: &Path, session: &Session) -> Result<()> {
    if !session.described {
        return Ok(());
    }
    files::save(path, session.model().to_toml())?;
    output::note(&format!(
        "wrote {}, the model as the log describes it: what is wrong with the log can be put right there \
         (`scale = -1` turns a signal's sign), and the file given before the log",
        path.display()
    ));
    Ok(())
}

/// Says that a file was written.
pub(crate) fn wrote(path: &Path) {
    output::note(&format!("wrote {}", path.display()));
}
