//! Reading a log, whatever its format: the content decides, not the ending of the name.

use std::borrow::Cow;
use std::path::Path;

use crate::csv_read::parse_csv;
use crate::error::RecordingError;
use crate::mcap_log::{is_mcap, read_mcap};
use crate::sysid::{SysIdLog, read_sysid};
use crate::table::Table;

/// A log as it stands in its file.
#[derive(Clone, Debug, PartialEq)]
pub enum Source {
    /// A table with a header.
    Table(Table),
    /// A SysId log: it says itself what was measured.
    SysId(SysIdLog),
}

impl Source {
    /// The log as a table with units in the headers.
    pub fn table(&self) -> Cow<'_, Table> {
        match self {
            Source::Table(table) => Cow::Borrowed(table),
            Source::SysId(log) => Cow::Owned(log.table()),
        }
    }

    /// A model file for a log that describes itself.
    pub fn model_toml(&self) -> Option<String> {
        match self {
            Source::Table(_) => None,
            Source::SysId(log) => Some(log.model_toml()),
        }
    }
}

/// Reads a log: CSV with a header, SysId JSON, or an MCAP file that a loop wrote.
///
/// # Errors
///
/// [`RecordingError`] says what is wrong and where.
pub fn read(path: &Path) -> Result<Source, RecordingError> {
    if path.is_dir() {
        return Err(RecordingError::Directory {
            path: path.to_owned(),
        });
    }
    let bytes = std::fs::read(path).map_err(|e| RecordingError::Io {
        path: path.to_owned(),
        action: "read",
        message: e.to_string().into(),
    })?;
    read_bytes(&bytes, &path.display().to_string())
}

/// Reads a log from the bytes of a file: as [`read`]; `log` stands for the file in messages.
///
/// # Errors
///
/// [`RecordingError`] says what is wrong and where.
pub fn read_bytes(bytes: &[u8], log: &str) -> Result<Source, RecordingError> {
    if is_mcap(bytes) {
        return read_mcap(bytes, log).map(Source::Table);
    }
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
    if let Some(position) = bytes.iter().position(|b| *b == 0) {
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
