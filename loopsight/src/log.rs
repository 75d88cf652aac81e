//! A log: what was applied and what was measured.

mod memory;

use std::ops::Range;
use std::path::Path;

use loopsight_recordings::output::Written;
use loopsight_recordings::{RecordingError, Source, Table};

use crate::error::{Error, Result};
use crate::model::Model;

pub use memory::LogBuilder;

/// What was applied to a machine and what was measured, as it stands in a file or in memory.
///
/// A log is read as it is. Its columns are matched with the signals of a model, its units converted and
/// its faults found when a [`Session`](crate::Session) is made of both.
#[derive(Clone, Debug)]
pub struct Log {
    pub(crate) source: Source,
    pub(crate) name: String,
    /// The text, for messages that show a line.
    text: Option<String>,
}

/// Refuses what need not have an end, other than a pipe.
#[cfg(unix)]
fn endless(path: &Path) -> Result<()> {
    use std::os::unix::fs::FileTypeExt as _;
    // Of a file that is not there somebody else says so.
    let found = std::fs::metadata(path).map(|m| m.file_type());
    if found.is_ok_and(|t| t.is_char_device() || t.is_block_device() || t.is_socket()) {
        let shown = path.display();
        let message = format!("cannot read {shown}: it is a device or a socket, expected a file");
        return Err(Error::request(message));
    }
    Ok(())
}

/// There are only files here.
#[cfg(not(unix))]
fn endless(_: &Path) -> Result<()> {
    Ok(())
}

impl Log {
    /// Reads a log: CSV with units at the end of the names (`voltage_right_V`), SysId JSON, or what other
    /// programs write: WPILOG, ULog, MCAP, ROS 2 bags (the folder), MATLAB, NumPy, and with the feature
    /// `all-formats` HDF5, Parquet, Arrow. The content decides, not the name; gzip and zstd are taken off.
    ///
    /// # Errors
    ///
    /// The file cannot be read, or is no log: with the line and the field, where it has lines.
    pub fn read(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        let name = path.display().to_string();
        endless(path)?;
        match loopsight_recordings::read(path) {
            Ok(source) => Ok(Self {
                // Read again where a message has to show a line: a log may be large.
                text: None,
                source,
                name,
            }),
            Err(error) => {
                let text = std::fs::read_to_string(path).ok();
                Err(Error::in_log(&error, &name, text.as_deref()))
            }
        }
    }

    /// Reads a log from bytes: what a file of it would hold; `name` stands for the file in messages.
    ///
    /// ```
    /// let text = "time_s,voltage_V,speed_rpm\n0.0,0,0\n0.5,6,30\n1.0,6,60\n";
    /// let log = loopsight::Log::from_bytes("motor.csv", text.as_bytes())?;
    /// assert_eq!(log.columns(), ["time_s", "voltage_V", "speed_rpm"]);
    ///
    /// let wrong = loopsight::Log::from_bytes("motor.csv", b"time_s,u_V\n0.0,x\n").unwrap_err();
    /// assert_eq!((wrong.line(), wrong.column()), (Some(2), Some(2)));
    /// # Ok::<(), loopsight::Error>(())
    /// ```
    ///
    /// # Errors
    ///
    /// As [`Log::read`].
    pub fn from_bytes(name: &str, bytes: &[u8]) -> Result<Self> {
        let text = std::str::from_utf8(bytes).ok();
        match loopsight_recordings::read_bytes(bytes, name) {
            Ok(source) => Ok(Self {
                source,
                name: name.to_owned(),
                text: text.map(str::to_owned),
            }),
            Err(error) => Err(Error::in_log(&error, name, text)),
        }
    }

    /// Begins a log of numbers that are in memory; `name` stands for a file in messages and titles.
    ///
    /// ```
    /// let log = loopsight::Log::in_memory("bench test")
    ///     .column("time", "s", &[0.0, 0.01, 0.02])
    ///     .column("voltage", "V", &[0.0, 6.0, 6.0])
    ///     .column("speed", "rpm", &[0.0, 12.0, f64::NAN])   // NaN: no sample
    ///     .build()?;
    /// assert_eq!((log.runs(), log.rows()), (1, 3));
    /// # Ok::<(), loopsight::Error>(())
    /// ```
    pub fn in_memory<'a>(name: &str) -> LogBuilder<'a> {
        LogBuilder::new(name)
    }

    pub(crate) fn of_table(table: Table) -> Self {
        Self {
            name: table.source.clone(),
            source: Source::Table(table),
            text: None,
        }
    }

    /// The file, or the name under which it was handed over.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The columns, with units at the end of the names.
    pub fn columns(&self) -> Vec<String> {
        self.source.table().column_texts()
    }

    /// Number of runs that the log itself separates.
    pub fn runs(&self) -> usize {
        self.source.table().runs.len()
    }

    /// Number of rows of all runs.
    pub fn rows(&self) -> usize {
        let table = self.source.table();
        let width = table.columns.len().max(1);
        table.runs.iter().map(|run| run.rows.len() / width).sum()
    }

    /// The values of a column, by its name in [`Log::columns`]: those of all runs, one after another. `NaN` where
    /// there is no sample, `None` where there is no such column.
    ///
    /// ```
    /// let log = loopsight::Log::from_bytes("motor.csv", b"time_s,speed_rpm\n0.0,0\n0.5,30\n")?;
    /// assert_eq!(log.column("speed_rpm"), Some(vec![0.0, 30.0]));
    /// # Ok::<(), loopsight::Error>(())
    /// ```
    pub fn column(&self, name: &str) -> Option<Vec<f64>> {
        let table = self.source.table();
        let at = table.columns.iter().position(|c| c.text == name)?;
        let rows = table
            .runs
            .iter()
            .flat_map(|run| run.rows.chunks_exact(table.columns.len()));
        Some(rows.map(|row| row[at]).collect())
    }

    /// The rows `rows` of the log, counted from 0 over all its runs: to fit to one part and judge on another.
    /// A part of a log that describes itself does so no more.
    #[must_use]
    pub fn part(&self, rows: Range<usize>) -> Self {
        let mut table = self.source.table().into_owned();
        let width = table.columns.len().max(1);
        let mut before = 0;
        for run in &mut table.runs {
            let n = run.rows.len() / width;
            let of_run = |row: usize| row.saturating_sub(before).min(n);
            let (start, end) = (of_run(rows.start), of_run(rows.end));
            let kept = start..end.max(start);
            run.rows = run.rows[width * kept.start..width * kept.end].to_vec();
            if run.first_line > 0 {
                run.first_line += kept.start;
            }
            if let Some(lines) = run.lines.get(kept) {
                run.lines = lines.to_vec();
            }
            before += n;
        }
        table.runs.retain(|run| !run.rows.is_empty());
        Self {
            source: Source::Table(table),
            ..self.clone()
        }
    }

    /// The log without the runs of these names, as the log has them or as faults name them (`#1` where they
    /// have none).
    ///
    /// # Errors
    ///
    /// There is no such run, or none is left.
    pub fn without_runs(self, names: &[&str]) -> Result<Self> {
        if names.is_empty() {
            return Ok(self);
        }
        let all: Vec<String> = match &self.source {
            Source::SysId(log) => log.runs.iter().map(|run| run.name.clone()).collect(),
            Source::Table(table) => table.runs.iter().map(|run| run.name.clone()).collect(),
            // One recording of a session: a model's `[log]` cuts it.
            Source::Channels(_) => vec![String::new()],
        };
        let named = |index: usize, run: &str| match run {
            "" => format!("#{}", index + 1),
            name => name.to_owned(),
        };
        let known: Vec<String> = (all.iter().enumerate())
            .map(|(index, run)| named(index, run))
            .collect();
        if let Some(missing) = names.iter().find(|name| !known.iter().any(|k| k == *name)) {
            return Err(Error::request(format!(
                "{} has no run `{missing}`: its runs are {}",
                self.name,
                known.join(", ")
            )));
        }
        if known.iter().all(|run| names.contains(&run.as_str())) {
            return Err(Error::request(format!(
                "{}: no run is left without {}",
                self.name,
                names.join(", ")
            )));
        }
        let mut log = self;
        let mut kept = known.iter().map(|run| !names.contains(&run.as_str()));
        match &mut log.source {
            Source::SysId(sysid) => sysid.runs.retain(|_| kept.next().unwrap_or(true)),
            Source::Table(table) => table.runs.retain(|_| kept.next().unwrap_or(true)),
            Source::Channels(_) => {}
        }
        Ok(log)
    }

    /// Whether its time stamps are a column, of which only the name says the unit.
    pub(crate) fn has_columns_of_time(&self) -> bool {
        match &self.source {
            Source::Table(_) => true,
            Source::Channels(log) => log.clocks.is_empty(),
            Source::SysId(_) => false,
        }
    }

    /// Writes the log as CSV, whole or not at all. Several runs are told apart by a column `run` with their
    /// numbers.
    ///
    /// # Errors
    ///
    /// The file cannot be written.
    pub fn save(&self, path: impl AsRef<Path>) -> Result<Written> {
        let path = path.as_ref();
        let table = self.source.table();
        let mut headers = self.columns();
        let width = headers.len().max(1);
        let mut rows = Vec::new();
        let numbered = table.runs.len() > 1;
        if numbered {
            headers.insert(0, "run".to_owned());
        }
        for (number, run) in (1_u32..).zip(&table.runs) {
            for row in run.rows.chunks_exact(width) {
                rows.extend(numbered.then_some(f64::from(number)));
                rows.extend(row);
            }
        }
        loopsight_recordings::write_csv(path, &headers, &rows)
            .map_err(|error| Error::in_log(&error, &path.display().to_string(), None))
    }

    /// The model that a log brings which describes itself (SysId JSON): its parameters are unknown.
    /// `None` for any other log.
    ///
    /// # Errors
    ///
    /// What the log says of its mechanism makes no model.
    pub fn model(&self) -> Option<Result<Model>> {
        let text = self.source.model_toml()?;
        Some(Model::from_toml(
            &format!("model made from {}", self.name),
            &text,
        ))
    }

    /// An error in this log, with its line where there is one.
    pub(crate) fn wrong(&self, error: &RecordingError) -> Error {
        match &self.text {
            Some(text) => Error::in_log(error, &self.name, Some(text)),
            None => {
                let text = std::fs::read_to_string(&self.name).ok();
                Error::in_log(error, &self.name, text.as_deref())
            }
        }
    }
}
