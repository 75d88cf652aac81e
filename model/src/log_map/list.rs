//! Lists in a file: each element is read by its type, and the whole by a rule of its own.

use std::fmt;
use std::marker::PhantomData;

use serde::de::{self, Deserialize, Deserializer, SeqAccess, Visitor};

/// Reads a list of `E`, of which `make` makes the value or says what is wrong. `expected` says what may stand there.
pub(super) fn list<'de, E, T, D>(
    deserializer: D,
    expected: &'static str,
    make: fn(Vec<E>) -> Result<T, String>,
) -> Result<T, D::Error>
where
    E: Deserialize<'de>,
    D: Deserializer<'de>,
{
    deserializer.deserialize_seq(List {
        expected,
        make,
        element: PhantomData,
    })
}

struct List<E, T> {
    expected: &'static str,
    make: fn(Vec<E>) -> Result<T, String>,
    element: PhantomData<E>,
}

impl<'de, E: Deserialize<'de>, T> Visitor<'de> for List<E, T> {
    type Value = T;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.expected)
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<T, A::Error> {
        let wrong = |_| de::Error::custom(format!("expected {}", self.expected));
        let mut elements = Vec::new();
        while let Some(element) = list.next_element::<E>().map_err(wrong)? {
            elements.push(element);
        }
        (self.make)(elements).map_err(de::Error::custom)
    }
}
