//! Logs as MCAP: rows and events as JSON messages, chunk by chunk.
//!
//! A row is a message of the channel `loop`, an object with the columns of a CSV log as keys, without
//! those that have no value; an event is one of `events`, `{"time_s": …, "what": …}`. Times of
//! messages are those of the log. Numbers read back to the last place or the one beside it.
//!
//! Foxglove refuses a schema in which a property has several types, such as a number or `null`: each
//! has one, and no key is required.
//!
//! Reference: the MCAP format, <https://mcap.dev/spec>; schemas are JSON Schema.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufWriter, Write};

use mcap::records::MessageHeader;
use mcap::{McapResult, WriteOptions, Writer};
use serde_json::{Map, Value, json};

/// Channel of the rows, and of the events.
const ROWS: &str = "loop";
const EVENTS: &str = "events";

/// Rows and events on their way into a file.
pub(crate) struct McapLog {
    writer: Writer<BufWriter<File>>,
    columns: Vec<String>,
    channels: [u16; 2],
    sequence: u32,
}

impl McapLog {
    /// Writes what stands before the first row.
    pub(crate) fn new(file: File, columns: &[String]) -> McapResult<Self> {
        let options = WriteOptions::new()
            .compression(None)
            .library(concat!("loopsight ", env!("CARGO_PKG_VERSION")));
        let mut writer = options.create(BufWriter::new(file))?;
        let number = json!({ "type": "number" });
        let properties: Map<String, Value> = columns
            .iter()
            .map(|column| (column.clone(), number.clone()))
            .collect();
        let event = json!({ "time_s": { "type": "number" }, "what": { "type": "string" } });
        let mut channels = [0; 2];
        for (channel, (topic, properties)) in channels
            .iter_mut()
            .zip([(ROWS, Value::Object(properties)), (EVENTS, event)])
        {
            let schema = json!({ "type": "object", "properties": properties }).to_string();
            let name = format!("loopsight.{topic}");
            let schema = writer.add_schema(&name, "jsonschema", schema.as_bytes())?;
            *channel = writer.add_channel(schema, topic, "json", &BTreeMap::new())?;
        }
        Ok(Self {
            writer,
            columns: columns.to_vec(),
            channels,
            sequence: 0,
        })
    }

    /// Appends a row; the first value is the time in seconds.
    pub(crate) fn row(&mut self, row: &[f64]) -> McapResult<()> {
        // JSON has finite numbers only.
        let pairs = self.columns.iter().zip(row).filter(|(_, v)| v.is_finite());
        let object: Map<String, Value> = pairs.map(|(c, v)| (c.clone(), json!(v))).collect();
        let time = row.first().copied().unwrap_or(0.0);
        self.message(0, time, &Value::Object(object))
    }

    /// Appends an event.
    pub(crate) fn event(&mut self, time: f64, what: &str) -> McapResult<()> {
        self.message(1, time, &json!({ "time_s": time, "what": what }))
    }

    fn message(&mut self, channel: usize, time: f64, value: &Value) -> McapResult<()> {
        let nanoseconds = (time * 1e9).round().max(0.0) as u64;
        self.sequence = self.sequence.wrapping_add(1);
        let header = MessageHeader {
            channel_id: self.channels[channel],
            sequence: self.sequence,
            log_time: nanoseconds,
            publish_time: nanoseconds,
        };
        self.writer
            .write_to_known_channel(&header, value.to_string().as_bytes())
    }

    /// Ends the chunk, so that all rows so far are in the file.
    pub(crate) fn flush(&mut self) -> McapResult<()> {
        self.writer.flush()
    }

    /// Writes what stands behind the last row.
    pub(crate) fn finish(mut self) -> McapResult<()> {
        self.writer.finish()?;
        Ok(self.writer.into_inner().flush()?)
    }
}

#[cfg(test)]
mod tests {
    use mcap::MessageStream;

    use super::*;
    use crate::{LogWriter, Source, Table, read};

    fn names(names: &[&str]) -> Vec<String> {
        names.iter().map(|n| (*n).to_owned()).collect()
    }

    fn table(path: &std::path::Path) -> Table {
        let Source::Table(table) = read(path).unwrap() else {
            panic!("a table")
        };
        table
    }

    #[test]
    fn a_log_reads_back_to_the_last_place() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run.mcap");
        let mut log = LogWriter::create(&path, &names(&["time_s", "u_V", "y_m"])).unwrap();
        let mut expected = Vec::new();
        for k in 0..500 {
            let sample = f64::from(k);
            let missing = if k == 7 {
                f64::NAN
            } else {
                1.0 / (sample + 3.0)
            };
            let row = [sample * 0.01, sample.sqrt(), missing];
            log.write(&row).unwrap();
            expected.extend(row);
            if k == 250 {
                log.remark(2.5, "an actuator saturates").unwrap();
            }
        }
        log.finish().unwrap();
        let table = table(&path);
        assert_eq!(table.column_texts(), ["time_s", "u_V", "y_m"]);
        assert_eq!(table.runs[0].rows.len(), expected.len());
        for (a, b) in table.runs[0].rows.iter().zip(&expected) {
            let close = (a - b).abs() <= f64::EPSILON * b.abs();
            assert!(close || (a.is_nan() && b.is_nan()), "{a} {b}");
        }
        let bytes = std::fs::read(&path).unwrap();
        let events: Vec<_> = MessageStream::new(&bytes)
            .unwrap()
            .map(Result::unwrap)
            .filter(|m| m.channel.topic == EVENTS)
            .collect();
        assert_eq!(events.len(), 1);
        assert_eq!(events[0].log_time, 2_500_000_000);
        assert!(String::from_utf8_lossy(&events[0].data).contains("an actuator saturates"));
    }

    /// What Foxglove asks of a schema: an object, each of whose properties has one type; messages have no other keys.
    #[test]
    fn schemas_are_plain_and_hold_for_every_message() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run.mcap");
        let mut log = LogWriter::create(&path, &names(&["time_s", "u_V", "y_m"])).unwrap();
        log.write(&[0.0, 1.0, f64::NAN]).unwrap();
        log.write(&[0.1, 1.0, 2.0]).unwrap();
        log.remark(0.1, "stopped").unwrap();
        log.finish().unwrap();
        let bytes = std::fs::read(&path).unwrap();
        let mut keys = Vec::new();
        for message in MessageStream::new(&bytes).unwrap() {
            let message = message.unwrap();
            let schema = message.channel.schema.as_ref().unwrap();
            assert_eq!(
                (&*message.channel.message_encoding, &*schema.encoding),
                ("json", "jsonschema")
            );
            assert_eq!(schema.name, format!("loopsight.{}", message.channel.topic));
            let schema: Value = serde_json::from_slice(&schema.data).unwrap();
            assert_eq!(schema["type"], "object");
            let data: Map<String, Value> = serde_json::from_slice(&message.data).unwrap();
            for (key, value) in &data {
                let number = schema["properties"][key]["type"] == "number";
                let text = schema["properties"][key]["type"] == "string";
                assert!(
                    number && value.is_number() || text && value.is_string(),
                    "{key}"
                );
            }
            keys.push(data.len());
        }
        assert_eq!(keys, [2, 3, 2]);
    }

    /// What is in the part file is what a killed run leaves.
    #[test]
    fn a_part_can_be_read_and_lacks_at_most_a_second() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run.mcap");
        let mut log = LogWriter::create(&path, &names(&["time_s", "u_V"])).unwrap();
        for k in 0..1050 {
            log.write(&[f64::from(k) * 0.01, 1.0]).unwrap();
            if k > 100 && k % 97 == 0 {
                let left = folder.path().join("left.mcap");
                std::fs::copy(log.part_path(), &left).unwrap();
                let rows = table(&left).runs[0].rows.len() / 2;
                assert!(rows + 100 > k as usize, "{rows} of {k}");
            }
        }
    }

    #[test]
    fn an_mcap_file_of_nothing_has_no_column() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("other.mcap");
        std::fs::write(&path, mcap::MAGIC).unwrap();
        assert_eq!(read(&path).unwrap().table().columns, []);
    }
}
