//! An effect and where it is.

use loopsight_model::model::{Attached, Model};
use serde::Serialize;

/// An effect at its channels.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct EffectAt {
    /// Id of the effect.
    pub effect: String,
    /// Ids of the channels.
    pub at: Vec<String>,
}

/// Indices of a step's effect in `model`: one, or one for each of its channels; none when another effect has
/// replaced it.
pub(crate) fn instances(model: &Model, place: &EffectAt) -> Vec<usize> {
    let of_place = |e: &Attached| {
        e.meta.id == place.effect && e.at.iter().all(|c| place.at.iter().any(|at| at == c.id))
    };
    (0..model.effects.len())
        .filter(|index| of_place(&model.effects[*index]))
        .collect()
}
