//! CSV in: a header of names with units, then numbers.
//!
//! Fields are separated by commas, semicolons or tabs, whichever the header has most of; lines
//! that begin with `#` are comments. An empty field, `nan`, `na` or `null` is a missing value. A
//! column without a unit whose first field is a word is a column of words (a run's name, a mode).

use std::collections::BTreeMap;
use std::io::Read;

use crate::error::RecordingError;
use crate::source::as_text;
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
    let mut columns: Vec<ColumnName> = Vec::new();
    let mut labels: BTreeMap<usize, Vec<String>> = BTreeMap::new();
    let mut run = TableRun::default();
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
        if columns.is_empty() {
            columns = header(&record, log, line)?;
            continue;
        }
        if record.len() != columns.len() {
            return Err(RecordingError::FieldCount {
                log: log.into(),
                line,
                expected: columns.len(),
                found: record.len(),
            });
        }
        let first = run.lines.is_empty();
        run.lines.push(line);
        for (at, (field, column)) in record.iter().zip(&columns).enumerate() {
            let value = match (labels.get_mut(&at), number(field, delimiter)) {
                (Some(words), _) => index_of(words, field),
                (None, Some(value)) => value,
                (None, None) if first && column.unit.is_none() => {
                    labels.insert(at, vec![field.to_owned()]);
                    0.0
                }
                (None, None) => {
                    return Err(RecordingError::NotANumber {
                        log: log.into(),
                        line,
                        column: at + 1,
                        name: column.text.as_str().into(),
                        text: field.into(),
                    });
                }
            };
            run.rows.push(value);
        }
    }
    if columns.is_empty() {
        return Err(RecordingError::Empty { log: log.into() });
    }
    run.first_line = *run
        .lines
        .first()
        .ok_or_else(|| RecordingError::HeaderOnly { log: log.into() })?;
    Ok(Table {
        source: log.into(),
        columns,
        runs: vec![run],
        labels,
        ..Table::default()
    })
}

fn header(
    record: &csv::StringRecord,
    log: &str,
    line: usize,
) -> Result<Vec<ColumnName>, RecordingError> {
    if record.iter().all(|field| number(field, b',').is_some()) {
        return Err(RecordingError::NoHeader {
            log: log.into(),
            line,
            text: record.iter().collect::<Vec<_>>().join(",").into(),
        });
    }
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

/// The separator that the header has most of.
fn delimiter(text: &str) -> u8 {
    let header = text
        .lines()
        .find(|line| !line.trim().is_empty() && !line.starts_with('#'));
    let count = |d: u8| header.map_or(0, |h| h.bytes().filter(|b| *b == d).count());
    // `max_by_key` takes the last of equals: the comma.
    [b'\t', b';', b',']
        .into_iter()
        .max_by_key(|d| count(*d))
        .unwrap_or(b',')
}

fn number(field: &str, delimiter: u8) -> Option<f64> {
    if ["", "na", "n/a", "null", "none"]
        .iter()
        .any(|m| field.eq_ignore_ascii_case(m))
    {
        return Some(f64::NAN);
    }
    match field.parse() {
        Ok(value) => Some(value),
        // Decimal commas, where the comma does not separate.
        Err(_) if delimiter != b',' => field.replacen(',', ".", 1).parse().ok(),
        Err(_) => None,
    }
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
                "0,1\n1,2\n",
                "l.csv:1: no header: the first line holds only numbers (`0,1`)",
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
