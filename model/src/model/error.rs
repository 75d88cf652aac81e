//! Why a model could not be made.

use crate::config::{ConfigError, ReadError};
use crate::registry::RegistryError;

/// Why a model could not be made.
#[derive(Debug, thiserror::Error)]
pub enum ModelError {
    /// The file could not be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// A mistake in the file.
    #[error(transparent)]
    Config(#[from] Box<ConfigError>),
    /// The parts linked into the program cannot be used.
    #[error(transparent)]
    Registry(#[from] RegistryError),
}
