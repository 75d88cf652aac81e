//! Files that are written whole or not at all.

use std::path::Path;

use crate::error::{Error, Result};

/// Writes a text through a temporary name in the same folder.
pub(crate) fn save(path: &Path, text: &str) -> Result<()> {
    writable(path)?;
    Ok(loopsight_report::save(path, text)?)
}

/// Refuses an output that is one of the inputs, by whatever name.
///
/// # Errors
///
/// It is.
pub(crate) fn apart<'p>(output: &Path, inputs: impl IntoIterator<Item = &'p Path>) -> Result<()> {
    let Ok(place) = output.canonicalize() else {
        return Ok(());
    };
    for input in inputs {
        if input.canonicalize().is_ok_and(|input| input == place) {
            let (output, input) = (output.display(), input.display());
            return Err(Error::request(format!(
                "cannot write `{output}`: it is `{input}`, which this command reads"
            )));
        }
    }
    Ok(())
}

/// Refuses a place that cannot be written before the work whose result it is for.
///
/// # Errors
///
/// It is a folder, a link, a device, a pipe or a socket, lies in no folder, or the operating system refuses.
pub(crate) fn writable(path: &Path) -> Result<()> {
    let cannot = |why: &str| {
        let shown = path.display();
        Error::request(format!("cannot write `{shown}`: {why}"))
    };
    if path.is_dir() {
        return Err(cannot("it is a directory, expected a file"));
    }
    // Of the name itself: what a link points to would stay, and the link be lost.
    if let Ok(there) = std::fs::symlink_metadata(path)
        && !there.is_file()
    {
        let what = if there.is_symlink() {
            "it is a symbolic link, which is not replaced; give the file it points to"
        } else {
            "it is a device, a pipe or a socket, which is not replaced"
        };
        return Err(cannot(what));
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_but_a_file_is_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("log.csv");
        std::fs::write(&file, "time_s\n").unwrap();
        save(&file, "new").unwrap();
        assert_eq!(std::fs::read_to_string(&file).unwrap(), "new");
        let again = folder.path().join(".").join("log.csv");
        let error = apart(&again, [file.as_path()]).unwrap_err().to_string();
        assert!(error.contains("which this command reads"), "{error}");
        apart(&folder.path().join("other.csv"), [file.as_path()]).unwrap();
    }

    #[cfg(unix)]
    #[test]
    fn links_and_sockets_stay() {
        let folder = tempfile::tempdir().unwrap();
        let (file, link) = (folder.path().join("a.csv"), folder.path().join("b.csv"));
        std::fs::write(&file, "old").unwrap();
        std::os::unix::fs::symlink(&file, &link).unwrap();
        let error = save(&link, "new").unwrap_err().to_string();
        assert!(error.contains("symbolic link"), "{error}");
        assert_eq!(std::fs::read_to_string(&file).unwrap(), "old");
        assert!(link.is_symlink());
        let socket = folder.path().join("socket");
        let _listener = std::os::unix::net::UnixListener::bind(&socket).unwrap();
        let error = save(&socket, "new").unwrap_err().to_string();
        assert!(error.contains("a socket"), "{error}");
    }
}
