//! Reading a log, whatever its format: the content decides, not the ending of the name.

use std::borrow::Cow;
use std::path::Path;

use loopsight_core::Signal;
use loopsight_formats::{Format, FormatError, Input, Log};
use loopsight_model::log_map::{ColumnMap, LogMap};

use crate::channels;
use crate::csv_read::parse_csv;
use crate::derive;
use crate::error::RecordingError;
use crate::sysid::{SysIdLog, read_sysid};
use crate::table::{TIME, Table};

/// A log as it stands in its file.
#[derive(Clone, Debug, PartialEq)]
pub enum Source {
    /// A table with a header.
    Table(Table),
    /// A SysId log: it says itself what was measured.
    SysId(SysIdLog),
    /// A log of another program: channels, most of them with time stamps of their own.
    Channels(Box<Log>),
}

impl Source {
    /// The log as a table with units in the headers; of a log of channels those that stand side by
    /// side with the longest one.
    pub fn table(&self) -> Cow<'_, Table> {
        match self {
            Source::Table(table) => Cow::Borrowed(table),
            Source::SysId(log) => Cow::Owned(log.table()),
            Source::Channels(log) => Cow::Owned(channels::table(log)),
        }
    }

    /// The table that a model needs, and the map of its columns.
    pub(crate) fn table_for<'s>(
        &'s self,
        inputs: &[Signal],
        signals: &[Signal],
        map: &'s LogMap,
    ) -> Result<(Cow<'s, Table>, Cow<'s, LogMap>), RecordingError> {
        let (mut table, mut map) = match self {
            Source::Channels(log) => {
                let (table, map) = channels::prepare(log, inputs, signals, map)?;
                (Cow::Owned(table), Cow::Owned(map))
            }
            Source::SysId(log) => {
                let moving = log.without_rest();
                let table = moving.as_ref().unwrap_or(log).table();
                (Cow::Owned(table), Cow::Borrowed(map))
            }
            Source::Table(table) => (Cow::Borrowed(table), Cow::Borrowed(map)),
        };
        if map.period_s.is_some() && self.says_both(&map) {
            return Err(RecordingError::TimeTwice);
        }
        for sum in derive::wanted(&table, &map) {
            table.to_mut().add_sum(sum)?;
        }
        if let (Some(period), None) = (map.period_s, &map.time) {
            table.to_mut().stamp(period)?;
            map.to_mut().time = Some(ColumnMap::Name(TIME.to_owned()));
        }
        Ok((table, map))
    }

    /// Whether a model file names a column of time stamps beside a period.
    fn says_both(&self, map: &LogMap) -> bool {
        let own = map.time.as_ref().is_some_and(|time| time.name() == TIME);
        map.time.is_some() && !(own && matches!(self, Source::Channels(_)))
    }

    /// A model file for a log that describes itself.
    pub fn model_toml(&self) -> Option<String> {
        match self {
            Source::Table(_) | Source::Channels(_) => None,
            Source::SysId(log) => Some(log.model_toml()),
        }
    }
}

/// Reads a log: CSV with a header, SysId JSON, or what [`loopsight_formats`] reads: a file, the
/// folder of a ROS 2 bag, standard input as `-`; packed or not.
///
/// # Errors
///
/// [`RecordingError`] says what is wrong and where.
pub fn read(path: &Path) -> Result<Source, RecordingError> {
    let folder = path.is_dir();
    read_input(Input::open(path)).map_err(|error| match error {
        RecordingError::Format(e) if folder && matches!(*e, FormatError::NotRead { .. }) => {
            RecordingError::Directory {
                path: path.to_owned(),
            }
        }
        other => other,
    })
}

/// Reads a log from the bytes of a file: as [`read`]; `log` stands for the file in messages.
///
/// # Errors
///
/// [`RecordingError`] says what is wrong and where.
pub fn read_bytes(bytes: &[u8], log: &str) -> Result<Source, RecordingError> {
    read_input(Input::from_bytes(bytes.to_vec(), log))
}

fn read_input(input: Result<Input, FormatError>) -> Result<Source, RecordingError> {
    let input = input?;
    let name = input.name().to_owned();
    if input.format() == Format::Text {
        return read_text(&input.into_bytes()?, &name);
    }
    let log = loopsight_formats::read(input)?;
    Ok(match channels::own(&log) {
        Some(table) => Source::Table(table),
        None => Source::Channels(Box::new(log)),
    })
}

fn read_text(bytes: &[u8], log: &str) -> Result<Source, RecordingError> {
    let text = as_text(bytes, log)?;
    match text.trim_start().chars().next() {
        Some('{') => read_sysid(text, log).map(Source::SysId),
        Some('[') => Err(RecordingError::UnknownFormat {
            log: log.into(),
            found: "a JSON list".into(),
        }),
        Some('<') => Err(RecordingError::UnknownFormat {
            log: log.into(),
            found: "XML or HTML".into(),
        }),
        _ => parse_csv(text, log).map(Source::Table),
    }
}

/// The bytes as text, without byte order mark.
pub(crate) fn as_text<'b>(bytes: &'b [u8], log: &str) -> Result<&'b str, RecordingError> {
    let log = || log.to_owned();
    if let Some(position) = memchr::memchr(0, bytes) {
        return Err(RecordingError::Binary {
            log: log().into(),
            position: position + 1,
        });
    }
    let text = std::str::from_utf8(bytes).map_err(|e| {
        let before = bytes.get(..e.valid_up_to()).unwrap_or(bytes);
        let line_start = before
            .iter()
            .rposition(|b| *b == b'\n')
            .map_or(0, |at| at + 1);
        RecordingError::NotUtf8 {
            log: log().into(),
            line: 1 + before.iter().filter(|b| **b == b'\n').count(),
            column: 1 + before.len() - line_start,
        }
    })?;
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    if text.trim().is_empty() {
        return Err(RecordingError::Empty { log: log().into() });
    }
    Ok(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_that_are_no_logs() {
        let folder = tempfile::tempdir().unwrap();
        assert!(matches!(
            read(folder.path()),
            Err(RecordingError::Directory { .. })
        ));
        let missing = read(&folder.path().join("no.csv")).unwrap_err();
        assert!(missing.to_string().contains("cannot read"), "{missing}");
        for (bytes, says) in [
            (&b""[..], "l: the file is empty"),
            (b" \n\n", "l: the file is empty"),
            (b"PK\x03\x00", "l: a binary file (byte 4 is zero)"),
            (b"time_s,u\n0,\xff\n", "l:2:3: the text is not UTF-8"),
            (b"[1, 2]", "l: unknown format: a JSON list"),
            (b"<html>", "l: unknown format: XML or HTML"),
            (
                b"{\"test\":\"Simple\",\n \"units\":",
                "l:2:9: the JSON ends too early",
            ),
            (b"{\"test\":\"Simple\" oops}", "l:1:18: not valid JSON"),
            (
                b"{\"a\":1}",
                "l: unknown format: a JSON object with the keys `a`",
            ),
        ] {
            let error = read_bytes(bytes, "l").unwrap_err().to_string();
            assert!(error.starts_with(says), "{error} | {says}");
        }
    }

    #[test]
    fn the_content_decides() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("log.json");
        std::fs::write(&path, "\u{feff}time_s,u_V\r\n0,1\r\n").unwrap();
        let Source::Table(table) = read(&path).unwrap() else {
            panic!("a table")
        };
        assert_eq!(table.columns[0].text, "time_s");
        assert_eq!(table.runs[0].rows, [0.0, 1.0]);
    }
}
