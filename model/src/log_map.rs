//! How the columns of a log map on the signals of a model.

mod labels;
mod list;
mod measured;
mod ranges;

use std::collections::BTreeMap;

pub use labels::Labels;
pub use measured::Measured;
pub use ranges::Ranges;
use serde::{Deserialize, Serialize};

/// Where the label of an experiment stands in the name of a column.
const PLACE: &str = "{}";

/// How the columns of a log map on the signals of a model: the table `[log]` of a model file.
///
/// Signals that are not mentioned are looked for by name: the column `linear_velocity_m_per_s`
/// is the signal `linear_velocity` in m/s.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LogMap {
    /// Column of the time stamps; by default the first column whose name begins with `time` or
    /// is `t`, with a unit of time; of a CSV file without one the first in a unit of time that rises throughout.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub time: Option<ColumnMap>,
    /// Time from one row to the next, s, of a log without time stamps.
    #[serde(default, alias = "period", skip_serializing_if = "Option::is_none")]
    pub period_s: Option<f64>,
    /// Rows to use, from 1, both ends included: `[1, 5000]`, or a list of such pairs, each a run.
    #[serde(default, skip_serializing_if = "Ranges::is_empty")]
    pub rows: Ranges,
    /// Times to use, s, as the log's own time stamps say them: `[10, 25]`, or a list of such pairs, each a run.
    #[serde(default, skip_serializing_if = "Ranges::is_empty")]
    pub times_s: Ranges,
    /// Column of a run number or name; rows with another value start a new run.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub run: Option<String>,
    /// Experiments in columns side by side: what stands for `{}` in the names of columns, once for each run.
    #[serde(default, skip_serializing_if = "Labels::is_empty")]
    pub side_by_side: Labels,
    /// The inputs were measured at the machine, and are no commands: what a driver and a supply make of a command
    /// is in them, and the effects that stand for it ([`EffectMeta::before_input`](loopsight_core::EffectMeta))
    /// are no candidates.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub inputs_measured: bool,
    /// Inputs of the plant, by id.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub inputs: BTreeMap<String, ColumnMap>,
    /// Measured signals, by id. Empty: every signal of the plant for which the log has a column.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub measured: BTreeMap<String, Measured>,
}

impl LogMap {
    /// As it stands in a model file: `[log]` and the tables below it; none where it cannot be written.
    pub fn to_toml(&self) -> Option<String> {
        #[derive(Serialize)]
        struct File<'m> {
            log: &'m LogMap,
        }
        toml::to_string(&File { log: self }).ok()
    }

    /// The map of each experiment that stands beside others, with its label; none where there is one.
    pub fn experiments(&self) -> Vec<(&str, LogMap)> {
        let labels = self.side_by_side.names().iter();
        labels
            .map(|label| (label.as_str(), self.experiment(label)))
            .collect()
    }

    /// Whether a column is named by the label of its experiment.
    pub fn names_experiments(&self) -> bool {
        let columns = self
            .time
            .iter()
            .chain(self.inputs.values())
            .map(ColumnMap::name);
        let measured = self.measured.values().filter_map(|m| m.column.as_deref());
        let mut all = columns.chain(measured).chain(self.run.as_deref());
        all.any(|name| name.contains(PLACE))
    }

    fn experiment(&self, label: &str) -> LogMap {
        let mut map = self.clone();
        map.side_by_side = Labels::default();
        let put = |name: &mut String| *name = name.replace(PLACE, label);
        for column in map.time.iter_mut().chain(map.inputs.values_mut()) {
            match column {
                ColumnMap::Name(name) => put(name),
                ColumnMap::Full(column) => put(&mut column.column),
            }
        }
        let measured = map.measured.values_mut().filter_map(|m| m.column.as_mut());
        measured.chain(&mut map.run).for_each(put);
        map
    }
}

/// A column of a log: its name alone, or with unit and scale.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(
    untagged,
    expecting = "the column's name as a string, or a table as `{ column = \"name\", scale = -1.0 }`"
)]
pub enum ColumnMap {
    /// The name; the unit is read from its ending.
    Name(String),
    /// Name, unit, factor.
    Full(Column),
}

/// A column with its conversion: SI value = (value in `unit` as SI) times (`scale` in `scale_unit`
/// as SI) + `offset`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Column {
    /// Name in the header, or a sum or difference of names: `right - left`.
    pub column: String,
    /// Unit when the name does not end with it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unit: Option<String>,
    /// Factor; `-1` reverses the sign.
    #[serde(default = "one", skip_serializing_if = "is_one")]
    pub scale: f64,
    /// Unit of `scale` where the column holds what a transducer makes of the signal: `m/V`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scale_unit: Option<String>,
    /// Added at last, in SI: an angle that is counted from elsewhere.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub offset: f64,
    /// How an input runs between its samples.
    #[serde(default, skip_serializing_if = "Hold::is_zero_order")]
    pub hold: Hold,
}

/// How an input runs between the samples of a log (A. V. Oppenheim, R. W. Schafer, 2010,
/// "Discrete-Time Signal Processing", 3rd edition, section 4.2).
///
/// A computer's command is constant between samples. An input that was *measured*, or a smooth reference, is not: if
/// it is taken as constant, even a perfect model seems to have half a sample of delay.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Hold {
    /// Constant until the next sample.
    #[default]
    ZeroOrder,
    /// A straight line to the next sample.
    FirstOrder,
}

impl Hold {
    fn is_zero_order(&self) -> bool {
        *self == Hold::ZeroOrder
    }
}

fn one() -> f64 {
    1.0
}

#[allow(
    clippy::trivially_copy_pass_by_ref,
    reason = "the signature serde asks for"
)]
fn is_one(value: &f64) -> bool {
    *value == 1.0
}

#[allow(
    clippy::trivially_copy_pass_by_ref,
    reason = "the signature serde asks for"
)]
fn is_zero(value: &f64) -> bool {
    *value == 0.0
}

impl ColumnMap {
    /// Name in the header.
    pub fn name(&self) -> &str {
        match self {
            ColumnMap::Name(name) => name,
            ColumnMap::Full(column) => &column.column,
        }
    }

    /// Unit given in the model file.
    pub fn unit(&self) -> Option<&str> {
        match self {
            ColumnMap::Name(_) => None,
            ColumnMap::Full(column) => column.unit.as_deref(),
        }
    }

    /// Factor.
    pub fn scale(&self) -> f64 {
        match self {
            ColumnMap::Name(_) => 1.0,
            ColumnMap::Full(column) => column.scale,
        }
    }

    /// Unit of the factor.
    pub fn scale_unit(&self) -> Option<&str> {
        match self {
            ColumnMap::Name(_) => None,
            ColumnMap::Full(column) => column.scale_unit.as_deref(),
        }
    }

    /// What is added at last, in SI.
    pub fn offset(&self) -> f64 {
        match self {
            ColumnMap::Name(_) => 0.0,
            ColumnMap::Full(column) => column.offset,
        }
    }

    /// How an input runs between its samples.
    pub fn hold(&self) -> Hold {
        match self {
            ColumnMap::Name(_) => Hold::ZeroOrder,
            ColumnMap::Full(column) => column.hold,
        }
    }
}
