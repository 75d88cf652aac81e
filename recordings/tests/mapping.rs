//! What `[log]` makes of the columns of a table, and of how they are written.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use std::collections::BTreeMap;

use loopsight_core::Signal;
use loopsight_model::log_map::{ColumnMap, Labels, LogMap, Measured, Ranges};
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
fn a_scale_that_converts_once_more_is_told() {
    let text = "time_s,u_V,w_rpm\n0,5,30\n0.5,6,60\n1,7,90\n";
    let told = |scale: f64, unit: Option<&str>| {
        let mut log = from("u_V", "w_rpm");
        let speed = log.measured.get_mut("speed").unwrap();
        (speed.scale, speed.unit) = (Some(scale), unit.map(str::to_owned));
        let recording = mapped(text, &log).unwrap();
        let faults = recording.faults.iter();
        let twice = faults.filter(|f| f.kind == FaultKind::ScaledTwice);
        twice.map(|f| f.detail.clone()).next()
    };
    let detail = told(0.10472, None).unwrap();
    assert!(
        detail.contains("is in rpm") && detail.contains("`unit = \"rad/s\"`"),
        "{detail}"
    );
    for (scale, unit) in [
        (1.0, None),
        (-1.0, None),
        (0.5, None),
        (0.10472, Some("rad/s")),
    ] {
        assert_eq!(told(scale, unit), None, "{scale}");
    }
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

/// As other programs export channels with times of their own: a row for each stamp, empty where nothing was logged.
#[test]
fn an_input_with_times_of_its_own_holds_its_last_value() {
    let row = |k: u32| match k % 4 {
        1 => format!("{},{k},\n", f64::from(k) * 0.1),
        _ => format!("{},,{}\n", f64::from(k) * 0.1, 10 * k),
    };
    let rows: String = (0..12).map(row).collect();
    let text = format!("time_s,voltage_V,speed_rad_per_s\n{rows}");
    let recording = mapped(&text, &LogMap::default()).unwrap();
    let run = &recording.runs[0];
    // What the input was in the first row is not known.
    assert_eq!(run.inputs(), [1., 1., 1., 1., 5., 5., 5., 5., 9., 9., 9.]);
    assert!(run.measured()[0].is_nan());
    assert_eq!(run.measured()[1..4], [20.0, 30.0, 40.0]);
    assert!(
        recording
            .faults
            .iter()
            .all(|f| f.kind != FaultKind::NotANumber)
    );
    // A part begins with what was commanded before it.
    let part = LogMap {
        rows: Ranges::of([(4.0, 6.0)]),
        ..LogMap::default()
    };
    assert_eq!(
        mapped(&text, &part).unwrap().runs[0].inputs(),
        [1.0, 1.0, 5.0]
    );
    // One that is lost here and there is not.
    let lost = two_seconds().replace("\n1,10,", "\n1,,");
    let error = said(&lost, &LogMap::default());
    assert!(
        error.contains("line 12, column 2") && error.contains("an input must have a value"),
        "{error}"
    );
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

/// Two experiments of a table: the second is shorter, and its commands are in another column.
#[test]
fn experiments_side_by_side_are_runs() {
    let row = |k: u32| {
        let second = match k {
            2..30 => format!("{},{}", 3 * k, 4 * k),
            _ => ",".to_owned(),
        };
        format!("{},{k},{},{second}\n", f64::from(k) * 0.1, 2 * k)
    };
    let rows: String = (0..41).map(row).collect();
    let text = format!("time_s,u1,y1_rpm,u2,y2_rpm\n{rows}");
    let mut log = LogMap {
        side_by_side: Labels::of(["1", "2"]),
        ..from("u{}", "y{}")
    };
    let recording = mapped(&text, &log).unwrap();
    let runs: Vec<_> = recording.runs.iter().map(|r| (r.name(), r.len())).collect();
    assert_eq!(runs, [("1", 41), ("2", 28)]);
    let second = &recording.runs[1];
    assert_eq!((second.time()[0], second.input(1)[0]), (0.0, 9.0));
    let rpm = std::f64::consts::PI / 30.0;
    assert!((second.sample(1)[0] - 12.0 * rpm).abs() < 1e-12);
    // What is so in both is said once.
    let units: Vec<&str> = (recording.faults.iter())
        .filter(|f| f.kind == FaultKind::UnitAssumed)
        .map(|f| f.detail.as_str())
        .collect();
    let said_once =
        "the column `u1` does not say its unit; taken as V; so it is in each of 2 experiments";
    assert_eq!(units, [said_once]);

    log.side_by_side = Labels::of(["1", "2", "3"]);
    let error = said(&text, &log);
    assert!(
        error.contains("`u3`") && error.contains("did you mean `u"),
        "{error}"
    );
    let shared = LogMap {
        side_by_side: Labels::of(["1", "2"]),
        ..from("u1", "y1")
    };
    let error = said(&text, &shared);
    assert!(error.contains("no column in [log] has `{}`"), "{error}");
}
