//! What [`check`](crate::check) answers.

use serde::Serialize;

use super::Answer;
use super::common::LogFault;
use crate::error::Error;

/// Whether files are right, and what they are.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct CheckAnswer {
    /// `loopsight/check/1`.
    #[cfg_attr(feature = "schema", schemars(extend("const" = "loopsight/check/1")))]
    pub schema: &'static str,
    /// All of them are right.
    pub right: bool,
    /// The files, in the order in which they were named.
    pub files: Vec<Checked>,
}

/// A file that was looked over.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct Checked {
    /// The file.
    pub file: String,
    /// It is right.
    pub right: bool,
    /// What it is; `null` where it is not right.
    pub kind: Option<FileKind>,
    /// What it is, or what is wrong with it, in words.
    pub summary: String,
    /// Of a model: the parameters without a value.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub without_value: Vec<String>,
    /// Of a log: its columns.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub columns: Vec<String>,
    /// Of a log that describes itself: its faults, the worst first.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub faults: Vec<LogFault>,
    /// What is wrong; absent where nothing is.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mistake: Option<Mistake>,
}

/// Kinds of files.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum FileKind {
    /// A model.
    Model,
    /// A loop.
    Loop,
    /// An experiment.
    Experiment,
    /// A log.
    Log,
}

/// A mistake in a file.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct Mistake {
    /// What was expected and what was found.
    pub message: String,
    /// The line, from 1; `null` where none is known.
    pub line: Option<usize>,
    /// The column, from 1: characters in TOML, fields in CSV; `null` where none is known.
    pub column: Option<usize>,
    /// The nearest right thing; `null` where none is known.
    pub help: Option<String>,
    #[serde(skip)]
    #[cfg_attr(feature = "schema", schemars(skip))]
    error: Error,
}

impl Mistake {
    pub(crate) fn new(error: Error) -> Self {
        Self {
            message: error.message().to_owned(),
            line: error.line(),
            column: error.column(),
            help: error.help().map(str::to_owned),
            error,
        }
    }

    /// As the error that it is.
    pub fn error(&self) -> &Error {
        &self.error
    }
}

impl Answer for CheckAnswer {
    const SCHEMA: &'static str = "loopsight/check/1";
}

impl CheckAnswer {
    pub(crate) fn new(files: Vec<Checked>) -> Self {
        Self {
            schema: Self::SCHEMA,
            right: files.iter().all(|file| file.right),
            files,
        }
    }
}

impl Checked {
    pub(crate) fn right(file: &str, kind: Option<FileKind>, summary: String) -> Self {
        Self {
            file: file.to_owned(),
            right: true,
            kind,
            summary,
            without_value: Vec::new(),
            columns: Vec::new(),
            faults: Vec::new(),
            mistake: None,
        }
    }
}
