//! What can go wrong, in one type: what was expected, what was found, and where.

use std::fmt;
use std::ops::Range;

use loopsight_diagnosis::{Cancelled, CompareError, FitError, QuestionError};
use loopsight_model::config::{ConfigError, ReadError};
use loopsight_model::model::ModelError;
use loopsight_model::registry::RegistryError;
use loopsight_recordings::RecordingError;
use loopsight_recordings::output::OutputError;

/// The result of everything in this crate that can fail.
pub type Result<T> = std::result::Result<T, Error>;

/// Who has to do something about an [`Error`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum ErrorKind {
    /// The request or a file is wrong: correct it. The command ends with status 2.
    Request,
    /// The work failed, though the request was right. The command ends with status 1.
    Work,
    /// The work was cancelled before it had a result. The command ends with status 1.
    Cancelled,
}

/// What went wrong, and where.
///
/// ```
/// let wrong = loopsight::Model::from_toml("robot.toml", "[plant.ddmr]\nhalf_trak = 0.1\n").unwrap_err();
/// assert_eq!((wrong.file(), wrong.line()), (Some("robot.toml"), Some(2)));
/// assert_eq!(wrong.help(), Some("did you mean `half_track`?"));
/// ```
#[derive(Clone)]
pub struct Error(Box<Inner>);

#[derive(Clone, Debug)]
struct Inner {
    kind: ErrorKind,
    message: String,
    help: Option<String>,
    file: Option<String>,
    line: Option<usize>,
    column: Option<usize>,
    /// The text with the mistake, and where in it; the message then names no place.
    shown: Option<Shown>,
}

/// A text with a mistake in it.
#[derive(Clone, Debug)]
struct Shown {
    text: String,
    /// In bytes.
    span: Range<usize>,
    /// Whether the message names the place itself.
    named: bool,
}

impl Error {
    fn new(kind: ErrorKind, message: impl Into<String>) -> Self {
        Self(Box::new(Inner {
            kind,
            message: message.into(),
            help: None,
            file: None,
            line: None,
            column: None,
            shown: None,
        }))
    }

    /// The request or a file is wrong.
    pub(crate) fn request(message: impl Into<String>) -> Self {
        Self::new(ErrorKind::Request, message)
    }

    /// The work failed.
    pub(crate) fn work(message: impl Into<String>) -> Self {
        Self::new(ErrorKind::Work, message)
    }

    /// With what to do about it.
    pub(crate) fn with_help(mut self, help: String) -> Self {
        self.0.help = Some(help);
        self
    }

    /// Who has to do something about it.
    pub fn kind(&self) -> ErrorKind {
        self.0.kind
    }

    /// What was expected and what was found.
    pub fn message(&self) -> &str {
        &self.0.message
    }

    /// The nearest right thing, where one is known.
    pub fn help(&self) -> Option<&str> {
        self.0.help.as_deref()
    }

    /// The file, or the name under which a text was handed over.
    pub fn file(&self) -> Option<&str> {
        self.0.file.as_deref()
    }

    /// The line, from 1.
    pub fn line(&self) -> Option<usize> {
        self.0.line
    }

    /// The column, from 1: characters in TOML, fields in CSV.
    pub fn column(&self) -> Option<usize> {
        self.0.column
    }

    /// What a command that ends with this error returns: 1 or 2.
    pub fn exit_status(&self) -> u8 {
        match self.0.kind {
            ErrorKind::Request => 2,
            ErrorKind::Work | ErrorKind::Cancelled => 1,
        }
    }

    /// The text with the mistake in it, and where in it, in bytes; where it is at hand.
    pub fn excerpt(&self) -> Option<(&str, Range<usize>)> {
        let shown = self.0.shown.as_ref()?;
        Some((&shown.text, shown.span.clone()))
    }

    /// An error in a log; `text` is the log as text, where it is at hand.
    pub(crate) fn in_log(error: &RecordingError, file: &str, text: Option<&str>) -> Self {
        // A full disk is not a mistake in the request.
        let written = matches!(error, RecordingError::Output(error) if !error.is_request());
        let mut this = if written {
            Self::work(error.to_string())
        } else {
            Self::request(error.to_string())
        };
        this.0.file = Some(file.to_owned());
        if error.needs_all_formats() {
            this.0.help = Some(ALL_FORMATS.to_owned());
        }
        let Some((line, field)) = place(error) else {
            return this;
        };
        (this.0.line, this.0.column) = (Some(line), field);
        this.0.shown = text.and_then(|text| {
            let span = span(text, line, field)?;
            let text = text.to_owned();
            let named = true;
            Some(Shown { text, span, named })
        });
        this
    }
}

/// How to get a program that reads and writes every format.
const ALL_FORMATS: &str =
    "the command with every format: `cargo install --path loopsight --features all-formats`";

/// Line and field (both from 1) of an error in a log.
fn place(error: &RecordingError) -> Option<(usize, Option<usize>)> {
    match error {
        RecordingError::NotANumber { line, column, .. }
        | RecordingError::NotATime { line, column, .. } => Some((*line, Some(*column))),
        RecordingError::FieldCount { line, .. } => Some((*line, None)),
        RecordingError::DuplicateColumn { line, second, .. } => Some((*line, Some(*second))),
        RecordingError::MissingValue { at, .. } | RecordingError::AbsurdValue { at, .. } => {
            at.line.map(|line| (line, Some(at.column_number)))
        }
        _ => None,
    }
}

/// Where a field of a line stands, or the whole line, in bytes.
fn span(text: &str, line: usize, field: Option<usize>) -> Option<Range<usize>> {
    let mut start = 0;
    let mut lines = text.split_inclusive('\n');
    for before in lines.by_ref().take(line.checked_sub(1)?) {
        start += before.len();
    }
    let found = lines.next()?.trim_end_matches(['\n', '\r']);
    let mut at = start;
    for (i, piece) in found.split(',').enumerate() {
        if Some(i + 1) == field {
            return Some(at..at + piece.len());
        }
        at += piece.len() + 1;
    }
    Some(start..start + found.len())
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let inner = &self.0;
        if let (Some(file), Some(line), Some(column)) = (&inner.file, inner.line, inner.column)
            && inner.shown.as_ref().is_some_and(|shown| !shown.named)
        {
            write!(f, "{file}:{line}:{column}: ")?;
        }
        f.write_str(&inner.message)?;
        match &inner.help {
            Some(help) => write!(f, " ({help})"),
            None => Ok(()),
        }
    }
}

impl fmt::Debug for Error {
    /// What `fn main() -> loopsight::Result<()>` prints: the message, not the fields.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

impl std::error::Error for Error {}

impl From<Box<ConfigError>> for Error {
    fn from(error: Box<ConfigError>) -> Self {
        let mut this = Self::request(error.message);
        this.0.help = error.help;
        this.0.file = Some(error.file);
        (this.0.line, this.0.column) = (Some(error.line), Some(error.column));
        this.0.shown = Some(Shown {
            text: error.text,
            span: error.span,
            named: false,
        });
        this
    }
}

impl From<ReadError> for Error {
    fn from(error: ReadError) -> Self {
        let mut this = Self::request(error.to_string());
        this.0.file = Some(error.path.display().to_string());
        this
    }
}

impl From<ModelError> for Error {
    fn from(error: ModelError) -> Self {
        match error {
            ModelError::Config(error) => error.into(),
            ModelError::Read(error) => error.into(),
            ModelError::Registry(error) => error.into(),
        }
    }
}

impl From<RegistryError> for Error {
    fn from(error: RegistryError) -> Self {
        Self::work(error.to_string())
    }
}

impl From<OutputError> for Error {
    fn from(error: OutputError) -> Self {
        if error.is_request() {
            Self::request(error.to_string())
        } else {
            Self::work(error.to_string())
        }
    }
}

impl From<Cancelled> for Error {
    fn from(cancelled: Cancelled) -> Self {
        Self::new(ErrorKind::Cancelled, cancelled.to_string())
    }
}

impl From<CompareError> for Error {
    fn from(error: CompareError) -> Self {
        match error {
            CompareError::Diverged { .. } => Self::work(error.to_string()),
            CompareError::Cancelled(cancelled) => cancelled.into(),
            _ => Self::request(error.to_string()),
        }
    }
}

impl From<FitError> for Error {
    fn from(error: FitError) -> Self {
        match error {
            FitError::Compare(error) => error.into(),
            FitError::Solver(_) => Self::work(error.to_string()),
            FitError::Cancelled(cancelled) => cancelled.into(),
            _ => Self::request(error.to_string()),
        }
    }
}

impl From<QuestionError> for Error {
    fn from(error: QuestionError) -> Self {
        match error {
            QuestionError::Unstable | QuestionError::Excitation(_) => Self::work(error.to_string()),
            QuestionError::Cancelled(cancelled) => cancelled.into(),
            _ => Self::request(error.to_string()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_field_of_a_line_is_found() {
        let text = "a,b\r\n1,22\r\n3,x\r\n";
        assert_eq!(span(text, 2, Some(2)).map(|s| &text[s]), Some("22"));
        assert_eq!(span(text, 3, None).map(|s| &text[s]), Some("3,x"));
        assert_eq!(span(text, 3, Some(7)).map(|s| &text[s]), Some("3,x"));
        assert_eq!(span(text, 0, None), None);
        assert_eq!(span(text, 9, None), None);
    }
}
