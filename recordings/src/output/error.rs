//! Why a file could not be written.

use std::path::{Path, PathBuf};

/// Why a file, or a folder, could not be written.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum OutputError {
    /// Nothing can be written there: another place has to be named.
    #[error("cannot write `{}`: {why}", path.display())]
    Place {
        /// The file.
        path: PathBuf,
        /// What stands in the way.
        why: Box<str>,
    },
    /// It is one of the inputs.
    #[error("cannot write `{}`: it is `{}`, which this command reads", path.display(), input.display())]
    Input {
        /// The file.
        path: PathBuf,
        /// The input, as it was named.
        input: PathBuf,
    },
    /// A folder that is to be new, and cannot be made.
    #[error("cannot make the folder `{}`: {why}", path.display())]
    Folder {
        /// The folder.
        path: PathBuf,
        /// What stands in the way.
        why: Box<str>,
    },
    /// The operating system refused, though the place is right: a full disk, as a rule.
    #[error("{}: cannot {action}: {message}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What was tried.
        action: &'static str,
        /// What the system said.
        message: Box<str>,
    },
}

impl OutputError {
    /// Whether another place has to be named; otherwise the request was right and the work failed.
    pub fn is_request(&self) -> bool {
        !matches!(self, Self::Io { .. })
    }

    pub(super) fn place(path: &Path, why: impl Into<Box<str>>) -> Self {
        Self::Place {
            path: path.to_owned(),
            why: why.into(),
        }
    }

    pub(super) fn folder(path: &Path, why: impl Into<Box<str>>) -> Self {
        Self::Folder {
            path: path.to_owned(),
            why: why.into(),
        }
    }

    pub(crate) fn io(path: &Path, action: &'static str, error: &std::io::Error) -> Self {
        Self::Io {
            path: path.to_owned(),
            action,
            message: error.to_string().into(),
        }
    }
}
