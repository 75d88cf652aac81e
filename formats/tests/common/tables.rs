//! Small tables, by the writers of the crates that read them.

#[cfg(feature = "parquet")]
pub(crate) fn parquet() -> Vec<u8> {
    use parquet::data_type::{ByteArray, ByteArrayType, DoubleType, Int64Type};
    use parquet::file::properties::WriterProperties;
    use parquet::file::writer::SerializedFileWriter;
    use parquet::schema::parser::parse_message_type;
    let schema = "message log {
        required int64 t (TIMESTAMP(NANOS, true));
        optional double u;
        required binary s (STRING);
        optional group pose { optional double x; }
    }";
    let schema = std::sync::Arc::new(parse_message_type(schema).unwrap());
    let properties = WriterProperties::builder()
        .set_compression(parquet::basic::Compression::SNAPPY)
        .build();
    let mut writer =
        SerializedFileWriter::new(Vec::new(), schema, std::sync::Arc::new(properties)).unwrap();
    let mut group = writer.next_row_group().unwrap();
    let times: Vec<i64> = (0..6).map(|k| k * 1_000_000).collect();
    let mut column = group.next_column().unwrap().unwrap();
    column
        .typed::<Int64Type>()
        .write_batch(&times, None, None)
        .unwrap();
    column.close().unwrap();
    let mut column = group.next_column().unwrap().unwrap();
    let levels = [1, 1, 0, 1, 1, 1];
    let values = [0.0, 1.0, 3.0, 4.0, 5.0];
    column
        .typed::<DoubleType>()
        .write_batch(&values, Some(&levels), None)
        .unwrap();
    column.close().unwrap();
    let mut column = group.next_column().unwrap().unwrap();
    let texts: Vec<ByteArray> = ["up", "up", "up", "down", "down", "down"]
        .iter()
        .map(|t| ByteArray::from(*t))
        .collect();
    column
        .typed::<ByteArrayType>()
        .write_batch(&texts, None, None)
        .unwrap();
    column.close().unwrap();
    let mut column = group.next_column().unwrap().unwrap();
    let levels = [2, 2, 1, 0, 2, 2];
    let values = [0.5, 1.5, 4.5, 5.5];
    column
        .typed::<DoubleType>()
        .write_batch(&values, Some(&levels), None)
        .unwrap();
    column.close().unwrap();
    group.close().unwrap();
    writer.into_inner().unwrap()
}

#[cfg(feature = "arrow")]
fn batch() -> arrow_array::RecordBatch {
    use arrow_array::{
        ArrayRef, DictionaryArray, Float64Array, StructArray, TimestampMillisecondArray,
    };
    use arrow_schema::{DataType, Field, Schema};
    use std::sync::Arc;
    let time: ArrayRef = Arc::new(TimestampMillisecondArray::from_iter_values(
        (0..6).map(|k| 10 * k),
    ));
    let u: ArrayRef = Arc::new(Float64Array::from(vec![
        Some(0.0),
        Some(1.0),
        None,
        Some(3.0),
        Some(4.0),
        Some(5.0),
    ]));
    let state: DictionaryArray<arrow_array::types::Int32Type> =
        ["up", "up", "down", "down", "up", "up"]
            .into_iter()
            .collect();
    let x: ArrayRef = Arc::new(Float64Array::from_iter_values((0..6).map(f64::from)));
    let inner = Field::new("x", DataType::Float64, true);
    let pose: ArrayRef = Arc::new(StructArray::from(vec![(Arc::new(inner), x)]));
    let state: ArrayRef = Arc::new(state);
    let unit: std::collections::HashMap<String, String> =
        [("unit".to_owned(), "V".to_owned())].into();
    let fields = vec![
        Field::new("t", time.data_type().clone(), false),
        Field::new("u", DataType::Float64, true).with_metadata(unit),
        Field::new("state", state.data_type().clone(), false),
        Field::new("pose", pose.data_type().clone(), false),
    ];
    let schema = Arc::new(Schema::new(fields));
    arrow_array::RecordBatch::try_new(schema, vec![time, u, state, pose]).unwrap()
}

#[cfg(feature = "arrow")]
pub(crate) fn arrow_file(packed: bool) -> Vec<u8> {
    use arrow_ipc::CompressionType;
    use arrow_ipc::writer::{FileWriter, IpcWriteOptions};
    let batch = batch();
    let packed = packed.then_some(CompressionType::ZSTD);
    let options = IpcWriteOptions::default()
        .try_with_compression(packed)
        .unwrap();
    let mut out = Vec::new();
    let mut writer = FileWriter::try_new_with_options(&mut out, &batch.schema(), options).unwrap();
    writer.write(&batch).unwrap();
    writer.write(&batch).unwrap();
    writer.finish().unwrap();
    drop(writer);
    out
}

#[cfg(feature = "arrow")]
pub(crate) fn arrow_stream() -> Vec<u8> {
    let batch = batch();
    let mut out = Vec::new();
    let mut writer = arrow_ipc::writer::StreamWriter::try_new(&mut out, &batch.schema()).unwrap();
    writer.write(&batch).unwrap();
    writer.finish().unwrap();
    drop(writer);
    out
}

/// A bag of `std_msgs/msg/Float64` without definitions.
#[cfg(feature = "sqlite")]
pub(crate) fn sqlite() -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bag.db3");
    let database = rusqlite::Connection::open(&path).unwrap();
    database
        .execute_batch(
            "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL, serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL);
             CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL, data BLOB NOT NULL);
             CREATE INDEX timestamp_idx ON messages (timestamp ASC);
             INSERT INTO topics VALUES(1, '/u', 'std_msgs/msg/Float64', 'cdr', '');",
        )
        .unwrap();
    for k in 0..6i64 {
        let mut data = vec![0u8, 1, 0, 0];
        data.extend((k as f64).to_le_bytes());
        database
            .execute(
                "INSERT INTO messages(topic_id, timestamp, data) VALUES(1, ?1, ?2)",
                rusqlite::params![k * 10_000_000, data],
            )
            .unwrap();
    }
    drop(database);
    std::fs::read(&path).unwrap()
}
