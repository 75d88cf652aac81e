//! What a run says of its signals, parameters and regressions.

use std::collections::BTreeMap;

use loopsight_diagnosis::tracking::StepResponse;
use loopsight_report::LoopRecord;
use serde::Serialize;

/// How a controlled signal followed its reference.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct Tracking {
    /// The signal.
    pub id: String,
    /// Its unit.
    pub unit: String,
    /// Root mean square of its error; `null` of nothing.
    pub rms_error: Option<f64>,
    /// Largest magnitude of its error.
    pub largest_error: f64,
    /// How it followed the steps of its reference.
    pub steps: Vec<ReferenceStep>,
}

/// The response to one step of a reference.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct ReferenceStep {
    /// When the reference stepped, s.
    pub at_s: f64,
    /// Reference before.
    pub from: f64,
    /// Reference after.
    pub to: f64,
    /// From the step until the response stays within 2 % of it; `null` when it did not before the next
    /// step, or when the noise alone is wider than that.
    pub settling_time_s: Option<f64>,
    /// How far the response went beyond the new value, in per cent of the step.
    #[cfg_attr(feature = "schema", schemars(with = "Option<f64>"))]
    pub overshoot_percent: f64,
}

impl From<&StepResponse> for ReferenceStep {
    fn from(step: &StepResponse) -> Self {
        Self {
            at_s: step.at_s,
            from: step.from,
            to: step.to,
            settling_time_s: step.settling_time_s,
            overshoot_percent: step.overshoot_percent,
        }
    }
}

/// A parameter at the end of a run.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct LearnedParameter {
    /// Its name.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// Its value in the model file.
    pub start: f64,
    /// Its value at the end.
    #[cfg_attr(feature = "schema", schemars(with = "Option<f64>"))]
    pub value: f64,
    /// Standard error in white noise; `null` where nothing was learned.
    pub std_error: Option<f64>,
    /// Interval that contains the true value with 95 % confidence in white noise; `null` where nothing was
    /// learned.
    pub interval95: Option<[f64; 2]>,
}

/// How large something of a regression was.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct Spread {
    /// The output of the regression.
    pub id: String,
    /// Unit.
    pub unit: String,
    /// Root mean square; `null` of nothing.
    pub rms: Option<f64>,
    /// The last one.
    pub last: f64,
}

/// How often a regression was taught something, and why not at the other ticks.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct Learning {
    /// The output of the regression.
    pub id: String,
    /// Share of the ticks that taught it something.
    pub taught_share: f64,
    /// Shares of the ticks that taught it nothing, by reason.
    pub withheld_share: BTreeMap<&'static str, f64>,
}

/// Something that happened.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct Happened {
    /// When, s.
    pub time_s: f64,
    /// What, in words.
    pub what: String,
}

/// How well a loop kept real time.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct LoopTiming {
    /// Root mean square of the differences between periods and the period asked for, s.
    pub jitter_s: f64,
    /// Longest time after its time at which a tick began, s.
    pub latest_s: f64,
    /// Ticks that began more than a period late.
    pub missed: usize,
    /// Longest time from the beginning of a tick until its command was written, s.
    pub longest_s: f64,
}

/// A loop tick by tick: all lists are as long as `time_s`, `null` marks what is missing. Of a very long
/// run one in `every` ticks is kept.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct RunSeries {
    /// One in so many ticks is kept.
    pub every: usize,
    /// Time of each tick since the start, s.
    pub time_s: Vec<f64>,
    /// The signals under control.
    pub controlled: Vec<ControlledSeries>,
    /// The inputs.
    pub inputs: Vec<InputSeries>,
    /// The parameters that were learned.
    pub parameters: Vec<ParameterSeries>,
}

/// A controlled signal tick by tick.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct ControlledSeries {
    /// The signal.
    pub signal: String,
    /// Its unit.
    pub unit: String,
    /// What it should be.
    #[cfg_attr(feature = "schema", schemars(with = "Vec<Option<f64>>"))]
    pub reference: Vec<f64>,
    /// What it was.
    #[cfg_attr(feature = "schema", schemars(with = "Vec<Option<f64>>"))]
    pub measured: Vec<f64>,
    /// What the design promises; `null` where it promises nothing.
    #[cfg_attr(feature = "schema", schemars(with = "Option<Vec<Option<f64>>>"))]
    pub ideal: Option<Vec<f64>>,
}

/// An input tick by tick.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct InputSeries {
    /// The signal.
    pub signal: String,
    /// Its unit.
    pub unit: String,
    /// What the controller asked for.
    #[cfg_attr(feature = "schema", schemars(with = "Vec<Option<f64>>"))]
    pub commanded: Vec<f64>,
    /// What was applied, after limits.
    #[cfg_attr(feature = "schema", schemars(with = "Vec<Option<f64>>"))]
    pub applied: Vec<f64>,
}

/// A parameter tick by tick.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct ParameterSeries {
    /// Its name.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// The estimate.
    #[cfg_attr(feature = "schema", schemars(with = "Vec<Option<f64>>"))]
    pub value: Vec<f64>,
    /// Its standard deviation; `null` where none is known.
    #[cfg_attr(feature = "schema", schemars(with = "Option<Vec<Option<f64>>>"))]
    pub std: Option<Vec<f64>>,
}

impl RunSeries {
    pub(super) fn new(record: &LoopRecord) -> Self {
        let controlled = record.controlled.iter().map(|trace| ControlledSeries {
            signal: trace.id.clone(),
            unit: trace.unit.clone(),
            reference: trace.reference.clone(),
            measured: trace.measured.clone(),
            ideal: trace.ideal.clone(),
        });
        let inputs = record.inputs.iter().map(|trace| InputSeries {
            signal: trace.id.clone(),
            unit: trace.unit.clone(),
            commanded: trace.commanded.clone(),
            applied: trace.applied.clone(),
        });
        let parameters = record.parameters.iter().map(|trace| ParameterSeries {
            name: trace.name.clone(),
            unit: trace.unit.clone(),
            value: trace.values.clone(),
            std: trace.std.clone(),
        });
        Self {
            every: record.every.max(1),
            time_s: record.time.clone(),
            controlled: controlled.collect(),
            inputs: inputs.collect(),
            parameters: parameters.collect(),
        }
    }
}
