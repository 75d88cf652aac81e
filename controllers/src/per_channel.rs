//! Settings that are one number, or one per channel.

use loopsight_model::registry::BuildError;
use nalgebra::DVector;
use serde::{Deserialize, Serialize};

/// One number for all channels, or a list of one per channel.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(
    untagged,
    expecting = "expected a number, or a list of numbers, one per channel"
)]
pub enum PerChannel {
    /// The same for all.
    All(f64),
    /// One each, in the order of the controlled states or inputs.
    Each(Vec<f64>),
}

impl PerChannel {
    /// The numbers one by one; a single one where it holds for all.
    pub(crate) fn listed(&self) -> &[f64] {
        match self {
            PerChannel::All(value) => std::slice::from_ref(value),
            PerChannel::Each(values) => values,
        }
    }

    pub(crate) fn expand(&self, key: &str, n: usize) -> Result<DVector<f64>, BuildError> {
        match self {
            PerChannel::All(value) => Ok(DVector::repeat(n, *value)),
            PerChannel::Each(values) if values.len() == n => Ok(DVector::from_column_slice(values)),
            PerChannel::Each(values) => Err(BuildError::at(
                key,
                format!(
                    "`{key}` has {} numbers, expected one, or a list of {n}",
                    values.len()
                ),
            )),
        }
    }
}
