//! What [`Session::convert`](crate::Session::convert) answers.

use loopsight_recordings::output::Written;
use serde::Serialize;

use super::Answer;

/// What was written of a log.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct ConvertAnswer {
    /// `loopsight/convert/1`.
    #[cfg_attr(feature = "schema", schemars(extend("const" = "loopsight/convert/1")))]
    pub schema: &'static str,
    /// What it comes to, in a sentence.
    pub summary: String,
    /// The file that was written.
    pub file: String,
    /// The runs, in the order of the numbers in the column `run`; empty for one without a name.
    pub runs: Vec<String>,
    /// Samples of all of them.
    pub samples: usize,
    /// Their durations, s, added up.
    pub duration_s: f64,
    /// The columns of the file.
    pub columns: Vec<String>,
    #[serde(skip)]
    #[cfg_attr(feature = "schema", schemars(skip))]
    pub(crate) written: Written,
}

impl Answer for ConvertAnswer {
    const SCHEMA: &'static str = "loopsight/convert/1";
}

impl ConvertAnswer {
    /// The file that was written, and whether it replaced one.
    pub fn written(&self) -> &Written {
        &self.written
    }
}
