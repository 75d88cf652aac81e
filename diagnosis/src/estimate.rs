//! What a fit says of one parameter.

use loopsight_core::Parameter;
use loopsight_model::model::ModelParameter;
use serde::Serialize;

/// What a fit says of one parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum ParameterVerdict {
    /// Determined by the data.
    Good,
    /// Not estimated: frozen at the value of the file, or at one that suits the log where the file has none.
    #[serde(rename = "held")]
    Frozen,
    /// Has no influence on what is measured in this recording.
    Dead,
    /// Only a combination with other parameters is determined.
    Flat,
    /// The interval is wider than the value.
    NotPinned,
    /// Not shown by this recording: it follows from others, as the plant says.
    Tied,
    /// Rests on the end of its admissible range.
    AtBound,
    /// The fit was cancelled before it could say.
    Unfinished,
}

impl ParameterVerdict {
    /// In words.
    pub fn text(self) -> &'static str {
        match self {
            ParameterVerdict::Good => "pinned by the data",
            ParameterVerdict::Frozen => "frozen, not estimated",
            ParameterVerdict::Dead => "no influence on what is measured here",
            ParameterVerdict::Flat => "only a combination with other parameters is determined",
            ParameterVerdict::NotPinned => "interval wider than the value",
            ParameterVerdict::Tied => "not shown here: it follows from others",
            ParameterVerdict::AtBound => "at the end of its range",
            ParameterVerdict::Unfinished => "the fit was cancelled",
        }
    }
}

/// A parameter that differs from run to run, in one of them.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct OfRun {
    /// Name of the run; empty where the log holds one only.
    pub run: String,
    /// What it is there.
    #[serde(flatten)]
    pub estimate: Estimate,
}

/// One estimated parameter.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Estimate {
    /// The value.
    pub value: f64,
    /// Its unit.
    pub unit: String,
    /// Standard error, in that unit; `null` where the data say nothing.
    pub std_error: Option<f64>,
    /// Interval that contains the true value with 95 % confidence.
    pub interval95: Option<[f64; 2]>,
    /// What the data say of it.
    pub verdict: ParameterVerdict,
}

impl Estimate {
    /// Whether the data say how large it is: its standard error is at most `undetermined` times its value.
    pub(crate) fn is_determined(&self, undetermined: f64) -> bool {
        match self.verdict {
            ParameterVerdict::Flat
            | ParameterVerdict::Dead
            | ParameterVerdict::Frozen
            | ParameterVerdict::Unfinished => false,
            ParameterVerdict::NotPinned => {
                (self.std_error).is_some_and(|e| e <= undetermined * self.value.abs())
            }
            ParameterVerdict::Good | ParameterVerdict::AtBound | ParameterVerdict::Tied => true,
        }
    }
}

/// Whether a fit would take one of an effect's parameters beyond where it is searched: the effect stands in for another
/// one. An end at zero or one is that of a law, as that of a share, and no such end.
pub(crate) fn stands_in<'a>(mut estimates: impl Iterator<Item = &'a Estimate>) -> bool {
    estimates.any(|estimate| {
        let of_law = estimate.value == 0.0 || estimate.value.abs() == 1.0;
        estimate.verdict == ParameterVerdict::AtBound && !of_law
    })
}

/// Whether the data say how strong an effect is: its `parameters`, with their estimates. One that is zero without
/// the effect must be determined, or any at all where there is none of that kind. When a payload changes is no
/// evidence while nobody can tell by how much.
pub(crate) fn strength_is_determined<'a>(
    parameters: impl Iterator<Item = (&'a ModelParameter, &'a Estimate)> + Clone,
    undetermined: f64,
) -> bool {
    let size = |p: &Parameter| p.default == Some(0.0) && !p.starts_in_durations;
    let sizes = || (parameters.clone()).filter(|(p, _)| size(p.declaration));
    let determined = |(_, estimate): (_, &Estimate)| estimate.is_determined(undetermined);
    match sizes().next() {
        Some(_) => sizes().any(determined),
        None => parameters.clone().any(determined),
    }
}
