//! Arrow IPC files (Feather 2) and streams.
//!
//! Every column is a channel; fields of structures have paths (`pose.x`), lists of fixed length
//! indices. Missing values are NaN. Times with a unit become seconds. Metadata `unit` or `units` of
//! a field are its unit.
//!
//! Reference: Apache Arrow columnar format, "Serialization and interprocess communication".

mod column;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;

use arrow_buffer::Buffer;
use arrow_ipc::convert::try_fb_to_schema;
use arrow_ipc::reader::{FileDecoder, StreamDecoder, read_footer_length};
use arrow_ipc::{Block, root_as_footer, root_as_message};
use arrow_schema::ArrowError;

use crate::bytes::Bytes;
use crate::detect::Format;
use crate::error::FormatError;
use crate::input::{Input, UNPACK_FACTOR, UNPACK_LEAST, too_large};
use crate::sink::Sink;
use column::Columns;

/// What errors call the file, and what it may unfold to.
struct About {
    log: String,
    format: Format,
    limit: u64,
}

impl About {
    fn new(input: &Input) -> Self {
        Self {
            log: input.name().to_owned(),
            format: input.format(),
            limit: UNPACK_LEAST.max(input.size().saturating_mul(UNPACK_FACTOR)),
        }
    }

    fn refused(&self, message: impl ToString) -> FormatError {
        FormatError::Refused {
            log: self.log.as_str().into(),
            format: self.format,
            message: message.to_string().into(),
        }
    }

    /// Looks at a message before it is decoded: its buffers must lie within its body, and those
    /// that are packed must not promise too much.
    fn check(&self, metadata: &[u8], body: &[u8]) -> Result<(), FormatError> {
        let message = root_as_message(metadata).map_err(|e| self.refused(e))?;
        let batch = message.header_as_record_batch().or_else(|| {
            let dictionary = message.header_as_dictionary_batch()?;
            dictionary.data()
        });
        let Some(batch) = batch else {
            return Ok(());
        };
        let mut sum = 0u64;
        for buffer in batch.buffers().into_iter().flatten() {
            let place = usize::try_from(buffer.offset()).ok();
            let size = usize::try_from(buffer.length()).ok();
            let end = place.zip(size).and_then(|(p, s)| p.checked_add(s));
            let within = place.zip(end).and_then(|(p, e)| body.get(p..e));
            let Some(within) = within else {
                return Err(self.refused("a buffer lies outside of its message"));
            };
            if batch.compression().is_some() {
                let promised = Bytes::new(within).u64().unwrap_or(0) as i64;
                sum = sum.saturating_add(u64::try_from(promised).unwrap_or(0));
            }
        }
        if sum > self.limit {
            return Err(too_large(&self.log, "the unpacked content", self.limit));
        }
        Ok(())
    }
}

/// Continuation marker and length, which stand before metadata.
fn metadata(data: &[u8]) -> Option<(&[u8], usize)> {
    let mut bytes = Bytes::new(data);
    let mut size = bytes.u32()?;
    if size == u32::MAX {
        size = bytes.u32()?;
    }
    let metadata = bytes.take(usize::try_from(size).ok()?)?;
    Some((metadata, bytes.at()))
}

/// Reads a file.
pub(crate) fn read_file(input: Input, sink: &mut dyn Sink) -> Result<(), FormatError> {
    guarded(input, sink, file)
}

/// Reads a stream.
pub(crate) fn read_stream(input: Input, sink: &mut dyn Sink) -> Result<(), FormatError> {
    guarded(input, sink, |input, sink| {
        let about = About::new(&input);
        stream(Buffer::from_vec(input.into_bytes()?), &about, sink)
    })
}

/// The `arrow` crate takes the keys of a dictionary as they lie: a buffer whose length or place does not suit them ends in a
/// panic (`buffer/immutable.rs`). It holds no state outside the decoder that is dropped here, so the panic is caught and
/// becomes the error that it should have been.
fn guarded(
    input: Input,
    sink: &mut dyn Sink,
    read: impl FnOnce(Input, &mut dyn Sink) -> Result<(), FormatError>,
) -> Result<(), FormatError> {
    let about = About::new(&input);
    let work = AssertUnwindSafe(|| read(input, sink));
    let done = catch_unwind(work);
    done.unwrap_or_else(
        |_| Err(about.refused("a buffer contradicts its type, the file is damaged")),
    )
}

fn file(input: Input, sink: &mut dyn Sink) -> Result<(), FormatError> {
    let about = About::new(&input);
    let data = Buffer::from_vec(input.into_bytes()?);
    // A file that was cut is a stream behind its first eight bytes.
    let Some(footer) = footer(&data) else {
        sink.cut(data.len() as u64, "the footer");
        return stream(data.slice(8.min(data.len())), &about, sink);
    };
    let footer = root_as_footer(footer).map_err(|e| about.refused(e))?;
    let schema = footer.schema().ok_or_else(|| about.refused("no schema"))?;
    let schema = Arc::new(try_fb_to_schema(schema).map_err(|e| about.refused(e))?);
    let mut decoder = FileDecoder::new(Arc::clone(&schema), footer.version());
    let mut columns = Columns::announce(&schema, sink)?;
    let slice = |block: &Block| {
        let start = usize::try_from(block.offset()).ok()?;
        let head = usize::try_from(block.metaDataLength()).ok()?;
        let body = usize::try_from(block.bodyLength()).ok()?;
        let length = head.checked_add(body)?;
        let end = start.checked_add(length).filter(|end| *end <= data.len())?;
        let part = data.get(start..end)?;
        let (metadata, _) = metadata(part.get(..head)?)?;
        Some((
            data.slice_with_length(start, length),
            metadata,
            part.get(head..)?,
        ))
    };
    let outside = || about.refused("a block lies outside of the file");
    for block in footer.dictionaries().into_iter().flatten() {
        let (part, metadata, body) = slice(block).ok_or_else(outside)?;
        about.check(metadata, body)?;
        let done = decoder.read_dictionary(block, &part);
        done.map_err(|e| about.refused(e))?;
    }
    for block in footer.recordBatches().into_iter().flatten() {
        let (part, metadata, body) = slice(block).ok_or_else(outside)?;
        about.check(metadata, body)?;
        let batch = decoder.read_record_batch(block, &part);
        if let Some(batch) = batch.map_err(|e| about.refused(e))? {
            columns.batch(&batch, sink)?;
        }
    }
    Ok(())
}

fn footer(data: &Buffer) -> Option<&[u8]> {
    let trailer = data.len().checked_sub(10)?;
    let tail: [u8; 10] = data.get(trailer..)?.try_into().ok()?;
    let length = read_footer_length(tail).ok()?;
    data.get(trailer.checked_sub(length)?..trailer)
}

fn stream(mut data: Buffer, about: &About, sink: &mut dyn Sink) -> Result<(), FormatError> {
    let mut decoder = StreamDecoder::new();
    let mut columns: Option<Columns> = None;
    let mut at = 0u64;
    while !data.is_empty() {
        // The end: a marker and no length, or the footer of a file.
        let Some((head, start)) = metadata(&data) else {
            sink.cut(at, "a message");
            break;
        };
        if head.is_empty() {
            break;
        }
        let message = root_as_message(head).map_err(|e| about.refused(e))?;
        let body = usize::try_from(message.bodyLength()).ok();
        let end = body.and_then(|n| n.checked_add(start));
        let Some(end) = end.filter(|end| *end <= data.len()) else {
            sink.cut(at, "a message");
            break;
        };
        about.check(head, data.get(start..end).unwrap_or_default())?;
        let mut part = data.slice_with_length(0, end);
        while !part.is_empty() {
            let batch: Result<_, ArrowError> = decoder.decode(&mut part);
            let Some(batch) = batch.map_err(|e| about.refused(e))? else {
                break;
            };
            if columns.is_none() {
                columns = Some(Columns::announce(&batch.schema(), sink)?);
            }
            if let Some(columns) = &mut columns {
                columns.batch(&batch, sink)?;
            }
        }
        data = data.slice(end);
        at += end as u64;
    }
    Ok(())
}
