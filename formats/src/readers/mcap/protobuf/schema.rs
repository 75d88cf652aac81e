//! Descriptors: the types of messages and their fields.

use std::collections::HashMap;

use super::wire::{Value, Wire};

/// Types within types.
const DEPTH: usize = 32;

/// All messages of a set of files.
#[derive(Debug, Default)]
pub(super) struct Schema {
    pub(super) messages: Vec<Message>,
    names: HashMap<String, usize>,
}

#[derive(Debug, Default)]
pub(super) struct Message {
    pub(super) fields: Vec<Field>,
    /// Index of a field by its number.
    pub(super) numbers: HashMap<u64, usize>,
}

#[derive(Debug)]
pub(super) struct Field {
    pub(super) name: String,
    pub(super) kind: Kind,
    pub(super) repeated: bool,
    /// Whether it is told apart that nothing was sent.
    presence: bool,
    type_name: String,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Double,
    Float,
    /// Whole numbers: bits, with a sign, zigzag, of fixed size.
    Whole {
        bits: u32,
        signed: bool,
        zigzag: bool,
        fixed: bool,
    },
    Bool,
    Text,
    Bytes,
    Enum,
    Instant,
    Span,
    Message(usize),
    Other,
}

impl Kind {
    fn of(number: u64) -> Self {
        let whole = |bits, signed, zigzag, fixed| Kind::Whole {
            bits,
            signed,
            zigzag,
            fixed,
        };
        match number {
            1 => Kind::Double,
            2 => Kind::Float,
            3 => whole(64, true, false, false),
            4 => whole(64, false, false, false),
            5 => whole(32, true, false, false),
            6 => whole(64, false, false, true),
            7 => whole(32, false, false, true),
            8 => Kind::Bool,
            9 => Kind::Text,
            12 => Kind::Bytes,
            13 => whole(32, false, false, false),
            14 => Kind::Enum,
            15 => whole(32, true, false, true),
            16 => whole(64, true, false, true),
            17 => whole(32, true, true, false),
            18 => whole(64, true, true, false),
            _ => Kind::Other,
        }
    }

    pub(super) fn is_number(self) -> bool {
        matches!(
            self,
            Kind::Double | Kind::Float | Kind::Whole { .. } | Kind::Bool | Kind::Enum
        )
    }

    /// Type on the wire of a number.
    pub(super) fn wire(self) -> u64 {
        match self {
            Kind::Double => 1,
            Kind::Float => 5,
            Kind::Whole {
                bits: 64,
                fixed: true,
                ..
            } => 1,
            Kind::Whole { fixed: true, .. } => 5,
            _ => 0,
        }
    }

    pub(super) fn number(self, raw: u64) -> Option<f64> {
        Some(match self {
            Kind::Double => f64::from_bits(raw),
            Kind::Float => f64::from(f32::from_bits(raw as u32)),
            Kind::Whole { zigzag: true, .. } => ((raw >> 1) as i64 ^ -((raw & 1) as i64)) as f64,
            Kind::Whole {
                bits: 32,
                signed: true,
                ..
            }
            | Kind::Enum => f64::from(raw as u32 as i32),
            Kind::Whole { signed: true, .. } => raw as i64 as f64,
            Kind::Whole { bits: 32, .. } => f64::from(raw as u32),
            Kind::Whole { .. } => raw as f64,
            Kind::Bool => f64::from(raw != 0),
            _ => return None,
        })
    }

    pub(super) fn declared(self) -> &'static str {
        match self {
            Kind::Double => "double",
            Kind::Float => "float",
            Kind::Whole {
                bits: 32,
                signed: true,
                ..
            } => "int32",
            Kind::Whole { bits: 32, .. } => "uint32",
            Kind::Whole { signed: true, .. } => "int64",
            Kind::Whole { .. } => "uint64",
            Kind::Bool => "bool",
            Kind::Text => "string",
            Kind::Bytes => "bytes",
            Kind::Enum => "enum",
            Kind::Instant => "time",
            Kind::Span => "duration",
            Kind::Message(_) => "message",
            Kind::Other => "group",
        }
    }
}

impl Field {
    /// What stands for a field that was not sent.
    pub(super) fn default(&self) -> Option<Value<'static>> {
        match self.kind {
            _ if self.presence => None,
            Kind::Text => Some(Value::Bytes(&[])),
            kind if kind.is_number() => Some(Value::Number(0)),
            _ => None,
        }
    }
}

impl Schema {
    /// Reads a `FileDescriptorSet`.
    pub(super) fn parse(data: &[u8]) -> Option<Self> {
        let mut schema = Self::default();
        let mut wire = Wire::new(data);
        while !wire.is_empty() {
            if let (1, Value::Bytes(file)) = wire.field()? {
                schema.file(file)?;
            }
        }
        schema.link();
        Some(schema)
    }

    pub(super) fn find(&self, name: &str) -> Option<usize> {
        self.names.get(name.trim_start_matches('.')).copied()
    }

    fn file(&mut self, data: &[u8]) -> Option<()> {
        let (mut package, mut proto3) = (String::new(), false);
        let mut messages = Vec::new();
        let mut wire = Wire::new(data);
        while !wire.is_empty() {
            match wire.field()? {
                (2, Value::Bytes(text)) => package = String::from_utf8_lossy(text).into_owned(),
                (4, Value::Bytes(message)) => messages.push(message),
                (12, Value::Bytes(syntax)) => proto3 = syntax == b"proto3",
                _ => {}
            }
        }
        for message in messages {
            self.message(message, &package, proto3, 0)?;
        }
        Some(())
    }

    fn message(&mut self, data: &[u8], within: &str, proto3: bool, depth: usize) -> Option<()> {
        if depth > DEPTH {
            return None;
        }
        let mut name = String::new();
        let mut message = Message::default();
        let mut inner = Vec::new();
        let mut wire = Wire::new(data);
        while !wire.is_empty() {
            match wire.field()? {
                (1, Value::Bytes(text)) => name = String::from_utf8_lossy(text).into_owned(),
                (2, Value::Bytes(field)) => {
                    let (number, field) = field_of(field, proto3)?;
                    message.numbers.insert(number, message.fields.len());
                    message.fields.push(field);
                }
                (3, Value::Bytes(message)) => inner.push(message),
                _ => {}
            }
        }
        let full = match within {
            "" => name,
            within => format!("{within}.{name}"),
        };
        self.names.insert(full.clone(), self.messages.len());
        self.messages.push(message);
        for message in inner {
            self.message(message, &full, proto3, depth + 1)?;
        }
        Some(())
    }

    /// Names of types become their indices.
    fn link(&mut self) {
        for message in &mut self.messages {
            for field in &mut message.fields {
                let name = field.type_name.trim_start_matches('.');
                field.kind = match (field.kind, name) {
                    (Kind::Other, "google.protobuf.Timestamp") => Kind::Instant,
                    (Kind::Other, "google.protobuf.Duration") => Kind::Span,
                    (Kind::Other, name) => self
                        .names
                        .get(name)
                        .map_or(Kind::Other, |at| Kind::Message(*at)),
                    (kind, _) => kind,
                };
            }
        }
    }
}

fn field_of(data: &[u8], proto3: bool) -> Option<(u64, Field)> {
    let (mut number, mut label, mut kind) = (0, 1, 0);
    let (mut name, mut type_name) = (String::new(), String::new());
    let (mut optional, mut one_of) = (false, false);
    let mut wire = Wire::new(data);
    while !wire.is_empty() {
        match wire.field()? {
            (1, Value::Bytes(text)) => name = String::from_utf8_lossy(text).into_owned(),
            (3, Value::Number(n)) => number = n,
            (4, Value::Number(n)) => label = n,
            (5, Value::Number(n)) => kind = n,
            (6, Value::Bytes(text)) => type_name = String::from_utf8_lossy(text).into_owned(),
            (9, Value::Number(_)) => one_of = true,
            (17, Value::Number(n)) => optional = n != 0,
            _ => {}
        }
    }
    let field = Field {
        name,
        kind: Kind::of(kind),
        repeated: label == 3,
        presence: !proto3 || optional || one_of,
        type_name,
    };
    Some((number, field))
}
