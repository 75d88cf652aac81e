//! A model file, as written.

use serde::{Deserialize, Serialize};

use crate::log_map::LogMap;
use crate::registry::{EffectPart, PlantPart};

/// A model file, as written.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ModelFile {
    /// Name of the robot, for titles.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// The plant.
    pub plant: Box<dyn PlantPart>,
    /// Effects, in the order they are applied.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub effect: Vec<Box<dyn EffectPart>>,
    /// Effects of the file's own that are not in the model, and that a diagnosis tries.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub candidate: Vec<Box<dyn EffectPart>>,
    /// How a log maps on the plant's signals.
    #[serde(default)]
    pub log: LogMap,
    /// How the model is integrated.
    #[serde(default)]
    pub simulation: SimulationTable,
    /// What a fit estimates.
    #[serde(default)]
    pub fit: FitTable,
}

/// `[simulation]`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SimulationTable {
    /// Longest integration step, s; by default the plant's own
    /// ([`Plant::MAX_STEP_S`](loopsight_core::Plant::MAX_STEP_S)), up to a quarter longer so that a late sample takes no
    /// step more, or longer where samples are far apart and steps of half the length come to the same place.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub max_step_s: Option<f64>,
}

/// `[fit]`: parameters that a fit estimates or freezes, where this differs from their declaration.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FitTable {
    /// Estimated though declared as known.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub free: Vec<String>,
    /// Frozen though declared as estimated.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub fixed: Vec<String>,
    /// What the plant says they are where no recording shows them ([`Unshown`](loopsight_core::Unshown)).
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub tied: Vec<String>,
    /// Estimated in each run anew, since they differ from run to run.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub per_run: Vec<String>,
}
