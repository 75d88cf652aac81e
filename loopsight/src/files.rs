//! Files that are written whole or not at all.

use std::path::Path;

use crate::error::{Error, Result};

/// Writes a text through a temporary name in the same folder.
pub(crate) fn save(path: &Path, text: &str) -> Result<()> {
    writable(path)?;
    Ok(loopsight_report::save(path, text)?)
}

/// Refuses a place that cannot be written before the work whose result it is for.
///
/// # Errors
///
/// It is a folder, lies in none, or the operating system refuses.
pub(crate) fn writable(path: &Path) -> Result<()> {
    let cannot = |why: &str| {
        let shown = path.display();
        Error::request(format!("cannot write `{shown}`: {why}"))
    };
    if path.is_dir() {
        return Err(cannot("it is a directory, expected a file"));
    }
    let folder = match (path.parent(), path.file_name()) {
        (Some(parent), Some(_)) if !parent.as_os_str().is_empty() => parent,
        (Some(_), Some(_)) => Path::new("."),
        _ => return Err(cannot("expected the name of a file")),
    };
    if !folder.is_dir() {
        return Err(cannot(&format!(
            "there is no directory {}",
            folder.display()
        )));
    }
    tempfile::NamedTempFile::new_in(folder)
        .map(drop)
        .map_err(|error| cannot(&error.to_string()))
}
