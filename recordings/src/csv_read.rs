//! CSV in: a header of names with units, then numbers.
//!
//! Fields are separated by commas, semicolons or tabs, whichever the header has most of, or by spaces;
//! lines that begin with `#` are comments. An empty field, `nan`, `na` or `null` is a missing value. A
//! column without a unit whose first field is a word is a column of words (a run's name, a mode), one
//! whose first field is a date or a time is a column of times, in seconds since its first. Units may
//! stand at the end of names, in brackets, or on a line of their own below the names. Without a header
//! columns are called `column 1`, `column 2`.

use std::collections::BTreeMap;
use std::io::Read;

use crate::dialect::{self, delimiter, number};
use crate::error::RecordingError;
use crate::source::as_text;
use crate::stamp::nanoseconds;
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
    let text = &*spaced;
    let delimiter = delimiter(text);
    let mut reader = csv::ReaderBuilder::new()
        .has_headers(false)
        .flexible(true)
        .comment(Some(b'#'))
        .delimiter(delimiter)
        .trim(csv::Trim::All)
        .from_reader(text.as_bytes());
    let mut lines = Lines {
        text: text.as_bytes(),
        at: 0,
        line: 1,
    };
    let mut record = csv::StringRecord::new();
    let mut rows = Rows {
        log,
        delimiter,
        columns: Vec::new(),
        labels: BTreeMap::new(),
        origins: BTreeMap::new(),
        run: TableRun::default(),
        named: true,
    };
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
        rows.record(&record, line)?;
    }
    let Rows {
        columns,
        labels,
        origins,
        mut run,
        named,
        ..
    } = rows;
    if columns.is_empty() {
        return Err(RecordingError::Empty { log: log.into() });
    }
    run.first_line = *run
        .lines
        .first()
        .ok_or_else(|| RecordingError::HeaderOnly { log: log.into() })?;
    let width = columns.len().max(1);
    let first = || run.rows.iter().step_by(width);
    let rising = !named && width > 1 && first().zip(first().skip(1)).all(|(a, b)| a < b);
    if run.lines.windows(2).all(|w| w[1] == w[0] + 1) {
        run.lines = Vec::new();
    }
    Ok(Table {
        source: log.into(),
        columns,
        runs: vec![run],
        labels,
        stamps: origins.into_keys().next().or(rising.then_some(0)),
        ..Table::default()
    })
}

/// What was read so far.
struct Rows<'l> {
    log: &'l str,
    delimiter: u8,
    columns: Vec<ColumnName>,
    labels: BTreeMap<usize, Vec<String>>,
    /// Columns of dates and times, and the first of each, ns.
    origins: BTreeMap<usize, i64>,
    run: TableRun,
    /// There is a header.
    named: bool,
}

impl Rows<'_> {
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
        if self.run.lines.is_empty()
            && let Some(units) = dialect::units(record)
        {
            for (column, unit) in self.columns.iter_mut().zip(units) {
                column.unit = unit.or(column.unit.take());
            }
            return Ok(());
        }
        let first = self.run.lines.is_empty();
        self.run.lines.push(line);
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
        if let Some(origin) = self.origins.get(&at) {
            if field.is_empty() {
                return Ok(f64::NAN);
            }
            let since = |now: i64| Some(now.checked_sub(*origin)? as f64 / 1e9);
            return nanoseconds(field)
                .and_then(since)
                .ok_or_else(|| RecordingError::NotATime {
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
        if let Some(origin) = nanoseconds(field).filter(|_| first) {
            self.origins.insert(at, origin);
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

/// Line numbers of rising byte positions; blank lines and comments before a record are skipped.
struct Lines<'t> {
    text: &'t [u8],
    at: usize,
    line: usize,
}

impl Lines<'_> {
    fn of(&mut self, byte: u64) -> usize {
        let byte = usize::try_from(byte)
            .unwrap_or(usize::MAX)
            .min(self.text.len());
        let mut comment = false;
        while let Some(b) = self.text.get(self.at) {
            if self.at >= byte {
                match b {
                    b'#' => comment = true,
                    b'\n' => comment = false,
                    b'\r' => {}
                    _ if comment => {}
                    _ => break,
                }
            }
            self.line += usize::from(*b == b'\n');
            self.at += 1;
        }
        self.line
    }
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
