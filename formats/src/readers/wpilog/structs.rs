//! Schemas of WPILib structs: `double x;Rotation2d rotation;float gains[3];int8 mode:4`.
//!
//! Fields follow one another without padding. Bit fields of one type share its bytes.
//!
//! Reference: WPILib, "WPILib Packed Struct Serialization Specification, Version 1.0".

use std::collections::HashMap;

use crate::bytes::little;
use crate::sink::{ARRAY_MOST, Kind};

/// Structs within structs.
const DEPTH: usize = 16;
/// Values of one struct.
const VALUES: usize = 512;

/// Schemas by name.
#[derive(Debug, Default)]
pub(super) struct Structs {
    schemas: HashMap<String, String>,
    layouts: std::cell::RefCell<HashMap<String, Option<std::rc::Rc<Layout>>>>,
}

/// A struct as a flat list of its numbers.
#[derive(Debug, Default)]
pub(super) struct Layout {
    pub(super) fields: Vec<Field>,
    pub(super) size: usize,
    /// Schemas that were followed to make it.
    followed: usize,
}

/// One number of a struct.
#[derive(Clone, Debug)]
pub(super) struct Field {
    pub(super) path: String,
    basic: Basic,
    at: usize,
    /// First bit and number of bits of a bit field.
    bits: Option<(u32, u32)>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Basic {
    Bool,
    Char,
    Int(usize),
    Uint(usize),
    Float,
    Double,
}

impl Basic {
    fn of(name: &str) -> Option<Self> {
        Some(match name {
            "bool" => Basic::Bool,
            "char" => Basic::Char,
            "int8" => Basic::Int(1),
            "int16" => Basic::Int(2),
            "int32" => Basic::Int(4),
            "int64" => Basic::Int(8),
            "uint8" => Basic::Uint(1),
            "uint16" => Basic::Uint(2),
            "uint32" => Basic::Uint(4),
            "uint64" => Basic::Uint(8),
            "float" | "float32" => Basic::Float,
            "double" | "float64" => Basic::Double,
            _ => return None,
        })
    }

    fn size(self) -> usize {
        match self {
            Basic::Bool | Basic::Char => 1,
            Basic::Int(n) | Basic::Uint(n) => n,
            Basic::Float => 4,
            Basic::Double => 8,
        }
    }
}

impl Field {
    pub(super) fn kind(&self) -> Kind {
        match self.basic {
            Basic::Bool => Kind::Boolean,
            _ => Kind::Number,
        }
    }

    pub(super) fn declared(&self) -> &'static str {
        match self.basic {
            Basic::Bool => "bool",
            Basic::Char => "char",
            Basic::Int(_) => "int",
            Basic::Uint(_) => "uint",
            Basic::Float => "float",
            Basic::Double => "double",
        }
    }

    /// The number in the bytes of a struct.
    pub(super) fn value(&self, data: &[u8]) -> Option<f64> {
        let size = self.basic.size();
        let raw = little(data.get(self.at..self.at.checked_add(size)?)?);
        let width = size as u32 * 8;
        let (first, bits) = self.bits.unwrap_or((0, width));
        let shifted = raw >> first.min(63);
        let masked = if bits >= 64 {
            shifted
        } else {
            shifted & ((1 << bits) - 1)
        };
        Some(match self.basic {
            Basic::Bool => f64::from(masked != 0),
            Basic::Char | Basic::Uint(_) => masked as f64,
            Basic::Int(_) => {
                let up = 64 - bits.clamp(1, 64);
                ((masked << up) as i64 >> up) as f64
            }
            Basic::Float => f64::from(f32::from_bits(masked as u32)),
            Basic::Double => f64::from_bits(masked),
        })
    }
}

impl Structs {
    /// Takes a schema from its entry `…/.schema/struct:Name`.
    pub(super) fn define(&mut self, entry: &str, text: &[u8]) {
        let name = entry.rsplit("struct:").next().unwrap_or(entry);
        let text = String::from_utf8_lossy(text).into_owned();
        self.schemas.insert(name.to_owned(), text);
        self.layouts.borrow_mut().clear();
    }

    /// The layout of a struct; none when its schema, or one within it, is not known.
    pub(super) fn fields(&self, name: &str) -> Option<std::rc::Rc<Layout>> {
        if let Some(known) = self.layouts.borrow().get(name) {
            return known.clone();
        }
        let mut layout = Layout::default();
        let made = self
            .add(name, "", &mut layout, 0)
            .map(|()| std::rc::Rc::new(layout));
        self.layouts
            .borrow_mut()
            .insert(name.to_owned(), made.clone());
        made
    }

    fn add(&self, name: &str, prefix: &str, layout: &mut Layout, depth: usize) -> Option<()> {
        layout.followed += 1;
        if depth > DEPTH || layout.followed > VALUES {
            return None;
        }
        let schema = self.schemas.get(name)?;
        // Bytes and bits that the bit fields before left.
        let mut shared: Option<(usize, usize, u32)> = None;
        for declaration in schema.split(';').map(str::trim).filter(|d| !d.is_empty()) {
            // `enum {a=1,b=2} int8 mode` counts as its number.
            let declaration = match declaration.split_once('}') {
                Some((_, rest)) => rest.trim(),
                None => declaration,
            };
            let (kind, rest) = declaration.split_once(char::is_whitespace)?;
            let rest = rest.trim();
            let (rest, bits) = match rest.split_once(':') {
                Some((rest, bits)) => (rest.trim(), Some(bits.trim().parse::<u32>().ok()?)),
                None => (rest, None),
            };
            let (field, count) = match rest.split_once('[') {
                Some((field, count)) => {
                    let count = count.trim_end_matches(']').trim().parse().ok()?;
                    (field.trim(), Some(count))
                }
                None => (rest, None),
            };
            let path = format!("{prefix}{field}");
            if let (Some(bits), Some(basic)) = (bits, Basic::of(kind)) {
                let size = basic.size();
                let width = size as u32 * 8;
                if bits == 0 || bits > width {
                    return None;
                }
                let (at, first) = match shared {
                    Some((at, s, used)) if s == size && used + bits <= width => (at, used),
                    // A boolean takes a bit of whatever stands before it.
                    Some((at, s, used)) if basic == Basic::Bool && used < 8 * s as u32 => {
                        shared = Some((at, s, used + 1));
                        let byte = at + used as usize / 8;
                        layout.push(path, basic, byte, Some((used % 8, 1)))?;
                        continue;
                    }
                    _ => {
                        let at = layout.size;
                        layout.size += size;
                        (at, 0)
                    }
                };
                shared = Some((at, size, first + bits));
                layout.push(path, basic, at, Some((first, bits)))?;
                continue;
            }
            shared = None;
            self.members(kind, &path, count, layout, depth)?;
        }
        Some(())
    }

    fn members(
        &self,
        kind: &str,
        path: &str,
        count: Option<usize>,
        layout: &mut Layout,
        depth: usize,
    ) -> Option<()> {
        for at in 0..count.unwrap_or(1) {
            let path = match count {
                Some(_) => format!("{path}[{at}]"),
                None => path.to_owned(),
            };
            match Basic::of(kind) {
                Some(basic) => {
                    let shown = at < ARRAY_MOST && !(basic == Basic::Char && count.is_some());
                    if shown {
                        layout.push(path, basic, layout.size, None)?;
                    }
                    layout.size = layout.size.checked_add(basic.size())?;
                    if layout.size > 1 << 20 {
                        return None;
                    }
                }
                None => self.add(kind, &format!("{path}."), layout, depth + 1)?,
            }
        }
        Some(())
    }
}

impl Layout {
    fn push(
        &mut self,
        path: String,
        basic: Basic,
        at: usize,
        bits: Option<(u32, u32)>,
    ) -> Option<()> {
        if self.fields.len() >= VALUES {
            return None;
        }
        self.fields.push(Field {
            path,
            basic,
            at,
            bits,
        });
        Some(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nested_structs_arrays_and_bits() {
        let mut structs = Structs::default();
        structs.define("NT:/.schema/struct:Rotation2d", b"double value");
        structs.define(
            "NT:/.schema/struct:State",
            b"float speeds[2]; Rotation2d heading;enum {off=0,on=1} uint8 mode:4;uint8 flags:2; int8 z",
        );
        let layout = structs.fields("State").unwrap();
        let paths: Vec<&str> = layout.fields.iter().map(|f| f.path.as_str()).collect();
        assert_eq!(
            paths,
            [
                "speeds[0]",
                "speeds[1]",
                "heading.value",
                "mode",
                "flags",
                "z"
            ]
        );
        assert_eq!(layout.size, 18);
        let mut data = Vec::new();
        data.extend(1.5f32.to_le_bytes());
        data.extend((-2.0f32).to_le_bytes());
        data.extend(0.25f64.to_le_bytes());
        data.push(0b10_0101);
        data.push(0xff);
        let values: Vec<f64> = layout
            .fields
            .iter()
            .map(|f| f.value(&data).unwrap())
            .collect();
        assert_eq!(values, [1.5, -2.0, 0.25, 5.0, 2.0, -1.0]);
        assert!(layout.fields[2].value(&data[..10]).is_none());
    }

    #[test]
    fn a_struct_within_itself_is_refused() {
        let mut structs = Structs::default();
        structs.define("struct:A", b"A a[64]");
        assert!(structs.fields("A").is_none());
        assert!(structs.fields("B").is_none());
    }
}
