//! Parquet tables out: columns of doubles, a missing value is null.
//!
//! The unit of a column is the metadata `unit` of its Arrow field, which the file has under
//! `ARROW:schema`, where pyarrow, pandas and polars look.
//!
//! Reference: Apache Parquet format, <https://parquet.apache.org/docs/file-format/>.

use std::collections::HashMap;
use std::io::Write;
use std::sync::Arc;

use arrow_ipc::writer::{DictionaryTracker, IpcDataGenerator, IpcWriteOptions};
use arrow_schema::{DataType, Field, Schema};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use parquet::basic::{Compression, Repetition, Type as Physical};
use parquet::data_type::DoubleType;
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::Type;

/// Key of the Arrow schema in the metadata of a file.
pub(crate) const ARROW_SCHEMA: &str = "ARROW:schema";
/// Key of the unit in the metadata of a field.
pub(crate) const UNIT: &str = "unit";
/// Rows of a group: those of an hour at 100 Hz.
const GROUP: usize = 360_000;

/// A column of a table that is written.
#[derive(Clone, Debug, PartialEq)]
pub struct OutColumn {
    /// Its name.
    pub name: String,
    /// Its unit, where it has one.
    pub unit: Option<String>,
}

/// Writes `rows`, row by row; NaN is null.
///
/// # Errors
///
/// What the `parquet` crate says, in words: two columns of one name, or a disk that is full.
pub fn write_parquet(
    out: impl Write + Send,
    columns: &[OutColumn],
    rows: &[f64],
) -> Result<(), String> {
    write(out, columns, rows).map_err(|e| e.to_string())
}

fn write(out: impl Write + Send, columns: &[OutColumn], rows: &[f64]) -> Result<(), ParquetError> {
    let leaf = |column: &OutColumn| {
        let leaf = Type::primitive_type_builder(&column.name, Physical::DOUBLE);
        leaf.with_repetition(Repetition::OPTIONAL)
            .build()
            .map(Arc::new)
    };
    let leaves: Vec<_> = columns.iter().map(leaf).collect::<Result<_, _>>()?;
    let schema = Type::group_type_builder("schema")
        .with_fields(leaves)
        .build()?;
    let about = vec![KeyValue::new(
        ARROW_SCHEMA.to_owned(),
        arrow_schema(columns),
    )];
    let properties = WriterProperties::builder()
        .set_compression(Compression::SNAPPY)
        .set_created_by(concat!("loopsight ", env!("CARGO_PKG_VERSION")).to_owned())
        .set_key_value_metadata(Some(about))
        .build();
    let mut file = SerializedFileWriter::new(out, Arc::new(schema), Arc::new(properties))?;
    let width = columns.len().max(1);
    for group in rows.chunks(GROUP * width) {
        let mut row_group = file.next_row_group()?;
        for at in 0..columns.len() {
            let Some(mut column) = row_group.next_column()? else {
                break;
            };
            let all = group.chunks_exact(width).filter_map(|row| row.get(at));
            let there: Vec<i16> = all.clone().map(|v| i16::from(!v.is_nan())).collect();
            let values: Vec<f64> = all.copied().filter(|v| !v.is_nan()).collect();
            let writer = column.typed::<DoubleType>();
            writer.write_batch(&values, Some(&there), None)?;
            column.close()?;
        }
        row_group.close()?;
    }
    file.close().map(|_| ())
}

/// The schema as Arrow writes it into Parquet: a message of Arrow IPC behind its length, in base64.
fn arrow_schema(columns: &[OutColumn]) -> String {
    let field = |column: &OutColumn| {
        let unit = column
            .unit
            .iter()
            .map(|unit| (UNIT.to_owned(), unit.clone()));
        let field = Field::new(&column.name, DataType::Float64, true);
        field.with_metadata(unit.collect::<HashMap<_, _>>())
    };
    let schema = Schema::new(columns.iter().map(field).collect::<Vec<_>>());
    let message = IpcDataGenerator::default().schema_to_bytes_with_dictionary_tracker(
        &schema,
        &mut DictionaryTracker::new(true),
        &IpcWriteOptions::default(),
    );
    let mut bytes = vec![0xff; 4];
    bytes.extend((message.ipc_message.len() as u32).to_le_bytes());
    bytes.extend(message.ipc_message);
    STANDARD.encode(bytes)
}

/// The units of the fields of an Arrow schema in a file's metadata, by name.
pub(crate) fn units(text: &str) -> HashMap<String, String> {
    let mut units = HashMap::new();
    let bytes = STANDARD.decode(text).unwrap_or_default();
    let Some(message) = bytes
        .get(8..)
        .and_then(|b| arrow_ipc::root_as_message(b).ok())
    else {
        return units;
    };
    let fields = message
        .header_as_schema()
        .and_then(|schema| schema.fields());
    for field in fields.iter().flatten() {
        let about = field.custom_metadata();
        let unit = about.iter().flatten().find_map(|pair| {
            let is_unit = matches!(pair.key(), Some(UNIT | "units"));
            pair.value().filter(|_| is_unit)
        });
        if let (Some(name), Some(unit)) = (field.name(), unit) {
            units.insert(name.to_owned(), unit.to_owned());
        }
    }
    units
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Input, read};

    fn column(name: &str, unit: Option<&str>) -> OutColumn {
        OutColumn {
            name: name.to_owned(),
            unit: unit.map(str::to_owned),
        }
    }

    #[test]
    fn what_is_written_reads_back_with_units() {
        let columns = [
            column("time", Some("s")),
            column("u", Some("V")),
            column("n", None),
        ];
        let rows: Vec<f64> = (0..500)
            .flat_map(|k| {
                let missing = if k % 7 == 0 {
                    f64::NAN
                } else {
                    1.0 / f64::from(k)
                };
                [0.01 * f64::from(k), missing, f64::from(k)]
            })
            .collect();
        let mut bytes = Vec::new();
        write_parquet(&mut bytes, &columns, &rows).unwrap();
        let log = read(Input::from_bytes(bytes, "out.parquet").unwrap()).unwrap();
        for (at, (channel, column)) in log.channels.iter().zip(&columns).enumerate() {
            assert_eq!(channel.info.path, column.name);
            assert_eq!(channel.info.unit, column.unit);
            let values = channel.numbers().unwrap();
            assert_eq!(values.len(), 500);
            for (row, value) in values.iter().enumerate() {
                let expected = rows[3 * row + at];
                assert!(*value == expected || (value.is_nan() && expected.is_nan()));
            }
        }
    }

    #[test]
    fn a_damaged_schema_says_no_units() {
        let whole = arrow_schema(&[column("u", Some("V"))]);
        assert_eq!(units(&whole).get("u").map(String::as_str), Some("V"));
        for text in ["", "////", "no base64!", &whole[..whole.len() / 2]] {
            assert!(units(text).is_empty(), "{text}");
        }
    }
}
