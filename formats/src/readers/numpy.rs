//! NumPy arrays (`.npy`) and archives of them (`.npz`).
//!
//! An array has a header that says its type, order and shape. A structured array is a table: its
//! fields are channels. An archive holds one file for each array; a matrix is a channel for each
//! column (or row, where those are fewer): `y[1]`.
//!
//! Reference: NumPy manual, "numpy.lib.format".

mod header;

use std::io::Read;

use crate::columns::{Array, Order};
use crate::detect::Format;
use crate::error::FormatError;
use crate::input::{Input, UNPACK_FACTOR, UNPACK_LEAST, too_large};
use crate::sink::{ChannelInfo, Kind, Sink, Stamps};
use header::{Basic, Field, Header};

/// Reads an array.
pub(crate) fn read_npy(input: &mut Input, sink: &mut dyn Sink) -> Result<(), FormatError> {
    input.rewind()?;
    let mut data = Vec::new();
    let read = input.read_to_end(&mut data);
    read.map_err(|e| input.io(&e))?;
    let name = input.name().to_owned();
    array("array", &data, &name, &mut Stamps::default(), sink)
}

/// Reads all arrays of an archive.
pub(crate) fn read_npz(input: &mut Input, sink: &mut dyn Sink) -> Result<(), FormatError> {
    let name = input.name().to_owned();
    let limit = UNPACK_LEAST.max(input.size().saturating_mul(UNPACK_FACTOR));
    let refused = |message: String| FormatError::Refused {
        log: name.as_str().into(),
        format: Format::Npz,
        message: message.into(),
    };
    input.rewind()?;
    let mut archive = zip::ZipArchive::new(input).map_err(|e| refused(e.to_string()))?;
    let mut stamps = Stamps::default();
    let mut left = limit;
    for at in 0..archive.len() {
        let file = archive.by_index(at).map_err(|e| refused(e.to_string()))?;
        let entry = file
            .name()
            .map_err(|e| refused(e.to_string()))?
            .into_owned();
        let mut data = Vec::new();
        file.take(left + 1)
            .read_to_end(&mut data)
            .map_err(|e| refused(format!("{entry}: {e}")))?;
        left = left
            .checked_sub(data.len() as u64)
            .ok_or_else(|| too_large(&name, "the unpacked content", limit))?;
        if let Some(path) = entry.strip_suffix(".npy") {
            array(path, &data, &format!("{name}: {entry}"), &mut stamps, sink)?;
        }
    }
    Ok(())
}

fn array(
    path: &str,
    data: &[u8],
    log: &str,
    stamps: &mut Stamps,
    sink: &mut dyn Sink,
) -> Result<(), FormatError> {
    let damaged = |position: usize, expected: &str, found: String| FormatError::Damaged {
        log: log.into(),
        format: Format::Npy,
        position: position as u64,
        expected: expected.into(),
        found: found.into(),
    };
    let Some((text, body)) = header::split(data) else {
        return Err(damaged(0, "a header", "one that is cut".into()));
    };
    let Some(header) = Header::parse(text) else {
        let text: String = text.chars().take(200).collect();
        return Err(damaged(
            10,
            "a header with descr, fortran_order and shape",
            text,
        ));
    };
    let count = header
        .shape
        .iter()
        .try_fold(1usize, |n, d| n.checked_mul(*d));
    let row = header.row_bytes();
    let wanted = count.and_then(|n| n.checked_mul(row));
    let (Some(count), Some(wanted)) = (count, wanted) else {
        return Err(damaged(
            10,
            "a shape that fits",
            format!("{:?}", header.shape),
        ));
    };
    let mut shape = header.shape.clone();
    let mut rows = count;
    if wanted > body.len() {
        sink.cut((data.len() - body.len()) as u64, path);
        // Whole rows of what is there, where rows stand one after the other.
        let first = shape.first().copied().unwrap_or(0).max(1);
        let across = count / first;
        let Some(whole) = body
            .len()
            .checked_div(row * across)
            .filter(|_| !header.fortran)
        else {
            return Ok(());
        };
        if let Some(first) = shape.first_mut() {
            *first = whole;
        }
        rows = whole * across;
    }
    let body = body.get(..rows * row).unwrap_or(body);
    let named = header.fields.len() > 1 || header.fields.iter().any(|f| !f.name.is_empty());
    for field in &header.fields {
        let path = match (named, field.name.as_str()) {
            (true, name) if path == "array" => name.to_owned(),
            (true, name) => format!("{path}.{name}"),
            _ => path.to_owned(),
        };
        let order = if header.fortran {
            Order::Column
        } else {
            Order::Row
        };
        column(&path, field, &shape, order, row, body, stamps, sink)?;
    }
    Ok(())
}

#[allow(
    clippy::too_many_arguments,
    reason = "one column of one array, called from one place"
)]
fn column(
    path: &str,
    field: &Field,
    shape: &[usize],
    order: Order,
    row: usize,
    body: &[u8],
    stamps: &mut Stamps,
    sink: &mut dyn Sink,
) -> Result<(), FormatError> {
    let declared = field.declared.as_str();
    let width = field.basic.width();
    let cells = body
        .chunks_exact(row.max(1))
        .filter_map(|r| r.get(field.at..field.at + width * field.count))
        .flat_map(|r| r.chunks_exact(width.max(1)));
    match field.basic {
        Basic::Text(_) | Basic::Wide(_) => {
            let channel = sink.channel(ChannelInfo::new(path, Kind::Text, declared))?;
            for cell in cells {
                sink.text(channel, &field.text(cell))?;
            }
            return Ok(());
        }
        Basic::Other(_) => {
            let channel = sink.channel(ChannelInfo::new(path, Kind::Opaque, declared))?;
            return sink.opaque(channel);
        }
        _ => {}
    }
    let values: Vec<f64> = cells
        .map(|cell| match field.basic {
            Basic::Instant(unit) => match field.whole(cell) {
                // Not a time.
                i64::MIN => f64::NAN,
                ticks => stamps.seconds(i128::from(ticks) * i128::from(unit), sink),
            },
            _ => field.number(cell),
        })
        .collect();
    let mut shape = shape.to_vec();
    if field.count > 1 {
        shape.push(field.count);
    }
    let kind = match field.basic {
        Basic::Bool => Kind::Boolean,
        _ => Kind::Number,
    };
    let unit = matches!(field.basic, Basic::Instant(_) | Basic::Span(_));
    let array = Array {
        path,
        shape: &shape,
        order,
        kind,
        declared,
        unit: unit.then(|| "s".to_owned()),
        matlab: false,
    };
    array.emit(&values, sink)
}
