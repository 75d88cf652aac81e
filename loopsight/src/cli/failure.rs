//! What goes wrong, shown to a person once.

use std::path::Path;

use loopsight_diagnosis::{CompareError, FitError};
use loopsight_model::config::{ConfigError, ReadError};
use loopsight_model::model::ModelError;
use loopsight_recordings::RecordingError;
use loopsight_report::ReportError;
use miette::{GraphicalReportHandler, GraphicalTheme, LabeledSpan, MietteDiagnostic, NamedSource};

/// An error with the exit status it leads to.
#[derive(Debug)]
pub(crate) struct Failure {
    status: u8,
    text: String,
}

impl Failure {
    /// The request or a file is wrong.
    pub(crate) fn request(text: impl Into<String>) -> Self {
        Self {
            status: 2,
            text: format!("error: {}", text.into()),
        }
    }

    /// The work failed.
    pub(crate) fn work(text: impl Into<String>) -> Self {
        Self {
            status: 1,
            text: format!("error: {}", text.into()),
        }
    }

    pub(crate) fn status(&self) -> u8 {
        self.status
    }

    pub(crate) fn print(&self) {
        eprintln!("{}", self.text.trim_end());
    }

    /// A place in a text, with a caret.
    fn placed(
        message: &str,
        help: Option<&str>,
        file: &str,
        text: &str,
        span: std::ops::Range<usize>,
    ) -> Self {
        let label = LabeledSpan::new_with_span(None, span);
        let mut diagnostic = MietteDiagnostic::new(message.to_owned()).with_label(label);
        if let Some(help) = help {
            diagnostic = diagnostic.with_help(help);
        }
        let report = miette::Report::new(diagnostic)
            .with_source_code(NamedSource::new(file, text.to_owned()));
        let colours = std::io::IsTerminal::is_terminal(&std::io::stderr())
            && std::env::var_os("NO_COLOR").is_none();
        let theme = if colours {
            GraphicalTheme::unicode()
        } else {
            GraphicalTheme::unicode_nocolor()
        };
        let mut shown = String::new();
        let handler = GraphicalReportHandler::new_themed(theme).with_context_lines(1);
        if handler.render_report(&mut shown, report.as_ref()).is_err() {
            shown = format!("{file}: {message}");
        }
        Self {
            status: 2,
            text: shown,
        }
    }
}

impl From<Box<ConfigError>> for Failure {
    fn from(error: Box<ConfigError>) -> Self {
        Self::placed(
            &error.message,
            error.help.as_deref(),
            &error.file,
            &error.text,
            error.span.clone(),
        )
    }
}

impl From<ReadError> for Failure {
    fn from(error: ReadError) -> Self {
        Self::request(error.to_string())
    }
}

impl From<ModelError> for Failure {
    fn from(error: ModelError) -> Self {
        match error {
            ModelError::Config(error) => error.into(),
            ModelError::Read(error) => error.into(),
            ModelError::Registry(_) => Self::work(error.to_string()),
        }
    }
}

impl From<ReportError> for Failure {
    fn from(error: ReportError) -> Self {
        Self::request(error.to_string())
    }
}

impl From<CompareError> for Failure {
    fn from(error: CompareError) -> Self {
        match error {
            CompareError::Diverged { .. } => Self::work(error.to_string()),
            _ => Self::request(error.to_string()),
        }
    }
}

impl From<FitError> for Failure {
    fn from(error: FitError) -> Self {
        match error {
            FitError::Compare(error) => error.into(),
            FitError::Solver(_) => Self::work(error.to_string()),
            _ => Self::request(error.to_string()),
        }
    }
}

/// An error in a log, with the line shown where there is one.
pub(crate) fn recording(path: &Path, error: &RecordingError) -> Failure {
    let message = error.to_string();
    let Some((line, field)) = place(error) else {
        return Failure::request(message);
    };
    let Ok(text) = std::fs::read_to_string(path) else {
        return Failure::request(message);
    };
    let Some(found) = text.lines().nth(line - 1) else {
        return Failure::request(message);
    };
    let start = found.as_ptr() as usize - text.as_ptr() as usize;
    let mut span = start..start + found.len();
    if let Some(field) = field {
        let mut at = start;
        for (i, piece) in found.split(',').enumerate() {
            if i + 1 == field {
                span = at..at + piece.len();
            }
            at += piece.len() + 1;
        }
    }
    Failure::placed(&message, None, &path.display().to_string(), &text, span)
}

/// Line and field (both from 1) of an error in a log.
fn place(error: &RecordingError) -> Option<(usize, Option<usize>)> {
    match error {
        RecordingError::NotANumber { line, column, .. } => Some((*line, Some(*column))),
        RecordingError::FieldCount { line, .. } | RecordingError::NoHeader { line, .. } => {
            Some((*line, None))
        }
        RecordingError::DuplicateColumn { line, second, .. } => Some((*line, Some(*second))),
        RecordingError::MissingValue { at, .. } | RecordingError::AbsurdValue { at, .. } => {
            at.line.map(|line| (line, Some(at.column_number)))
        }
        _ => None,
    }
}
