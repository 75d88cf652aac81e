//! Why a log cannot be read.

use std::path::PathBuf;

use crate::detect::Format;

/// What stands in the way of reading a log.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FormatError {
    /// The operating system refused.
    #[error("{}: cannot read: {message}", path.display())]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// What the system said.
        message: Box<str>,
    },
    /// No content at all.
    #[error("{log}: the file is empty")]
    Empty {
        /// The file.
        log: Box<str>,
    },
    /// The bytes contradict the format.
    #[error("{log}: damaged {format} at byte {position}: expected {expected}, found {found}")]
    Damaged {
        /// The file.
        log: Box<str>,
        /// Its format.
        format: Format,
        /// Byte, from 0, in the unpacked content.
        position: u64,
        /// What the format asks for.
        expected: Box<str>,
        /// What is there.
        found: Box<str>,
    },
    /// The library that reads this format refused the file.
    #[error("{log}: this {format} file cannot be read: {message}")]
    Refused {
        /// The file.
        log: Box<str>,
        /// Its format.
        format: Format,
        /// What is wrong.
        message: Box<str>,
    },
    /// A format that is known and not read.
    #[error("{log}: this is {what}, which is not read; {remedy}")]
    NotRead {
        /// The file.
        log: Box<str>,
        /// The format, with its article.
        what: Box<str>,
        /// How people convert it.
        remedy: Box<str>,
    },
    /// A format that this build was made without.
    #[error(
        "{log}: this is a {format} file; this program was built without the feature `{feature}` that reads it"
    )]
    NotBuilt {
        /// The file.
        log: Box<str>,
        /// The format.
        format: Format,
        /// The feature of `loopsight-formats`.
        feature: &'static str,
    },
    /// More content than the size of the file can stand for.
    #[error(
        "{log}: {what} would take more than {limit} bytes of memory, out of proportion to the file's size"
    )]
    TooLarge {
        /// The file.
        log: Box<str>,
        /// What is too large.
        what: Box<str>,
        /// Bytes allowed.
        limit: u64,
    },
}
