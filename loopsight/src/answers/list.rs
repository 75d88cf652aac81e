//! What [`list`](crate::list) answers.

use serde::Serialize;

use super::Answer;

/// Parts that are known.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct ListAnswer {
    /// `loopsight/list/1`.
    #[cfg_attr(feature = "schema", schemars(extend("const" = "loopsight/list/1")))]
    pub schema: &'static str,
    /// The parts, role by role.
    pub parts: Vec<Listed>,
}

/// A part.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct Listed {
    /// `plant`, `effect`, `estimator`, `controller` or `driver`.
    pub role: &'static str,
    /// Identifier in TOML.
    pub id: &'static str,
    /// One sentence.
    pub summary: &'static str,
    /// Where a plant was asked for: the channels that an effect can act on.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub at: Vec<&'static str>,
}

impl Answer for ListAnswer {
    const SCHEMA: &'static str = "loopsight/list/1";
}

impl ListAnswer {
    pub(crate) fn new(parts: Vec<Listed>) -> Self {
        Self {
            schema: Self::SCHEMA,
            parts,
        }
    }
}
