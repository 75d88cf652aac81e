//! WPILib data logs (`.wpilog`), also as AdvantageKit and URCL write them.
//!
//! A header, then records `entry, size, timestamp in µs, payload` in 1 to 4, 1 to 4 and 1 to 8
//! bytes. Entry 0 holds control records: start (name, type, metadata), finish, new metadata. Every
//! entry is logged at its own times, most of them when they change. Arrays become channels by
//! index, structs channels by field (`pose.translation.x`), frames of motor controllers that URCL
//! recorded channels by quantity.
//!
//! Reference: WPILib, "WPILib Data Log File Format Specification, Version 1.0".

mod json;
mod structs;
mod urcl;

use std::collections::HashMap;

use crate::bytes::{Bytes, Stream, little};
use crate::detect::Format;
use crate::error::FormatError;
use crate::input::Input;
use crate::sink::{ARRAY_MOST, ChannelInfo, Kind, Sink, Stamps};
use structs::Structs;

/// Reads all entries.
pub(crate) fn read(input: &mut Input, sink: &mut dyn Sink) -> Result<(), FormatError> {
    let mut stream = Stream::new(input)?;
    let header = stream.take(12)?.map(|h| (h[7], little(&h[8..12])));
    let Some((major, extra)) = header else {
        sink.cut(0, "the header");
        return Ok(());
    };
    if major != 1 {
        return Err(FormatError::Damaged {
            log: stream.name().into(),
            format: Format::Wpilog,
            position: 6,
            expected: "version 1".into(),
            found: format!("version {major}").into(),
        });
    }
    let Some(extra) = stream.take(extra)? else {
        sink.cut(12, "the header");
        return Ok(());
    };
    if !extra.is_empty() {
        let text = String::from_utf8_lossy(extra).into_owned();
        sink.note(format!("the file says of itself: {}", text.trim()));
    }
    Reader::default().records(&mut stream, sink)
}

/// One entry, from its start record on.
#[derive(Debug, Default)]
struct Entry {
    name: String,
    kind: Type,
    unit: Option<String>,
    /// Clock and channels, once the first value is there.
    clock: Option<usize>,
    channels: Vec<usize>,
    urcl: Option<Box<urcl::Frames>>,
}

/// What an entry's type says.
#[derive(Clone, Debug, Default, PartialEq)]
enum Type {
    Boolean,
    Int,
    Float,
    Double,
    Text,
    Booleans,
    Ints,
    Floats,
    Doubles,
    Texts,
    Struct(String),
    Structs(String),
    Schema,
    Urcl(urcl::Part),
    #[default]
    Other,
}

impl Type {
    fn of(text: &str, name: &str) -> Self {
        if let Some(part) = urcl::Part::of(text) {
            return Type::Urcl(part);
        }
        match text {
            "boolean" => Type::Boolean,
            "int64" => Type::Int,
            "float" => Type::Float,
            "double" => Type::Double,
            "string" | "json" => Type::Text,
            "boolean[]" => Type::Booleans,
            "int64[]" => Type::Ints,
            "float[]" => Type::Floats,
            "double[]" => Type::Doubles,
            "string[]" => Type::Texts,
            "structschema" => Type::Schema,
            _ if name.contains("/.schema/struct:") => Type::Schema,
            _ => match text.strip_prefix("struct:") {
                Some(of) => match of.strip_suffix("[]") {
                    Some(of) => Type::Structs(of.to_owned()),
                    None => Type::Struct(of.to_owned()),
                },
                None => Type::Other,
            },
        }
    }

    fn declared(&self) -> &'static str {
        match self {
            Type::Boolean | Type::Booleans => "boolean",
            Type::Int | Type::Ints => "int64",
            Type::Float | Type::Floats => "float",
            Type::Double | Type::Doubles => "double",
            Type::Text | Type::Texts => "string",
            _ => "raw",
        }
    }

    fn kind(&self) -> Kind {
        match self {
            Type::Boolean | Type::Booleans => Kind::Boolean,
            Type::Text | Type::Texts => Kind::Text,
            _ => Kind::Number,
        }
    }
}

#[derive(Default)]
struct Reader {
    entries: HashMap<u32, Entry>,
    /// Entries by name and type.
    names: HashMap<(String, String), u32>,
    /// Names of motor controllers, by number.
    aliases: HashMap<String, String>,
    structs: Structs,
    stamps: Stamps,
}

impl Reader {
    fn records(mut self, stream: &mut Stream<'_>, sink: &mut dyn Sink) -> Result<(), FormatError> {
        while stream.left() > 0 {
            let at = stream.at();
            let Some(lengths) = stream.take(1)?.map(|b| b[0]) else {
                break;
            };
            if lengths & 0x80 != 0 {
                return Err(damaged(stream, at, "the lengths of a record", lengths));
            }
            let widths = [
                (lengths & 3) + 1,
                (lengths >> 2 & 3) + 1,
                (lengths >> 4 & 7) + 1,
            ];
            let mut numbers = [0; 3];
            let mut whole = true;
            for (number, width) in numbers.iter_mut().zip(widths) {
                match stream.take(u64::from(width))? {
                    Some(bytes) => *number = little(bytes),
                    None => whole = false,
                }
            }
            let [entry, size, time] = numbers;
            let payload = if whole { stream.take(size)? } else { None };
            let Some(payload) = payload else {
                sink.cut(at, "a record");
                break;
            };
            let Ok(entry) = u32::try_from(entry) else {
                continue;
            };
            if entry == 0 {
                if self.control(payload).is_none() {
                    return Err(FormatError::Damaged {
                        log: stream.name().into(),
                        format: Format::Wpilog,
                        position: at,
                        expected: "a control record".into(),
                        found: "a record that is too short".into(),
                    });
                }
                continue;
            }
            self.value(entry, time, payload, sink)?;
        }
        self.silent(sink)
    }

    /// Start, finish or new metadata of an entry.
    fn control(&mut self, payload: &[u8]) -> Option<()> {
        let mut bytes = Bytes::new(payload);
        let what = bytes.u8()?;
        let id = bytes.u32()?;
        match what {
            0 => {
                let name = String::from_utf8_lossy(bytes.text32()?).into_owned();
                let text = String::from_utf8_lossy(bytes.text32()?).into_owned();
                let metadata = bytes.text32()?;
                // A program that starts anew announces the same entry once more.
                let old = self.names.insert((name.clone(), text.clone()), id);
                if let Some(entry) = old.and_then(|old| self.entries.remove(&old)) {
                    self.entries.insert(id, entry);
                    return Some(());
                }
                let entry = Entry {
                    kind: Type::of(&text, &name),
                    unit: json::unit(metadata),
                    name,
                    ..Entry::default()
                };
                self.entries.insert(id, entry);
            }
            2 => {
                let unit = json::unit(bytes.text32()?);
                if let Some(entry) = self.entries.get_mut(&id) {
                    entry.unit = unit.or(entry.unit.take());
                }
            }
            _ => {}
        }
        Some(())
    }

    fn value(
        &mut self,
        id: u32,
        micros: u64,
        payload: &[u8],
        sink: &mut dyn Sink,
    ) -> Result<(), FormatError> {
        let Some(entry) = self.entries.get_mut(&id) else {
            return Ok(());
        };
        if let Type::Urcl(part) = entry.kind {
            let (part, name) = (part, entry.name.clone());
            return self.urcl(id, part, &name, payload, sink);
        }
        if entry.kind == Type::Schema {
            self.structs.define(&entry.name, payload);
            return Ok(());
        }
        let time = self.stamps.seconds_of_micros(i128::from(micros), sink);
        let clock = *entry.clock.get_or_insert_with(|| sink.clock(&entry.name));
        sink.tick(clock, time)?;
        entry.push(payload, &self.structs, clock, sink)
    }

    /// Entries that were announced and never had a value.
    fn silent(self, sink: &mut dyn Sink) -> Result<(), FormatError> {
        let mut names: Vec<&Entry> = self.entries.values().collect();
        names.retain(|e| {
            let schema = matches!(e.kind, Type::Schema | Type::Urcl(_));
            e.clock.is_none() && !schema
        });
        if !names.is_empty() {
            let n = names.len();
            sink.note(format!("{n} entries are announced and have no value"));
        }
        Ok(())
    }
}

impl Entry {
    fn push(
        &mut self,
        payload: &[u8],
        structs: &Structs,
        clock: usize,
        sink: &mut dyn Sink,
    ) -> Result<(), FormatError> {
        let kind = self.kind.clone();
        match &kind {
            Type::Boolean => self.numbers(payload, 1, clock, sink, |b| f64::from(b[0] != 0)),
            Type::Int => self.numbers(payload, 8, clock, sink, int),
            Type::Float => self.numbers(payload, 4, clock, sink, float),
            Type::Double => self.numbers(payload, 8, clock, sink, double),
            Type::Booleans => self.numbers(payload, 1, clock, sink, |b| f64::from(b[0] != 0)),
            Type::Ints => self.numbers(payload, 8, clock, sink, int),
            Type::Floats => self.numbers(payload, 4, clock, sink, float),
            Type::Doubles => self.numbers(payload, 8, clock, sink, double),
            Type::Text => {
                let channel = self.channel(0, false, clock, sink)?;
                sink.text(channel, &String::from_utf8_lossy(payload))
            }
            Type::Texts => {
                let mut bytes = Bytes::new(payload);
                let n = bytes.u32().unwrap_or(0) as usize;
                for at in 0..n.min(ARRAY_MOST) {
                    let Some(text) = bytes.text32() else { break };
                    let channel = self.channel(at, true, clock, sink)?;
                    sink.text(channel, &String::from_utf8_lossy(text))?;
                }
                Ok(())
            }
            Type::Struct(name) | Type::Structs(name) => {
                let list = matches!(kind, Type::Structs(_));
                let Some(fields) = structs.fields(name) else {
                    return self.opaque(clock, &format!("struct:{name}"), sink);
                };
                self.fields(payload, &fields, list, clock, sink)
            }
            _ => self.opaque(clock, "raw", sink),
        }
    }

    /// A number, or one channel for each element of an array of them.
    fn numbers(
        &mut self,
        payload: &[u8],
        width: usize,
        clock: usize,
        sink: &mut dyn Sink,
        value: fn(&[u8]) -> f64,
    ) -> Result<(), FormatError> {
        let list = matches!(
            self.kind,
            Type::Booleans | Type::Ints | Type::Floats | Type::Doubles
        );
        let most = if list { ARRAY_MOST } else { 1 };
        if payload.len() / width > ARRAY_MOST {
            return self.opaque(clock, self.kind.declared(), sink);
        }
        for (at, bytes) in payload.chunks_exact(width).take(most).enumerate() {
            let channel = self.channel(at, list, clock, sink)?;
            sink.number(channel, value(bytes))?;
        }
        Ok(())
    }

    /// The channel of an element, announced when it is first needed.
    fn channel(
        &mut self,
        at: usize,
        list: bool,
        clock: usize,
        sink: &mut dyn Sink,
    ) -> Result<usize, FormatError> {
        while self.channels.len() <= at {
            let path = match list {
                true => format!("{}[{}]", self.name, self.channels.len()),
                false => self.name.clone(),
            };
            let info = ChannelInfo::new(path, self.kind.kind(), self.kind.declared())
                .at(clock)
                .in_unit(self.unit.clone());
            self.channels.push(sink.channel(info)?);
        }
        Ok(self.channels.get(at).copied().unwrap_or(usize::MAX))
    }

    fn opaque(
        &mut self,
        clock: usize,
        declared: &str,
        sink: &mut dyn Sink,
    ) -> Result<(), FormatError> {
        if self.channels.is_empty() {
            let info = ChannelInfo::new(&self.name, Kind::Opaque, declared).at(clock);
            self.channels.push(sink.channel(info)?);
        }
        match self.channels.first() {
            Some(channel) => sink.opaque(*channel),
            None => Ok(()),
        }
    }

    fn fields(
        &mut self,
        payload: &[u8],
        layout: &structs::Layout,
        list: bool,
        clock: usize,
        sink: &mut dyn Sink,
    ) -> Result<(), FormatError> {
        let size = layout.size.max(1);
        let count = if list { payload.len() / size } else { 1 };
        if count * layout.fields.len() > ARRAY_MOST * 8 {
            return self.opaque(clock, "struct[]", sink);
        }
        for at in 0..count {
            let part = payload.get(at * size..).unwrap_or_default();
            for (f, field) in layout.fields.iter().enumerate() {
                let index = at * layout.fields.len() + f;
                if self.channels.len() <= index {
                    let element = if list {
                        format!("[{at}]")
                    } else {
                        String::new()
                    };
                    let path = format!("{}{element}.{}", self.name, field.path);
                    let info = ChannelInfo::new(path, field.kind(), field.declared()).at(clock);
                    self.channels.push(sink.channel(info)?);
                }
                if let (Some(channel), Some(value)) = (self.channels.get(index), field.value(part))
                {
                    sink.number(*channel, value)?;
                }
            }
        }
        Ok(())
    }
}

fn int(bytes: &[u8]) -> f64 {
    little(bytes) as i64 as f64
}

fn float(bytes: &[u8]) -> f64 {
    f64::from(f32::from_bits(little(bytes) as u32))
}

fn double(bytes: &[u8]) -> f64 {
    f64::from_bits(little(bytes))
}

fn damaged(stream: &Stream<'_>, at: u64, expected: &str, found: u8) -> FormatError {
    FormatError::Damaged {
        log: stream.name().into(),
        format: Format::Wpilog,
        position: at,
        expected: expected.into(),
        found: format!("the byte {found:#04x}").into(),
    }
}
