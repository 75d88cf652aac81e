//! A starting point that runs at once: a folder for a robot, or a crate.

mod model_text;
mod robot;
mod texts;
mod workshop;

use loopsight_recordings::output::Written;

pub(crate) use robot::robot;
pub(crate) use workshop::workshop;

/// A folder that was made.
pub(crate) struct Made {
    /// The files in it.
    pub(crate) written: Vec<Written>,
    /// What to know about it.
    pub(crate) note: Option<String>,
    /// The commands to type next, in it.
    pub(crate) next: Vec<String>,
}
