//! WPILib SysId logs: JSON that says which mechanism was tested and in what units.
//!
//! `{"test": "Drivetrain", "units": "Meters", "unitsPerRotation": 0.48, "slow-forward": [[…], …]}`
//! with one list of rows for each run. Positions are in rotations, velocities in rotations per
//! second, whatever `units` says; `unitsPerRotation` turns them into `units`. Rows are
//!
//! * drivetrain: time, left V, right V, left and right position, left and right velocity, gyro
//!   angle in rad, gyro rate in rad/s;
//! * drivetrain, older: time, battery V, duty, left V, right V, left and right position, left and
//!   right velocity, gyro angle. Its voltages may be magnitudes; their signs are then taken from
//!   the duty and from the way each side moved, run by run;
//! * everything else: time, V, position, velocity.
//!
//! Format: <https://github.com/wpilibsuite/sysid/blob/main/docs/data-collection.md>.

use loopsight_core::unit::{Unit, parse};
use serde_json::{Map, Value};

use crate::error::RecordingError;
use crate::names::nearest;

mod broken;
mod resting;
mod view;
mod windows;

/// The mechanism that was tested.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TestKind {
    /// Differential drive, driven straight.
    Drivetrain,
    /// Differential drive, turned on the spot.
    DrivetrainAngular,
    /// A motor with inertia: flywheel, turret.
    Simple,
    /// A joint that lifts its arm.
    Arm,
    /// A lift.
    Elevator,
}

impl TestKind {
    const ALL: [(&'static str, TestKind); 5] = [
        ("Drivetrain", TestKind::Drivetrain),
        ("Drivetrain (Angular)", TestKind::DrivetrainAngular),
        ("Simple", TestKind::Simple),
        ("Arm", TestKind::Arm),
        ("Elevator", TestKind::Elevator),
    ];

    /// True for both tests of a differential drive.
    pub fn is_drivetrain(self) -> bool {
        matches!(self, TestKind::Drivetrain | TestKind::DrivetrainAngular)
    }

    /// Name as in the file.
    pub fn name(self) -> &'static str {
        Self::ALL
            .iter()
            .find(|(_, kind)| *kind == self)
            .map_or("", |(name, _)| name)
    }
}

/// A SysId file, as it stands there.
#[derive(Clone, Debug, PartialEq)]
pub struct SysIdLog {
    /// File name.
    pub source: String,
    /// What was tested.
    pub test: TestKind,
    /// Name of the units, e.g. `Meters`.
    pub units: String,
    /// How many of them one rotation makes.
    pub units_per_rotation: f64,
    /// One for each list of rows, in the order of the file.
    pub runs: Vec<SysIdRun>,
}

/// One list of rows of a SysId file.
#[derive(Clone, Debug, PartialEq)]
pub struct SysIdRun {
    /// Its key, e.g. `slow-forward`.
    pub name: String,
    /// Values, row by row, as in the file; NaN: null.
    pub rows: Vec<f64>,
    /// Values in a row.
    pub width: usize,
}

/// Columns of the older drivetrain rows.
const OLD_WIDTH: usize = 10;
const STANDARD_RUNS: [&str; 4] = [
    "slow-forward",
    "slow-backward",
    "fast-forward",
    "fast-backward",
];
const UNITS: [&str; 6] = [
    "Meters",
    "Feet",
    "Inches",
    "Radians",
    "Degrees",
    "Rotations",
];

/// Reads SysId JSON; `log` is what errors call it.
///
/// # Errors
///
/// [`RecordingError`] names the line for broken JSON, and key, run and row otherwise.
pub fn read_sysid(text: &str, log: &str) -> Result<SysIdLog, RecordingError> {
    let json: Value = serde_json::from_str(text).map_err(|e| RecordingError::Json {
        log: log.into(),
        line: e.line(),
        column: e.column(),
        truncated: e.is_eof(),
        message: e.to_string().into(),
    })?;
    let Value::Object(object) = json else {
        return Err(RecordingError::UnknownFormat {
            log: log.into(),
            found: found(&json).into(),
        });
    };
    if !object.contains_key("test") && !object.contains_key("sysid") {
        let keys: Vec<String> = object.keys().take(6).map(|k| format!("`{k}`")).collect();
        return Err(RecordingError::UnknownFormat {
            log: log.into(),
            found: format!("a JSON object with the keys {}", keys.join(", ")).into(),
        });
    }
    let test = test_kind(&object, log)?;
    let units = units(&object, log)?;
    let units_per_rotation = match key(&object, "unitsPerRotation", "a number", log)? {
        Value::Number(n) => n.as_f64().filter(|n| n.is_finite() && *n > 0.0),
        _ => None,
    }
    .ok_or_else(|| RecordingError::SysIdValue {
        log: log.into(),
        key: "unitsPerRotation".into(),
        expected: "a number above 0".into(),
        found: object
            .get("unitsPerRotation")
            .map_or_else(String::new, found)
            .into(),
        nearest: None,
    })?;
    let mut runs = Vec::new();
    for (name, value) in &object {
        match value {
            Value::Array(rows) if is_run(name, rows) => runs.push(run(name, rows, test, log)?),
            other if STANDARD_RUNS.contains(&name.as_str()) => {
                return Err(RecordingError::SysIdValue {
                    log: log.into(),
                    key: name.as_str().into(),
                    expected: "a list of rows".into(),
                    found: found(other).into(),
                    nearest: None,
                });
            }
            _ => {}
        }
    }
    if runs.is_empty() {
        return Err(missing(&object, "slow-forward", "a list of rows", log));
    }
    Ok(SysIdLog {
        source: log.into(),
        test,
        units,
        units_per_rotation,
        runs,
    })
}

fn is_run(name: &str, rows: &[Value]) -> bool {
    STANDARD_RUNS.contains(&name) || matches!(rows.first(), Some(Value::Array(_)))
}

fn key<'o>(
    object: &'o Map<String, Value>,
    name: &'static str,
    expected: &'static str,
    log: &str,
) -> Result<&'o Value, RecordingError> {
    object
        .get(name)
        .ok_or_else(|| missing(object, name, expected, log))
}

fn missing(
    object: &Map<String, Value>,
    key: &'static str,
    expected: &'static str,
    log: &str,
) -> RecordingError {
    RecordingError::SysIdKey {
        log: log.into(),
        key,
        expected,
        nearest: nearest(key, object.keys().map(String::as_str)),
        keys: object.keys().cloned().collect(),
    }
}

fn test_kind(object: &Map<String, Value>, log: &str) -> Result<TestKind, RecordingError> {
    let value = key(object, "test", "the name of a test", log)?;
    let name = value.as_str().unwrap_or("");
    TestKind::ALL
        .iter()
        .find(|(known, _)| *known == name)
        .map(|(_, kind)| *kind)
        .ok_or_else(|| RecordingError::SysIdValue {
            log: log.into(),
            key: "test".into(),
            expected: TestKind::ALL
                .map(|(known, _)| format!("\"{known}\""))
                .join(", ")
                .into(),
            found: found(value).into(),
            nearest: nearest(name, TestKind::ALL.map(|(known, _)| known)),
        })
}

fn units(object: &Map<String, Value>, log: &str) -> Result<String, RecordingError> {
    let value = key(object, "units", "the name of a unit", log)?;
    let name = value.as_str().unwrap_or("");
    let wanted = |unit: &Unit| {
        ["m", "rad"]
            .iter()
            .any(|si| parse(si).is_ok_and(|si| si.dimension == unit.dimension))
    };
    match parse(name) {
        Ok(unit) if wanted(&unit) => Ok(name.to_owned()),
        _ => Err(RecordingError::SysIdValue {
            log: log.into(),
            key: "units".into(),
            expected: UNITS.map(|u| format!("\"{u}\"")).join(", ").into(),
            found: found(value).into(),
            nearest: nearest(name, UNITS),
        }),
    }
}

fn run(name: &str, rows: &[Value], test: TestKind, log: &str) -> Result<SysIdRun, RecordingError> {
    let wrong = |row: usize, expected: &str, found: String| RecordingError::SysIdRow {
        log: log.into(),
        run: name.into(),
        row: row + 1,
        expected: expected.into(),
        found: found.into(),
    };
    let mut out = SysIdRun {
        name: name.into(),
        rows: Vec::new(),
        width: 0,
    };
    for (at, row) in rows.iter().enumerate() {
        let Value::Array(values) = row else {
            return Err(wrong(at, "a list of numbers", found(row)));
        };
        let fits = match (test.is_drivetrain(), out.width) {
            (true, 0) => matches!(values.len(), 9 | OLD_WIDTH),
            (false, 0) => values.len() == 4,
            (_, width) => values.len() == width,
        };
        if !fits {
            let expected = match (out.width, test.is_drivetrain()) {
                (0, true) => "9 numbers (or 10 in the older format)".to_owned(),
                (0, false) => "4 numbers".to_owned(),
                (width, _) => format!("{width} numbers as in the rows before"),
            };
            return Err(wrong(at, &expected, values.len().to_string()));
        }
        out.width = values.len();
        for value in values {
            out.rows.push(match value {
                Value::Null => f64::NAN,
                value => value
                    .as_f64()
                    .ok_or_else(|| wrong(at, "numbers", found(value)))?,
            });
        }
    }
    Ok(out)
}

fn found(value: &Value) -> String {
    match value {
        Value::Null => "null".into(),
        Value::Bool(b) => b.to_string(),
        Value::Number(n) => n.to_string(),
        Value::String(s) => format!("\"{}\"", s.chars().take(60).collect::<String>()),
        Value::Array(list) => format!("a list of {}", list.len()),
        Value::Object(_) => "an object".into(),
    }
}

#[cfg(test)]
mod tests;
