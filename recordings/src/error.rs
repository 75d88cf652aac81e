//! What can be wrong with a file, said with place, expectation and finding.

mod location;

use loopsight_model::run::RunError;
use std::path::PathBuf;

use loopsight_core::unit::{Dimension, UnitError};
use loopsight_formats::FormatError;

use crate::names::{did_you_mean, list};
use crate::output::OutputError;
pub use location::Location;

/// Why a log cannot be read, mapped or written.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RecordingError {
    /// The operating system refused.
    #[error("{}: cannot {action}: {message}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What was tried.
        action: &'static str,
        /// What the system said.
        message: Box<str>,
    },
    /// A log cannot be written.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// A folder where a file is expected.
    #[error("{}: this is a folder; a log is a CSV file or a SysId JSON file", path.display())]
    Directory {
        /// The folder.
        path: PathBuf,
    },
    /// What a run says makes no sense together.
    #[error("{log}: {error}")]
    Run {
        /// The file.
        log: Box<str>,
        /// What is wrong with the run.
        error: RunError,
    },
    /// No content at all.
    #[error("{log}: the file is empty")]
    Empty {
        /// The file.
        log: Box<str>,
    },
    /// Zero bytes in it.
    #[error(
        "{log}: a binary file (byte {position} is zero); expected CSV or SysId JSON as UTF-8 text"
    )]
    Binary {
        /// The file.
        log: Box<str>,
        /// Byte, from 1.
        position: usize,
    },
    /// Not UTF-8.
    #[error("{log}:{line}:{column}: the text is not UTF-8; save it as UTF-8")]
    NotUtf8 {
        /// The file.
        log: Box<str>,
        /// Line, from 1.
        line: usize,
        /// Byte in the line, from 1.
        column: usize,
    },
    /// A log of channels that has none.
    #[error("{log}: this log has no channels{}", cut.as_deref().map(|cut| format!("; {cut}")).unwrap_or_default())]
    NoChannels {
        /// The file.
        log: Box<str>,
        /// Where it ends too early, if it does.
        cut: Option<Box<str>>,
    },
    /// Neither CSV nor SysId JSON.
    #[error(
        "{log}: unknown format: {found}; expected CSV with a header, or SysId JSON with the keys \"test\" and \"units\""
    )]
    UnknownFormat {
        /// The file.
        log: Box<str>,
        /// What is there instead.
        found: Box<str>,
    },
    /// JSON that does not parse.
    #[error("{log}:{line}:{column}: {}: {message}", if *truncated { "the JSON ends too early (truncated?)" } else { "not valid JSON" })]
    Json {
        /// The file.
        log: Box<str>,
        /// Line, from 1.
        line: usize,
        /// Column, from 1.
        column: usize,
        /// The file ends in the middle.
        truncated: bool,
        /// What the parser said.
        message: Box<str>,
    },
    /// A key of a SysId file is missing.
    #[error(
        "{log}: the key \"{key}\" is missing; expected {expected}{}; the keys are {}",
        did_you_mean(nearest),
        list(keys)
    )]
    SysIdKey {
        /// The file.
        log: Box<str>,
        /// The key.
        key: &'static str,
        /// What it should hold.
        expected: &'static str,
        /// The nearest key there is.
        nearest: Option<Box<str>>,
        /// All keys there are.
        keys: Box<[String]>,
    },
    /// A key of a SysId file holds something else.
    #[error(
        "{log}: \"{key}\": expected {expected}, found {found}{}",
        did_you_mean(nearest)
    )]
    SysIdValue {
        /// The file.
        log: Box<str>,
        /// The key.
        key: Box<str>,
        /// What it should hold.
        expected: Box<str>,
        /// What it holds.
        found: Box<str>,
        /// The nearest thing that would do.
        nearest: Option<Box<str>>,
    },
    /// A row of a SysId run is wrong.
    #[error("{log}: run \"{run}\", row {row}: expected {expected}, found {found}")]
    SysIdRow {
        /// The file.
        log: Box<str>,
        /// The run.
        run: Box<str>,
        /// Row, from 1.
        row: usize,
        /// What it should be.
        expected: Box<str>,
        /// What it is.
        found: Box<str>,
    },
    /// Two columns of one name.
    #[error("{log}:{line}: columns {first} and {second} are both named `{name}`")]
    DuplicateColumn {
        /// The file.
        log: Box<str>,
        /// Line of the header.
        line: usize,
        /// The name.
        name: Box<str>,
        /// Number of the first, from 1.
        first: usize,
        /// Number of the second.
        second: usize,
    },
    /// Nothing below the header.
    #[error("{log}: there is a header but no row of numbers below it")]
    HeaderOnly {
        /// The file.
        log: Box<str>,
    },
    /// A row of another length.
    #[error("{log}:{line}: expected {expected} fields as in the header, found {found}")]
    FieldCount {
        /// The file.
        log: Box<str>,
        /// Line, from 1.
        line: usize,
        /// Fields of the header.
        expected: usize,
        /// Fields of the row.
        found: usize,
    },
    /// A field that is no number.
    #[error("{log}:{line}: column {column} (`{name}`): expected a number, found `{text}`")]
    NotANumber {
        /// The file.
        log: Box<str>,
        /// Line, from 1.
        line: usize,
        /// Number of the column, from 1.
        column: usize,
        /// Its header.
        name: Box<str>,
        /// The field.
        text: Box<str>,
    },
    /// A field of a column of dates and times that is none.
    #[error(
        "{log}:{line}: column {column} (`{name}`): expected a date and time as in `2024-05-01T12:00:00.125Z`, found `{text}`"
    )]
    NotATime {
        /// The file.
        log: Box<str>,
        /// Line, from 1.
        line: usize,
        /// Number of the column, from 1.
        column: usize,
        /// Its header.
        name: Box<str>,
        /// The field.
        text: Box<str>,
    },
    /// A format that this build does not write.
    #[error("cannot write `{}`: this program was built without the feature `all-formats` that writes Parquet", path.display())]
    NotBuilt {
        /// The file.
        path: PathBuf,
    },
    /// `side_by_side` without a column that it is for.
    #[error(
        "`side_by_side` lists {count} experiments, and no column in [log] has `{{}}` where their labels stand: `column = \"u{{}}\"`"
    )]
    NoExperiments {
        /// How many are listed.
        count: usize,
    },
    /// A time stamp or an input is missing.
    #[error("{log}: {at}: the value is missing; {role} must have a value in every row")]
    MissingValue {
        /// The file.
        log: Box<str>,
        /// Where.
        at: Box<Location>,
        /// `the time` or `an input`.
        role: &'static str,
    },
    /// A magnitude no control loop has.
    #[error(
        "{log}: {at}: the value {value} is absurd: its magnitude is {limit:e} or more in SI units"
    )]
    AbsurdValue {
        /// The file.
        log: Box<str>,
        /// Where.
        at: Box<Location>,
        /// The value, in SI.
        value: f64,
        /// The limit.
        limit: f64,
    },
    /// No column for something the model needs.
    #[error(
        "{log}: no column for {role} `{id}` ({wanted}){}; the columns are {}",
        did_you_mean(nearest),
        list(columns)
    )]
    MissingColumn {
        /// The file.
        log: Box<str>,
        /// `the time`, `the input`, `the measured signal` or `the run`.
        role: &'static str,
        /// Id of the signal.
        id: Box<str>,
        /// What was looked for.
        wanted: Box<str>,
        /// The nearest column.
        nearest: Option<Box<str>>,
        /// All columns.
        columns: Box<[String]>,
    },
    /// Channels without time stamps that do not belong to the same rows.
    #[error(
        "{log}: `{first}` has {rows} values and `{second}` has {found}; channels without time stamps must have the same number"
    )]
    ChannelLengths {
        /// The file.
        log: Box<str>,
        /// One channel.
        first: Box<str>,
        /// Its values.
        rows: usize,
        /// Another.
        second: Box<str>,
        /// Its values.
        found: usize,
    },
    /// Nothing but runs of one row.
    #[error(
        "{log}: one row{} is no recording; expected rows at least two sampling periods long{}",
        if *runs > 1 { format!(" in each of {runs} runs") } else { String::new() },
        if *runs > 1 { "; is the column of the time, or of the run, another one?" } else { "" }
    )]
    OneRow {
        /// The file.
        log: Box<str>,
        /// Number of runs, each of one row.
        runs: usize,
    },
    /// Time stamps that are no seconds.
    #[error(
        "{log}: {at}: the time {stamp} is taken as seconds, which is after the year 5000; in {unit} it is a time of these years: say `time = {{ column = \"{}\", unit = \"{unit}\" }}` in the model's [log]", at.column
    )]
    NotSeconds {
        /// The file.
        log: Box<str>,
        /// Where.
        at: Box<Location>,
        /// The stamp, s.
        stamp: f64,
        /// What it seems to be in.
        unit: &'static str,
    },
    /// A part of a log without a row.
    #[error(
        "{log}: [log] {key} = [{from}, {to}] has no row; the log has {} to {}", span.0, span.1
    )]
    EmptyPart {
        /// The file.
        log: Box<str>,
        /// `rows` or `times_s`.
        key: &'static str,
        /// Where it begins.
        from: f64,
        /// Where it ends.
        to: f64,
        /// What the log has, from and to.
        span: (f64, f64),
    },
    /// Rows of a log whose channels have none in common.
    #[error(
        "{log}: [log] rows: its channels have time stamps of their own and no rows in common; say `times_s = [from, to]`"
    )]
    RowsOfClocks {
        /// The file.
        log: Box<str>,
    },
    /// Most rows are earlier than the one before.
    #[error(
        "{log}: time runs backwards: in `{column}` {back} of {rows} rows are earlier than the row before; sort the rows by time, or name another column as `time` in the model's [log]"
    )]
    TimeBackwards {
        /// The file.
        log: Box<str>,
        /// The column of time stamps.
        column: Box<str>,
        /// Rows that are earlier than the one before.
        back: usize,
        /// All rows.
        rows: usize,
    },
    /// A log of another program that cannot be read.
    #[error(transparent)]
    Format(Box<FormatError>),
    /// Two things that stamp the rows.
    #[error(
        "[log] has both `time` and `period_s`: a log has time stamps or even rows; leave one of them out"
    )]
    TimeTwice,
    /// A period that is none.
    #[error("[log] period_s = {period}: expected a time above 0")]
    BadPeriod {
        /// What was given, s.
        period: f64,
    },
    /// The log has no signal of the plant.
    #[error(
        "{log}: no column is a signal of the model; the signals are {}; the columns are {}; name one under [log.measured]",
        list(signals),
        list(columns)
    )]
    NothingMeasured {
        /// The file.
        log: Box<str>,
        /// Signals of the plant.
        signals: Box<[String]>,
        /// All columns.
        columns: Box<[String]>,
    },
    /// The map names a signal that the plant does not have.
    #[error(
        "[{table}] names `{id}`, which the plant does not have{}; it has {}",
        did_you_mean(nearest),
        list(known)
    )]
    UnknownSignal {
        /// `log.inputs` or `log.measured`.
        table: &'static str,
        /// The id.
        id: Box<str>,
        /// The nearest signal.
        nearest: Option<Box<str>>,
        /// All signals.
        known: Box<[String]>,
    },
    /// A unit that is none.
    #[error("{log}: column `{column}`: `{unit}` is not a unit: at `{}`: {error}", error.piece(unit))]
    BadUnit {
        /// The file.
        log: Box<str>,
        /// The column, or the signal whose unit it is.
        column: Box<str>,
        /// The text.
        unit: Box<str>,
        /// What is wrong with it.
        error: UnitError,
    },
    /// A unit that measures something else.
    #[error(
        "{log}: column `{column}` is in {unit} ({found}), but `{id}` is in {expected_unit} ({expected}); if the ending of the name is no unit, give `unit = \"{expected_unit}\"` in the model's [log]; if a factor turns one into the other, its unit is `scale_unit`: a radius of 0.1 m makes m/s of rpm by `scale = 0.1, scale_unit = \"m/rad\"`"
    )]
    UnitMismatch {
        /// The file.
        log: Box<str>,
        /// The column.
        column: Box<str>,
        /// Its unit.
        unit: Box<str>,
        /// Its unit in SI base units.
        found: Dimension,
        /// The signal.
        id: Box<str>,
        /// Its unit.
        expected_unit: Box<str>,
        /// Its unit in SI base units.
        expected: Dimension,
    },
    /// A scale that is no number, or zero.
    #[error("column `{column}`: the scale {scale} must be a finite number, not 0")]
    BadScale {
        /// The column.
        column: Box<str>,
        /// The scale.
        scale: f64,
    },
    /// A column of words where numbers are needed.
    #[error(
        "{log}: {at}: `{id}` needs numbers, found the text `{text}`; name another column for it in the model's [log]"
    )]
    TextColumn {
        /// The file.
        log: Box<str>,
        /// Where.
        at: Box<Location>,
        /// Who needs it.
        id: Box<str>,
        /// The first text.
        text: Box<str>,
    },
    /// A row handed to a writer does not fit its header.
    #[error("{}: a row has {found} values, the header has {expected} columns", path.display())]
    RowWidth {
        /// The file.
        path: PathBuf,
        /// Columns of the header.
        expected: usize,
        /// Values of the row.
        found: usize,
    },
}

impl From<FormatError> for RecordingError {
    fn from(error: FormatError) -> Self {
        match error {
            FormatError::Io { path, message } => RecordingError::Io {
                path,
                action: "read",
                message,
            },
            FormatError::Empty { log } => RecordingError::Empty { log },
            other => RecordingError::Format(Box::new(other)),
        }
    }
}

impl RecordingError {
    /// Whether a build with the feature `all-formats` would do it.
    pub fn needs_all_formats(&self) -> bool {
        match self {
            RecordingError::NotBuilt { .. } => true,
            RecordingError::Format(error) => matches!(**error, FormatError::NotBuilt { .. }),
            _ => false,
        }
    }
}
