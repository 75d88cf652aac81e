//! Messages in JSON.
//!
//! Numbers are read from their text, so that they come back to the last digit.

use serde::de::{MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};
use serde_json::value::RawValue;

use crate::error::FormatError;
use crate::sink::ARRAY_MOST;
use crate::tree::{DEPTH, Out, Slot};

/// Hands the values of a message on; false when it is no JSON.
pub(super) fn decode(data: &[u8], root: &mut Slot, out: &mut Out<'_>) -> Result<bool, FormatError> {
    let Ok(value) = serde_json::from_slice::<&RawValue>(data) else {
        return Ok(false);
    };
    walk(value, Some(root), out, 0)?;
    Ok(true)
}

fn walk(
    value: &RawValue,
    slot: Option<&mut Slot>,
    out: &mut Out<'_>,
    depth: usize,
) -> Result<(), FormatError> {
    let Some(slot) = slot.filter(|_| depth <= DEPTH) else {
        return Ok(());
    };
    let text = value.get();
    match text.bytes().next() {
        Some(b't' | b'f') => slot.boolean(text == "true", out),
        Some(b'"') => match serde_json::from_str::<String>(text) {
            Ok(value) => slot.text(&value, out),
            Err(_) => Ok(()),
        },
        Some(b'[') => {
            let Some(values) = list(value) else {
                return Ok(());
            };
            if values.len() > ARRAY_MOST {
                return slot.opaque(&format!("array[{}]", values.len()), out);
            }
            for (at, value) in values.iter().enumerate() {
                let place = slot.element(at, None, out);
                walk(value, place, out, depth + 1)?;
            }
            Ok(())
        }
        Some(b'{') => match serde_json::from_str::<Fields<'_>>(text) {
            Ok(Fields(fields)) => object(&fields, slot, out, depth),
            Err(_) => Ok(()),
        },
        // A number, or null, which is missing.
        _ => match text.parse() {
            Ok(number) => slot.number(number, "number", out),
            Err(_) => Ok(()),
        },
    }
}

fn object(
    fields: &[(String, &RawValue)],
    slot: &mut Slot,
    out: &mut Out<'_>,
    depth: usize,
) -> Result<(), FormatError> {
    let names = fields
        .iter()
        .find(|(key, _)| ["name", "names", "joint_names"].contains(&key.as_str()))
        .and_then(|(_, value)| serde_json::from_str::<Vec<String>>(value.get()).ok())
        .filter(|names| !names.is_empty() && names.len() <= ARRAY_MOST);
    for (key, value) in fields {
        let Some(place) = slot.named(key, out) else {
            continue;
        };
        let numbers = names.as_ref().and_then(|names| {
            let values = list(value).filter(|values| values.len() == names.len())?;
            let number = |v: &&RawValue| v.get().parse::<f64>().is_ok();
            values.iter().all(number).then_some((names, values))
        });
        let Some((names, values)) = numbers else {
            walk(value, Some(place), out, depth + 1)?;
            continue;
        };
        for (at, (name, value)) in names.iter().zip(values).enumerate() {
            let place = place.element(at, Some(name), out);
            walk(value, place, out, depth + 1)?;
        }
    }
    Ok(())
}

/// The elements of an array.
fn list(value: &RawValue) -> Option<Vec<&RawValue>> {
    if !value.get().starts_with('[') {
        return None;
    }
    serde_json::from_str::<Elements<'_>>(value.get())
        .ok()
        .map(|e| e.0)
}

/// Elements as they stand in the text.
struct Elements<'t>(Vec<&'t RawValue>);

/// Fields in the order of the text.
struct Fields<'t>(Vec<(String, &'t RawValue)>);

impl<'t> Deserialize<'t> for Elements<'t> {
    fn deserialize<D: Deserializer<'t>>(from: D) -> Result<Self, D::Error> {
        struct All;
        impl<'t> Visitor<'t> for All {
            type Value = Elements<'t>;

            fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str("an array")
            }

            fn visit_seq<A: SeqAccess<'t>>(self, mut from: A) -> Result<Self::Value, A::Error> {
                let mut all = Vec::new();
                while let Some(one) = from.next_element()? {
                    all.push(one);
                }
                Ok(Elements(all))
            }
        }
        from.deserialize_seq(All)
    }
}

impl<'t> Deserialize<'t> for Fields<'t> {
    fn deserialize<D: Deserializer<'t>>(from: D) -> Result<Self, D::Error> {
        struct All;
        impl<'t> Visitor<'t> for All {
            type Value = Fields<'t>;

            fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str("an object")
            }

            fn visit_map<A: MapAccess<'t>>(self, mut from: A) -> Result<Self::Value, A::Error> {
                let mut all = Vec::new();
                while let Some(one) = from.next_entry()? {
                    all.push(one);
                }
                Ok(Fields(all))
            }
        }
        from.deserialize_map(All)
    }
}
