//! Logs of numbers that are in memory.

use std::borrow::Cow;

use loopsight_core::unit;
use loopsight_recordings::{ColumnName, Table, TableRun, column};

use super::Log;
use crate::error::{Error, Result};

/// A log in the making; see [`Log::in_memory`].
///
/// One run needs no more than its columns. Of several, each begins with [`LogBuilder::run`] and has the
/// same columns as the first.
///
/// Values are taken, `Vec<f64>`, or only looked at, `&[f64]`: [`LogBuilder::build`] copies them once, into
/// rows.
#[derive(Clone, Debug)]
#[must_use = "`build` makes the log"]
pub struct LogBuilder<'a> {
    name: String,
    runs: Vec<Rows<'a>>,
}

#[derive(Clone, Debug, Default)]
struct Rows<'a> {
    name: String,
    columns: Vec<Named<'a>>,
}

#[derive(Clone, Debug)]
struct Named<'a> {
    name: ColumnName,
    values: Cow<'a, [f64]>,
}

impl Rows<'_> {
    /// The values row by row, of columns of this length.
    fn interleaved(&self, rows: usize) -> Vec<f64> {
        let columns: Vec<&[f64]> = self.columns.iter().map(|c| &c.values[..rows]).collect();
        let width = columns.len();
        let mut values = vec![0.0; rows * width];
        for (block, out) in values.chunks_mut(BLOCK * width).enumerate() {
            for (c, column) in columns.iter().enumerate() {
                let from = column[block * BLOCK..].iter();
                for (to, value) in out[c..].iter_mut().step_by(width).zip(from) {
                    *to = *value;
                }
            }
        }
        values
    }
}

/// Rows that are made at a time, one column after another: so many of some ten columns stay in a processor's
/// first cache.
const BLOCK: usize = 256;

impl<'a> LogBuilder<'a> {
    pub(super) fn new(name: &str) -> Self {
        Self {
            name: name.to_owned(),
            runs: Vec::new(),
        }
    }

    /// Begins another run: what was recorded in one go.
    pub fn run(mut self, name: &str) -> Self {
        self.runs.push(Rows {
            name: name.to_owned(),
            columns: Vec::new(),
        });
        self
    }

    /// A column of the present run: a name, its unit (`1` for a plain number), a value for each row;
    /// `NaN` where there is none. One of them is `time`.
    pub fn column(self, name: &str, unit: &str, values: impl Into<Cow<'a, [f64]>>) -> Self {
        let unit = unit.trim();
        let name = ColumnName {
            text: column(name, unit),
            name: name.to_owned(),
            unit: Some(unit.to_owned()),
        };
        self.push(name, values.into())
    }

    /// A column whose name says its unit at its end, as in a file: `voltage_right_V`, `speed_rpm`. A name
    /// without one is in SI units.
    pub fn header(self, text: &str, values: impl Into<Cow<'a, [f64]>>) -> Self {
        self.push(ColumnName::new(text), values.into())
    }

    fn push(mut self, name: ColumnName, values: Cow<'a, [f64]>) -> Self {
        if self.runs.is_empty() {
            self.runs.push(Rows::default());
        }
        if let Some(run) = self.runs.last_mut() {
            run.columns.push(Named { name, values });
        }
        self
    }

    /// The log.
    ///
    /// # Errors
    ///
    /// There is no column or no row, a unit is none, two columns have one name, columns differ in length
    /// or between runs.
    pub fn build(self) -> Result<Log> {
        let wrong = |why: String| Error::request(format!("{}: {why}", self.name));
        let Some(first) = self.runs.first().filter(|run| !run.columns.is_empty()) else {
            return Err(wrong("the log has no column".to_owned()));
        };
        for (i, named) in first.columns.iter().enumerate() {
            let (name, written) = (&named.name.name, named.name.unit.as_deref());
            if first.columns[..i].iter().any(|c| c.name.name == *name) {
                return Err(wrong(format!("two columns are named `{name}`")));
            }
            if let Some(written) = written
                && let Err(error) = unit::parse(written)
            {
                return Err(wrong(format!(
                    "column `{name}`: `{written}` is not a unit: at `{}`: {error}",
                    error.piece(written)
                )));
            }
        }
        let mut runs = Vec::with_capacity(self.runs.len());
        for run in &self.runs {
            let of = if run.name.is_empty() {
                String::new()
            } else {
                format!(" of run `{}`", run.name)
            };
            let names = |run: &Rows<'_>| -> Vec<ColumnName> {
                run.columns.iter().map(|c| c.name.clone()).collect()
            };
            if names(run) != names(first) {
                return Err(wrong(format!(
                    "the columns{of} are not those of the first run"
                )));
            }
            let rows = run.columns[0].values.len();
            if let Some(other) = run.columns.iter().find(|c| c.values.len() != rows) {
                return Err(wrong(format!(
                    "column `{}`{of} has {} values, column `{}` has {rows}",
                    other.name.name,
                    other.values.len(),
                    run.columns[0].name.name
                )));
            }
            runs.push(TableRun {
                name: run.name.clone(),
                rows: run.interleaved(rows),
                first_line: 0,
                lines: Vec::new(),
            });
        }
        if runs.iter().all(|run| run.rows.is_empty()) {
            return Err(wrong("the log has no row".to_owned()));
        }
        let columns = first.columns.iter().map(|c| c.name.clone());
        Ok(Log::of_table(Table {
            columns: columns.collect(),
            runs,
            source: self.name.clone(),
            ..Table::default()
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_header_says_its_unit_as_in_a_file() {
        let log = Log::in_memory("bench")
            .header("time_s", &[0.0, 0.1])
            .header("speed_rpm", &[0.0, 60.0])
            .column("voltage", "V", &[0.0, 6.0])
            .build()
            .unwrap();
        assert_eq!(log.columns(), ["time_s", "speed_rpm", "voltage_V"]);
        assert_eq!(log.column("voltage_V"), Some(vec![0.0, 6.0]));
        assert_eq!(log.column("voltage"), None);
    }

    #[test]
    fn every_value_comes_back_where_it_was() {
        for rows in [1, BLOCK - 1, BLOCK, 3 * BLOCK + 1] {
            let column =
                |c: usize| -> Vec<f64> { (0..rows).map(|k| (10 * k + c) as f64).collect() };
            let (time, kept) = (column(0), column(1));
            let log = Log::in_memory("bench")
                .column("time", "s", time.clone())
                .column("u", "V", &kept)
                .column("w", "rad/s", column(2))
                .build()
                .unwrap();
            assert_eq!(log.rows(), rows);
            for (c, name) in log.columns().iter().enumerate() {
                assert_eq!(log.column(name), Some(column(c)), "{name}, {rows} rows");
            }
        }
    }

    #[test]
    fn what_does_not_fit_together_is_refused_with_its_name() {
        let begun = || Log::in_memory("bench").column("time", "s", &[0.0, 0.1]);
        let says = |builder: LogBuilder<'_>| builder.build().unwrap_err().to_string();
        for (builder, part) in [
            (Log::in_memory("bench"), "bench: the log has no column"),
            (
                Log::in_memory("bench").run("a").run("b"),
                "bench: the log has no column",
            ),
            (
                begun().column("u", "V", &[1.0]),
                "column `u` has 1 values, column `time` has 2",
            ),
            (
                begun().column("time", "s", &[0.0, 0.1]),
                "two columns are named `time`",
            ),
            (
                begun().column("u", "Volx", &[0.0, 0.1]),
                "`Volx` is not a unit",
            ),
            (
                begun().run("b").column("t", "s", &[0.0]),
                "the columns of run `b` are not those of the first run",
            ),
            (
                Log::in_memory("bench").column("time", "s", &[]),
                "the log has no row",
            ),
        ] {
            let said = says(builder);
            assert!(said.contains(part), "{said}");
        }
    }
}
