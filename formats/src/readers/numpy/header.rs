//! The header of an array: `{'descr': '<f8', 'fortran_order': False, 'shape': (3, 2), }`.

/// What an array is.
#[derive(Debug, PartialEq)]
pub(super) struct Header {
    /// One nameless field, or those of a structured array.
    pub(super) fields: Vec<Field>,
    pub(super) fortran: bool,
    pub(super) shape: Vec<usize>,
}

/// A field of a row.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Field {
    pub(super) name: String,
    pub(super) declared: String,
    pub(super) basic: Basic,
    big: bool,
    /// Byte within the row.
    pub(super) at: usize,
    pub(super) count: usize,
}

/// Type of one number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Basic {
    Bool,
    Int(usize),
    Uint(usize),
    Float(usize),
    /// Texts of so many bytes, or of so many letters of four bytes.
    Text(usize),
    Wide(usize),
    /// Point in time or duration in so many nanoseconds.
    Instant(i64),
    Span(i64),
    /// So many bytes of something else.
    Other(usize),
}

impl Basic {
    pub(super) fn width(self) -> usize {
        match self {
            Basic::Bool => 1,
            Basic::Int(n) | Basic::Uint(n) | Basic::Float(n) => n,
            Basic::Text(n) | Basic::Other(n) => n,
            Basic::Wide(n) => n.saturating_mul(4),
            Basic::Instant(_) | Basic::Span(_) => 8,
        }
    }

    /// The type behind the letter of the order of bytes: `f8`, `M8[ns]`.
    fn of(text: &str) -> Option<Self> {
        let mut letters = text.chars();
        let letter = letters.next()?;
        let rest = letters.as_str();
        let digits = rest.split('[').next()?;
        let n: usize = digits.parse().ok().filter(|n| *n <= 1 << 24)?;
        Some(match (letter, n) {
            ('b' | '?', 1) => Basic::Bool,
            ('i', 1 | 2 | 4 | 8) => Basic::Int(n),
            ('u', 1 | 2 | 4 | 8) => Basic::Uint(n),
            ('f', 2 | 4 | 8) => Basic::Float(n),
            ('S' | 'a', _) => Basic::Text(n),
            ('U', _) => Basic::Wide(n),
            ('M' | 'm', 8) => {
                let unit = rest.split_once('[')?.1.trim_end_matches(']');
                let nanoseconds = match unit {
                    "ns" => 1,
                    "us" => 1_000,
                    "ms" => 1_000_000,
                    "s" => 1_000_000_000,
                    _ => return Some(Basic::Other(8)),
                };
                match letter {
                    'M' => Basic::Instant(nanoseconds),
                    _ => Basic::Span(nanoseconds),
                }
            }
            ('c' | 'V' | 'f', _) => Basic::Other(n),
            _ => return None,
        })
    }
}

impl Field {
    fn new(name: &str, descr: &str, at: usize, count: usize) -> Option<Self> {
        let (order, rest) = match descr.chars().next()? {
            c @ ('<' | '>' | '|' | '=') => (c, &descr[1..]),
            _ => ('=', descr),
        };
        Some(Self {
            name: name.to_owned(),
            declared: rest.to_owned(),
            basic: Basic::of(rest)?,
            big: order == '>',
            at,
            count,
        })
    }

    fn raw(&self, cell: &[u8]) -> u64 {
        let add = |sum: u64, b: &u8| (sum << 8) | u64::from(*b);
        match self.big {
            true => cell.iter().fold(0, add),
            false => cell.iter().rev().fold(0, add),
        }
    }

    pub(super) fn whole(&self, cell: &[u8]) -> i64 {
        self.raw(cell) as i64
    }

    pub(super) fn number(&self, cell: &[u8]) -> f64 {
        let raw = self.raw(cell);
        match self.basic {
            Basic::Bool => f64::from(raw != 0),
            Basic::Int(n) => {
                let up = 64 - 8 * n as u32;
                ((raw << up) as i64 >> up) as f64
            }
            Basic::Float(2) => half(raw as u16),
            Basic::Float(4) => f64::from(f32::from_bits(raw as u32)),
            Basic::Float(_) => f64::from_bits(raw),
            Basic::Span(unit) => raw as i64 as f64 * unit as f64 / 1e9,
            _ => raw as f64,
        }
    }

    pub(super) fn text(&self, cell: &[u8]) -> String {
        let text: String = match self.basic {
            Basic::Wide(_) => cell
                .chunks_exact(4)
                .filter_map(|c| char::from_u32(self.raw(c) as u32))
                .collect(),
            _ => String::from_utf8_lossy(cell).into_owned(),
        };
        text.trim_end_matches('\0').to_owned()
    }
}

/// IEEE 754 binary16.
fn half(bits: u16) -> f64 {
    let sign = if bits & 0x8000 == 0 { 1.0 } else { -1.0 };
    let fraction = f64::from(bits & 0x3ff);
    let exponent = i32::from(bits >> 10 & 0x1f);
    sign * match exponent {
        0 => fraction * 2f64.powi(-24),
        31 if fraction == 0.0 => f64::INFINITY,
        31 => f64::NAN,
        _ => (1.0 + fraction / 1024.0) * 2f64.powi(exponent - 15),
    }
}

/// The text of the header, and what is behind it.
pub(super) fn split(data: &[u8]) -> Option<(&str, &[u8])> {
    let major = *data.get(6)?;
    let (length, at) = match major {
        1 => (
            u64::from(u16::from_le_bytes(data.get(8..10)?.try_into().ok()?)),
            10,
        ),
        _ => (
            u64::from(u32::from_le_bytes(data.get(8..12)?.try_into().ok()?)),
            12,
        ),
    };
    let end = at + usize::try_from(length).ok()?;
    let text = std::str::from_utf8(data.get(at..end)?).ok()?;
    Some((text, data.get(end..)?))
}

impl Header {
    pub(super) fn parse(text: &str) -> Option<Self> {
        let Literal::Dict(pairs) = Literal::parse(text)? else {
            return None;
        };
        let get = |key: &str| pairs.iter().find(|(k, _)| k == key).map(|(_, v)| v);
        let shape = match get("shape")? {
            Literal::List(list) => list.iter().map(Literal::size).collect::<Option<_>>()?,
            _ => return None,
        };
        let fortran = matches!(get("fortran_order")?, Literal::Word(word) if word == "True");
        let fields = match get("descr")? {
            Literal::Text(text) => vec![Field::new("", text, 0, 1)?],
            Literal::List(list) => {
                let mut at = 0usize;
                let mut fields = Vec::new();
                for entry in list {
                    let field = structured(entry, at)?;
                    let bytes = field.basic.width().checked_mul(field.count)?;
                    at = at.checked_add(bytes).filter(|n| *n < 1 << 30)?;
                    fields.push(field);
                }
                fields
            }
            _ => return None,
        };
        Some(Self {
            fields,
            fortran,
            shape,
        })
    }

    pub(super) fn row_bytes(&self) -> usize {
        self.fields.iter().map(|f| f.basic.width() * f.count).sum()
    }
}

/// `('name', '<f8')` or `('name', '<f8', (3,))`.
fn structured(entry: &Literal, at: usize) -> Option<Field> {
    let Literal::List(parts) = entry else {
        return None;
    };
    let (Literal::Text(name), Literal::Text(descr)) = (parts.first()?, parts.get(1)?) else {
        return None;
    };
    let count = match parts.get(2) {
        None => 1,
        Some(Literal::List(sides)) => sides
            .iter()
            .try_fold(1usize, |n, side| n.checked_mul(side.size()?))?,
        Some(one) => one.size()?,
    };
    Field::new(name, descr, at, count.min(1 << 24))
}

/// What stands in a header: the part of Python's literals that NumPy writes.
#[derive(Debug, PartialEq)]
enum Literal {
    Text(String),
    /// A number or a word.
    Word(String),
    List(Vec<Literal>),
    Dict(Vec<(String, Literal)>),
}

impl Literal {
    fn parse(text: &str) -> Option<Self> {
        let mut rest = text;
        let value = Self::value(&mut rest, 0)?;
        rest.trim().is_empty().then_some(value)
    }

    fn size(&self) -> Option<usize> {
        match self {
            Literal::Word(word) => word.trim_end_matches('L').parse().ok(),
            _ => None,
        }
    }

    fn value(rest: &mut &str, depth: usize) -> Option<Self> {
        *rest = rest.trim_start();
        let first = rest.chars().next()?;
        if depth > 8 {
            return None;
        }
        match first {
            '\'' | '"' => {
                let (text, after) = rest[1..].split_once(first)?;
                *rest = after;
                Some(Literal::Text(text.to_owned()))
            }
            '(' | '[' => {
                let close = if first == '(' { ')' } else { ']' };
                *rest = &rest[1..];
                let mut list = Vec::new();
                while !Self::ends(rest, close) {
                    list.push(Self::value(rest, depth + 1)?);
                    Self::comma(rest);
                }
                *rest = rest.get(1..)?;
                Some(Literal::List(list))
            }
            '{' => {
                *rest = &rest[1..];
                let mut pairs = Vec::new();
                while !Self::ends(rest, '}') {
                    let Literal::Text(key) = Self::value(rest, depth + 1)? else {
                        return None;
                    };
                    *rest = rest.trim_start().strip_prefix(':')?;
                    pairs.push((key, Self::value(rest, depth + 1)?));
                    Self::comma(rest);
                }
                *rest = rest.get(1..)?;
                Some(Literal::Dict(pairs))
            }
            _ => {
                let word = |c: char| c.is_alphanumeric() || "-+._".contains(c);
                let end = rest.find(|c| !word(c)).unwrap_or(rest.len());
                let (found, after) = rest.split_at(end);
                *rest = after;
                (!found.is_empty()).then(|| Literal::Word(found.to_owned()))
            }
        }
    }

    fn ends(rest: &mut &str, close: char) -> bool {
        *rest = rest.trim_start();
        rest.starts_with(close)
    }

    fn comma(rest: &mut &str) {
        *rest = rest.trim_start();
        *rest = rest.strip_prefix(',').unwrap_or(rest);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn headers_of_numpy() {
        let h = Header::parse("{'descr': '<f8', 'fortran_order': False, 'shape': (3, 2), }  \n");
        let h = h.unwrap();
        assert_eq!((h.shape.as_slice(), h.fortran), (&[3, 2][..], false));
        assert_eq!(h.fields[0].basic, Basic::Float(8));
        let h = Header::parse(
            "{'descr': [('t', '<M8[ns]'), ('q', '>f4', (3,)), ('s', '<U4')], 'fortran_order': True, 'shape': (5,)}",
        )
        .unwrap();
        let at: Vec<usize> = h.fields.iter().map(|f| f.at).collect();
        assert_eq!((at, h.row_bytes()), (vec![0, 8, 20], 36));
        assert!(h.fortran && h.fields[1].big && h.fields[1].count == 3);
        for broken in [
            "",
            "{",
            "{'descr': '<f8'}",
            "[1, 2",
            "{'a': }",
            "(((((((((((((((((",
        ] {
            assert_eq!(Header::parse(broken), None, "{broken}");
        }
    }

    #[test]
    fn half_precision() {
        assert_eq!(half(0x3c00), 1.0);
        assert_eq!(half(0xc000), -2.0);
        assert_eq!(half(0x0001), 2f64.powi(-24));
        assert!(half(0x7c01).is_nan() && half(0xfc00) == f64::NEG_INFINITY);
    }
}
