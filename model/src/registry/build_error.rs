//! The error of a part that cannot be built.

/// A part that cannot be built from what its table says.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{message}")]
pub struct BuildError {
    /// Key within the part's table that is to blame; empty for the table.
    pub key: String,
    /// What is wrong: what was expected, what was found.
    pub message: String,
    /// What would be right.
    pub help: Option<String>,
}

impl BuildError {
    /// An error at `key` of the part's table.
    pub fn at(key: &str, message: impl Into<String>) -> Self {
        Self {
            key: key.to_owned(),
            message: message.into(),
            help: None,
        }
    }

    /// Adds what would be right.
    #[must_use]
    pub fn help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }
}
