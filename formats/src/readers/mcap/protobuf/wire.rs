//! Fields as they stand in the bytes: a number, a type, a value.

use crate::bytes::Bytes;

/// A value whose type is in its field's descriptor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Value<'d> {
    /// Varint, or 4 or 8 bytes.
    Number(u64),
    /// Text, bytes, a message, or numbers one after the other.
    Bytes(&'d [u8]),
}

pub(super) struct Wire<'d> {
    bytes: Bytes<'d>,
}

impl<'d> Wire<'d> {
    pub(super) fn new(data: &'d [u8]) -> Self {
        Self {
            bytes: Bytes::new(data),
        }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.bytes.is_empty()
    }

    fn varint(&mut self) -> Option<u64> {
        let mut value = 0u64;
        for shift in (0..64).step_by(7) {
            let byte = self.bytes.u8()?;
            value |= u64::from(byte & 0x7f) << shift;
            if byte & 0x80 == 0 {
                return Some(value);
            }
        }
        None
    }

    /// A value of a type: 0 varint, 1 eight bytes, 2 with its length, 5 four bytes.
    pub(super) fn value(&mut self, kind: u64) -> Option<Value<'d>> {
        Some(match kind {
            0 => Value::Number(self.varint()?),
            1 => Value::Number(self.bytes.u64()?),
            2 => {
                let length = usize::try_from(self.varint()?).ok()?;
                Value::Bytes(self.bytes.take(length)?)
            }
            5 => Value::Number(u64::from(self.bytes.u32()?)),
            _ => return None,
        })
    }

    /// The next field.
    pub(super) fn field(&mut self) -> Option<(u64, Value<'d>)> {
        let key = self.varint()?;
        Some((key >> 3, self.value(key & 7)?))
    }
}

/// Seconds and nanoseconds of `google.protobuf.Timestamp` and `Duration`.
pub(super) fn nanoseconds(data: &[u8]) -> Option<i128> {
    let mut wire = Wire::new(data);
    let (mut seconds, mut nanos) = (0i64, 0i64);
    while !wire.is_empty() {
        match wire.field()? {
            (1, Value::Number(raw)) => seconds = raw as i64,
            (2, Value::Number(raw)) => nanos = raw as i64,
            _ => {}
        }
    }
    Some(i128::from(seconds) * 1_000_000_000 + i128::from(nanos))
}
