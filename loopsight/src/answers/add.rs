//! What [`Session::add`](crate::Session::add) answers.

use serde::Serialize;

use super::Answer;
use crate::model::Model;

/// A model with an effect added.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct AddAnswer {
    /// `loopsight/add/1`.
    #[cfg_attr(feature = "schema", schemars(extend("const" = "loopsight/add/1")))]
    pub schema: &'static str,
    /// Id of the effect.
    pub effect: String,
    /// Ids of the channels it acts on.
    pub at: Vec<String>,
    /// What it comes to, in a sentence.
    pub summary: String,
    #[serde(skip)]
    #[cfg_attr(feature = "schema", schemars(skip))]
    model: Model,
}

impl Answer for AddAnswer {
    const SCHEMA: &'static str = "loopsight/add/1";
}

impl AddAnswer {
    pub(crate) fn new(effect: &str, at: &[&str], model: Model) -> Self {
        Self {
            schema: Self::SCHEMA,
            effect: effect.to_owned(),
            at: at.iter().map(|channel| (*channel).to_owned()).collect(),
            summary: format!(
                "{effect} added at {}; a fit finds its parameters",
                at.join(", ")
            ),
            model,
        }
    }

    /// The model with the effect, its text with its comments.
    pub fn model(&self) -> &Model {
        &self.model
    }
}
