//! ROS 2 bags stored in SQLite (`.db3`).
//!
//! Tables `topics` and `messages`, and since ROS 2 Iron `message_definitions`; older bags carry no
//! definitions, so only messages of the common packages are decoded.
//!
//! Reference: ros2/rosbag2, `rosbag2_storage_sqlite3`.

use rusqlite::limits::Limit;
use rusqlite::{Connection, Error};

use super::mcap::{Reader, Schema};
use crate::detect::Format;
use crate::error::FormatError;
use crate::input::Input;
use crate::sink::Sink;

/// Reads a database on its own.
pub(crate) fn read(input: Input, sink: &mut dyn Sink) -> Result<(), FormatError> {
    let mut reader = Reader::new(input.name());
    read_into(input, &mut reader, sink)?;
    reader.finish(sink);
    Ok(())
}

/// Reads a database that is one of several of a bag.
pub(crate) fn read_into(
    input: Input,
    reader: &mut Reader,
    sink: &mut dyn Sink,
) -> Result<(), FormatError> {
    let name = input.name().to_owned();
    let refused = |e: Error| FormatError::Refused {
        log: name.as_str().into(),
        format: Format::Sqlite,
        message: e.to_string().into(),
    };
    let mut bytes = input.into_bytes()?;
    // A database in memory has no journal beside it: versions 2 would ask for one.
    if let Some(versions) = bytes.get_mut(18..20) {
        versions.copy_from_slice(&[1, 1]);
    }
    let size = bytes.len();
    let mut database = Connection::open_in_memory().map_err(refused)?;
    database
        .deserialize_read_exact("main", bytes.as_slice(), size, true)
        .map_err(refused)?;
    drop(bytes);
    let most = i32::try_from(size).unwrap_or(i32::MAX);
    database
        .set_limit(Limit::SQLITE_LIMIT_LENGTH, most.max(1000))
        .map_err(refused)?;
    database
        .execute_batch("PRAGMA trusted_schema = OFF; PRAGMA cell_size_check = ON;")
        .map_err(refused)?;
    if !has(&database, "topics") || !has(&database, "messages") {
        return Err(FormatError::NotRead {
            log: name.as_str().into(),
            what: "an SQLite database that is no ROS 2 bag".into(),
            remedy: "export its table as CSV: `sqlite3 -header -csv FILE 'SELECT …'`".into(),
        });
    }
    topics(&database, reader, sink).map_err(refused)?;
    messages(&database, reader, sink, &refused)
}

fn has(database: &Connection, table: &str) -> bool {
    let query = "SELECT count(*) FROM sqlite_master WHERE type = 'table' AND name = ?1";
    let count = database.query_row(query, [table], |row| row.get::<_, i64>(0));
    count.is_ok_and(|count| count > 0)
}

fn topics(database: &Connection, reader: &mut Reader, sink: &mut dyn Sink) -> Result<(), Error> {
    let mut definitions: Vec<(String, Schema)> = Vec::new();
    if has(database, "message_definitions") {
        let mut query = database.prepare(
            "SELECT topic_type, encoding, encoded_message_definition FROM message_definitions",
        )?;
        let mut rows = query.query([])?;
        while let Some(row) = rows.next()? {
            let name: String = row.get(0)?;
            let schema = Schema {
                name: name.clone(),
                encoding: row.get(1)?,
                data: row.get::<_, String>(2)?.into_bytes(),
            };
            definitions.push((name, schema));
        }
    }
    let mut query = database.prepare("SELECT id, name, type, serialization_format FROM topics")?;
    let mut rows = query.query([])?;
    while let Some(row) = rows.next()? {
        let (id, topic): (i64, String) = (row.get(0)?, row.get(1)?);
        let (kind, encoding): (String, String) = (row.get(2)?, row.get(3)?);
        let Ok(id) = u16::try_from(id) else {
            continue;
        };
        let known = definitions.iter().position(|(name, _)| *name == kind);
        let number = known.map_or(id, |at| u16::try_from(at).unwrap_or(u16::MAX) | 0x8000);
        let schema = match known.and_then(|at| definitions.get(at)) {
            Some((_, schema)) => schema.clone(),
            None => Schema {
                name: kind,
                ..Schema::default()
            },
        };
        reader.define(number, schema);
        reader.add(id, &topic, &encoding, number, sink);
    }
    Ok(())
}

fn messages(
    database: &Connection,
    reader: &mut Reader,
    sink: &mut dyn Sink,
    refused: &dyn Fn(Error) -> FormatError,
) -> Result<(), FormatError> {
    let text = "SELECT topic_id, timestamp, data FROM messages ORDER BY timestamp, id";
    let mut query = database.prepare(text).map_err(refused)?;
    let mut rows = query.query([]).map_err(refused)?;
    let mut seen = 0u64;
    loop {
        let row = match rows.next() {
            Ok(Some(row)) => row,
            Ok(None) => return Ok(()),
            // Damaged in its middle, or cut: what was read stays.
            Err(e) if seen > 0 => {
                sink.cut(seen, &format!("the database after {seen} messages ({e})"));
                return Ok(());
            }
            Err(e) => return Err(refused(e)),
        };
        let id: Result<i64, Error> = row.get(0);
        let (Ok(id), Ok(time)) = (id, row.get::<_, i64>(1)) else {
            continue;
        };
        let Ok(data) = row.get_ref(2).and_then(|d| Ok(d.as_blob()?)) else {
            continue;
        };
        seen += 1;
        if let Ok(id) = u16::try_from(id) {
            reader.message(id, i128::from(time), data, sink)?;
        }
    }
}
