//! What `[log]` makes of the columns of a table, and of how they are written.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use std::collections::BTreeMap;

use loopsight_core::Signal;
use loopsight_model::log_map::{ColumnMap, LogMap, Measured, Ranges};
use loopsight_recordings::{FaultKind, Recording, RecordingError, map, read_bytes};

const INPUTS: [Signal; 1] = [Signal::new("voltage", "V", "V", "voltage")];
const SIGNALS: [Signal; 2] = [
    Signal::new("speed", "w", "rad/s", "speed"),
    Signal::new("heat", "T", "K", "temperature"),
];

fn mapped(text: &str, log: &LogMap) -> Result<Recording, RecordingError> {
    let source = read_bytes(text.as_bytes(), "log.csv").unwrap();
    map(&source, &INPUTS, &SIGNALS, log)
}

fn said(text: &str, log: &LogMap) -> String {
    mapped(text, log).unwrap_err().to_string()
}

fn from(input: &str, speed: &str) -> LogMap {
    let measured = Measured {
        column: Some(speed.to_owned()),
        ..Measured::default()
    };
    LogMap {
        inputs: BTreeMap::from([("voltage".into(), ColumnMap::Name(input.into()))]),
        measured: BTreeMap::from([("speed".into(), measured)]),
        ..LogMap::default()
    }
}

/// The first input and the first signal of the first run.
fn series(recording: &Recording) -> (Vec<f64>, Vec<f64>) {
    let run = &recording.runs[0];
    let rows = 0..run.len();
    (
        rows.clone().map(|k| run.input(k)[0]).collect(),
        rows.map(|k| run.sample(k)[0]).collect(),
    )
}

#[test]
fn sums_and_differences_in_the_unit_of_the_first() {
    let text =
        "time_s,plus_V,minus_mV,a_rad_per_s,b_rpm\n0,5,1000,1,30\n0.5,6,1000,2,30\n1,7,2000,3,60\n";
    let (input, speed) = series(&mapped(text, &from("plus - minus", "a_rad_per_s + b")).unwrap());
    assert_eq!(input, [4.0, 5.0, 5.0]);
    let pi = std::f64::consts::PI;
    for (found, expected) in speed.iter().zip([1.0 + pi, 2.0 + pi, 3.0 + 2.0 * pi]) {
        assert!((found - expected).abs() < 1e-12, "{found} {expected}");
    }
    let error = said(text, &from("plus - munis_mV", "a_rad_per_s"));
    assert!(
        error.contains("(a column named `munis_mV`); did you mean `minus_mV`?"),
        "{error}"
    );
    let error = said(text, &from("plus - b", "a_rad_per_s"));
    assert!(error.contains("`b_rpm` is in rpm"), "{error}");
}

fn two_seconds() -> String {
    let row = |k: u32| format!("{},{},{}\n", f64::from(k) * 0.1, k, 2 * k);
    let rows: String = (0..41).map(row).collect();
    format!("time_s,voltage_V,speed_rad_per_s\n{rows}")
}

#[test]
fn an_offset_is_added_at_last() {
    let mut log = from("voltage", "speed");
    if let Some(speed) = log.measured.get_mut("speed") {
        (speed.scale, speed.offset) = (Some(2.0), Some(-1.5));
    }
    let text = "time_s,voltage_V,speed_rad_per_s\n0,1,1\n1,2,2\n";
    let (_, speed) = series(&mapped(text, &log).unwrap());
    assert_eq!(speed, [0.5, 2.5]);
}

#[test]
fn rows_and_times_are_cut_out() {
    let text = two_seconds();
    let rows = LogMap {
        rows: Ranges::of([(11.0, 31.0)]),
        ..LogMap::default()
    };
    let recording = mapped(&text, &rows).unwrap();
    let (input, _) = series(&recording);
    assert_eq!((input.len(), input[0], input[20]), (21, 10.0, 30.0));
    assert_eq!(recording.runs[0].time()[0], 0.0);
    let times = LogMap {
        times_s: Ranges::of([(0.0, 1.5), (2.0, 4.0)]),
        ..LogMap::default()
    };
    let recording = mapped(&text, &times).unwrap();
    let names: Vec<&str> = recording.runs.iter().map(|run| run.name()).collect();
    assert_eq!(names, ["0 to 1.5 s", "2 to 4 s"]);
    assert_eq!(recording.runs[1].input(0)[0], 20.0);
    let none = LogMap {
        times_s: Ranges::of([(50.0, 60.0)]),
        ..LogMap::default()
    };
    let error = said(&text, &none);
    assert!(
        error.contains("times_s = [50, 60] has no row; the log has 0 to 4"),
        "{error}"
    );
}

#[test]
fn brackets_degrees_and_capital_letters() {
    let text =
        "Time [ms],Voltage (V),Speed [rpm],heat_degC\n0,1,30,20\n500,2,60,21\n1000,3,60,21\n";
    let recording = mapped(text, &LogMap::default()).unwrap();
    assert_eq!(recording.runs[0].time(), [0.0, 0.5, 1.0]);
    let run = &recording.runs[0];
    assert!((run.sample(0)[0] - std::f64::consts::PI).abs() < 1e-12);
    assert!((run.sample(0)[1] - 293.15).abs() < 1e-9);
    let text = "time_s,voltage_V,heat [°F]\n0,1,68\n1,2,69\n";
    let recording = mapped(text, &LogMap::default()).unwrap();
    assert!((recording.runs[0].sample(0)[0] - 293.15).abs() < 1e-9);
    let text = "time_s,voltage_V,speed_degC\n0,1,68\n1,2,69\n";
    let error = said(text, &LogMap::default());
    assert!(error.contains("`speed_degC` is in degC (K)"), "{error}");
}

#[test]
fn times_of_day_are_seconds() {
    let text =
        "stamp,voltage_V,speed_rad_per_s\n2024-05-01 12:00:00.5,1,2\n2024-05-01 12:00:01.0,1,3\n";
    let recording = mapped(text, &LogMap::default()).unwrap();
    assert_eq!(recording.runs[0].time(), [0.0, 0.5]);
}

#[test]
fn what_is_no_recording_is_refused_with_the_remedy() {
    let none = LogMap::default();
    let error = said("time_s,voltage_V,speed_rpm\n0,1,2\n", &none);
    assert!(error.contains("one row is no recording"), "{error}");
    let text = "time_s,voltage_V,speed_rpm,run\n0,1,2,1\n1,1,2,2\n2,1,2,3\n";
    let error = said(text, &none);
    assert!(error.contains("one row in each of 3 runs"), "{error}");
    let text = "time,voltage_V,speed_rpm\n1714564800125,1,2\n1714564800225,1,2\n";
    let error = said(text, &none);
    assert!(
        error.contains("`time = { column = \"time\", unit = \"ms\" }`"),
        "{error}"
    );
    let text = "time_s,voltage,speed_rpm\n0,on,2\n1,off,3\n";
    let error = said(text, &none);
    assert!(
        error.contains("the text `on`; name another column"),
        "{error}"
    );
    let both = LogMap {
        time: Some(ColumnMap::Name("time_s".into())),
        period_s: Some(0.1),
        ..LogMap::default()
    };
    assert!(said(&two_seconds(), &both).contains("both `time` and `period_s`"));
}

#[test]
fn stamps_of_arrival_are_said_with_the_even_clock() {
    let row = |k: u32| format!("{},{},{}\n", f64::from(k / 4) * 0.4, k % 5, k);
    let rows: String = (0..80).map(row).collect();
    let text = format!("time_s,voltage_V,speed_rpm\n{rows}");
    let recording = mapped(&text, &LogMap::default()).unwrap();
    let fault = recording
        .faults
        .iter()
        .find(|f| f.kind == FaultKind::DuplicateTime)
        .unwrap();
    assert!(
        fault.detail.contains("stamped when they arrived"),
        "{fault}"
    );
    let even = LogMap {
        period_s: Some(0.1),
        ..LogMap::default()
    };
    assert_eq!(mapped(&text, &even).unwrap().runs[0].len(), 80);
}
