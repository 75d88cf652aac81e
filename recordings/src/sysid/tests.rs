use std::f64::consts::TAU;

use proptest::prelude::*;

use super::*;
use crate::FaultKind;

fn file(test: &str, units: &str, rest: &str) -> String {
    format!(r#"{{"sysid":true,"test":"{test}","units":"{units}","unitsPerRotation":0.5,{rest}}}"#)
}

fn error(text: &str) -> String {
    read_sysid(text, "log.json").unwrap_err().to_string()
}

#[test]
fn units_become_si() {
    let rows = r#""slow-forward":[[1.0,2.0,3.0,4.0]],"extra":[1,2],"note":"x""#;
    let log = read_sysid(&file("Simple", "Meters", rows), "l").unwrap();
    let table = log.table();
    assert_eq!(
        table.column_texts(),
        ["time_s", "voltage_V", "angle_rad", "speed_rad_per_s"]
    );
    assert_eq!(table.runs[0].rows, [1.0, 2.0, 3.0 * TAU, 4.0 * TAU]);

    let rows = r#""slow-forward":[[0,1,2,3,4,5,6,7,8]]"#;
    let log = read_sysid(&file("Drivetrain", "Feet", rows), "l").unwrap();
    let table = log.table();
    let metres = 0.5 * 0.3048;
    assert_eq!(table.columns.len(), 9);
    assert_eq!(table.runs[0].rows[..4], [0.0, 1.0, 2.0, 3.0 * metres]);
    assert_eq!(table.runs[0].rows[6..], [6.0 * metres, 7.0, 8.0]);

    let log = read_sysid(&file("Drivetrain", "Rotations", rows), "l").unwrap();
    assert_eq!(log.table().columns[5].text, "shaft_speed_left_rad_per_s");
    let rows = r#""slow-forward":[[0,1,2,3]]"#;
    let log = read_sysid(&file("Arm", "Degrees", rows), "l").unwrap();
    assert!((log.table().runs[0].rows[2] - 2.0 * 0.5 * TAU / 360.0).abs() < 1e-15);
}

#[test]
fn magnitudes_get_their_signs_back() {
    let rows = r#""slow-forward":[
        [0,12,0.0,4.0,4.0,0,0, 0.0,0.0,0],[1,12,0.2,2.0,2.5,0,0,-1.0,1.0,0]],
      "slow-backward":[[0,12,-0.2,2.0,2.5,0,0,-1.0,-1.0,0]]"#;
    let log = read_sysid(&file("Drivetrain", "Meters", rows), "l").unwrap();
    assert!(log.has_unsigned_voltages());
    let table = log.table();
    assert_eq!(table.columns.len(), 10);
    let voltages = |run: usize, row: usize| {
        let row = &table.runs[run].rows[row * 10..];
        (row[1], row[2])
    };
    assert_eq!(voltages(0, 0), (0.0, 0.0));
    assert_eq!(voltages(0, 1), (-2.0, 2.5));
    assert_eq!(voltages(1, 0), (-2.0, -2.5));
    let notes = log.notes();
    assert_eq!(notes[0].kind, FaultKind::UnsignedVoltage);
    assert!(
        notes[0]
            .detail
            .contains("against each other in slow-forward"),
        "{}",
        notes[0].detail
    );
}

#[test]
fn the_track_is_found_where_the_vehicle_turns() {
    let rows = |sign: f64| {
        let rows: Vec<String> = (0..100)
            .map(|k| {
                let heading = 0.02 * f64::from(k);
                let arc = 0.3 * heading / 0.5; // rotations, half track 0.3 m
                format!("[{k},0,0,{},{},0,0,{},0]", -arc, arc, sign * heading)
            })
            .collect();
        format!("\"turn\":[{}]", rows.join(","))
    };
    let log = read_sysid(&file("Drivetrain", "Meters", &rows(1.0)), "l").unwrap();
    let (half_track, turned) = log.half_track().unwrap();
    assert!(
        (half_track - 0.3).abs() < 1e-9 && turned > 1.0,
        "{half_track} {turned}"
    );
    assert_eq!(log.notes(), []);
    let log = read_sysid(&file("Drivetrain", "Meters", &rows(-1.0)), "l").unwrap();
    assert_eq!(log.notes()[0].kind, FaultKind::ReversedSign);
    assert_eq!(log.notes()[0].severity(), crate::Severity::Warning);
}

#[test]
fn errors_name_key_run_and_row() {
    for (text, says) in [
        (
            r#"{"sysid":true,"tset":"Arm"}"#.to_owned(),
            "log.json: the key \"test\" is missing; expected the name of a test; did you mean `tset`?",
        ),
        (
            r#"{"test":"Simple","units":"Meters","unitPerRotation":1}"#.to_owned(),
            "log.json: the key \"unitsPerRotation\" is missing; expected a number; did you mean `unitPerRotation`?",
        ),
        (
            file("Drivetran", "Meters", "\"a\":1"),
            "log.json: \"test\": expected \"Drivetrain\"",
        ),
        (
            file("Arm", "Metters", "\"a\":1"),
            "log.json: \"units\": expected \"Meters\"",
        ),
        (
            file("Arm", "Volts", "\"a\":1"),
            "log.json: \"units\": expected \"Meters\"",
        ),
        (
            file("Arm", "Meters", "\"a\":1"),
            "log.json: the key \"slow-forward\" is missing",
        ),
        (
            file("Arm", "Meters", "\"slow-forward\":[[1,2,3,4],[1,2,3]]"),
            "log.json: run \"slow-forward\", row 2: expected 4 numbers as in the rows before, found 3",
        ),
        (
            file("Drivetrain", "Meters", "\"slow-forward\":[[1,2,3,4]]"),
            "log.json: run \"slow-forward\", row 1: expected 9 numbers (or 10 in the older format), found 4",
        ),
        (
            file("Arm", "Meters", "\"slow-forward\":[[1,2,3,\"x\"]]"),
            "log.json: run \"slow-forward\", row 1: expected numbers, found \"x\"",
        ),
        (
            file("Arm", "Meters", "\"slow-forward\":7"),
            "log.json: \"slow-forward\": expected a list of rows, found 7",
        ),
    ] {
        let error = error(&text);
        assert!(error.starts_with(says), "{error} | {says}");
    }
    assert!(error(&file("Drivetran", "Meters", "\"a\":1")).ends_with("did you mean `Drivetrain`?"));
    assert!(error(&file("Arm", "Metters", "\"a\":1")).ends_with("did you mean `Meters`?"));
    let zero = r#"{"test":"Arm","units":"Feet","unitsPerRotation":0}"#;
    assert!(error(zero).ends_with("expected a number above 0, found 0"));
}

proptest! {
    #[test]
    fn never_panics(text in any::<String>(), rows in "[\\[\\],0-9nul.e-]{0,60}", kind in 0..5usize) {
        let _ = read_sysid(&text, "l");
        let test = TestKind::ALL[kind].0;
        let text = file(test, "Meters", &format!("\"slow-forward\":[{rows}]"));
        if let Ok(log) = read_sysid(&text, "l") {
            let _ = (log.table(), log.notes(), log.model_toml(), log.without_rest());
        }
    }
}
