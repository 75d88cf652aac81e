//! Writing a page to a file.

use std::io::Write;
use std::path::{Path, PathBuf};

/// Why a page could not be written.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// The operating system refused.
    #[error("{}: cannot {action}: {source}", path.display())]
    Io {
        /// The page's file.
        path: PathBuf,
        /// What was tried.
        action: &'static str,
        /// What the system said.
        source: std::io::Error,
    },
}

/// Writes `html` to `path`, whole or not at all: into a new file in the same folder, which is then renamed.
///
/// # Errors
///
/// [`ReportError::Io`] where the folder does not exist, may not be written to, or has no space left, and where
/// `path` is a folder.
pub fn save(path: &Path, html: &str) -> Result<(), ReportError> {
    let error = |action| {
        move |source| ReportError::Io {
            path: path.to_owned(),
            action,
            source,
        }
    };
    let folder = match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    let mut builder = tempfile::Builder::new();
    builder.prefix(".loopsight-").suffix(".tmp");
    #[cfg(unix)]
    {
        // As any other new file, not readable by its owner alone.
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(std::fs::Permissions::from_mode(0o666));
    }
    let mut file = builder
        .tempfile_in(folder)
        .map_err(error("create a file beside it"))?;
    file.write_all(html.as_bytes()).map_err(error("write"))?;
    file.persist(path).map_err(|e| error("write")(e.error))?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_is_written_whole_and_replaces_the_old_one() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("page.html");
        save(&path, "old").unwrap();
        save(&path, "new").unwrap();
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "new");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn an_error_names_the_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("nowhere").join("page.html");
        let message = save(&path, "x").unwrap_err().to_string();
        assert!(
            message.contains("nowhere") && message.contains("page.html"),
            "{message}"
        );
        let message = save(folder.path(), "x").unwrap_err().to_string();
        assert!(message.contains("cannot write"), "{message}");
    }
}
