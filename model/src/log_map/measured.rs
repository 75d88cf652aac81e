//! A measured signal of the table `[log]`: a table, or the name of its column alone.

use std::fmt;

use serde::de::value::MapAccessDeserializer;
use serde::de::{Error, MapAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::sensor::Sensor;

/// A measured signal: which column, and what kind of sensor made it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, remote = "Self")]
pub struct Measured {
    /// Name in the header, or a sum or difference of names; by default found by the signal's id.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub column: Option<String>,
    /// Unit when the name does not end with it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unit: Option<String>,
    /// Factor; `-1` reverses the sign.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scale: Option<f64>,
    /// Unit of `scale` where the column holds what a transducer makes of the signal: `m/V`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scale_unit: Option<String>,
    /// Added at last, in SI: an angle that is counted from elsewhere.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub offset: Option<f64>,
    /// How the number is made.
    #[serde(default, skip_serializing_if = "Sensor::is_default")]
    pub sensor: Sensor,
}

impl Serialize for Measured {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        Self::serialize(self, serializer)
    }
}

impl<'de> Deserialize<'de> for Measured {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Either;
        impl<'de> Visitor<'de> for Either {
            type Value = Measured;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("the column's name as a string, or a table as `{ column = \"name\" }`")
            }

            fn visit_str<E: Error>(self, column: &str) -> Result<Measured, E> {
                Ok(Measured {
                    column: Some(column.to_owned()),
                    ..Measured::default()
                })
            }

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Measured, A::Error> {
                Measured::deserialize(MapAccessDeserializer::new(map))
            }
        }
        deserializer.deserialize_any(Either)
    }
}

#[cfg(test)]
mod tests {
    use crate::log_map::LogMap;

    #[test]
    fn the_name_of_a_column_is_enough() {
        let map = |text: &str| toml::from_str::<LogMap>(text);
        let short = map("[measured]\nspeed = \"w_rpm\"\n").unwrap();
        let long = map("[measured.speed]\ncolumn = \"w_rpm\"\n").unwrap();
        assert_eq!(short, long);
        let error = map("[measured]\nspeed = 3\n").unwrap_err().to_string();
        assert!(
            error.contains("expected the column's name as a string, or a table as"),
            "{error}"
        );
        let error = map("[measured.speed]\nsensr = 3\n").unwrap_err();
        assert!(error.to_string().contains("sensr"), "{error}");
        assert!(error.span().is_some());
    }
}
