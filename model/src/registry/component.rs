//! Plants and effects as they stand in a model file, and ready to be composed.

use std::fmt::Debug;

use loopsight_core::{Channel, EffectMeta, PlantMeta};

use super::scalar::{AnyDynamics, AnyPhysics};
use crate::config::{Mistake, PathSegment};
use crate::values::Values;

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
    ///
    /// # Errors
    ///
    /// [`Mistake`] where the table does not define a plant.
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
    pub paths: Vec<Vec<PathSegment>>,
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
    ///
    /// # Errors
    ///
    /// [`Mistake`] where the table does not define an effect that can act there.
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
#[derive(Clone)]
pub struct ReadyEffect {
    /// The declaration.
    pub meta: &'static EffectMeta,
    /// The equations.
    pub physics: &'static dyn AnyPhysics,
    /// The parameters the file gives.
    pub given: Vec<Option<f64>>,
    /// Where each of them stands in the effect's table.
    pub paths: Vec<Vec<PathSegment>>,
    /// Signals it reads beside those that play roles, by index among states, inputs and outputs.
    pub signals: Vec<usize>,
}
