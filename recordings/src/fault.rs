//! A fault of a log: what it is, where it shows, and how much it matters.

use std::fmt;

use loopsight_core::unit::split_name;
use serde::{Deserialize, Serialize};

/// Kinds of faults a log can have.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FaultKind {
    /// Time stamps that go backwards; the rows were left out.
    NonMonotoneTime,
    /// Rows with the time stamp of the row before; they were left out.
    DuplicateTime,
    /// A hole in the time stamps; the run was split there.
    Gap,
    /// Time stamps far from equidistant.
    IrregularTime,
    /// Missing samples.
    NotANumber,
    /// Samples of a magnitude that cannot be; they count as missing.
    AbsurdValue,
    /// A sensor that never moves although it should.
    DeadSensor,
    /// A sensor that stands still in part of the log, or in all of it with some excuse.
    ConstantSensor,
    /// An input that never changes.
    ConstantInput,
    /// Nothing moves.
    Motionless,
    /// A signal with the wrong sign.
    ReversedSign,
    /// A rate that is not the derivative of its angle, by the factor between degrees and radians.
    GyroScale,
    /// A rate that is not the derivative of its position, by another factor.
    RateScale,
    /// A run too short to learn from.
    ShortRun,
    /// A run without rows.
    EmptyRun,
    /// A run that is not of the same machine in the same state as the others.
    BrokenRun,
    /// A run that rests before it moves; the rest was left out.
    RestingStart,
    /// Voltages logged as magnitudes; their signs were reconstructed.
    UnsignedVoltage,
    /// An angle that begins anew after each turn, or a counter that runs over; it was taken as going on.
    Wrapped,
    /// A column that does not say its unit; SI was assumed.
    UnitAssumed,
    /// A column whose `scale` does once more what its unit does already.
    ScaledTwice,
    /// A file that ends too early; what is before the cut was read.
    CutLog,
    /// A length that cannot be.
    Implausible,
}

impl FaultKind {
    /// Name as in JSON.
    pub fn name(self) -> &'static str {
        match self {
            FaultKind::NonMonotoneTime => "non_monotone_time",
            FaultKind::DuplicateTime => "duplicate_time",
            FaultKind::Gap => "gap",
            FaultKind::IrregularTime => "irregular_time",
            FaultKind::NotANumber => "not_a_number",
            FaultKind::AbsurdValue => "absurd_value",
            FaultKind::DeadSensor => "dead_sensor",
            FaultKind::ConstantSensor => "constant_sensor",
            FaultKind::ConstantInput => "constant_input",
            FaultKind::Motionless => "motionless",
            FaultKind::ReversedSign => "reversed_sign",
            FaultKind::GyroScale => "gyro_scale",
            FaultKind::RateScale => "rate_scale",
            FaultKind::ShortRun => "short_run",
            FaultKind::EmptyRun => "empty_run",
            FaultKind::BrokenRun => "broken_run",
            FaultKind::RestingStart => "resting_start",
            FaultKind::UnsignedVoltage => "unsigned_voltage",
            FaultKind::Wrapped => "wrapped",
            FaultKind::UnitAssumed => "unit_assumed",
            FaultKind::ScaledTwice => "scaled_twice",
            FaultKind::CutLog => "cut_log",
            FaultKind::Implausible => "implausible",
        }
    }
}

impl fmt::Display for FaultKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// How much a fault matters to a fit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Severity {
    /// Good to know.
    Note,
    /// A part of the log is lost or doubtful; the rest can be used.
    Warning,
    /// A fit to this log would mean nothing.
    Fatal,
}

/// A fault of a log; one entry for each kind and signal.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Fault {
    /// What it is.
    pub kind: FaultKind,
    /// The runs it shows in, separated by commas; empty: the log as a whole.
    #[serde(default)]
    pub run: String,
    /// Id of the signal; the header for a column that the model does not use; may be empty.
    pub signal: String,
    /// What was seen, with figures.
    pub detail: String,
}

impl Fault {
    /// How much it matters. A fault of a column that the model does not use is never fatal, nor
    /// is one that only some runs have, but for a run that is broken: it would be explained by physics
    /// that is not there.
    pub fn severity(&self) -> Severity {
        // Ids of signals carry no unit, headers do.
        let unused_column = split_name(&self.signal).1.is_some();
        let whole_log = self.run.is_empty();
        match self.kind {
            FaultKind::DuplicateTime
            | FaultKind::IrregularTime
            | FaultKind::RestingStart
            | FaultKind::UnsignedVoltage
            | FaultKind::Wrapped
            | FaultKind::UnitAssumed => Severity::Note,
            FaultKind::BrokenRun => Severity::Fatal,
            FaultKind::DeadSensor
            | FaultKind::Motionless
            | FaultKind::ReversedSign
            | FaultKind::GyroScale
            | FaultKind::ShortRun
            | FaultKind::EmptyRun
                if whole_log && !unused_column =>
            {
                Severity::Fatal
            }
            _ => Severity::Warning,
        }
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.kind)?;
        if !self.signal.is_empty() {
            write!(f, " `{}`", self.signal)?;
        }
        if !self.run.is_empty() {
            write!(f, " in run {}", self.run)?;
        }
        write!(f, ": {}", self.detail)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn json_is_flat_and_snake_case() {
        let fault = Fault {
            kind: FaultKind::DeadSensor,
            run: String::new(),
            signal: "speed".into(),
            detail: "never moves".into(),
        };
        let json = serde_json::to_value(&fault).unwrap();
        assert_eq!(json["kind"], "dead_sensor");
        assert_eq!(json["kind"], fault.kind.name());
        assert_eq!(json["signal"], "speed");
        assert_eq!(fault.to_string(), "dead_sensor `speed`: never moves");
    }

    #[test]
    fn severity_depends_on_whether_the_model_needs_it() {
        let mut fault = Fault {
            kind: FaultKind::GyroScale,
            run: String::new(),
            signal: "angular_velocity".into(),
            detail: String::new(),
        };
        assert_eq!(fault.severity(), Severity::Fatal);
        fault.signal = "gyro_rate_rad_per_s".into();
        assert_eq!(fault.severity(), Severity::Warning);
        fault.signal = "speed".into();
        fault.run = "slow".into();
        assert_eq!(fault.severity(), Severity::Warning);
        fault.kind = FaultKind::IrregularTime;
        assert_eq!(fault.severity(), Severity::Note);
    }
}
