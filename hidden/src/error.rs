//! What can go wrong.

use std::path::PathBuf;

use loopsight_model::registry::BuildError;
use loopsight_recordings::RecordingError;

use crate::Hidden;

/// A recording that could not be made or written.
#[derive(Debug, thiserror::Error)]
pub enum HiddenError {
    /// There is no such effect.
    #[error("there is no effect `{id}` to hide")]
    UnknownEffect {
        /// What was asked for.
        id: String,
    },
    /// The machine has no place for the effect.
    #[error("`{effect}` cannot be hidden in the {robot}")]
    NotHere {
        /// The effect.
        effect: Hidden,
        /// Name of the machine.
        robot: &'static str,
    },
    /// The machine can only be recorded as a whole.
    #[error("the {0} is none of motors and wheels, and cannot be driven step by step")]
    NotDriven(&'static str),
    /// The size makes no physical sense.
    #[error("`{effect}` of size {size}: expected a size above 0 and at most {largest}")]
    Size {
        /// The effect.
        effect: Hidden,
        /// What was asked for.
        size: f64,
        /// The largest that is possible.
        largest: f64,
    },
    /// What was recorded is no run.
    #[error(transparent)]
    Run(#[from] loopsight_model::run::RunError),
    /// An excitation could not be built.
    #[error("excitation: {0}")]
    Excitation(#[from] BuildError),
    /// A log could not be written.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// Another file could not be read or written.
    #[error("{}: {source}", path.display())]
    Io {
        /// Which file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
}
