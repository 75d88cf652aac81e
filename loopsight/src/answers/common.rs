//! Parts that several answers have in common.

use std::collections::BTreeMap;

use serde::Serialize;

use super::mirror::{Because, FaultKind, ParameterVerdict, Severity};

/// How far a model is from the measurements.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct ModelErrors {
    /// Free-run error over all signals: root mean square of the signals' `nrmse`.
    #[cfg_attr(feature = "schema", schemars(with = "Option<f64>"))]
    pub nrmse: f64,
    /// `100 (1 - nrmse)`.
    #[cfg_attr(feature = "schema", schemars(with = "Option<f64>"))]
    pub fit_percent: f64,
    /// Errors of each measured signal.
    pub signals: Vec<SignalError>,
    /// Faults of the log, the worst first.
    pub faults: Vec<LogFault>,
    /// How the free run is corrected by the measurements; absent where it is simulated from the inputs
    /// alone.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub observer: Option<Correction>,
    /// Where the free run fails, the most telling first.
    pub where_it_fails: Vec<Failing>,
}

/// How far a model is from one measured signal.
///
/// With residuals `e = y - ŷ`: `rmse = sqrt(mean(e²))`, `nrmse = rmse/std(y)`.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct SignalError {
    /// The signal.
    pub id: String,
    /// Its unit.
    pub unit: String,
    /// Root mean square of the free-run error, in the signal's unit.
    #[cfg_attr(feature = "schema", schemars(with = "Option<f64>"))]
    pub rmse: f64,
    /// The same over the standard deviation of the measurement.
    #[cfg_attr(feature = "schema", schemars(with = "Option<f64>"))]
    pub nrmse: f64,
    /// `100 (1 - nrmse)`.
    #[cfg_attr(feature = "schema", schemars(with = "Option<f64>"))]
    pub fit_percent: f64,
    /// As `nrmse`, for the prediction of one sample from the measured state.
    #[cfg_attr(feature = "schema", schemars(with = "Option<f64>"))]
    pub one_step_nrmse: f64,
}

/// A fault of a log; one entry for each kind and signal.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct LogFault {
    /// What it is.
    pub kind: FaultKind,
    /// The runs it shows in, separated by commas; empty: the log as a whole.
    pub run: String,
    /// Id of the signal; the header for a column that the model does not use; may be empty.
    pub signal: String,
    /// What was seen, with figures.
    pub detail: String,
    /// How much it matters.
    pub severity: Severity,
}

impl From<&loopsight_recordings::Fault> for LogFault {
    fn from(fault: &loopsight_recordings::Fault) -> Self {
        Self {
            kind: fault.kind.into(),
            run: fault.run.clone(),
            signal: fault.signal.clone(),
            detail: fault.detail.clone(),
            severity: fault.severity().into(),
        }
    }
}

impl std::fmt::Display for LogFault {
    /// ``dead_sensor `speed` in run slow: never moves``
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}", self.kind.name())?;
        if !self.signal.is_empty() {
            write!(f, " `{}`", self.signal)?;
        }
        if !self.run.is_empty() {
            write!(f, " in run {}", self.run)?;
        }
        write!(f, ": {}", self.detail)
    }
}

/// How a free run is corrected by the measurements, and why.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct Correction {
    /// Why the model cannot be simulated from the inputs alone.
    pub because: Because,
    /// Time constant with which the observer forgets old measurements, s.
    pub horizon_s: f64,
    /// In words.
    pub statement: String,
}

impl From<&loopsight_diagnosis::Correction> for Correction {
    fn from(held: &loopsight_diagnosis::Correction) -> Self {
        Self {
            because: held.because.into(),
            horizon_s: held.horizon_s,
            statement: held.statement.clone(),
        }
    }
}

/// Where a model fails.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct Failing {
    /// In words.
    pub statement: String,
    /// Share of the squared error that it explains.
    pub share_of_squared_error: f64,
    /// The measured signal it is about.
    pub signal: String,
}

impl From<&loopsight_diagnosis::Statement> for Failing {
    fn from(statement: &loopsight_diagnosis::Statement) -> Self {
        Self {
            statement: statement.statement.clone(),
            share_of_squared_error: statement.share_of_squared_error,
            signal: statement.signal.clone(),
        }
    }
}

impl From<&loopsight_diagnosis::Comparison> for ModelErrors {
    fn from(comparison: &loopsight_diagnosis::Comparison) -> Self {
        let signals = comparison.signals.iter().map(|s| SignalError {
            id: s.id.clone(),
            unit: s.unit.clone(),
            rmse: s.rmse,
            nrmse: s.nrmse,
            fit_percent: s.fit_percent,
            one_step_nrmse: s.one_step_nrmse,
        });
        Self {
            nrmse: comparison.nrmse,
            fit_percent: comparison.fit_percent,
            signals: signals.collect(),
            faults: all(&comparison.faults),
            observer: comparison.observer.as_ref().map(Into::into),
            where_it_fails: all(&comparison.where_it_fails),
        }
    }
}

/// What is known of one parameter.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct ParameterEstimate {
    /// The value.
    pub value: f64,
    /// Its unit.
    pub unit: String,
    /// Standard error, in that unit; `null` where the data say nothing.
    pub std_error: Option<f64>,
    /// Interval that contains the true value with 95 % confidence; `null` where the data say nothing.
    pub interval95: Option<[f64; 2]>,
    /// What the data say of it.
    pub verdict: ParameterVerdict,
}

impl From<&loopsight_diagnosis::Estimate> for ParameterEstimate {
    fn from(estimate: &loopsight_diagnosis::Estimate) -> Self {
        Self {
            value: estimate.value,
            unit: estimate.unit.clone(),
            std_error: estimate.std_error,
            interval95: estimate.interval95,
            verdict: estimate.verdict.into(),
        }
    }
}

/// Parameters by name.
pub type Estimates = BTreeMap<String, ParameterEstimate>;

pub(crate) fn estimates(from: &BTreeMap<String, loopsight_diagnosis::Estimate>) -> Estimates {
    let of = from.iter();
    of.map(|(name, p)| (name.clone(), p.into())).collect()
}

/// A parameter that differs from run to run, in one of them.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct RunEstimate {
    /// Name of the run; empty where the log holds one only.
    pub run: String,
    /// What is known of it there.
    #[serde(flatten)]
    pub estimate: ParameterEstimate,
}

/// Parameters that differ from run to run, by name.
pub type PerRun = BTreeMap<String, Vec<RunEstimate>>;

pub(crate) fn per_run(from: &BTreeMap<String, Vec<loopsight_diagnosis::OfRun>>) -> PerRun {
    let each = |of: &loopsight_diagnosis::OfRun| RunEstimate {
        run: of.run.clone(),
        estimate: (&of.estimate).into(),
    };
    let of = from.iter();
    of.map(|(name, runs)| (name.clone(), runs.iter().map(each).collect()))
        .collect()
}

/// An effect at its channels.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct EffectAt {
    /// Id of the effect.
    pub effect: String,
    /// Ids of the channels.
    pub at: Vec<String>,
}

impl From<&loopsight_diagnosis::EffectAt> for EffectAt {
    fn from(place: &loopsight_diagnosis::EffectAt) -> Self {
        Self {
            effect: place.effect.clone(),
            at: place.at.clone(),
        }
    }
}

impl std::fmt::Display for EffectAt {
    /// `coulomb_friction @ wheel.right+wheel.left`
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} @ {}", self.effect, self.at.join("+"))
    }
}

/// An error level.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct Level {
    /// Free-run error relative to the standard deviation of what was measured.
    #[cfg_attr(feature = "schema", schemars(with = "Option<f64>"))]
    pub nrmse: f64,
}

/// An experiment and what it is good for.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct Recommendation {
    /// Why.
    pub why: String,
    /// What to record.
    pub experiment: String,
}

impl From<&loopsight_diagnosis::Advice> for Recommendation {
    fn from(advice: &loopsight_diagnosis::Advice) -> Self {
        Self {
            why: advice.why.clone(),
            experiment: advice.experiment.clone(),
        }
    }
}

/// Each element of a list as an answer says it.
pub(crate) fn all<'e, E: 'e, A: From<&'e E>>(list: impl IntoIterator<Item = &'e E>) -> Vec<A> {
    list.into_iter().map(A::from).collect()
}
