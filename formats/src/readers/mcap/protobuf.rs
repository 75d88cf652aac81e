//! Messages in protobuf, by the descriptors that the file carries.
//!
//! A field of proto3 that was not sent is its default; one that has presence is missing. Of what is
//! sent twice the last counts. Maps and groups are not read.
//!
//! Reference: Protocol Buffers, "Encoding"; `google/protobuf/descriptor.proto`.

mod schema;
mod wire;

use crate::error::FormatError;
use crate::sink::{ARRAY_MOST, Stamps};
use crate::tree::{DEPTH, Out, Slot};
use schema::{Field, Kind, Schema};
use wire::{Value, Wire};

/// The types of a topic's messages.
pub(super) struct Layout {
    schema: Schema,
    root: usize,
}

impl Layout {
    /// Reads a schema: a `FileDescriptorSet`.
    pub(super) fn new(name: &str, data: &[u8]) -> Result<Self, String> {
        let schema = Schema::parse(data).ok_or("its schema is no set of descriptors")?;
        let root = schema
            .find(name)
            .ok_or_else(|| format!("its schema does not define {name}"))?;
        Ok(Self { schema, root })
    }

    /// Hands the values of a message on; false when its bytes do not fit.
    pub(super) fn decode(
        &self,
        data: &[u8],
        root: &mut Slot,
        stamps: &mut Stamps,
        out: &mut Out<'_>,
    ) -> Result<bool, FormatError> {
        self.message(self.root, data, root, stamps, out, 0)
    }

    fn message(
        &self,
        which: usize,
        data: &[u8],
        slot: &mut Slot,
        stamps: &mut Stamps,
        out: &mut Out<'_>,
        depth: usize,
    ) -> Result<bool, FormatError> {
        let Some(message) = self.schema.messages.get(which).filter(|_| depth <= DEPTH) else {
            return Ok(false);
        };
        let mut values: Vec<Vec<Value<'_>>> = vec![Vec::new(); message.fields.len()];
        let mut wire = Wire::new(data);
        while !wire.is_empty() {
            let Some((number, value)) = wire.field() else {
                return Ok(false);
            };
            let at = message.numbers.get(&number);
            let Some((at, field)) = at.and_then(|at| Some((*at, message.fields.get(*at)?))) else {
                continue;
            };
            let Some(values) = values.get_mut(at) else {
                continue;
            };
            match value {
                Value::Bytes(packed) if field.repeated && field.kind.is_number() => {
                    let mut wire = Wire::new(packed);
                    while !wire.is_empty() {
                        let Some(value) = wire.value(field.kind.wire()) else {
                            return Ok(false);
                        };
                        values.push(value);
                    }
                }
                value => values.push(value),
            }
        }
        let mut whole = true;
        for (at, (field, values)) in message.fields.iter().zip(&values).enumerate() {
            let Some(place) = slot.field(at, &field.name, out) else {
                continue;
            };
            if field.repeated {
                if values.len() > ARRAY_MOST {
                    let declared = format!("{}[{}]", field.kind.declared(), values.len());
                    place.opaque(&declared, out)?;
                    continue;
                }
                for (k, value) in values.iter().enumerate() {
                    if let Some(place) = place.element(k, None, out) {
                        whole &= self.value(field, *value, place, stamps, out, depth)?;
                    }
                }
                continue;
            }
            let value = values.last().copied().or_else(|| field.default());
            if let Some(value) = value {
                whole &= self.value(field, value, place, stamps, out, depth)?;
            }
        }
        Ok(whole)
    }

    /// One value; false when it is none of its field's type.
    fn value(
        &self,
        field: &Field,
        value: Value<'_>,
        place: &mut Slot,
        stamps: &mut Stamps,
        out: &mut Out<'_>,
        depth: usize,
    ) -> Result<bool, FormatError> {
        let number = match (field.kind, value) {
            (Kind::Bool, Value::Number(raw)) => {
                place.boolean(raw != 0, out)?;
                return Ok(true);
            }
            (Kind::Text, Value::Bytes(bytes)) => {
                place.text(&String::from_utf8_lossy(bytes), out)?;
                return Ok(true);
            }
            (Kind::Bytes | Kind::Other, _) => {
                place.opaque(field.kind.declared(), out)?;
                return Ok(true);
            }
            (Kind::Instant | Kind::Span, Value::Bytes(bytes)) => {
                let Some(total) = wire::nanoseconds(bytes) else {
                    return Ok(false);
                };
                let seconds = match field.kind {
                    Kind::Instant => stamps.seconds(total, out.sink),
                    _ => total as f64 / 1e9,
                };
                place.seconds(seconds, field.kind.declared(), out)?;
                return Ok(true);
            }
            (Kind::Message(which), Value::Bytes(bytes)) => {
                return self.message(which, bytes, place, stamps, out, depth + 1);
            }
            (kind, Value::Number(raw)) => match kind.number(raw) {
                Some(number) => number,
                None => return Ok(false),
            },
            _ => return Ok(false),
        };
        place.number(number, field.kind.declared(), out)?;
        Ok(true)
    }
}
