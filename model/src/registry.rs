//! The parts that are known at run time, by id, and the object-safe traits behind their TOML.
//!
//! A part that is declared ([`declare_plant!`](crate::declare_plant),
//! [`declare_effect!`](crate::declare_effect), [`declare_part!`](crate::declare_part)) is here
//! with nothing else touched: listings, help, templates, fits and reports walk this registry. A
//! crate that is only a dependency is not linked, so whoever wants its parts says
//! `use loopsight_plants as _;`.

mod build_error;
mod component;
mod meta;
mod roles;
mod scalar;

use loopsight_core::{Derived, EffectMeta, PlantMeta};

pub use crate::configured::{ConfiguredEffect, ConfiguredPlant};
pub use crate::values::{Values, range_text};
pub use build_error::BuildError;
pub use component::{
    DeclaredEffect, DeclaredPlant, EffectPart, PlantPart, ReadyEffect, ReadyPlant,
};
pub use meta::{PartMeta, Setting};
pub use roles::{
    ControllerPart, DriverContext, DriverPart, EstimatorPart, HalfError, Halves, HostDriver,
    HostDriverError, LoadRuns,
};
pub use scalar::{AnyDynamics, AnyPhysics, HostReal};

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

/// Why the parts linked into a program cannot be used.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum RegistryError {
    /// No plant is linked.
    #[error(
        "no plant is known to this program: link the crate that declares it with `use … as _;`"
    )]
    Empty,
    /// Parts of one role share an id.
    #[error("parts with the same id are linked: {}", .0.join(", "))]
    Duplicates(Vec<String>),
}

/// Checks that parts are linked and that their ids differ.
///
/// # Errors
///
/// [`RegistryError::Empty`] where no plant is linked: a program with an empty registry would silently
/// know nothing. [`RegistryError::Duplicates`] where two parts of one role share an id.
pub fn check() -> Result<(), RegistryError> {
    if plants().is_empty() {
        return Err(RegistryError::Empty);
    }
    let twice = duplicates();
    if twice.is_empty() {
        Ok(())
    } else {
        Err(RegistryError::Duplicates(twice))
    }
}
