//! Formats of ULog: `vehicle_attitude:uint64_t timestamp;float[4] q;…`, flattened.

use std::collections::HashMap;
use std::rc::Rc;

use crate::bytes::little;
use crate::sink::{ARRAY_MOST, Kind};

/// Formats within formats.
const DEPTH: usize = 16;
/// Fields of one topic; PX4 has a few hundred at most.
const FIELDS: usize = 4096;

/// Formats by name, as declared.
#[derive(Default)]
pub(super) struct Formats {
    declared: HashMap<String, String>,
    layouts: HashMap<String, Option<Rc<Layout>>>,
}

/// A format as a flat list of fields.
#[derive(Debug, Default)]
pub(super) struct Layout {
    pub(super) fields: Vec<Field>,
    /// Byte of the time stamp.
    pub(super) time: Option<usize>,
    size: usize,
    followed: usize,
}

/// A number, a text, or a long array.
#[derive(Debug)]
pub(super) struct Field {
    pub(super) path: String,
    basic: Basic,
    at: usize,
    /// Elements of a text or a long array; 1 for a number.
    count: usize,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Basic {
    Int(usize),
    Uint(usize),
    Float,
    Double,
    Bool,
    Char,
}

impl Basic {
    fn of(name: &str) -> Option<(Self, usize)> {
        Some(match name {
            "int8_t" => (Basic::Int(1), 1),
            "uint8_t" => (Basic::Uint(1), 1),
            "int16_t" => (Basic::Int(2), 2),
            "uint16_t" => (Basic::Uint(2), 2),
            "int32_t" => (Basic::Int(4), 4),
            "uint32_t" => (Basic::Uint(4), 4),
            "int64_t" => (Basic::Int(8), 8),
            "uint64_t" => (Basic::Uint(8), 8),
            "float" => (Basic::Float, 4),
            "double" => (Basic::Double, 8),
            "bool" => (Basic::Bool, 1),
            "char" => (Basic::Char, 1),
            _ => return None,
        })
    }

    fn size(self) -> usize {
        match self {
            Basic::Int(n) | Basic::Uint(n) => n,
            Basic::Float => 4,
            Basic::Double => 8,
            Basic::Bool | Basic::Char => 1,
        }
    }
}

impl Field {
    pub(super) fn kind(&self) -> Kind {
        match (self.basic, self.count) {
            (Basic::Char, _) => Kind::Text,
            (_, n) if n > 1 => Kind::Opaque,
            (Basic::Bool, _) => Kind::Boolean,
            _ => Kind::Number,
        }
    }

    pub(super) fn declared(&self) -> &'static str {
        match self.basic {
            Basic::Int(1) => "int8",
            Basic::Int(2) => "int16",
            Basic::Int(4) => "int32",
            Basic::Int(_) => "int64",
            Basic::Uint(1) => "uint8",
            Basic::Uint(2) => "uint16",
            Basic::Uint(4) => "uint32",
            Basic::Uint(_) => "uint64",
            Basic::Float => "float",
            Basic::Double => "double",
            Basic::Bool => "bool",
            Basic::Char => "char",
        }
    }

    pub(super) fn number(&self, data: &[u8]) -> Option<f64> {
        let size = self.basic.size();
        let raw = little(data.get(self.at..self.at + size)?);
        Some(match self.basic {
            Basic::Int(n) => {
                let up = 64 - 8 * n as u32;
                ((raw << up) as i64 >> up) as f64
            }
            Basic::Uint(_) | Basic::Char => raw as f64,
            Basic::Float => f64::from(f32::from_bits(raw as u32)),
            Basic::Double => f64::from_bits(raw),
            Basic::Bool => f64::from(raw != 0),
        })
    }

    pub(super) fn text<'d>(&self, data: &'d [u8]) -> Option<std::borrow::Cow<'d, str>> {
        let bytes = data.get(self.at..self.at + self.count)?;
        let text = bytes.split(|b| *b == 0).next().unwrap_or_default();
        Some(String::from_utf8_lossy(text))
    }
}

impl Formats {
    /// Takes the content of an `F` message.
    pub(super) fn define(&mut self, content: &[u8]) -> Option<()> {
        let text = std::str::from_utf8(content).ok()?;
        let (name, fields) = text.split_once(':')?;
        self.declared.insert(name.to_owned(), fields.to_owned());
        Some(())
    }

    /// The flat fields of a format; none when it, or one within it, is not declared.
    pub(super) fn layout(&mut self, name: &str) -> Option<Rc<Layout>> {
        if let Some(known) = self.layouts.get(name) {
            return known.clone();
        }
        let mut layout = Layout::default();
        let made = self.add(name, "", &mut layout, 0).map(|()| Rc::new(layout));
        self.layouts.insert(name.to_owned(), made.clone());
        made
    }

    fn add(&self, name: &str, prefix: &str, layout: &mut Layout, depth: usize) -> Option<()> {
        layout.followed += 1;
        if depth > DEPTH || layout.followed > FIELDS {
            return None;
        }
        let declared = self.declared.get(name)?;
        for field in declared.split(';').filter(|f| !f.trim().is_empty()) {
            let (kind, field) = field.trim().split_once(' ')?;
            let (kind, count) = match kind.split_once('[') {
                Some((kind, count)) => {
                    let count: usize = count.trim_end_matches(']').parse().ok()?;
                    (kind, Some(count))
                }
                None => (kind, None),
            };
            let path = format!("{prefix}{field}");
            match Basic::of(kind) {
                Some((basic, size)) => {
                    let n = count.unwrap_or(1);
                    let bytes = size.checked_mul(n)?;
                    if depth == 0 && field == "timestamp" && basic == Basic::Uint(8) {
                        layout.time = Some(layout.size);
                    } else if !field.starts_with("_padding") {
                        layout.push(&path, basic, count)?;
                    }
                    layout.size = layout.size.checked_add(bytes)?;
                    // A message holds 64 KiB at most.
                    if layout.size > 1 << 16 {
                        return None;
                    }
                }
                None => {
                    for at in 0..count.unwrap_or(1) {
                        let path = match count {
                            Some(_) => format!("{path}[{at}]."),
                            None => format!("{path}."),
                        };
                        self.add(kind, &path, layout, depth + 1)?;
                    }
                }
            }
        }
        Some(())
    }
}

impl Layout {
    fn push(&mut self, path: &str, basic: Basic, count: Option<usize>) -> Option<()> {
        let at = self.size;
        let whole = match count {
            None => Some(1),
            Some(n) if basic == Basic::Char || n > ARRAY_MOST => Some(n),
            Some(_) => None,
        };
        let field = |path: String, at: usize, count: usize| Field {
            path,
            basic,
            at,
            count,
        };
        match whole {
            Some(n) => self.fields.push(field(path.to_owned(), at, n)),
            None => {
                for k in 0..count.unwrap_or(0) {
                    let at = at + k * basic.size();
                    self.fields.push(field(format!("{path}[{k}]"), at, 1));
                }
            }
        }
        (self.fields.len() <= FIELDS).then_some(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nested_formats_are_flat() {
        let mut formats = Formats::default();
        formats
            .define(b"inner:uint8_t[3] cells;char[4] name;")
            .unwrap();
        formats
            .define(
                b"outer:uint64_t timestamp;float x;inner[2] packs;bool ok;uint8_t[3] _padding0;",
            )
            .unwrap();
        let layout = formats.layout("outer").unwrap();
        let paths: Vec<&str> = layout.fields.iter().map(|f| f.path.as_str()).collect();
        assert_eq!(
            paths,
            [
                "x",
                "packs[0].cells[0]",
                "packs[0].cells[1]",
                "packs[0].cells[2]",
                "packs[0].name",
                "packs[1].cells[0]",
                "packs[1].cells[1]",
                "packs[1].cells[2]",
                "packs[1].name",
                "ok"
            ]
        );
        assert_eq!(layout.time, Some(0));
        let mut data = vec![0; 27];
        data[8..12].copy_from_slice(&2.5f32.to_le_bytes());
        data[12..19].copy_from_slice(b"\x01\x02\x03up\0\0");
        data[26] = 1;
        assert_eq!(layout.fields[0].number(&data), Some(2.5));
        assert_eq!(layout.fields[3].number(&data), Some(3.0));
        assert_eq!(layout.fields[4].text(&data).unwrap(), "up");
        assert_eq!(layout.fields[9].number(&data), Some(1.0));
        assert_eq!(layout.fields[9].number(&data[..20]), None);
    }

    #[test]
    fn a_format_within_itself_is_refused() {
        let mut formats = Formats::default();
        formats.define(b"a:a[64] a;").unwrap();
        assert!(formats.layout("a").is_none());
        assert!(formats.layout("b").is_none());
    }
}
