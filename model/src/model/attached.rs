//! Effects and measured signals of a composed model.

use std::ops::Range;

use loopsight_core::{Channel, EffectMeta, Role, Signal};

use crate::registry::AnyPhysics;
use crate::sensor::Sensor;

/// An effect of a composed model, bound to its channels.
#[derive(Clone)]
pub struct Attached {
    /// The declaration.
    pub meta: &'static EffectMeta,
    /// The channels, in the order of the file.
    pub at: Vec<&'static Channel>,
    /// First of its parameters in [`Model::parameters`](super::Model::parameters).
    pub first_parameter: usize,
    pub(crate) physics: &'static dyn AnyPhysics,
    /// For each channel and role, the index of the signal that plays it.
    pub(crate) reads: Vec<[Option<usize>; Role::COUNT]>,
    /// Signals it reads beside those.
    pub(crate) signals: Vec<usize>,
}

impl Attached {
    /// Its parameters in [`Model::parameters`](super::Model::parameters).
    pub fn own(&self) -> Range<usize> {
        self.first_parameter..self.first_parameter + self.meta.parameters.len()
    }

    /// Whether it is the same effect at the same channels as `other`.
    pub fn is_same(&self, other: &Self) -> bool {
        let others = other.at.iter().map(|c| c.id);
        self.meta.id == other.meta.id && self.at.iter().map(|c| c.id).eq(others)
    }
}

/// A measured signal of a composed model.
#[derive(Clone, Debug, PartialEq)]
pub struct MeasuredSignal {
    /// Index among states, inputs and outputs, in that order.
    pub index: usize,
    /// The declaration.
    pub signal: &'static Signal,
    /// How the number is made.
    pub sensor: Sensor,
}
