//! The parts that are known at run time, by id, and the object-safe traits behind their TOML.
//!
//! A part that is declared ([`declare_plant!`](crate::declare_plant),
//! [`declare_effect!`](crate::declare_effect), [`declare_part!`](crate::declare_part)) is here
//! with nothing else touched: listings, help, templates, fits and reports walk this registry. A
//! crate that is only a dependency is not linked, so whoever wants its parts says
//! `use loopsight_plants as _;`.

use std::any::Any;
use std::fmt::Debug;

use crate::Dual;
use crate::config::{Mistake, Step};
pub use crate::configured::{ConfiguredEffect, ConfiguredPlant, Values, range_text};
use crate::model::{Model, ModelError};
use crate::run::Run;
use loopsight_core::{
    Channel, Controller, Derived, Driver, DriverError, DriverFault, Dynamics, EffectMeta,
    Estimator, Physics, PlantMeta, Real,
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
    /// The plant ready to be composed; an error where what the file says of it cannot be.
    fn ready(&self) -> Result<ReadyPlant, Mistake> {
        let (meta, values) = (self.meta(), self.values().clone());
        let set = values.set.checked_sub(1);
        let set = set.and_then(|i| meta.parameterizations.get(i));
        let parameters = set.map_or(meta.parameters, |s| s.parameters);
        let path = |id: &'static str| set.map(|s| s.id.into()).into_iter().chain([id.into()]);
        Ok(ReadyPlant {
            meta,
            dynamics: self.dynamics(),
            paths: parameters.iter().map(|p| path(p.id).collect()).collect(),
            values,
        })
    }
}

/// A plant ready to be composed.
pub struct ReadyPlant {
    /// The declaration.
    pub meta: &'static PlantMeta,
    /// The equations.
    pub dynamics: &'static dyn AnyDynamics,
    /// The parameters the file gives.
    pub values: Values,
    /// Where each of them stands in the plant's table.
    pub paths: Vec<Vec<Step>>,
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
    /// The key of its table that names the channels.
    fn at_key(&self) -> &'static str {
        "at"
    }
    /// The effect ready to act at these channels of a plant; an error where what the file says of
    /// it cannot be.
    fn ready(
        &self,
        plant: &'static PlantMeta,
        at: &[&'static Channel],
    ) -> Result<ReadyEffect, Mistake> {
        let _ = (plant, at);
        Ok(ReadyEffect {
            meta: self.meta(),
            physics: self.physics(),
            given: self.values().given.clone(),
            paths: self
                .meta()
                .parameters
                .iter()
                .map(|p| vec![p.id.into()])
                .collect(),
            signals: Vec::new(),
        })
    }
}

/// An effect ready to be attached.
pub struct ReadyEffect {
    /// The declaration.
    pub meta: &'static EffectMeta,
    /// The equations.
    pub physics: &'static dyn AnyPhysics,
    /// The parameters the file gives.
    pub given: Vec<Option<f64>>,
    /// Where each of them stands in the effect's table.
    pub paths: Vec<Vec<Step>>,
    /// Signals it reads beside those that play roles, by index among states, inputs and outputs.
    pub signals: Vec<usize>,
}

/// What an estimator, controller or driver says about itself.
#[derive(Clone, Copy, Debug)]
pub struct PartMeta {
    /// Identifier in TOML.
    pub id: &'static str,
    /// `estimator`, `controller` or `driver`; `plant` or `effect` for those of [`written`].
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
pub trait ControllerPart: Debug + Send + Sync + Any {
    /// The declaration.
    fn meta(&self) -> &'static PartMeta;
    /// Builds it for a model and a period (s).
    fn build(&self, model: &Model, period: f64) -> Result<Box<dyn Controller<f64>>, BuildError>;
    /// Plain statements about what was asked for and what the design will give, for reports.
    fn notes(&self) -> Vec<String> {
        Vec::new()
    }
    /// True where the controller inverts the model it is given, so that effects in the model file
    /// change its commands.
    fn inverts_model(&self) -> bool {
        false
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

/// Loads the runs of a recording for a model, by a path relative to the loop file.
pub type LoadRuns<'a> = dyn Fn(&str, &Model) -> Result<Vec<Run>, BuildError> + 'a;

/// What a driver may need to be built.
pub struct DriverContext<'a> {
    /// The loop's model: its inputs and measured signals are what the driver serves.
    pub model: &'a Model,
    /// The loop's period, s.
    pub period: f64,
    /// Loads another model file, by a path relative to the loop file.
    pub load_model: &'a dyn Fn(&str) -> Result<Model, BuildError>,
    /// Loads the runs of a recording for `model`, by a path relative to the loop file.
    pub load_runs: &'a LoadRuns<'a>,
    /// Reads a column of a table, by a path relative to the loop file.
    pub read_column: &'a crate::excitation::ReadColumn<'a>,
}

/// A loop's driver and controller, or which of the two cannot be built.
pub type Halves = Result<(HostDriver, Box<dyn Controller<f64>>), HalfError>;

/// The half of a loop that cannot be built.
#[derive(Clone, Debug, PartialEq)]
pub enum HalfError {
    /// The driver's table.
    Driver(BuildError),
    /// The controller's table.
    Controller(BuildError),
}

/// A driver as it stands in a file: `[driver.<id>]`.
#[typetag::serde]
pub trait DriverPart: Debug + Send + Sync + Any {
    /// The declaration.
    fn meta(&self) -> &'static PartMeta;
    /// Builds it.
    fn build(&self, context: &DriverContext<'_>) -> Result<HostDriver, BuildError>;
    /// True when the driver's time is simulated: the loop then runs as fast as it can.
    fn is_simulated(&self) -> bool;
    /// True where the robot runs the loop's law itself, by a timer of its own: its readings keep the time, and
    /// [`DriverPart::build_with`] makes the controller.
    fn runs_law(&self) -> bool {
        false
    }
    /// Builds it, and the controller of the same loop: each by itself, where they need not know of each
    /// other.
    fn build_with(&self, controller: &dyn ControllerPart, context: &DriverContext<'_>) -> Halves {
        let controller = controller
            .build(context.model, context.period)
            .map_err(HalfError::Controller)?;
        Ok((self.build(context).map_err(HalfError::Driver)?, controller))
    }
}

/// Registers a plant; made by [`declare_plant!`](crate::declare_plant).
#[derive(Debug)]
pub struct PlantEntry(pub &'static PlantMeta, pub &'static [Derived]);
/// Registers an effect; made by [`declare_effect!`](crate::declare_effect).
pub struct EffectEntry(pub &'static EffectMeta, pub &'static dyn AnyPhysics);
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

/// Parts that the model file itself defines, see [`crate::expression`].
pub fn written() -> [&'static PartMeta; 2] {
    [
        &crate::expression::PLANT_PART,
        &crate::expression::EFFECT_PART,
    ]
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

/// What follows from the parameters of the linked plant `id`; nothing where there is none.
pub fn derived(id: &str) -> &'static [Derived] {
    inventory::iter::<PlantEntry>
        .into_iter()
        .find(|e| e.0.id == id)
        .map_or(&[], |e| e.1)
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

/// The effect `id` with nothing given.
pub(crate) fn effect(id: &str) -> Option<ReadyEffect> {
    let entry = inventory::iter::<EffectEntry>
        .into_iter()
        .find(|e| e.0.id == id)?;
    let parameters = entry.0.parameters;
    Some(ReadyEffect {
        meta: entry.0,
        physics: entry.1,
        given: vec![None; parameters.len()],
        paths: parameters.iter().map(|p| vec![p.id.into()]).collect(),
        signals: Vec::new(),
    })
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
