//! The parts that are known at run time, by id, and the object-safe traits behind their TOML.
//!
//! A part that is declared ([`declare_plant!`](crate::declare_plant),
//! [`declare_effect!`](crate::declare_effect), [`declare_part!`](crate::declare_part)) is here
//! with nothing else touched: listings, help, templates, fits and reports walk this registry. A
//! crate that is only a dependency is not linked, so whoever wants its parts says
//! `use loopsight_plants as _;`.

use std::fmt::Debug;
use std::marker::PhantomData;

use serde::de::{Error as _, MapAccess, Visitor};
use serde::ser::SerializeMap;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::model::{Model, ModelError};
use crate::run::Run;
use crate::{
    Controller, Driver, DriverError, DriverFault, Dual, Dynamics, EffectMeta, Estimator, Parameter,
    Parameterization, Physics, PlantMeta, Real,
};

/// A scalar that composed models are run with on a host.
pub trait HostReal: Real {
    /// The plant for this scalar.
    fn dynamics(any: &'static dyn AnyDynamics) -> &'static dyn Dynamics<Self>;
    /// The effect for this scalar.
    fn physics(any: &'static dyn AnyPhysics) -> &'static dyn Physics<Self>;
}

macro_rules! host_real {
    ($($scalar:ty),*) => {$(
        impl HostReal for $scalar {
            fn dynamics(any: &'static dyn AnyDynamics) -> &'static dyn Dynamics<Self> {
                any
            }
            fn physics(any: &'static dyn AnyPhysics) -> &'static dyn Physics<Self> {
                any
            }
        }
    )*};
}
host_real!(f32, f64, Dual);

/// A plant for every scalar a host uses.
pub trait AnyDynamics: Dynamics<f32> + Dynamics<f64> + Dynamics<Dual> {}
impl<T: Dynamics<f32> + Dynamics<f64> + Dynamics<Dual>> AnyDynamics for T {}

/// An effect for every scalar a host uses.
pub trait AnyPhysics: Physics<f32> + Physics<f64> + Physics<Dual> {}
impl<T: Physics<f32> + Physics<f64> + Physics<Dual>> AnyPhysics for T {}

/// What [`declare_plant!`](crate::declare_plant) knows of a plant.
pub trait DeclaredPlant: Send + Sync + 'static {
    /// The declaration.
    const META: &'static PlantMeta;
    /// The plant itself; it has no data.
    const INSTANCE: &'static dyn AnyDynamics;
}

/// What [`declare_effect!`](crate::declare_effect) knows of an effect.
pub trait DeclaredEffect: Send + Sync + 'static {
    /// The declaration.
    const META: &'static EffectMeta;
    /// The effect itself; it has no data.
    const INSTANCE: &'static dyn AnyPhysics;
}

/// A plant as it stands in a model file: `[plant.<id>]`.
#[typetag::serde]
pub trait PlantPart: Debug + Send + Sync {
    /// The declaration.
    fn meta(&self) -> &'static PlantMeta;
    /// The parameters the file gives.
    fn values(&self) -> &Values;
    /// The equations.
    fn dynamics(&self) -> &'static dyn AnyDynamics;
}

/// An effect as it stands in a model file: `[effect.<id>]` in an `[[effect]]`.
#[typetag::serde]
pub trait EffectPart: Debug + Send + Sync {
    /// The declaration.
    fn meta(&self) -> &'static EffectMeta;
    /// The channels it is attached to.
    fn at(&self) -> &[String];
    /// The parameters the file gives.
    fn values(&self) -> &Values;
    /// The equations.
    fn physics(&self) -> &'static dyn AnyPhysics;
}

/// What an estimator, controller or driver says about itself.
#[derive(Clone, Copy, Debug)]
pub struct PartMeta {
    /// Identifier in TOML.
    pub id: &'static str,
    /// `estimator`, `controller` or `driver`.
    pub role: &'static str,
    /// One sentence.
    pub summary: &'static str,
    /// The equations, or what it does, in plain text.
    pub equation: &'static str,
    /// Where they come from.
    pub reference: &'static str,
    /// A TOML table that builds it.
    pub example: &'static str,
    /// Its settings: key, unit, sentence.
    pub settings: &'static [Setting],
}

/// One setting of an estimator, controller or driver.
#[derive(Clone, Copy, Debug)]
pub struct Setting {
    /// Key in TOML.
    pub id: &'static str,
    /// SI unit; empty where it has none to have (a list of names, a file).
    pub unit: &'static str,
    /// One sentence, with the default.
    pub doc: &'static str,
}

impl Setting {
    /// Declares a setting.
    pub const fn new(id: &'static str, unit: &'static str, doc: &'static str) -> Self {
        Self { id, unit, doc }
    }
}

/// A part that cannot be built from what its table says.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{message}")]
pub struct BuildError {
    /// Key within the part's table that is to blame; empty for the table.
    pub key: String,
    /// What is wrong: what was expected, what was found.
    pub message: String,
    /// What would be right.
    pub help: Option<String>,
}

impl BuildError {
    /// An error at `key` of the part's table.
    pub fn at(key: &str, message: impl Into<String>) -> Self {
        Self {
            key: key.to_owned(),
            message: message.into(),
            help: None,
        }
    }

    /// Adds what would be right.
    #[must_use]
    pub fn help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }
}

/// A recursive estimator as it stands in a file: `[estimator.<id>]`.
#[typetag::serde]
pub trait EstimatorPart: Debug + Send + Sync {
    /// The declaration.
    fn meta(&self) -> &'static PartMeta;
    /// Builds one for `theta.len()` parameters, starting from `theta`.
    fn build(&self, theta: &[f64]) -> Result<Box<dyn Estimator<f64>>, BuildError>;
}

/// A controller as it stands in a file: `[controller.<id>]`.
#[typetag::serde]
pub trait ControllerPart: Debug + Send + Sync {
    /// The declaration.
    fn meta(&self) -> &'static PartMeta;
    /// Builds it for a model and a period (s).
    fn build(&self, model: &Model, period: f64) -> Result<Box<dyn Controller<f64>>, BuildError>;
    /// Plain statements about what was asked for and what the design will give, for reports.
    fn notes(&self) -> Vec<String> {
        Vec::new()
    }
    /// What the design promises: the controlled signals from rest, sampled with `period` (s), for
    /// `references` (one list of samples per controlled signal), without limits or disturbances.
    /// `None` where the design promises nothing of that kind.
    fn ideal(&self, references: &[Vec<f64>], period: f64) -> Option<Vec<Vec<f64>>> {
        let _ = (references, period);
        None
    }
}

/// The error of a driver chosen at run time.
#[derive(Clone, Debug, thiserror::Error)]
#[error("{message}")]
pub struct HostDriverError {
    /// The kind.
    pub fault: DriverFault,
    /// What happened.
    pub message: String,
}

impl DriverError for HostDriverError {
    fn kind(&self) -> DriverFault {
        self.fault
    }
}

/// A driver chosen at run time.
pub type HostDriver = Box<dyn Driver<f64, Error = HostDriverError>>;

/// What a driver may need to be built.
pub struct DriverContext<'a> {
    /// The loop's model: its inputs and measured signals are what the driver serves.
    pub model: &'a Model,
    /// The loop's period, s.
    pub period: f64,
    /// Loads another model file, by a path relative to the loop file.
    pub load_model: &'a dyn Fn(&str) -> Result<Model, BuildError>,
    /// Loads the runs of a recording for `model`, by a path relative to the loop file.
    pub load_runs: &'a dyn Fn(&str, &Model) -> Result<Vec<Run>, BuildError>,
}

/// A driver as it stands in a file: `[driver.<id>]`.
#[typetag::serde]
pub trait DriverPart: Debug + Send + Sync {
    /// The declaration.
    fn meta(&self) -> &'static PartMeta;
    /// Builds it.
    fn build(&self, context: &DriverContext<'_>) -> Result<HostDriver, BuildError>;
    /// True when the driver's time is simulated: the loop then runs as fast as it can.
    fn is_simulated(&self) -> bool;
}

/// Registers a plant; made by [`declare_plant!`](crate::declare_plant).
#[derive(Debug)]
pub struct PlantEntry(pub &'static PlantMeta);
/// Registers an effect; made by [`declare_effect!`](crate::declare_effect).
#[derive(Debug)]
pub struct EffectEntry(pub &'static EffectMeta);
/// Registers an estimator, controller or driver; made by
/// [`declare_part!`](crate::declare_part).
#[derive(Debug)]
pub struct PartEntry(pub &'static PartMeta);

inventory::collect!(PlantEntry);
inventory::collect!(EffectEntry);
inventory::collect!(PartEntry);

/// Registers an estimator, controller or driver beside its `#[typetag::serde]` implementation.
#[macro_export]
macro_rules! declare_part {
    ($meta:expr) => {
        const _: () = {
            use $crate::__private::inventory;
            inventory::submit! { $crate::registry::PartEntry($meta) }
        };
    };
}

/// All linked plants, by id.
pub fn plants() -> Vec<&'static PlantMeta> {
    let mut all: Vec<_> = inventory::iter::<PlantEntry>
        .into_iter()
        .map(|e| e.0)
        .collect();
    all.sort_by_key(|m| m.id);
    all
}

/// All linked effects, by id.
pub fn effects() -> Vec<&'static EffectMeta> {
    let mut all: Vec<_> = inventory::iter::<EffectEntry>
        .into_iter()
        .map(|e| e.0)
        .collect();
    all.sort_by_key(|m| m.id);
    all
}

/// All linked estimators, controllers and drivers, by role and id.
pub fn parts() -> Vec<&'static PartMeta> {
    let mut all: Vec<_> = inventory::iter::<PartEntry>
        .into_iter()
        .map(|e| e.0)
        .collect();
    all.sort_by_key(|m| (m.role, m.id));
    all
}

/// Ids that were registered twice within their role, as `role id`. Must be empty at start.
pub fn duplicates() -> Vec<String> {
    let mut ids: Vec<String> = plants().iter().map(|m| format!("plant {}", m.id)).collect();
    ids.extend(effects().iter().map(|m| format!("effect {}", m.id)));
    ids.extend(parts().iter().map(|m| format!("{} {}", m.role, m.id)));
    ids.sort();
    let mut twice: Vec<String> = ids
        .windows(2)
        .filter(|w| w[0] == w[1])
        .map(|w| w[0].clone())
        .collect();
    twice.dedup();
    twice
}

/// Parameter values as a file gives them, in the order of the declaration.
#[derive(Clone, Debug, PartialEq)]
pub struct Values {
    /// 0: the equations' own parameters; `i`: the `i`-th other parameterization.
    pub set: usize,
    /// One per parameter of that set; `None` where the file is silent.
    pub given: Vec<Option<f64>>,
}

impl Values {
    fn empty(set: usize, parameters: &[Parameter]) -> Self {
        Self {
            set,
            given: vec![None; parameters.len()],
        }
    }

    fn serialize_into<M: SerializeMap>(
        &self,
        map: &mut M,
        parameters: &[Parameter],
    ) -> Result<(), M::Error> {
        for (parameter, value) in parameters.iter().zip(&self.given) {
            if let Some(value) = value {
                map.serialize_entry(parameter.id, value)?;
            }
        }
        Ok(())
    }
}

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

/// The range of a parameter in words, e.g. `a number above 0 kg`.
pub fn range_text(parameter: &Parameter) -> String {
    let unit = parameter.unit;
    match (
        parameter.min.is_finite(),
        parameter.max.is_finite(),
        parameter.open,
    ) {
        (false, false, _) => "a finite number".to_owned(),
        (true, false, true) => format!("a number above {} {unit}", parameter.min),
        (true, false, false) => format!("a number from {} {unit} upwards", parameter.min),
        (false, true, true) => format!("a number below {} {unit}", parameter.max),
        (false, true, false) => format!("a number up to {} {unit}", parameter.max),
        (true, true, _) => {
            format!(
                "a number from {} to {} {unit}",
                parameter.min, parameter.max
            )
        }
    }
}

/// A plant with the parameters of a file.
#[derive(Clone)]
pub struct ConfiguredPlant<P> {
    given: Values,
    plant: PhantomData<P>,
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
#[derive(Clone)]
pub struct ConfiguredEffect<E> {
    at: Vec<String>,
    given: Values,
    effect: PhantomData<E>,
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

/// Whether any part at all is linked; a command with an empty registry would silently know
/// nothing.
pub fn check() -> Result<(), ModelError> {
    if plants().is_empty() {
        return Err(ModelError::EmptyRegistry);
    }
    let twice = duplicates();
    if twice.is_empty() {
        Ok(())
    } else {
        Err(ModelError::Duplicates(twice))
    }
}
