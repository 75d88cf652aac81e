//! Parquet tables.
//!
//! Every leaf of the schema is a channel (`pose.x`), unless it repeats within a row. Missing values
//! are NaN. Times with a unit become seconds. Metadata `unit` or `units` of an Arrow field is the
//! unit of its column.
//!
//! Reference: Apache Parquet format, <https://parquet.apache.org/docs/file-format/>.

use std::panic::{AssertUnwindSafe, catch_unwind};

use bytes::Bytes;
use parquet::basic::{LogicalType, TimeUnit};
use parquet::column::reader::ColumnReader;
use parquet::data_type::ByteArray;
use parquet::errors::ParquetError;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::schema::types::ColumnDescPtr;

use crate::detect::Format;
use crate::error::FormatError;
use crate::input::Input;
use crate::parquet_write::{ARROW_SCHEMA, units};
use crate::sink::{ChannelInfo, Kind, Sink, Stamps};

/// Rows that are decoded at a time.
const ROWS: usize = 8192;

/// Reads all columns.
///
/// The decoders of the `parquet` crate trust what is inside a page: a length or an index of a
/// dictionary that reaches beyond it ends in a panic (`util/bit_util.rs`, `encodings/rle.rs`), in
/// too many places to look at every page first. They hold no state outside the reader that is
/// dropped here, so the panic is caught and becomes the error that it should have been.
pub(crate) fn read(input: Input, sink: &mut dyn Sink) -> Result<(), FormatError> {
    let name = input.name().to_owned();
    let work = AssertUnwindSafe(|| read_columns(input, sink));
    catch_unwind(work).unwrap_or_else(|_| {
        Err(FormatError::Refused {
            log: name.into(),
            format: Format::Parquet,
            message: "a page contradicts itself, the file is damaged".into(),
        })
    })
}

fn read_columns(input: Input, sink: &mut dyn Sink) -> Result<(), FormatError> {
    let name = input.name().to_owned();
    let refused = |e: ParquetError| FormatError::Refused {
        log: name.as_str().into(),
        format: Format::Parquet,
        message: e.to_string().into(),
    };
    let bytes = Bytes::from(input.into_bytes()?);
    let reader = SerializedFileReader::new(bytes).map_err(refused)?;
    let schema = reader.metadata().file_metadata().schema_descr_ptr();
    let mut stamps = Stamps::default();
    let mut columns: Vec<Column> = Vec::new();
    let about = reader.metadata().file_metadata().key_value_metadata();
    let arrow = about.and_then(|pairs| pairs.iter().find(|pair| pair.key == ARROW_SCHEMA));
    let units = arrow.and_then(|pair| pair.value.as_deref()).map(units);
    let units = units.unwrap_or_default();
    for leaf in schema.columns() {
        let unit = units.get(&leaf.path().string()).map(String::as_str);
        columns.push(Column::announce(leaf, unit, sink)?);
    }
    for group in 0..reader.num_row_groups() {
        let rows = reader.get_row_group(group).map_err(refused)?;
        for (at, column) in columns.iter().enumerate() {
            if column.what == What::Opaque {
                sink.opaque(column.channel)?;
                continue;
            }
            let values = rows.get_column_reader(at).map_err(refused)?;
            column.read(values, &mut stamps, sink, &refused)?;
        }
    }
    Ok(())
}

/// How a column becomes a channel.
#[derive(Clone, Copy, Debug, PartialEq)]
enum What {
    Number,
    Unsigned,
    /// Ticks of so many nanoseconds since 1970.
    Instant(i64),
    /// Ticks of so many nanoseconds.
    Span(i64),
    /// Divided by a power of ten.
    Decimal(i32),
    Text,
    Opaque,
}

struct Column {
    channel: usize,
    what: What,
    /// Level of definition at which there is a value.
    full: i16,
}

impl Column {
    fn announce(
        leaf: &ColumnDescPtr,
        declared_unit: Option<&str>,
        sink: &mut dyn Sink,
    ) -> Result<Self, FormatError> {
        let physical = leaf.physical_type();
        let declared = match leaf.logical_type_ref() {
            Some(logical) => format!("{logical:?}"),
            None => format!("{physical:?}"),
        };
        let what = match leaf.max_rep_level() {
            0 => what(leaf),
            _ => What::Opaque,
        };
        let kind = match (what, physical) {
            (What::Text, _) => Kind::Text,
            (What::Opaque, _) => Kind::Opaque,
            (_, parquet::basic::Type::BOOLEAN) => Kind::Boolean,
            _ => Kind::Number,
        };
        let seconds = matches!(what, What::Instant(_) | What::Span(_)).then_some("s");
        let unit = seconds.or(declared_unit);
        let path = leaf.path().string();
        let info = ChannelInfo::new(path, kind, declared).in_unit(unit);
        Ok(Self {
            channel: sink.channel(info)?,
            what,
            full: leaf.max_def_level(),
        })
    }

    fn read(
        &self,
        reader: ColumnReader,
        stamps: &mut Stamps,
        sink: &mut dyn Sink,
        refused: &dyn Fn(ParquetError) -> FormatError,
    ) -> Result<(), FormatError> {
        let mut put = |sink: &mut dyn Sink, whole: i64| {
            let value = match self.what {
                What::Unsigned => whole as u64 as f64,
                What::Instant(unit) => stamps.seconds(i128::from(whole) * i128::from(unit), sink),
                What::Span(unit) => whole as f64 * unit as f64 / 1e9,
                What::Decimal(scale) => whole as f64 / 10f64.powi(scale),
                _ => whole as f64,
            };
            sink.number(self.channel, value)
        };
        macro_rules! columns {
            ($reader:expr, $put:expr) => {{
                let mut reader = $reader;
                loop {
                    let (mut levels, mut values) = (Vec::new(), Vec::new());
                    let read = reader.read_records(ROWS, Some(&mut levels), None, &mut values);
                    let (records, _, _) = read.map_err(refused)?;
                    if records == 0 {
                        return Ok(());
                    }
                    let mut values = values.into_iter();
                    for row in 0..records {
                        let there = self.full == 0 || levels.get(row) == Some(&self.full);
                        match there.then(|| values.next()).flatten() {
                            Some(value) => $put(sink, value)?,
                            None => self.missing(sink)?,
                        }
                    }
                }
            }};
        }
        let channel = self.channel;
        let number = |sink: &mut dyn Sink, v: f64| sink.number(channel, v);
        match reader {
            ColumnReader::BoolColumnReader(r) => columns!(r, |sink: &mut dyn Sink, v: bool| {
                number(sink, f64::from(v))
            }),
            ColumnReader::Int32ColumnReader(r) => columns!(r, |sink: &mut dyn Sink, v: i32| {
                let whole = match self.what {
                    What::Unsigned => i64::from(v as u32),
                    _ => i64::from(v),
                };
                put(sink, whole)
            }),
            ColumnReader::Int64ColumnReader(r) => {
                columns!(r, |sink: &mut dyn Sink, v: i64| put(sink, v))
            }
            ColumnReader::FloatColumnReader(r) => columns!(r, |sink: &mut dyn Sink, v: f32| {
                number(sink, f64::from(v))
            }),
            ColumnReader::DoubleColumnReader(r) => columns!(r, number),
            ColumnReader::ByteArrayColumnReader(r) => {
                columns!(r, |sink: &mut dyn Sink, v: ByteArray| {
                    sink.text(channel, &String::from_utf8_lossy(v.data()))
                })
            }
            // Times of 96 bits and bytes of fixed length were announced as opaque.
            _ => Ok(()),
        }
    }

    fn missing(&self, sink: &mut dyn Sink) -> Result<(), FormatError> {
        match self.what {
            What::Text => sink.text(self.channel, ""),
            _ => sink.number(self.channel, f64::NAN),
        }
    }
}

fn nanoseconds(unit: &TimeUnit) -> i64 {
    match unit {
        TimeUnit::MILLIS => 1_000_000,
        TimeUnit::MICROS => 1_000,
        TimeUnit::NANOS => 1,
    }
}

fn what(leaf: &ColumnDescPtr) -> What {
    use parquet::basic::{ConvertedType, Type};
    match (leaf.logical_type_ref(), leaf.physical_type()) {
        (_, Type::INT96 | Type::FIXED_LEN_BYTE_ARRAY) => What::Opaque,
        (_, Type::BOOLEAN | Type::FLOAT | Type::DOUBLE) => What::Number,
        (Some(LogicalType::Timestamp(t)), _) => What::Instant(nanoseconds(&t.unit)),
        (Some(LogicalType::Time(t)), _) => What::Span(nanoseconds(&t.unit)),
        (Some(LogicalType::Integer(i)), _) if !i.is_signed => What::Unsigned,
        (Some(LogicalType::Decimal(_)), Type::BYTE_ARRAY) => What::Opaque,
        (Some(LogicalType::Decimal(d)), _) => What::Decimal(d.scale),
        (_, Type::BYTE_ARRAY) => match leaf.converted_type() {
            ConvertedType::UTF8 | ConvertedType::ENUM | ConvertedType::JSON => What::Text,
            _ => What::Opaque,
        },
        _ => match leaf.converted_type() {
            ConvertedType::TIMESTAMP_MILLIS => What::Instant(1_000_000),
            ConvertedType::TIMESTAMP_MICROS => What::Instant(1_000),
            _ => What::Number,
        },
    }
}
