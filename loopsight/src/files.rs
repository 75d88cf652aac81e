//! Files that the library writes, and those it has read on the way.

use std::cell::RefCell;
use std::path::{Path, PathBuf};

use loopsight_recordings::output;
use loopsight_recordings::output::Written;

use crate::error::Result;

#[cfg(feature = "cli")]
pub(crate) use output::apart;
pub(crate) use output::{check, distinct};

/// Whether a file is one of TOML by its name.
pub(crate) fn is_toml(path: &Path) -> bool {
    path.extension().is_some_and(|e| e == "toml")
}

/// Writes a text, whole or not at all.
pub(crate) fn save(path: &Path, text: &str) -> Result<Written> {
    Ok(output::save(path, text.as_bytes())?)
}

/// The files that others name and that were read: none of them may be written.
#[derive(Debug, Default)]
pub(crate) struct Reads(RefCell<Vec<PathBuf>>);

impl Reads {
    /// Notes a file that is about to be read.
    pub(crate) fn note(&self, path: PathBuf) -> PathBuf {
        self.0.borrow_mut().push(path.clone());
        path
    }

    /// Refuses outputs that were read.
    ///
    /// # Errors
    ///
    /// One of them was.
    pub(crate) fn apart<'p>(&self, outputs: impl IntoIterator<Item = &'p Path>) -> Result<()> {
        let reads = self.0.borrow();
        for output in outputs {
            output::apart(output, reads.iter().map(PathBuf::as_path))?;
        }
        Ok(())
    }

    /// All of them.
    pub(crate) fn all(self) -> Vec<PathBuf> {
        self.0.into_inner()
    }
}
