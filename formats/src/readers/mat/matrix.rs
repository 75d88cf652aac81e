//! Variables: arrays of numbers, texts, structures, cells.

use super::element::{Bits, Element, MATRIX};
use crate::columns::{Array, Order};
use crate::error::FormatError;
use crate::sink::{ARRAY_MOST, ChannelInfo, Kind, Sink};

/// Structures within structures.
const DEPTH: usize = 16;

const CELL: u8 = 1;
const STRUCT: u8 = 2;
const OBJECT: u8 = 3;
const CHAR: u8 = 4;
const SPARSE: u8 = 5;
const FUNCTION: u8 = 16;
const OPAQUE: u8 = 17;

/// Hands a variable on; none when its parts do not fit it.
pub(super) fn variable(
    content: &[u8],
    big: bool,
    sink: &mut dyn Sink,
) -> Result<Option<()>, FormatError> {
    walk(content, big, None, sink, 0)
}

/// What stands before the content of a variable.
struct Head {
    class: u8,
    logical: bool,
    complex: bool,
    dims: Vec<usize>,
    path: String,
}

impl Head {
    /// Number of elements; none where that is more than can be counted.
    fn count(&self) -> Option<usize> {
        (self.dims.iter()).try_fold(1usize, |n, d| n.checked_mul(*d))
    }
}

fn head(bits: &mut Bits<'_>, path: Option<&str>) -> Option<Head> {
    let flags = bits.element()?.numbers()?.next()? as u32;
    let class = flags as u8;
    // Objects of newer classes have no dimensions: the name follows.
    let dims = match class {
        OPAQUE => Vec::new(),
        _ => bits.element()?.sizes()?,
    };
    let own = bits.element()?.text();
    Some(Head {
        class,
        logical: flags & 0x200 != 0,
        complex: flags & 0x800 != 0,
        dims,
        path: path.map_or(own, str::to_owned),
    })
}

fn walk(
    content: &[u8],
    big: bool,
    path: Option<&str>,
    sink: &mut dyn Sink,
    depth: usize,
) -> Result<Option<()>, FormatError> {
    // An empty element stands for an empty array.
    if content.is_empty() {
        return Ok(Some(()));
    }
    let mut bits = Bits::new(content, big);
    let Some(head) = head(&mut bits, path) else {
        return Ok(None);
    };
    if depth > DEPTH {
        return Ok(None);
    }
    // MATLAB keeps the inside of its objects in a variable without a name.
    if head.path.is_empty() && path.is_none() {
        return Ok(Some(()));
    }
    match head.class {
        STRUCT | OBJECT => structure(&head, &mut bits, big, sink, depth),
        CELL => cell(&head, &mut bits, big, sink, depth),
        CHAR => characters(&head, &mut bits, sink),
        SPARSE => unread(&head.path, "sparse matrix", sink).map(Some),
        FUNCTION => unread(&head.path, "function", sink).map(Some),
        OPAQUE => {
            let _system = bits.element();
            let class = bits.element().map(|e| e.text()).unwrap_or_default();
            sink.note(format!(
                "{}: a MATLAB object of the class {class} cannot be read; save its values as arrays",
                head.path
            ));
            unread(&head.path, &class, sink).map(Some)
        }
        6..=15 => numbers(&head, &mut bits, sink),
        _ => Ok(None),
    }
}

fn unread(path: &str, what: &str, sink: &mut dyn Sink) -> Result<(), FormatError> {
    let channel = sink.channel(ChannelInfo::new(path, Kind::Opaque, what))?;
    sink.opaque(channel)
}

fn numbers(
    head: &Head,
    bits: &mut Bits<'_>,
    sink: &mut dyn Sink,
) -> Result<Option<()>, FormatError> {
    let class = match head.class {
        6 => "double",
        7 => "single",
        8 => "int8",
        9 => "uint8",
        10 => "int16",
        11 => "uint16",
        12 => "int32",
        13 => "uint32",
        14 => "int64",
        _ => "uint64",
    };
    let Some(element) = bits.element() else {
        return Ok(None);
    };
    let (Some(count), Some(numbers)) = (element.len(), element.numbers()) else {
        return Ok(None);
    };
    let wanted = head.count();
    if wanted != Some(count) {
        return Ok(None);
    }
    if head.complex {
        return unread(&head.path, "complex", sink).map(Some);
    }
    let values: Vec<f64> = numbers.collect();
    let array = Array {
        path: &head.path,
        shape: &head.dims,
        order: Order::Column,
        kind: if head.logical {
            Kind::Boolean
        } else {
            Kind::Number
        },
        declared: if head.logical { "logical" } else { class },
        unit: None,
        matlab: true,
    };
    array.emit(&values, sink)?;
    Ok(Some(()))
}

/// One text for each row.
fn characters(
    head: &Head,
    bits: &mut Bits<'_>,
    sink: &mut dyn Sink,
) -> Result<Option<()>, FormatError> {
    let Some(element) = bits.element() else {
        return Ok(None);
    };
    let rows = head.dims.first().copied().unwrap_or(0);
    let texts = texts(&element, rows);
    let channel = sink.channel(ChannelInfo::new(&head.path, Kind::Text, "char"))?;
    for text in texts {
        sink.text(channel, &text)?;
    }
    Ok(Some(()))
}

fn texts(element: &Element<'_>, rows: usize) -> Vec<String> {
    let letters: Vec<char> = match element.kind {
        16 => String::from_utf8_lossy(element.data).chars().collect(),
        _ => {
            let units = element.numbers().into_iter().flatten();
            let units: Vec<u16> = units.map(|n| n as u16).collect();
            String::from_utf16_lossy(&units).chars().collect()
        }
    };
    let rows = rows.clamp(1, letters.len().max(1));
    (0..rows)
        .map(|row| {
            let line: String = letters.iter().skip(row).step_by(rows).collect();
            line.trim_end().to_owned()
        })
        .collect()
}

/// The element of a cell or a field.
fn inner(
    bits: &mut Bits<'_>,
    big: bool,
    path: &str,
    sink: &mut dyn Sink,
    depth: usize,
) -> Result<Option<()>, FormatError> {
    match bits.element() {
        Some(element) if element.kind == MATRIX => {
            walk(element.data, big, Some(path), sink, depth + 1)
        }
        _ => Ok(None),
    }
}

fn cell(
    head: &Head,
    bits: &mut Bits<'_>,
    big: bool,
    sink: &mut dyn Sink,
    depth: usize,
) -> Result<Option<()>, FormatError> {
    let Some(count) = head.count() else {
        return Ok(None);
    };
    if count > ARRAY_MOST {
        return unread(&head.path, &format!("cell[{count}]"), sink).map(Some);
    }
    for at in 0..count {
        let path = format!("{}[{at}]", head.path);
        if inner(bits, big, &path, sink, depth)?.is_none() {
            return Ok(None);
        }
    }
    Ok(Some(()))
}

fn structure(
    head: &Head,
    bits: &mut Bits<'_>,
    big: bool,
    sink: &mut dyn Sink,
    depth: usize,
) -> Result<Option<()>, FormatError> {
    if head.class == OBJECT {
        let _class = bits.element();
    }
    let width = bits.element().and_then(|e| e.sizes()?.first().copied());
    let names = bits.element();
    let (Some(width), Some(names)) = (width, names) else {
        return Ok(None);
    };
    if width == 0 && !names.data.is_empty() {
        return Ok(None);
    }
    let names: Vec<String> = names
        .data
        .chunks_exact(width.max(1))
        .map(|name| {
            let end = name.iter().position(|b| *b == 0).unwrap_or(name.len());
            String::from_utf8_lossy(&name[..end]).into_owned()
        })
        .collect();
    let Some(count) = head.count() else {
        return Ok(None);
    };
    if count > ARRAY_MOST {
        return unread(&head.path, &format!("struct[{count}]"), sink).map(Some);
    }
    for at in 0..count {
        for name in &names {
            let path = match count {
                1 => format!("{}.{name}", head.path),
                _ => format!("{}[{at}].{name}", head.path),
            };
            if inner(bits, big, &path, sink, depth)?.is_none() {
                return Ok(None);
            }
        }
    }
    Ok(Some(()))
}
