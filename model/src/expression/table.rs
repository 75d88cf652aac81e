//! Tables of a model file that both plants and effects have: names in order, parameters.

use std::fmt;
use std::marker::PhantomData;

use serde::de::value::MapAccessDeserializer;
use serde::de::{MapAccess, Visitor};
use serde::ser::SerializeMap;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::keep;
use super::lexer::is_name;
use super::operation::{constant, function};
use super::tree::{Slot, Tree};
use crate::config::{Mistake, PathSegment};
use crate::registry::{Values, range_text};
use loopsight_core::{Parameter, unit};

/// A table with names of the author's, in the order of the file.
#[derive(Clone, PartialEq)]
pub(crate) struct Ordered<T>(pub(crate) Vec<(String, T)>);

impl<T> Default for Ordered<T> {
    fn default() -> Self {
        Self(Vec::new())
    }
}

impl<T: fmt::Debug> fmt::Debug for Ordered<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_map().entries(self.iter()).finish()
    }
}

impl<T> Ordered<T> {
    pub(crate) fn iter(&self) -> impl ExactSizeIterator<Item = (&str, &T)> + Clone {
        self.0.iter().map(|(k, v)| (k.as_str(), v))
    }
    pub(crate) fn ids(&self) -> impl ExactSizeIterator<Item = &str> + Clone {
        self.0.iter().map(|(k, _)| k.as_str())
    }
    pub(crate) fn position(&self, id: &str) -> Option<usize> {
        self.ids().position(|k| k == id)
    }
    pub(crate) fn len(&self) -> usize {
        self.0.len()
    }
    pub(crate) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }
}

impl<T: Serialize> Serialize for Ordered<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(Some(self.len()))?;
        for (key, value) in self.iter() {
            map.serialize_entry(key, value)?;
        }
        map.end()
    }
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for Ordered<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Entries<T>(PhantomData<T>);
        impl<'de, T: Deserialize<'de>> Visitor<'de> for Entries<T> {
            type Value = Ordered<T>;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a table")
            }
            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Ordered<T>, A::Error> {
                let mut entries = Vec::new();
                while let Some(entry) = map.next_entry()? {
                    entries.push(entry);
                }
                Ok(Ordered(entries))
            }
        }
        deserializer.deserialize_map(Entries(PhantomData))
    }
}

/// A parameter of an expression: a plain number, or a table.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum ParameterTable {
    Number(f64),
    Table(ParameterKeys),
}

/// The table of a parameter.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct ParameterKeys {
    #[serde(default, skip_serializing_if = "Option::is_none")]
    value: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    unit: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    range: Option<[f64; 2]>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    above: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    below: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    scale: Option<f64>,
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    held: bool,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    symbol: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    doc: Option<String>,
}

impl Serialize for ParameterTable {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            ParameterTable::Number(value) => serializer.serialize_f64(*value),
            ParameterTable::Table(keys) => keys.serialize(serializer),
        }
    }
}

impl<'de> Deserialize<'de> for ParameterTable {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Either;
        impl<'de> Visitor<'de> for Either {
            type Value = ParameterTable;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a number or a table")
            }
            fn visit_f64<E>(self, value: f64) -> Result<ParameterTable, E> {
                Ok(ParameterTable::Number(value))
            }
            fn visit_i64<E>(self, value: i64) -> Result<ParameterTable, E> {
                Ok(ParameterTable::Number(value as f64))
            }
            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<ParameterTable, A::Error> {
                ParameterKeys::deserialize(MapAccessDeserializer::new(map))
                    .map(ParameterTable::Table)
            }
        }
        deserializer.deserialize_any(Either)
    }
}

/// The table of the parameters.
const PARAMETERS: &str = "parameters";

impl Ordered<ParameterTable> {
    /// The values that are given, in the order of the file.
    pub(crate) fn values(&self) -> Values {
        Values {
            set: 0,
            given: self.iter().map(|(id, p)| p.given(id).0).collect(),
        }
    }
}

impl ParameterTable {
    /// Its value and where that stands.
    pub(crate) fn given(&self, id: &str) -> (Option<f64>, Vec<PathSegment>) {
        let path = |more: &[PathSegment]| [&[PARAMETERS.into(), id.into()], more].concat();
        match self {
            ParameterTable::Number(value) => (Some(*value), path(&[])),
            ParameterTable::Table(keys) => (keys.value, path(&["value".into()])),
        }
    }

    /// What is declared, without the value.
    pub(crate) fn without_value(&self) -> ParameterKeys {
        match self {
            ParameterTable::Number(_) => ParameterKeys::default(),
            ParameterTable::Table(keys) => ParameterKeys {
                value: None,
                ..keys.clone()
            },
        }
    }

    /// Whether a fit leaves it as it is.
    pub(crate) fn is_held(&self) -> bool {
        matches!(self, ParameterTable::Table(keys) if keys.held)
    }

    /// The declaration; whether it enters linearly is said by those who know the equations.
    pub(crate) fn declare(&self, id: &str, linear: bool) -> Result<Parameter, Mistake> {
        let path = |key: &str| [PARAMETERS.into(), id.into(), key.into()];
        let keys = self.without_value();
        let text = keys.unit.as_deref().unwrap_or("1");
        let doc = keys
            .doc
            .as_deref()
            .unwrap_or("a parameter of the model file");
        let symbol = keys.symbol.as_deref().unwrap_or(id);
        let mut parameter = Parameter::new(
            keep::text(id),
            keep::text(symbol),
            keep::text(text),
            keep::text(doc),
        );
        if !linear {
            parameter = parameter.nonlinear();
        }
        if let Some([least, greatest]) = keys.range {
            if keys.above.is_some() || keys.below.is_some() {
                let message =
                    "the range is given in two ways, expected `range` or `above`, `below`";
                return Err(Mistake::key(path("range"), message));
            }
            if least.is_nan() || greatest.is_nan() || least >= greatest {
                let message = format!("the range is from {least} to {greatest}");
                let error = Mistake::value(path("range"), message);
                return Err(error.help("the least value comes first: `range = [0.0, 12.0]`"));
            }
            parameter = parameter.within(least, greatest);
        }
        for (key, bound) in [("above", keys.above), ("below", keys.below)] {
            match bound {
                Some(bound) if !bound.is_finite() => {
                    let message = format!("`{key}` is {bound}, expected a finite number");
                    return Err(Mistake::value(path(key), message));
                }
                Some(bound) if key == "above" => parameter = parameter.above(bound),
                Some(bound) => parameter = parameter.below(bound),
                None => {}
            }
        }
        if parameter.min >= parameter.max {
            let message = "no number is above the one bound and below the other";
            return Err(Mistake::value(path("below"), message));
        }
        match keys.scale {
            Some(scale) if !(scale > 0.0 && scale.is_finite()) => {
                let message = format!("`scale` is {scale}, expected a number above 0");
                return Err(Mistake::value(path("scale"), message));
            }
            Some(scale) => parameter = parameter.scaled(scale),
            None => {
                let width = parameter.max - parameter.min;
                if width.is_finite() {
                    parameter = parameter.scaled(0.1 * width);
                }
            }
        }
        let (value, place) = self.given(id);
        if keys.held {
            parameter = parameter.known();
            if value.is_none() {
                let message = format!("`{id}` is held and has no value");
                return Err(Mistake::key([PARAMETERS.into(), id.into()], message));
            }
        }
        match value {
            Some(value) if !parameter.admits(value) => {
                let range = range_text(&parameter);
                let message = format!("`{id}` is {value} {text}, expected {range}");
                Err(Mistake::value(place, message))
            }
            _ => Ok(parameter),
        }
    }
}

/// Checks that a name of the author's can be one.
pub(crate) fn check_name(table: &str, id: &str, taken: Option<&str>) -> Result<(), Mistake> {
    let wrong = |message: String| Err(Mistake::key([table.into(), id.into()], message));
    if !is_name(id) {
        return wrong(format!(
            "`{id}` is no name for an expression, expected letters, digits and `_`"
        ));
    }
    if function(id).is_some() || constant(id).is_some() {
        return wrong(format!("`{id}` is the name of a function or a constant"));
    }
    match taken {
        Some(what) => wrong(format!("`{id}` is already the name of {what}")),
        None => Ok(()),
    }
}

/// Checks a unit that stands at `path`.
pub(crate) fn check_unit(path: &[PathSegment], text: &str, written: &str) -> Result<(), Mistake> {
    unit::parse(text).map(drop).map_err(|error| {
        let piece = error.piece(text);
        let why = error.to_string();
        let what = match why.split_once(": ") {
            Some((_, why)) if piece == text => why.to_owned(),
            Some((_, why)) if !piece.is_empty() => format!("`{piece}`: {why}"),
            _ => why,
        };
        let mut mistake =
            Mistake::value(path.iter().cloned(), format!("the unit `{text}`: {what}"));
        if written == text && !piece.is_empty() {
            let place = error.position..error.position + error.length;
            mistake.at = crate::config::At::Text(place);
        }
        mistake
    })
}

/// Names that the trees use, and parameters that none of them does.
pub(crate) fn check_used<'t>(
    table: &str,
    ids: impl Iterator<Item = &'t str>,
    trees: &[&Tree],
    slot: impl Fn(u16) -> Slot,
    missing: &str,
) -> Result<(), Mistake> {
    let mut used = std::collections::BTreeSet::new();
    for tree in trees {
        tree.for_each_name(&mut |slot| {
            used.insert(slot);
        });
    }
    for (index, id) in (0u16..).zip(ids) {
        if !used.contains(&slot(index)) {
            let message = format!("`{id}` {missing}");
            return Err(Mistake::key([table.into(), id.into()], message));
        }
    }
    Ok(())
}
