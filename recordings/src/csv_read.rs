//! CSV in: a header of names with units, then numbers.
//!
//! Fields are separated by commas, semicolons or tabs, whichever the header has most of, or by spaces;
//! lines that begin with `#` are comments. An empty field, `nan`, `na` or `null` is a missing value. A
//! column without a unit whose first field is a word is a column of words (a run's name, a mode), one
//! whose first field is a date or a time is a column of times, in seconds since its first. Units may
//! stand at the end of names, in brackets, or on a line of their own below the names. Without a header
//! columns are called `column 1`, `column 2`.

mod lines;
mod quick;
#[cfg(test)]
mod same;

use std::collections::BTreeMap;
use std::io::Read;

use lines::{Lines, RowLines};
use quick::Unusual;

use crate::dialect::{self, delimiter, number};
use crate::error::RecordingError;
use crate::naming::{is_time, unit_of_time};
use crate::source::as_text;
use crate::stamp::Instant;
use crate::table::{ColumnName, Table, TableRun};

/// Reads CSV from anywhere; `source_name` is what errors call it.
///
/// # Errors
///
/// [`RecordingError`] names line and column, what was expected and what was found.
pub fn read_csv_from(mut reader: impl Read, source_name: &str) -> Result<Table, RecordingError> {
    let mut bytes = Vec::new();
    reader
        .read_to_end(&mut bytes)
        .map_err(|e| RecordingError::Io {
            path: source_name.into(),
            action: "read",
            message: e.to_string().into(),
        })?;
    parse_csv(as_text(&bytes, source_name)?, source_name)
}

pub(crate) fn parse_csv(text: &str, log: &str) -> Result<Table, RecordingError> {
    let spaced = dialect::tabs_for_spaces(text);
    let mut rows = Rows::new(log, delimiter(&spaced));
    let to = rows.general(&spaced, true)?;
    if rows.quick(&spaced, to).is_err() {
        rows = Rows::new(log, rows.delimiter);
        rows.general(&spaced, false)?;
    }
    rows.table()
}

/// What was read so far.
struct Rows<'l> {
    log: &'l str,
    delimiter: u8,
    columns: Vec<ColumnName>,
    labels: BTreeMap<usize, Vec<String>>,
    /// Columns of dates and times, the first of each, and the last one in seconds since then.
    origins: BTreeMap<usize, (Instant, f64)>,
    run: TableRun,
    lines: RowLines,
    /// There is a header.
    named: bool,
}

impl<'l> Rows<'l> {
    fn new(log: &'l str, delimiter: u8) -> Self {
        Self {
            log,
            delimiter,
            columns: Vec::new(),
            labels: BTreeMap::new(),
            origins: BTreeMap::new(),
            run: TableRun::default(),
            lines: RowLines::default(),
            named: true,
        }
    }

    /// Reads the text, or up to the first row of it; says where it stopped.
    fn general(&mut self, text: &str, first_only: bool) -> Result<usize, RecordingError> {
        let mut reader = csv::ReaderBuilder::new()
            .has_headers(false)
            .flexible(true)
            .comment(Some(b'#'))
            .delimiter(self.delimiter)
            .trim(csv::Trim::All)
            .from_reader(text.as_bytes());
        let mut lines = Lines::new(text.as_bytes());
        let mut record = csv::StringRecord::new();
        let log = self.log;
        while reader
            .read_record(&mut record)
            .map_err(|e| RecordingError::Io {
                path: log.into(),
                action: "read",
                message: e.to_string().into(),
            })?
        {
            let line = lines.of(record.position().map_or(0, |p| p.byte()));
            if record.iter().all(str::is_empty) && record.len() <= 1 {
                continue;
            }
            self.record(&record, line)?;
            if first_only && !self.lines.is_empty() {
                break;
            }
        }
        let byte = usize::try_from(reader.position().byte());
        Ok(byte.map_or(text.len(), |byte| byte.min(text.len())))
    }

    /// Reads the rows behind the first one, from `byte` on.
    fn quick(&mut self, text: &str, byte: usize) -> Result<(), Unusual> {
        let (before, rest) = text.split_at_checked(byte).ok_or(Unusual)?;
        let plain = quick::Rows {
            delimiter: self.delimiter,
            width: self.columns.len(),
        };
        if rest.is_empty() {
            return Ok(());
        }
        if !plain.plain() {
            return Err(Unusual);
        }
        let line = 1 + memchr::memchr_iter(b'\n', before.as_bytes()).count();
        let mut values = std::mem::take(&mut self.run.rows);
        let mut lines = std::mem::take(&mut self.lines);
        let words: Vec<usize> = (self.labels.keys().chain(self.origins.keys()))
            .copied()
            .collect();
        let read = match words.is_empty() {
            true => plain.numbers(rest, line, &mut values, &mut lines),
            false => {
                let value = |at: usize, field: &str, line| self.value(at, field, false, line).ok();
                plain.mixed(rest, line, &words, value, (&mut values, &mut lines))
            }
        };
        (self.run.rows, self.lines) = (values, lines);
        read
    }

    /// The table, when all was read.
    fn table(self) -> Result<Table, RecordingError> {
        let (log, mut run) = (self.log, self.run);
        if self.columns.is_empty() {
            return Err(RecordingError::Empty { log: log.into() });
        }
        if self.lines.is_empty() {
            return Err(RecordingError::HeaderOnly { log: log.into() });
        }
        (run.first_line, run.lines) = self.lines.first_and_all();
        let width = self.columns.len().max(1);
        let column = |at: usize| run.rows.iter().skip(at).step_by(width);
        let rises = |at: usize| {
            let mut steps = column(at).zip(column(at).skip(1)).peekable();
            steps.peek().is_some() && steps.all(|(a, b)| a < b)
        };
        let dates = self.origins.into_keys().next();
        let mut columns = self.columns;
        let stamps = dates.or_else(|| stamps(&mut columns, self.named, rises));
        Ok(Table {
            source: log.into(),
            columns,
            runs: vec![run],
            labels: self.labels,
            stamps,
            ..Table::default()
        })
    }

    fn record(&mut self, record: &csv::StringRecord, line: usize) -> Result<(), RecordingError> {
        if self.columns.is_empty() {
            let said = record
                .get(0)
                .is_some_and(|f| f.len() <= 5 && f.to_lowercase().starts_with("sep="));
            if said {
                return Ok(());
            }
            if !dialect::is_data(record, self.delimiter) {
                self.columns = header(record, self.log, line)?;
                return Ok(());
            }
            self.named = false;
            let numbers = 1..=record.len();
            self.columns = numbers
                .map(|n| ColumnName::new(&format!("column {n}")))
                .collect();
        }
        // A separator at the end of each row closes its last field, and opens none.
        let n = self.columns.len();
        let closed = record.len() == n + 1 && record.get(n) == Some("");
        if record.len() != n && !closed {
            return Err(RecordingError::FieldCount {
                log: self.log.into(),
                line,
                expected: n,
                found: record.len(),
            });
        }
        if self.lines.is_empty()
            && let Some(units) = dialect::units(record)
        {
            for (column, unit) in self.columns.iter_mut().zip(units) {
                column.unit = unit.or(column.unit.take());
            }
            return Ok(());
        }
        let first = self.lines.is_empty();
        self.lines.push(line);
        for (at, field) in record.iter().take(n).enumerate() {
            let value = self.value(at, field, first, line)?;
            self.run.rows.push(value);
        }
        Ok(())
    }

    fn value(
        &mut self,
        at: usize,
        field: &str,
        first: bool,
        line: usize,
    ) -> Result<f64, RecordingError> {
        if let Some(words) = self.labels.get_mut(&at) {
            return Ok(index_of(words, field));
        }
        if let Some((origin, last)) = self.origins.get_mut(&at) {
            if field.is_empty() {
                return Ok(f64::NAN);
            }
            if let Some(now) = Instant::of(field).and_then(|now| now.since(*origin, *last)) {
                *last = now;
                return Ok(now);
            }
            return Err(RecordingError::NotATime {
                log: self.log.into(),
                line,
                column: at + 1,
                name: self.name(at).into(),
                text: field.into(),
            });
        }
        if let Some(value) = number(field, self.delimiter) {
            return Ok(value);
        }
        if let Some(origin) = Instant::of(field).filter(|_| first) {
            self.origins.insert(at, (origin, 0.0));
            if let Some(column) = self.columns.get_mut(at) {
                column.unit = Some("s".to_owned());
            }
            return Ok(0.0);
        }
        let bare = self.columns.get(at).is_some_and(|c| c.unit.is_none());
        if first && bare {
            self.labels.insert(at, vec![field.to_owned()]);
            return Ok(0.0);
        }
        Err(RecordingError::NotANumber {
            log: self.log.into(),
            line,
            column: at + 1,
            name: self.name(at).into(),
            text: field.into(),
        })
    }

    fn name(&self, at: usize) -> &str {
        self.columns.get(at).map_or("", |c| c.text.as_str())
    }
}

/// The column of time stamps where no name says it: of a file without a header the first one, or else the first that is in
/// a unit of time, which it has from then on; it `rises` throughout.
fn stamps(columns: &mut [ColumnName], named: bool, rises: impl Fn(usize) -> bool) -> Option<usize> {
    if !named {
        return (columns.len() > 1 && rises(0)).then_some(0);
    }
    if columns.iter().any(|column| is_time(&column.name)) {
        return None;
    }
    let units = columns.iter().map(|column| unit_of_time(column));
    let (at, unit) = (units.enumerate())
        .filter_map(|(at, unit)| Some((at, unit?.to_owned())))
        .find(|(at, _)| rises(*at))?;
    columns[at].unit = Some(unit);
    Some(at)
}

fn header(
    record: &csv::StringRecord,
    log: &str,
    line: usize,
) -> Result<Vec<ColumnName>, RecordingError> {
    let mut columns: Vec<ColumnName> = Vec::with_capacity(record.len());
    for (at, field) in record.iter().enumerate() {
        // A table written with its row numbers has no name above them.
        let column = match field {
            "" => ColumnName::new(&format!("column {}", at + 1)),
            field => ColumnName::new(field),
        };
        if let Some(first) = columns.iter().position(|c| c.text == column.text) {
            return Err(RecordingError::DuplicateColumn {
                log: log.into(),
                line,
                name: column.text.into(),
                first: first + 1,
                second: at + 1,
            });
        }
        columns.push(column);
    }
    Ok(columns)
}

fn index_of(words: &mut Vec<String>, field: &str) -> f64 {
    let at = words
        .iter()
        .position(|word| word == field)
        .unwrap_or_else(|| {
            words.push(field.to_owned());
            words.len() - 1
        });
    at as f64
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn error(text: &str) -> String {
        parse_csv(text, "l.csv").unwrap_err().to_string()
    }

    #[test]
    fn numbers_words_and_missing_values() {
        let text =
            "# made by hand\n\ntime_s, u_V ,mode,y\n0,1,auto,\n# pause\n\n0.5,2e0,hand,NaN\n";
        let table = parse_csv(text, "l").unwrap();
        assert_eq!(table.column_texts(), ["time_s", "u_V", "mode", "y"]);
        assert_eq!(table.columns[1].unit.as_deref(), Some("V"));
        let run = &table.runs[0];
        assert_eq!((run.first_line, run.lines.as_slice()), (4, &[4, 7][..]));
        assert_eq!(run.rows[..3], [0.0, 1.0, 0.0]);
        assert_eq!(run.rows[4..7], [0.5, 2.0, 1.0]);
        assert!(run.rows[3].is_nan() && run.rows[7].is_nan());
        assert_eq!(table.labels[&2], ["auto", "hand"]);
    }

    #[test]
    fn semicolons_with_decimal_commas() {
        let table = parse_csv("t_s;u_V\n0,5;1,25\n", "l").unwrap();
        assert_eq!(table.runs[0].rows, [0.5, 1.25]);
        assert_eq!(parse_csv("t_s\tu_V\n0\t1\n", "l").unwrap().columns.len(), 2);
    }

    #[test]
    fn errors_name_line_column_and_text() {
        for (text, says) in [
            (
                "t_s,u_V\n0,1\n1\n",
                "l.csv:3: expected 2 fields as in the header, found 1",
            ),
            (
                "t_s,u_V\n0,1\n1,x\n",
                "l.csv:3: column 2 (`u_V`): expected a number, found `x`",
            ),
            (
                "t_s,u\n0,1\n\n1,x\n",
                "l.csv:4: column 2 (`u`): expected a number, found `x`",
            ),
            (
                "time,u\n12:00:00.5,1\nlater,2\n",
                "l.csv:3: column 1 (`time`): expected a date and time as in `2024-05-01T12:00:00.125Z`, found `later`",
            ),
            (
                "t_s,u_V,t_s\n0,1,2\n",
                "l.csv:1: columns 1 and 3 are both named `t_s`",
            ),
            ("t_s,u_V\n", "l.csv: there is a header but no row"),
            ("# nothing\n", "l.csv: the file is empty"),
        ] {
            assert!(error(text).starts_with(says), "{} | {says}", error(text));
        }
    }

    #[test]
    fn without_a_header_columns_have_numbers() {
        let table = parse_csv("0,1\n0.5,2\n", "l").unwrap();
        assert_eq!(table.column_texts(), ["column 1", "column 2"]);
        assert_eq!(table.runs[0].rows, [0.0, 1.0, 0.5, 2.0]);
        assert_eq!((table.runs[0].first_line, table.stamps), (1, Some(0)));
        let table = parse_csv("0,5;1,25\n1,0;2,5\n", "l").unwrap();
        assert_eq!(table.runs[0].rows, [0.5, 1.25, 1.0, 2.5]);
    }

    #[test]
    fn a_column_that_rises_in_a_unit_of_time_is_the_time() {
        let stamps = |text: &str| {
            let table = parse_csv(text, "l").unwrap();
            let unit = |at: usize| table.columns[at].unit.clone().unwrap();
            table.stamps.map(|at| (at, unit(at)))
        };
        let some = |at: usize, unit: &str| Some((at, unit.to_owned()));
        assert_eq!(stamps("us,pwm\n0,1\n50000,2\n"), some(0, "us"));
        assert_eq!(stamps("u_V;Zeit [ms]\n1;0,5\n1;20,5\n"), some(1, "ms"));
        // A time that something takes goes up and down, a radius is no time, and a name comes first.
        assert_eq!(stamps("latency_ms,u\n3,1\n2,2\n"), None);
        assert_eq!(stamps("radius,u\n3,1\n4,2\n"), None);
        assert_eq!(stamps("age_ms,time_s\n3,1\n4,2\n"), None);
    }

    #[test]
    fn dates_and_times_are_seconds_since_the_first() {
        let text = "when,u_V\n2024-05-01T12:00:00.100Z,1\n2024-05-01T12:00:00.350Z,2\n";
        let table = parse_csv(text, "l").unwrap();
        assert_eq!(table.runs[0].rows, [0.0, 1.0, 0.25, 2.0]);
        assert_eq!(
            (table.stamps, table.columns[0].unit.as_deref()),
            (Some(0), Some("s"))
        );
    }

    #[test]
    fn what_spreadsheets_and_plotters_write() {
        let table = parse_csv("sep=;\nTime;Speed;\n(ms);(rpm);\n1,5;30;\n2;60;\n", "l").unwrap();
        assert_eq!(table.columns[1].unit.as_deref(), Some("rpm"));
        assert_eq!((table.runs[0].first_line, table.runs[0].rows[0]), (4, 1.5));
        let table = parse_csv("# gnuplot\n  t_s   u_V\n 0.0   1\n 0.5  -2\n", "l").unwrap();
        assert_eq!(table.column_texts(), ["t_s", "u_V"]);
        assert_eq!(table.runs[0].rows, [0.0, 1.0, 0.5, -2.0]);
        let table = parse_csv("t [ms],speed (rpm)\n0,1\n", "l").unwrap();
        assert_eq!(table.columns[1].name, "speed");
        assert_eq!(table.columns[0].unit.as_deref(), Some("ms"));
        let table = parse_csv("t_s,u_V\n0,1,\n1,2,\n", "l").unwrap();
        assert_eq!(table.runs[0].rows, [0.0, 1.0, 1.0, 2.0]);
    }

    #[test]
    fn row_numbers_without_a_name() {
        let table = parse_csv(",t_s,u_V\n0,0.1,2\n", "l").unwrap();
        assert_eq!(table.columns[0].text, "column 1");
    }

    proptest! {
        #[test]
        fn never_panics(
            bytes in prop::collection::vec(any::<u8>(), 0..400),
            near in "[t_s,V;\"#\n\r0-9.e-]{0,200}",
        ) {
            let _ = read_csv_from(&bytes[..], "bytes");
            let _ = read_csv_from(near.as_bytes(), "text");
        }
    }
}
