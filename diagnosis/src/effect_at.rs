//! An effect and where it is.

use serde::Serialize;

/// An effect at its channels.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct EffectAt {
    /// Id of the effect.
    pub effect: String,
    /// Ids of the channels.
    pub at: Vec<String>,
}
