//! What is added to a plant from outside, beside its effects.

use crate::model::Model;
use crate::registry::HostReal;

/// What is added from outside, by place.
#[derive(Clone)]
pub(super) struct Pushed<S> {
    pub(super) efforts: Vec<S>,
    pub(super) inputs: Vec<S>,
    /// Empty until one is needed: the plant alone has a faster step.
    pub(super) rates: Vec<S>,
}

impl<S: HostReal> Pushed<S> {
    pub(super) fn nothing(model: &Model) -> Self {
        Self {
            efforts: vec![S::zero(); model.n_efforts()],
            inputs: vec![S::zero(); model.plant.inputs.len()],
            rates: Vec::new(),
        }
    }
}
