//! A log as it stands in its file: named columns of numbers.

use std::collections::BTreeMap;
use std::ops::Range;

use crate::error::{Location, RecordingError};
use crate::naming;

/// Name of a column of time stamps that a file does not have.
pub(crate) const TIME: &str = "time_s";

/// Columns and rows of a log, in the units of the file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Table {
    /// File name, or what else the log is called.
    pub source: String,
    /// Columns, as in the header.
    pub columns: Vec<ColumnName>,
    /// Rows, in the runs that the file itself separates.
    pub runs: Vec<TableRun>,
    /// Columns of words, by index: the number in a row is the index of the word here.
    pub labels: BTreeMap<usize, Vec<String>>,
    /// The columns were measured at times of their own: what is missing in a row was never there.
    pub own_clocks: bool,
    /// Where and how the file ends too early; empty: it does not.
    pub cut: String,
    /// The column of time stamps where its name does not say it: dates and times, in seconds since the first
    /// of them, or the first column of a file without a header, where it rises throughout.
    pub stamps: Option<usize>,
}

/// Header of one column.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ColumnName {
    /// As in the header, e.g. `speed_rpm`.
    pub text: String,
    /// Without the unit, e.g. `speed`.
    pub name: String,
    /// The unit at the end of the header, e.g. `rpm`.
    pub unit: Option<String>,
}

/// Rows that follow one another.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TableRun {
    /// Name; empty when the file gives none.
    pub name: String,
    /// Values, row by row; NaN: missing.
    pub rows: Vec<f64>,
    /// Line of the first row, from 1; 0 when the format has no lines.
    pub first_line: usize,
    /// Line of every row; empty when rows stand on consecutive lines, or there are none.
    pub lines: Vec<usize>,
}

impl ColumnName {
    /// Splits a header.
    pub fn new(text: &str) -> Self {
        let (name, unit) = naming::split(text);
        Self {
            text: text.to_owned(),
            name: name.to_owned(),
            unit,
        }
    }
}

/// The rows of a run by their numbers, without a list of them.
#[derive(Clone, Copy)]
pub(crate) struct RunRows<'t> {
    values: &'t [f64],
    width: usize,
}

impl<'t> RunRows<'t> {
    pub(crate) fn new(values: &'t [f64], width: usize) -> Self {
        Self {
            values,
            width: width.max(1),
        }
    }

    pub(crate) fn len(self) -> usize {
        self.values.len() / self.width
    }

    pub(crate) fn row(self, at: usize) -> &'t [f64] {
        &self.values[self.width * at..self.width * (at + 1)]
    }

    pub(crate) fn part(self, rows: Range<usize>) -> Self {
        let values = &self.values[self.width * rows.start..self.width * rows.end];
        Self { values, ..self }
    }

    pub(crate) fn iter(self) -> std::slice::ChunksExact<'t, f64> {
        self.values.chunks_exact(self.width)
    }
}

impl TableRun {
    /// Number of the line on which a row (from 0) stands; none when the format has no lines.
    pub fn line(&self, row: usize) -> Option<usize> {
        match self.lines.get(row) {
            Some(line) => Some(*line),
            None if self.first_line > 0 => Some(self.first_line + row),
            None => None,
        }
    }

    /// Some of its rows, each of `width` values.
    pub(crate) fn part(&self, rows: Range<usize>, width: usize) -> Self {
        let Range { start, end } = rows;
        let values = self.rows.get(start * width..end * width);
        Self {
            name: self.name.clone(),
            rows: values.unwrap_or_default().to_vec(),
            first_line: self.line(start).unwrap_or(0),
            lines: self.lines.get(start..end).unwrap_or_default().to_vec(),
        }
    }
}

impl Table {
    /// Headers, as in the file.
    pub fn column_texts(&self) -> Vec<String> {
        self.columns.iter().map(|c| c.text.clone()).collect()
    }

    /// Puts a column of time stamps before the others: a row every `period` seconds.
    pub(crate) fn stamp(&mut self, period: f64) -> Result<(), RecordingError> {
        if !(period.is_finite() && period > 0.0) {
            return Err(RecordingError::BadPeriod { period });
        }
        for run in &mut self.runs {
            let width = self.columns.len().max(1);
            let rows = std::mem::take(&mut run.rows);
            for (k, row) in rows.chunks_exact(width).enumerate() {
                run.rows.push(k as f64 * period);
                run.rows.extend(row);
            }
        }
        // A column of that name that is not the time keeps its place, not its name.
        for column in self.columns.iter_mut().filter(|c| c.text == TIME) {
            column.text.push('\'');
        }
        self.columns.insert(0, ColumnName::new(TIME));
        let labels = std::mem::take(&mut self.labels);
        self.labels = labels.into_iter().map(|(at, w)| (at + 1, w)).collect();
        self.stamps = self.stamps.map(|at| at + 1);
        Ok(())
    }

    /// Rows of a run as slices.
    pub(crate) fn rows<'t>(&self, run: &'t TableRun) -> std::slice::ChunksExact<'t, f64> {
        run.rows.chunks_exact(self.columns.len().max(1))
    }

    /// A column of words where `id` needs numbers.
    pub(crate) fn text_column(&self, column: usize, id: &str, words: &[String]) -> RecordingError {
        let first = self.runs.first().cloned().unwrap_or_default();
        RecordingError::TextColumn {
            log: self.source.as_str().into(),
            at: Box::new(self.location(&first, 0, column)),
            id: id.into(),
            text: words.first().cloned().unwrap_or_default().into(),
        }
    }

    /// Place of a value; `row` and `column` from 0.
    pub(crate) fn location(&self, run: &TableRun, row: usize, column: usize) -> Location {
        Location {
            line: run.line(row),
            run: run.name.clone(),
            row: row + 1,
            column: self
                .columns
                .get(column)
                .map_or_else(String::new, |c| c.text.clone()),
            column_number: column + 1,
        }
    }
}
