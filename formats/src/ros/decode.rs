//! The bytes of ROS messages: CDR (ROS 2) and the serialisation of ROS 1.
//!
//! CDR: four bytes say the order of bytes; numbers stand at multiples of their size (at most 8, or
//! 4 in its second version) counted behind them; a text has its length with a zero at the end; a
//! sequence its count. ROS 1 has no such bytes, no padding and no zero.
//!
//! Reference: OMG, "DDS Interoperability Wire Protocol", section 10; ROS wiki, "msg".

use super::definition::{Count, Definitions, Field, Kind};
use crate::error::FormatError;
use crate::sink::{ARRAY_MOST, Stamps};
use crate::tree::{DEPTH, Out, Slot};

/// Which ROS wrote a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Ros {
    One,
    Two,
}

/// What a message is made of, ready to be decoded.
#[derive(Debug)]
pub(crate) struct Layout {
    definitions: Definitions,
    ros: Ros,
}

/// Elements of all sequences of one message.
const ELEMENTS: usize = 1 << 20;

/// How a message ended that could not be read to its end.
pub(crate) enum Trouble {
    /// Its bytes do not fit its definition.
    Bytes,
    /// The sink refused.
    Sink(FormatError),
}

impl From<FormatError> for Trouble {
    fn from(error: FormatError) -> Self {
        Trouble::Sink(error)
    }
}

impl Layout {
    /// Reads the definition of a type.
    pub(crate) fn new(name: &str, text: &str, ros: Ros) -> Self {
        Self {
            definitions: Definitions::parse(name, text),
            ros,
        }
    }

    /// The first type that is named and not defined.
    pub(crate) fn lacks(&self) -> Option<&str> {
        let fields = |m: &'_ super::definition::Message| -> bool {
            m.fields.iter().any(|f| f.kind == Kind::Unknown)
        };
        let lacking = self.definitions.types.iter().find(|m| fields(m))?;
        Some(&lacking.name)
    }

    /// Hands the values of a message on; false when its bytes do not fit the definition.
    pub(crate) fn decode(
        &self,
        data: &[u8],
        root: &mut Slot,
        stamps: &mut Stamps,
        out: &mut Out<'_>,
    ) -> Result<bool, FormatError> {
        let reader = match self.ros {
            Ros::One => Some(Reader::new(data, 1)),
            Ros::Two => Reader::cdr(data),
        };
        let Some(reader) = reader else {
            return Ok(false);
        };
        let mut decoder = Decoder {
            types: &self.definitions,
            ros: self.ros,
            reader,
            stamps,
            elements: 0,
        };
        match decoder.message(0, Some(root), out, 0) {
            Ok(()) => Ok(true),
            Err(Trouble::Bytes) => Ok(false),
            Err(Trouble::Sink(error)) => Err(error),
        }
    }
}

/// Bytes with alignment.
struct Reader<'d> {
    data: &'d [u8],
    at: usize,
    most: usize,
    big: bool,
}

impl<'d> Reader<'d> {
    fn new(data: &'d [u8], most: usize) -> Self {
        Self {
            data,
            at: 0,
            most,
            big: false,
        }
    }

    fn cdr(data: &'d [u8]) -> Option<Self> {
        let (head, rest) = data.split_at_checked(4)?;
        let (most, big) = match head.get(..2)? {
            [0, 0] => (8, true),
            [0, 1] => (8, false),
            [0, 6] => (4, true),
            [0, 7] => (4, false),
            _ => return None,
        };
        Some(Self {
            data: rest,
            at: 0,
            most,
            big,
        })
    }

    fn take(&mut self, n: usize) -> Result<&'d [u8], Trouble> {
        let end = self.at.checked_add(n).ok_or(Trouble::Bytes)?;
        let taken = self.data.get(self.at..end).ok_or(Trouble::Bytes)?;
        self.at = end;
        Ok(taken)
    }

    fn left(&self) -> usize {
        self.data.len().saturating_sub(self.at)
    }

    fn align(&mut self, size: usize) {
        self.at = self.at.next_multiple_of(size.min(self.most).max(1));
    }

    fn raw(&mut self, size: usize) -> Result<u64, Trouble> {
        self.align(size);
        let big = self.big;
        let bytes = self.take(size)?;
        let add = |sum: u64, b: &u8| (sum << 8) | u64::from(*b);
        Ok(match big {
            true => bytes.iter().fold(0, add),
            false => bytes.iter().rev().fold(0, add),
        })
    }

    /// A count of things of at least one byte each.
    fn count(&mut self) -> Result<usize, Trouble> {
        let n = usize::try_from(self.raw(4)?).map_err(|_| Trouble::Bytes)?;
        if n > self.left() {
            return Err(Trouble::Bytes);
        }
        Ok(n)
    }
}

struct Decoder<'a> {
    types: &'a Definitions,
    ros: Ros,
    reader: Reader<'a>,
    stamps: &'a mut Stamps,
    elements: usize,
}

impl Decoder<'_> {
    fn message(
        &mut self,
        which: usize,
        mut slot: Option<&mut Slot>,
        out: &mut Out<'_>,
        depth: usize,
    ) -> Result<(), Trouble> {
        let types = self.types;
        let message = types.types.get(which).ok_or(Trouble::Bytes)?;
        if depth > DEPTH {
            return Err(Trouble::Bytes);
        }
        // A structure without members has one byte all the same.
        if message.fields.is_empty() && self.ros == Ros::Two {
            self.reader.take(1)?;
        }
        let mut names: Vec<String> = Vec::new();
        for (at, field) in message.fields.iter().enumerate() {
            let place = match &mut slot {
                Some(slot) => slot.field(at, &field.name, out),
                None => None,
            };
            match field.count {
                Count::One => self.value(field, place, out, depth)?,
                Count::Fixed(n) => self.array(field, n, place, &mut names, out, depth)?,
                Count::Sequence => {
                    let n = self.reader.count()?;
                    self.array(field, n, place, &mut names, out, depth)?;
                }
            }
        }
        Ok(())
    }

    fn array(
        &mut self,
        field: &Field,
        n: usize,
        mut slot: Option<&mut Slot>,
        names: &mut Vec<String>,
        out: &mut Out<'_>,
        depth: usize,
    ) -> Result<(), Trouble> {
        if n > ARRAY_MOST {
            if let Some(slot) = slot.take() {
                slot.opaque(&format!("{}[{n}]", field.kind.declared()), out)?;
            }
            if let Kind::Int(size) | Kind::Uint(size) = field.kind {
                self.reader.align(size);
                let bytes = n.checked_mul(size).ok_or(Trouble::Bytes)?;
                self.reader.take(bytes)?;
                return Ok(());
            }
        }
        let is_names = field.kind == Kind::String
            && ["name", "names", "joint_names"].contains(&field.name.as_str());
        for at in 0..n {
            self.elements += 1;
            if self.elements > ELEMENTS {
                return Err(Trouble::Bytes);
            }
            if is_names && n <= ARRAY_MOST {
                let text = self.string()?;
                if let Some(place) = slot.as_mut().and_then(|s| s.element(at, None, out)) {
                    place.text(&text, out)?;
                }
                names.push(text);
                continue;
            }
            let named = names.len() == n && field.kind != Kind::String;
            let name = names.get(at).filter(|_| named).map(String::as_str);
            let place = match &mut slot {
                Some(slot) => slot.element(at, name, out),
                None => None,
            };
            self.value(field, place, out, depth)?;
        }
        Ok(())
    }

    fn value(
        &mut self,
        field: &Field,
        slot: Option<&mut Slot>,
        out: &mut Out<'_>,
        depth: usize,
    ) -> Result<(), Trouble> {
        let declared = field.kind.declared();
        let number = match field.kind {
            Kind::Message(which) => return self.message(which, slot, out, depth + 1),
            Kind::Unknown => return Err(Trouble::Bytes),
            Kind::String | Kind::WString => {
                let text = match field.kind {
                    Kind::String => self.string()?,
                    _ => self.wide()?,
                };
                if let Some(slot) = slot {
                    slot.text(&text, out)?;
                }
                return Ok(());
            }
            Kind::Time | Kind::Duration => return self.time(field.kind, slot, out),
            Kind::Bool => {
                let value = self.reader.raw(1)? != 0;
                if let Some(slot) = slot {
                    slot.boolean(value, out)?;
                }
                return Ok(());
            }
            Kind::Int(n) => {
                let up = 64 - 8 * n as u32;
                ((self.reader.raw(n)? << up) as i64 >> up) as f64
            }
            Kind::Uint(n) => self.reader.raw(n)? as f64,
            Kind::Float32 => f64::from(f32::from_bits(self.reader.raw(4)? as u32)),
            Kind::Float64 => f64::from_bits(self.reader.raw(8)?),
        };
        if let Some(slot) = slot {
            slot.number(number, declared, out)?;
        }
        Ok(())
    }

    fn time(
        &mut self,
        kind: Kind,
        slot: Option<&mut Slot>,
        out: &mut Out<'_>,
    ) -> Result<(), Trouble> {
        let (seconds, nanos) = (self.reader.raw(4)? as u32, self.reader.raw(4)? as u32);
        // ROS 2 counts seconds with a sign; so do durations of both.
        let signed = self.ros == Ros::Two || kind == Kind::Duration;
        let seconds = match signed {
            true => i128::from(seconds as i32),
            false => i128::from(seconds),
        };
        let nanos = match (kind, self.ros) {
            (Kind::Duration, Ros::One) => i128::from(nanos as i32),
            _ => i128::from(nanos),
        };
        let total = seconds * 1_000_000_000 + nanos;
        let Some(slot) = slot else {
            return Ok(());
        };
        let value = match kind {
            Kind::Time => self.stamps.seconds(total, out.sink),
            _ => total as f64 / 1e9,
        };
        slot.seconds(value, kind.declared(), out)?;
        Ok(())
    }

    fn string(&mut self) -> Result<String, Trouble> {
        let n = self.reader.count()?;
        let bytes = self.reader.take(n)?;
        let bytes = bytes.strip_suffix(b"\0").unwrap_or(bytes);
        Ok(String::from_utf8_lossy(bytes).into_owned())
    }

    fn wide(&mut self) -> Result<String, Trouble> {
        let n = self.reader.count()?;
        let mut units = Vec::new();
        for _ in 0..n {
            units.push(self.reader.raw(2)? as u16);
        }
        Ok(String::from_utf16_lossy(&units))
    }
}
