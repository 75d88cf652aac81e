//! Plants and effects with the parameters of a file.

use std::fmt::Debug;
use std::marker::PhantomData;

use serde::de::{Error as _, MapAccess, Visitor};
use serde::ser::SerializeMap;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use loopsight_core::{Parameter, Parameterization};

use crate::registry::{DeclaredEffect, DeclaredPlant};
use crate::values::{Values, range_text};

/// Reads one `key = number` of a parameter table.
fn read_parameter<'de, A: MapAccess<'de>>(
    map: &mut A,
    key: &str,
    parameters: &[Parameter],
    given: &mut [Option<f64>],
    others: &[&str],
) -> Result<(), A::Error> {
    let Some(index) = parameters.iter().position(|p| p.id == key) else {
        let mut expected: Vec<String> = others.iter().map(|o| format!("`{o}`")).collect();
        expected.extend(parameters.iter().map(|p| format!("`{}`", p.id)));
        return Err(A::Error::custom(format!(
            "unknown field `{key}`, expected one of {}",
            expected.join(", ")
        )));
    };
    let parameter = &parameters[index];
    let value: f64 = map.next_value()?;
    if !parameter.admits(value) {
        return Err(A::Error::custom(format!(
            "field `{key}` is {value} {}, expected {}",
            parameter.unit,
            range_text(parameter)
        )));
    }
    given[index] = Some(value);
    Ok(())
}

/// A plant with the parameters of a file.
pub struct ConfiguredPlant<P> {
    given: Values,
    plant: PhantomData<P>,
}

impl<P> Clone for ConfiguredPlant<P> {
    fn clone(&self) -> Self {
        Self {
            given: self.given.clone(),
            plant: PhantomData,
        }
    }
}

impl<P: DeclaredPlant> ConfiguredPlant<P> {
    /// The parameters the file gives.
    pub fn given(&self) -> &Values {
        &self.given
    }
}

impl<P: DeclaredPlant> Debug for ConfiguredPlant<P> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}({:?})", P::META.id, self.given)
    }
}

impl<P: DeclaredPlant> Serialize for ConfiguredPlant<P> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(None)?;
        if self.given.set == 0 {
            self.given.serialize_into(&mut map, P::META.parameters)?;
        } else if let Some(set) = P::META.parameterizations.get(self.given.set - 1) {
            map.serialize_entry(set.id, &Subset(&self.given, set.parameters))?;
        }
        map.end()
    }
}

struct Subset<'a>(&'a Values, &'static [Parameter]);

impl Serialize for Subset<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(None)?;
        self.0.serialize_into(&mut map, self.1)?;
        map.end()
    }
}

impl<'de, P: DeclaredPlant> Deserialize<'de> for ConfiguredPlant<P> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct PlantVisitor<P>(PhantomData<P>);
        impl<'de, P: DeclaredPlant> Visitor<'de> for PlantVisitor<P> {
            type Value = ConfiguredPlant<P>;
            fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                write!(f, "a table with the parameters of `{}`", P::META.id)
            }
            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Self::Value, A::Error> {
                let meta = P::META;
                let mut own = Values::empty(0, meta.parameters);
                let mut other: Option<Values> = None;
                let names: Vec<&str> = meta.parameterizations.iter().map(|p| p.id).collect();
                while let Some(key) = map.next_key::<String>()? {
                    if let Some(set) = names.iter().position(|n| *n == key) {
                        let reader = SetReader {
                            set: set + 1,
                            of: &meta.parameterizations[set],
                        };
                        if other.replace(map.next_value_seed(reader)?).is_some() {
                            return Err(A::Error::custom(format!(
                                "field `{key}`: the parameters are given in two ways, expected one"
                            )));
                        }
                    } else {
                        read_parameter(&mut map, &key, meta.parameters, &mut own.given, &names)?;
                    }
                }
                let given = match other {
                    None => own,
                    Some(other) if own.given.iter().all(Option::is_none) => other,
                    Some(other) => {
                        return Err(A::Error::custom(format!(
                            "field `{}`: the parameters are given in two ways, expected either \
                             the table or the parameters of the equations beside it",
                            names[other.set - 1]
                        )));
                    }
                };
                Ok(ConfiguredPlant {
                    given,
                    plant: PhantomData,
                })
            }
        }
        deserializer.deserialize_map(PlantVisitor(PhantomData))
    }
}

struct SetReader {
    set: usize,
    of: &'static Parameterization,
}

impl<'de> serde::de::DeserializeSeed<'de> for SetReader {
    type Value = Values;
    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<Values, D::Error> {
        deserializer.deserialize_map(self)
    }
}

impl<'de> Visitor<'de> for SetReader {
    type Value = Values;
    fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "a table with the `{}` parameters", self.of.id)
    }
    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Values, A::Error> {
        let mut values = Values::empty(self.set, self.of.parameters);
        while let Some(key) = map.next_key::<String>()? {
            read_parameter(&mut map, &key, self.of.parameters, &mut values.given, &[])?;
        }
        Ok(values)
    }
}

/// An effect with the channels and parameters of a file.
pub struct ConfiguredEffect<E> {
    at: Vec<String>,
    given: Values,
    effect: PhantomData<E>,
}

impl<E> Clone for ConfiguredEffect<E> {
    fn clone(&self) -> Self {
        Self {
            at: self.at.clone(),
            given: self.given.clone(),
            effect: PhantomData,
        }
    }
}

impl<E: DeclaredEffect> ConfiguredEffect<E> {
    /// The channels the file names.
    pub fn channels(&self) -> &[String] {
        &self.at
    }
    /// The parameters the file gives.
    pub fn given(&self) -> &Values {
        &self.given
    }
}

impl<E: DeclaredEffect> Debug for ConfiguredEffect<E> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}({:?}, {:?})", E::META.id, self.at, self.given)
    }
}

impl<E: DeclaredEffect> Serialize for ConfiguredEffect<E> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(None)?;
        map.serialize_entry("at", &self.at)?;
        self.given.serialize_into(&mut map, E::META.parameters)?;
        map.end()
    }
}

impl<'de, E: DeclaredEffect> Deserialize<'de> for ConfiguredEffect<E> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct EffectVisitor<E>(PhantomData<E>);
        impl<'de, E: DeclaredEffect> Visitor<'de> for EffectVisitor<E> {
            type Value = ConfiguredEffect<E>;
            fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                write!(
                    f,
                    "a table with `at` and the parameters of `{}`",
                    E::META.id
                )
            }
            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Self::Value, A::Error> {
                let mut at = Vec::new();
                let mut given = Values::empty(0, E::META.parameters);
                while let Some(key) = map.next_key::<String>()? {
                    if key == "at" {
                        at = map.next_value::<Vec<String>>()?;
                    } else {
                        read_parameter(
                            &mut map,
                            &key,
                            E::META.parameters,
                            &mut given.given,
                            &["at"],
                        )?;
                    }
                }
                Ok(ConfiguredEffect {
                    at,
                    given,
                    effect: PhantomData,
                })
            }
        }
        deserializer.deserialize_map(EffectVisitor(PhantomData))
    }
}
