//! Tables and logs out: whole tables at once as CSV, and live logs row by row, as CSV or MCAP.
//!
//! Numbers are written in the shortest form that reads back to the same bits; NaN, the missing
//! value, as an empty field. Nobody ever sees half a file under the final name.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;
use std::time::Instant;

use loopsight_core::Signal;
use loopsight_core::unit::parse;

use crate::error::RecordingError;
use crate::mcap_log::McapLog;
use crate::output::{Growing, OutputError, OutputFile, Written};
use crate::sync::Syncer;

/// The column of a signal: `linear_velocity` in `m/s` is `linear_velocity_m_per_s`.
///
/// ```
/// use loopsight_core::Signal;
/// use loopsight_recordings::header;
/// let gain = Signal::new("gain", "k", "V s/m", "A gain.");
/// assert_eq!(header(&gain), "gain_V_s_per_m");
/// assert_eq!(header(&Signal::new("duty", "d", "1", "Duty.")), "duty");
/// ```
pub fn header(signal: &Signal) -> String {
    column(signal.id, signal.unit)
}

/// As [`header`], of anything that has a name and a unit.
pub fn column(id: &str, unit: &str) -> String {
    let unit = unit.trim();
    if matches!(unit, "" | "1") {
        return id.to_owned();
    }
    let mut text = format!("{id}_");
    for c in unit
        .strip_prefix("1/")
        .map_or(unit.into(), |rest| format!("/{rest}"))
        .chars()
    {
        match c {
            '/' if text.ends_with('_') => text.push_str("per_"),
            '/' => text.push_str("_per_"),
            ' ' | '*' | '·' | '⋅' | '.' if !text.ends_with('_') => text.push('_'),
            '²' => text.push('2'),
            '³' => text.push('3'),
            ' ' | '^' | '(' | ')' => {}
            c => text.push(c),
        }
    }
    // `V/m s` is V·s/m, but everything behind `per` divides: such a unit keeps its own spelling.
    let ending = text.get(id.len() + 1..).map(parse);
    if ending == Some(parse(unit)) {
        text
    } else {
        format!("{id}_{unit}")
    }
}

/// Writes a table, `rows` row by row, so that the file appears complete or not at all.
///
/// # Errors
///
/// [`RecordingError::Output`], and [`RecordingError::RowWidth`] when `rows` is no whole number of rows.
pub fn write_csv(path: &Path, headers: &[String], rows: &[f64]) -> Result<Written, RecordingError> {
    if headers.is_empty() || !rows.len().is_multiple_of(headers.len()) {
        return Err(RecordingError::RowWidth {
            path: path.to_owned(),
            expected: headers.len(),
            found: rows.len().checked_rem(headers.len()).unwrap_or(rows.len()),
        });
    }
    let mut out = OutputFile::create(path)?;
    let written = write_header(&mut out, headers).and_then(|()| {
        rows.chunks_exact(headers.len())
            .try_for_each(|row| write_row(&mut out, row))
    });
    written
        .and_then(|()| out.flush())
        .map_err(|e| io(path, "write", &e))?;
    Ok(out.finish()?)
}

fn io(path: &Path, action: &'static str, error: &std::io::Error) -> RecordingError {
    OutputError::io(path, action, error).into()
}

fn write_header(out: &mut impl Write, headers: &[String]) -> std::io::Result<()> {
    for (at, header) in headers.iter().enumerate() {
        let separator = if at == 0 { "" } else { "," };
        if header.contains(['"', ',', '\n', '\r', '#']) || header.is_empty() {
            write!(out, "{separator}\"{}\"", header.replace('"', "\"\""))?;
        } else {
            write!(out, "{separator}{header}")?;
        }
    }
    writeln!(out)
}

fn write_row(out: &mut impl Write, row: &[f64]) -> std::io::Result<()> {
    for (at, value) in row.iter().enumerate() {
        let separator = if at == 0 { "" } else { "," };
        match value.is_nan() {
            // One empty field alone would be a blank line.
            true if row.len() == 1 => write!(out, "nan")?,
            true => write!(out, "{separator}")?,
            false => write!(out, "{separator}{value}")?,
        }
    }
    writeln!(out)
}

/// Longest time between flushes, s, by the log's time stamps or by the clock, whichever comes first. A run that is killed
/// loses what came after the last flush, and the period in which it was due. The promise is less than a second, so this is half
/// of it: the other half is for a machine that is late.
const FLUSH_PERIOD: f64 = 0.5;

/// Writes a log while it is made.
///
/// Rows go to `NAME.part` beside the target (`NAME.2.part` and so on when an earlier run left
/// its own there): what is buffered twice a second, and that to the disk about once a second, beside the loop. [`LogWriter::finish`]
/// gives the file its name; dropped before that, the part stays and can be read.
pub struct LogWriter {
    file: Growing,
    out: Out,
    columns: usize,
    /// Time stamp and instant of the last flush.
    flushed: Option<(f64, Instant)>,
    sync: Syncer,
}

/// A log in its format.
enum Out {
    Csv {
        out: BufWriter<File>,
        /// The row that is written: in one piece, so that the buffer breaks between rows.
        row: Vec<u8>,
    },
    Mcap(Box<McapLog>),
}

impl LogWriter {
    /// Creates the part file and writes the header; the first column is the time in seconds. A name
    /// that ends in `.mcap` makes an MCAP file, any other one CSV.
    ///
    /// # Errors
    ///
    /// [`RecordingError::Output`] when the file cannot be created.
    pub fn create(path: &Path, headers: &[String]) -> Result<Self, RecordingError> {
        let (growing, file) = Growing::create(path)?;
        let sync = Syncer::of(&file);
        let out = if path
            .extension()
            .is_some_and(|e| e.eq_ignore_ascii_case("mcap"))
        {
            McapLog::new(file, headers)
                .map(|log| Out::Mcap(Box::new(log)))
                .map_err(std::io::Error::other)
        } else {
            let mut out = BufWriter::new(file);
            let written = write_header(&mut out, headers).and_then(|()| out.flush());
            written.map(|()| Out::Csv {
                out,
                row: Vec::new(),
            })
        };
        let out = out.map_err(|e| io(growing.part(), "write", &e))?;
        Ok(Self {
            file: growing,
            out,
            columns: headers.len(),
            flushed: None,
            sync,
        })
    }

    /// Where the rows are until the log is finished.
    pub fn part_path(&self) -> &Path {
        self.file.part()
    }

    /// Appends a row; the first value is the time in seconds.
    ///
    /// # Errors
    ///
    /// [`RecordingError::RowWidth`] or [`RecordingError::Output`].
    pub fn write(&mut self, row: &[f64]) -> Result<(), RecordingError> {
        if row.len() != self.columns {
            return Err(RecordingError::RowWidth {
                path: self.file.target().to_owned(),
                expected: self.columns,
                found: row.len(),
            });
        }
        let written = match &mut self.out {
            Out::Csv { out, row: text } => {
                text.clear();
                write_row(text, row).and_then(|()| out.write_all(text))
            }
            Out::Mcap(log) => log.row(row).map_err(std::io::Error::other),
        };
        written.map_err(|e| io(self.file.part(), "write", &e))?;
        let time = row.first().copied().unwrap_or(f64::NAN);
        let due = match self.flushed {
            None => {
                self.flushed = Some((time, Instant::now()));
                return Ok(());
            }
            // Written so that a NaN or a clock set back flushes, too.
            Some((last, at)) => {
                !(0.0..FLUSH_PERIOD).contains(&(time - last))
                    || at.elapsed().as_secs_f64() >= FLUSH_PERIOD
            }
        };
        if due { self.flush(time) } else { Ok(()) }
    }

    fn flush(&mut self, time: f64) -> Result<(), RecordingError> {
        self.flushed = Some((time, Instant::now()));
        let flushed = match &mut self.out {
            Out::Csv { out, .. } => out.flush(),
            Out::Mcap(log) => log.flush().map_err(std::io::Error::other),
        };
        self.sync.flushed();
        flushed.map_err(|e| io(self.file.part(), "write", &e))
    }

    /// Writes what happened at a time (s), and all rows so far to the disk: after a run was killed, events are
    /// what one looks for first. In CSV an event is a comment between the rows.
    ///
    /// # Errors
    ///
    /// [`RecordingError::Output`].
    pub fn remark(&mut self, time: f64, text: &str) -> Result<(), RecordingError> {
        let text = text.replace(['\n', '\r'], " ");
        let written = match &mut self.out {
            Out::Csv { out, .. } => writeln!(out, "# {time:.3} s: {text}"),
            Out::Mcap(log) => log.event(time, &text).map_err(std::io::Error::other),
        };
        written.map_err(|e| io(self.file.part(), "write", &e))?;
        self.flush(time)
    }

    /// Writes what is left and gives the file its name.
    ///
    /// # Errors
    ///
    /// [`RecordingError::Output`]; the part file then remains.
    pub fn finish(self) -> Result<Written, RecordingError> {
        let Self { file, out, .. } = self;
        let written = match out {
            Out::Csv { mut out, .. } => out.flush(),
            Out::Mcap(log) => log.finish().map_err(std::io::Error::other),
        };
        written.map_err(|e| io(file.part(), "write", &e))?;
        Ok(file.finish()?)
    }
}

#[cfg(test)]
mod tests {
    use loopsight_core::unit::split_name;
    use proptest::prelude::*;

    use super::*;
    use crate::{read_csv_from, source};

    fn names(names: &[&str]) -> Vec<String> {
        names.iter().map(|n| (*n).to_owned()).collect()
    }

    #[test]
    fn headers_read_back_to_the_unit() {
        for unit in [
            "m/s",
            "rad/s^2",
            "V s/m",
            "1/s",
            "N m s/rad",
            "kg m²",
            "V·s²/m",
            "%",
            "V/m s",
        ] {
            let text = header(&Signal::new("some_signal", "x", unit, "A signal."));
            let (name, ending) = split_name(&text);
            assert_eq!(name, "some_signal", "{text}");
            assert_eq!(parse(ending.unwrap()), parse(unit), "{text}");
        }
    }

    #[test]
    fn a_log_appears_when_it_is_finished() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run.csv");
        let mut log = LogWriter::create(&path, &names(&["time_s", "u_V"])).unwrap();
        for k in 0..250 {
            log.write(&[f64::from(k) * 0.01, 1.0]).unwrap();
        }
        assert!(!path.exists());
        let text = std::fs::read_to_string(log.part_path()).unwrap();
        let last: f64 = text
            .lines()
            .last()
            .unwrap()
            .split(',')
            .next()
            .unwrap()
            .parse()
            .unwrap();
        assert!(last >= 2.49 - 0.5, "{last}");
        let wrong = log.write(&[1.0]).unwrap_err().to_string();
        assert!(
            wrong.ends_with("a row has 1 values, the header has 2 columns"),
            "{wrong}"
        );
        let part = log.part_path().to_owned();
        assert_eq!(log.finish().unwrap().path, path);
        assert!(!part.exists());
        let source::Source::Table(table) = crate::read(&path).unwrap() else {
            panic!("a table")
        };
        assert_eq!(table.runs[0].rows.len(), 500);
    }

    /// By the time stamps of a simulated run, and by the clock of one whose time stamps hardly grow: what a killed run leaves is
    /// never older than half a second.
    #[test]
    fn a_killed_run_loses_half_a_second() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["run.csv", "run.mcap"] {
            let path = folder.path().join(name);
            let mut log = LogWriter::create(&path, &names(&["time_s", "u_V"])).unwrap();
            let size = |log: &LogWriter| std::fs::metadata(log.part_path()).unwrap().len();
            log.write(&[0.0, 1.0]).unwrap();
            let begun = size(&log);
            log.write(&[0.49, 1.0]).unwrap();
            assert_eq!(size(&log), begun, "{name}: not before it is time");
            log.write(&[0.51, 1.0]).unwrap();
            let stamped = size(&log);
            assert!(stamped > begun, "{name}: by the time stamps");
            log.flushed = log.flushed.and_then(|(time, at)| {
                let earlier = at.checked_sub(std::time::Duration::from_millis(500))?;
                Some((time, earlier))
            });
            log.write(&[0.52, 1.0]).unwrap();
            assert!(size(&log) > stamped, "{name}: by the clock");
        }
    }

    /// A power cut costs what came after the last sync.
    #[test]
    fn a_live_log_is_synced_once_a_second() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["run.csv", "run.mcap"] {
            let path = folder.path().join(name);
            let mut log = LogWriter::create(&path, &names(&["time_s", "u_V"])).unwrap();
            for k in 0..1000 {
                log.write(&[f64::from(k) * 0.01, 1.0]).unwrap();
            }
            assert_eq!(log.sync.done(), 0, "not before a second went by");
            log.sync.age();
            log.write(&[20.0, 1.0]).unwrap();
            let synced = (0..2000).any(|_| {
                std::thread::sleep(std::time::Duration::from_millis(5));
                log.sync.done() == 1
            });
            assert!(synced, "{name}");
            log.finish().unwrap();
        }
    }

    /// Also when the buffer is full before it is time to flush.
    #[test]
    fn a_part_ends_with_a_whole_row() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run.csv");
        let mut log = LogWriter::create(&path, &names(&["time_s", "u_V"])).unwrap();
        for k in 0..5000 {
            let sample = f64::from(k);
            log.write(&[sample * 1e-4 + 1e-12, sample.sqrt()]).unwrap();
            if k % 97 == 0 {
                let text = std::fs::read_to_string(log.part_path()).unwrap();
                assert!(text.ends_with('\n'), "after row {k}");
            }
        }
    }

    #[test]
    fn a_remark_is_on_the_disk_at_once_and_is_no_row() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run.csv");
        let mut log = LogWriter::create(&path, &names(&["time_s", "u_V"])).unwrap();
        log.write(&[0.0, 1.0]).unwrap();
        log.remark(0.0, "an actuator\nsaturates").unwrap();
        let text = std::fs::read_to_string(log.part_path()).unwrap();
        assert_eq!(text, "time_s,u_V\n0,1\n# 0.000 s: an actuator saturates\n");
        log.write(&[0.1, 2.0]).unwrap();
        let source::Source::Table(table) = crate::read(&log.finish().unwrap().path).unwrap() else {
            panic!("a table")
        };
        assert_eq!(table.runs[0].rows, [0.0, 1.0, 0.1, 2.0]);
    }

    #[test]
    fn a_killed_run_leaves_its_part_and_the_next_one_spares_it() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run.csv");
        for (run, name) in ["run.csv.part", "run.csv.2.part"].iter().enumerate() {
            let mut log = LogWriter::create(&path, &names(&["time_s"])).unwrap();
            log.write(&[run as f64]).unwrap();
            drop(log);
            let text = std::fs::read_to_string(folder.path().join(name)).unwrap();
            assert_eq!(text, format!("time_s\n{run}\n"));
        }
        assert!(!path.exists());
    }

    #[test]
    fn a_table_is_written_whole_or_not_at_all() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("t.csv");
        write_csv(&path, &names(&["t_s", "a, b"]), &[0.0, f64::NAN]).unwrap();
        assert_eq!(
            std::fs::read_to_string(&path).unwrap(),
            "t_s,\"a, b\"\n0,\n"
        );
        assert!(write_csv(&path, &names(&["t_s", "b"]), &[0.0]).is_err());
        let nowhere = folder.path().join("no/t.csv");
        assert!(write_csv(&nowhere, &names(&["t_s"]), &[0.0]).is_err());
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn numbers_round_trip_exactly(
            rows in prop::collection::vec(prop::array::uniform2(any::<f64>()), 1..20)
        ) {
            let folder = tempfile::tempdir().unwrap();
            let path = folder.path().join("t.csv");
            let flat: Vec<f64> = rows.iter().flatten().copied().collect();
            write_csv(&path, &names(&["t_s", "x"]), &flat).unwrap();
            let table = read_csv_from(File::open(&path).unwrap(), "t").unwrap();
            prop_assert_eq!(flat.len(), table.runs[0].rows.len());
            for (a, b) in flat.iter().zip(&table.runs[0].rows) {
                prop_assert!(a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan()));
            }
        }
    }
}
