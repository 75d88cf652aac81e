//! Columns of Arrow as channels.

use std::collections::HashMap;

use arrow_array::cast::AsArray;
use arrow_array::types::{
    ArrowPrimitiveType, DurationMicrosecondType, DurationMillisecondType, DurationNanosecondType,
    DurationSecondType, Float16Type, Float32Type, Float64Type, Int8Type, Int16Type, Int32Type,
    Int64Type, TimestampMicrosecondType, TimestampMillisecondType, TimestampNanosecondType,
    TimestampSecondType, UInt8Type, UInt16Type, UInt32Type, UInt64Type,
};
use arrow_array::{Array, ArrayRef, RecordBatch};
use arrow_schema::{DataType, Field, Schema, TimeUnit};

use crate::error::FormatError;
use crate::sink::{ARRAY_MOST, ChannelInfo, Kind, Sink, Stamps};

/// Structures within structures.
const DEPTH: usize = 16;

/// The channels of a schema, by path.
pub(super) struct Columns {
    channels: HashMap<String, usize>,
    stamps: Stamps,
}

impl Columns {
    pub(super) fn announce(schema: &Schema, sink: &mut dyn Sink) -> Result<Self, FormatError> {
        let mut columns = Self {
            channels: HashMap::new(),
            stamps: Stamps::default(),
        };
        for field in schema.fields() {
            columns.field(field.name().clone(), field, sink, 0)?;
        }
        Ok(columns)
    }

    fn field(
        &mut self,
        path: String,
        field: &Field,
        sink: &mut dyn Sink,
        depth: usize,
    ) -> Result<(), FormatError> {
        match field.data_type() {
            DataType::Struct(fields) if depth < DEPTH => {
                for inner in fields {
                    self.field(format!("{path}.{}", inner.name()), inner, sink, depth + 1)?;
                }
                return Ok(());
            }
            DataType::FixedSizeList(inner, n) if depth < DEPTH => {
                let count = usize::try_from(*n).unwrap_or(usize::MAX);
                if count <= ARRAY_MOST {
                    for at in 0..count {
                        self.field(format!("{path}[{at}]"), inner, sink, depth + 1)?;
                    }
                    return Ok(());
                }
            }
            _ => {}
        }
        let declared = field.data_type().to_string();
        let unit = ["unit", "units"]
            .iter()
            .find_map(|key| field.metadata().get(key).cloned());
        let unit = match field.data_type() {
            DataType::Timestamp(..) | DataType::Duration(_) => Some("s".to_owned()),
            _ => unit,
        };
        let info = ChannelInfo::new(&path, kind(field.data_type()), declared).in_unit(unit);
        let channel = sink.channel(info)?;
        self.channels.insert(path, channel);
        Ok(())
    }

    /// Hands the values of a batch on.
    pub(super) fn batch(
        &mut self,
        batch: &RecordBatch,
        sink: &mut dyn Sink,
    ) -> Result<(), FormatError> {
        let schema = batch.schema();
        for (field, array) in schema.fields().iter().zip(batch.columns()) {
            let rows: Vec<Option<usize>> = (0..array.len()).map(Some).collect();
            self.array(field.name(), array, &rows, sink, 0)?;
        }
        Ok(())
    }

    /// `rows` are the rows of `array` to take, or none for a missing one.
    fn array(
        &mut self,
        path: &str,
        array: &ArrayRef,
        rows: &[Option<usize>],
        sink: &mut dyn Sink,
        depth: usize,
    ) -> Result<(), FormatError> {
        let there = |row: &Option<usize>| row.filter(|row| array.is_valid(*row));
        match array.data_type() {
            DataType::Struct(fields) if depth < DEPTH => {
                let inner: Vec<Option<usize>> = rows.iter().map(there).collect();
                for (field, column) in fields.iter().zip(array.as_struct().columns()) {
                    let path = format!("{path}.{}", field.name());
                    self.array(&path, column, &inner, sink, depth + 1)?;
                }
                return Ok(());
            }
            DataType::FixedSizeList(_, n) if depth < DEPTH => {
                let list = array.as_fixed_size_list();
                let count = usize::try_from(*n).unwrap_or(usize::MAX);
                if count <= ARRAY_MOST {
                    for at in 0..count {
                        let inner: Vec<Option<usize>> = rows
                            .iter()
                            .map(|row| Some(there(row)? * count + at))
                            .collect();
                        let path = format!("{path}[{at}]");
                        self.array(&path, list.values(), &inner, sink, depth + 1)?;
                    }
                    return Ok(());
                }
            }
            _ => {}
        }
        let Some(channel) = self.channels.get(path).copied() else {
            return Ok(());
        };
        let stamps = &mut self.stamps;
        macro_rules! numbers {
            ($kind:ty, $value:expr) => {{
                let values = array.as_primitive::<$kind>();
                for row in rows {
                    let value = match there(row) {
                        Some(row) => {
                            let raw: <$kind as ArrowPrimitiveType>::Native = values.value(row);
                            $value(raw, sink)
                        }
                        None => f64::NAN,
                    };
                    sink.number(channel, value)?;
                }
            }};
        }
        let mut instant = |ticks: i64, unit: i128, sink: &mut dyn Sink| {
            stamps.seconds(i128::from(ticks) * unit, sink)
        };
        match array.data_type() {
            DataType::Float16 => {
                numbers!(Float16Type, |v, _: &mut dyn Sink| f64::from(f32::from(v)));
            }
            DataType::Float32 => numbers!(Float32Type, |v: f32, _: &mut dyn Sink| f64::from(v)),
            DataType::Float64 => numbers!(Float64Type, |v: f64, _: &mut dyn Sink| v),
            DataType::Int8 => numbers!(Int8Type, |v: i8, _: &mut dyn Sink| f64::from(v)),
            DataType::Int16 => numbers!(Int16Type, |v: i16, _: &mut dyn Sink| f64::from(v)),
            DataType::Int32 => numbers!(Int32Type, |v: i32, _: &mut dyn Sink| f64::from(v)),
            DataType::Int64 => numbers!(Int64Type, |v: i64, _: &mut dyn Sink| v as f64),
            DataType::UInt8 => numbers!(UInt8Type, |v: u8, _: &mut dyn Sink| f64::from(v)),
            DataType::UInt16 => numbers!(UInt16Type, |v: u16, _: &mut dyn Sink| f64::from(v)),
            DataType::UInt32 => numbers!(UInt32Type, |v: u32, _: &mut dyn Sink| f64::from(v)),
            DataType::UInt64 => numbers!(UInt64Type, |v: u64, _: &mut dyn Sink| v as f64),
            DataType::Timestamp(TimeUnit::Second, _) => {
                numbers!(TimestampSecondType, |v, s| instant(v, 1_000_000_000, s));
            }
            DataType::Timestamp(TimeUnit::Millisecond, _) => {
                numbers!(TimestampMillisecondType, |v, s| instant(v, 1_000_000, s));
            }
            DataType::Timestamp(TimeUnit::Microsecond, _) => {
                numbers!(TimestampMicrosecondType, |v, s| instant(v, 1_000, s));
            }
            DataType::Timestamp(TimeUnit::Nanosecond, _) => {
                numbers!(TimestampNanosecondType, |v, s| instant(v, 1, s));
            }
            DataType::Duration(TimeUnit::Second) => {
                numbers!(DurationSecondType, |v: i64, _: &mut dyn Sink| v as f64);
            }
            DataType::Duration(TimeUnit::Millisecond) => {
                numbers!(DurationMillisecondType, |v: i64, _: &mut dyn Sink| v as f64
                    / 1e3);
            }
            DataType::Duration(TimeUnit::Microsecond) => {
                numbers!(DurationMicrosecondType, |v: i64, _: &mut dyn Sink| v as f64
                    / 1e6);
            }
            DataType::Duration(TimeUnit::Nanosecond) => {
                numbers!(DurationNanosecondType, |v: i64, _: &mut dyn Sink| v as f64
                    / 1e9);
            }
            DataType::Boolean => {
                let values = array.as_boolean();
                for row in rows {
                    let value = there(row).map_or(f64::NAN, |r| f64::from(values.value(r)));
                    sink.number(channel, value)?;
                }
            }
            DataType::Utf8 => {
                let values = array.as_string::<i32>();
                for row in rows {
                    sink.text(channel, there(row).map_or("", |r| values.value(r)))?;
                }
            }
            DataType::LargeUtf8 => {
                let values = array.as_string::<i64>();
                for row in rows {
                    sink.text(channel, there(row).map_or("", |r| values.value(r)))?;
                }
            }
            DataType::Utf8View => {
                let values = array.as_string_view();
                for row in rows {
                    sink.text(channel, there(row).map_or("", |r| values.value(r)))?;
                }
            }
            DataType::Dictionary(_, _) if depth < DEPTH => {
                let dictionary = array.as_any_dictionary();
                let keys = dictionary.normalized_keys();
                let inner: Vec<Option<usize>> = rows
                    .iter()
                    .map(|row| keys.get(there(row)?).copied())
                    .collect();
                self.array(path, dictionary.values(), &inner, sink, depth + 1)?;
            }
            _ => sink.opaque(channel)?,
        }
        Ok(())
    }
}

fn kind(of: &DataType) -> Kind {
    match of {
        DataType::Boolean => Kind::Boolean,
        DataType::Utf8 | DataType::LargeUtf8 | DataType::Utf8View => Kind::Text,
        DataType::Dictionary(_, values) => kind(values),
        DataType::Timestamp(..) | DataType::Duration(_) | DataType::Float16 => Kind::Number,
        other if other.is_integer() || other.is_floating() => Kind::Number,
        _ => Kind::Opaque,
    }
}
