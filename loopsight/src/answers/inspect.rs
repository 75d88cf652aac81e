//! What [`inspect`](crate::inspect()) answers.

use loopsight_recordings::Inventory;
use loopsight_report::Context;
use serde::Serialize;

use super::Answer;

/// What is in a log, and the model file that it asks for.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct InspectAnswer {
    /// `loopsight/inspect/1`.
    #[cfg_attr(feature = "schema", schemars(extend("const" = "loopsight/inspect/1")))]
    pub schema: &'static str,
    /// The log in words.
    pub summary: String,
    /// The file.
    pub file: String,
    /// Its format: `CSV`, `WPILOG`.
    pub format: String,
    /// From the first time stamp to the last, s; `null` without time stamps.
    pub duration_s: Option<f64>,
    /// Number of runs that the file itself separates.
    pub runs: usize,
    /// A channel of texts that says which test runs, whose texts become runs; `null` where there is none.
    pub state: Option<String>,
    /// What the file says of itself, and where it ends too early.
    pub notes: Vec<String>,
    /// The channels, in the order of the file.
    pub channels: Vec<InspectedChannel>,
    /// Plants of the library whose inputs and signals the log seems to have, the best first.
    pub plants: Vec<FittingPlant>,
    /// A model file for the first of them; `null` where no plant fits.
    pub model_toml: Option<String>,
    #[serde(skip)]
    #[cfg_attr(feature = "schema", schemars(skip))]
    pub(crate) inventory: Inventory,
}

/// A channel of a log.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct InspectedChannel {
    /// Its path, as `[log]` names it.
    pub path: String,
    /// `number`, `boolean`, `text` or `opaque`.
    pub kind: &'static str,
    /// Its type in the file's own words.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub declared: String,
    /// Its unit; `null` where nothing says it.
    pub unit: Option<String>,
    /// Why it is taken to be that.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unit_from: Option<&'static str>,
    /// Number of values, those that are missing included.
    pub values: usize,
    /// Share of them that is missing, 0 to 1.
    pub missing: f64,
    /// Smallest number; `null` for texts.
    pub min: Option<f64>,
    /// Largest number; `null` for texts.
    pub max: Option<f64>,
    /// The first texts that occur.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub words: Vec<String>,
    /// Values a second, by the median time between two; `null` without time stamps.
    pub rate_hz: Option<f64>,
    /// Median deviation from the median time between two values, s.
    pub jitter_s: Option<f64>,
    /// Pauses of more than five periods.
    pub gaps: usize,
    /// The longest of them, s.
    pub longest_gap_s: f64,
    /// How often time goes back.
    pub backwards: usize,
}

/// A plant and the channels that would be its inputs and signals.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct FittingPlant {
    /// The plant.
    pub plant: String,
    /// Its inputs.
    pub inputs: Vec<MappedChannel>,
    /// What was measured of it.
    pub measured: Vec<MappedChannel>,
}

/// A signal of a plant and a channel.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct MappedChannel {
    /// The signal.
    pub id: String,
    /// The channel.
    pub channel: String,
    /// Its unit; `null`: taken as SI.
    pub unit: Option<String>,
}

impl Answer for InspectAnswer {
    const SCHEMA: &'static str = "loopsight/inspect/1";
}

impl InspectAnswer {
    /// A page with a small picture of each channel (HTML) that opens offline; `command` stands at its foot and may be
    /// empty.
    pub fn page(&self, command: &str) -> String {
        let context = Context {
            title: format!("What is in {}", self.file),
            model_name: self.format.clone(),
            log_file: self.file.clone(),
            notes: self.notes.clone(),
            command: command.to_owned(),
            ..Context::default()
        };
        let model = self.model_toml.as_deref();
        loopsight_report::inventory_page(&context, &self.summary, &self.inventory, model)
    }
}
