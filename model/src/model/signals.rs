//! The signals of a plant by index.

use loopsight_core::{PlantMeta, Signal};

/// Signals of a plant by index: states, then inputs, then outputs.
pub fn signals(plant: &'static PlantMeta) -> impl Iterator<Item = &'static Signal> {
    plant.states.iter().chain(plant.inputs).chain(plant.outputs)
}

pub(crate) fn signal_index(plant: &'static PlantMeta, id: &str) -> Option<usize> {
    signals(plant).position(|s| s.id == id)
}
