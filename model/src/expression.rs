//! Effects and plants of your own, as expressions in TOML.
//!
//! `[effect.expression]` and `[plant.expression]` are read here; how they are written is told in
//! `docs/own-in-toml.md`. Behind the registry such a part is like any other: a declaration with
//! parameters, and equations for any scalar. The text of an expression becomes a tree
//! and then a flat program that allocates nothing.

mod at_channels;
mod channels;
mod described;
mod draft;
mod effect;
mod equations;
mod keep;
mod lexer;
mod operation;
mod parse;
mod plant;
mod precedence;
mod program;
mod states;
mod table;
#[cfg(test)]
mod tests;
mod tree;

use std::ops::Range;

use crate::config::{At, Mistake, PathSegment};
pub(crate) use described::{EFFECT_PART, PLANT_PART};
pub use draft::{EffectDraft, ParameterDraft};
use tree::Tree;

/// A mistake in an expression.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{message}")]
pub struct ExpressionError {
    /// Where in the expression, in bytes.
    pub place: Range<usize>,
    /// What is wrong.
    pub message: String,
    /// What would be right.
    pub help: Option<String>,
}

impl ExpressionError {
    fn at(place: Range<usize>, message: impl Into<String>) -> Self {
        Self {
            place,
            message: message.into(),
            help: None,
        }
    }

    fn help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }
}

/// The names an expression may use.
pub(crate) trait Names {
    /// What the name stands for; an error where it is known and cannot be used here.
    fn find(&self, name: &str) -> Option<Result<Tree, String>>;
    /// All names, for messages.
    fn known(&self) -> Vec<String>;
}

/// A mistake in the expression at `path` of a part's table.
fn placed(path: &[PathSegment], error: ExpressionError) -> Mistake {
    let mut mistake = Mistake::value(path.iter().cloned(), error.message);
    mistake.at = At::Text(error.place);
    mistake.help = error.help;
    mistake
}
