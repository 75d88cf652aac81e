//! Measurements made by others on real hardware. They are not part of the project: the folder that
//! holds them is named by the environment variable `LOOPSIGHT_DATA`.

#![allow(clippy::unwrap_used, reason = "helpers of tests")]

use std::path::PathBuf;

use loopsight_core::Signal;
use loopsight_model::log_map::{Column, ColumnMap, Hold, LogMap, Measured};
use loopsight_recordings::{FaultKind, Recording, Severity, Source, map, read};

const DRIVE_INPUTS: [Signal; 2] = [
    Signal::new("voltage_right", "u_r", "V", "."),
    Signal::new("voltage_left", "u_l", "V", "."),
];
const DRIVE_SIGNALS: [Signal; 2] = [
    Signal::new("track_speed_right", "v_r", "m/s", "."),
    Signal::new("track_speed_left", "v_l", "m/s", "."),
];
const AXIS_INPUTS: [Signal; 1] = [Signal::new("voltage", "u", "V", ".")];
const AXIS_SIGNALS: [Signal; 1] = [Signal::new("speed", "w", "rad/s", ".")];

fn open(file: &str) -> Option<Source> {
    let Some(folder) = std::env::var_os("LOOPSIGHT_DATA") else {
        println!("LOOPSIGHT_DATA is not set: nothing was tested against {file}");
        return None;
    };
    Some(read(&PathBuf::from(folder).join(file)).unwrap())
}

fn mapped(source: &Source, inputs: &[Signal], signals: &[Signal], log: &LogMap) -> Recording {
    let recording = map(source, inputs, signals, log).unwrap();
    println!("{}", recording.source);
    for run in &recording.runs {
        println!(
            "  {:15} {:6} samples {:8.3} s",
            run.name(),
            run.len(),
            run.duration()
        );
    }
    for fault in &recording.faults {
        println!("  {:?} {fault}", fault.severity());
    }
    recording
}

fn drive(file: &str) -> Option<(Source, Recording)> {
    let source = open(file)?;
    println!("{}", source.model_toml().unwrap());
    let recording = mapped(&source, &DRIVE_INPUTS, &DRIVE_SIGNALS, &LogMap::default());
    Some((source, recording))
}

fn axis(file: &str) -> Option<Recording> {
    let source = open(file)?;
    println!("{}", source.model_toml().unwrap());
    Some(mapped(
        &source,
        &AXIS_INPUTS,
        &AXIS_SIGNALS,
        &LogMap::default(),
    ))
}

fn kinds(recording: &Recording, at_least: Severity) -> Vec<(FaultKind, &str)> {
    let worse = recording.faults.iter().filter(|f| f.severity() >= at_least);
    worse.map(|f| (f.kind, f.signal.as_str())).collect()
}

fn named(name: &str, unit: Option<&str>) -> ColumnMap {
    ColumnMap::Full(Column {
        column: name.into(),
        unit: unit.map(str::to_owned),
        scale: 1.0,
        scale_unit: None,
        offset: 0.0,
        hold: Hold::ZeroOrder,
    })
}

#[test]
fn team4277_has_a_gyro_rate_off_by_57() {
    let Some((_, log)) = drive("frc/team4277-drivetrain.json") else {
        return;
    };
    assert_eq!(log.runs.len(), 4);
    assert_eq!(
        kinds(&log, Severity::Warning),
        [(FaultKind::GyroScale, "gyro_rate_rad_per_s")]
    );
    assert!(
        log.runs
            .iter()
            .all(|run| run.time()[0] == 0.0 && run.n_measured() == 2)
    );
}

#[test]
fn team157_is_clean() {
    let Some((_, log)) = drive("frc/team157-drivetrain.json") else {
        return;
    };
    assert_eq!(log.runs.len(), 4);
    assert_eq!(kinds(&log, Severity::Warning), []);
}

#[test]
fn team564_straight_has_voltages_with_signs() {
    let Some((source, log)) = drive("frc/team564-drivetrain-linear.json") else {
        return;
    };
    assert_eq!(log.runs.len(), 5);
    // Its encoders have single readings that no wheel could have made.
    let absurd = ["track_speed_right", "track_speed_left"].map(|s| (FaultKind::AbsurdValue, s));
    assert_eq!(kinds(&log, Severity::Warning), absurd);
    assert!(
        log.faults
            .iter()
            .any(|f| f.kind == FaultKind::UnsignedVoltage)
    );
    let Source::SysId(sysid) = source else {
        panic!("SysId")
    };
    let (half_track, _) = sysid.half_track().unwrap();
    assert!((0.27..0.31).contains(&half_track), "{half_track}");
    let backward = log
        .runs
        .iter()
        .find(|run| run.name() == "slow-backward")
        .unwrap();
    let (_, last) = (backward.input(0), backward.input(backward.len() - 1));
    assert!(last[0] < -4.0 && last[1] < -4.0, "{last:?}");
}

#[test]
fn team564_turning_has_its_left_side_reversed() {
    let Some((source, log)) = drive("frc/team564-drivetrain-angular.json") else {
        return;
    };
    assert_eq!(log.runs.len(), 5);
    // Its encoders have single readings that no wheel could have made.
    let absurd = ["track_speed_right", "track_speed_left"].map(|s| (FaultKind::AbsurdValue, s));
    assert_eq!(kinds(&log, Severity::Warning), absurd);
    let forward = log
        .runs
        .iter()
        .find(|run| run.name() == "fast-forward")
        .unwrap();
    let middle = forward.input(forward.len() / 2);
    assert!(middle[0] > 5.0 && middle[1] < -5.0, "{middle:?}");
    let Source::SysId(sysid) = source else {
        panic!("SysId")
    };
    let (half_track, _) = sysid.half_track().unwrap();
    assert!((0.28..0.295).contains(&half_track), "{half_track}");
}

#[test]
fn denham_is_clean() {
    let Some(log) = axis("frc/denham-flywheel.json") else {
        return;
    };
    assert_eq!(log.runs.len(), 4);
    assert_eq!(kinds(&log, Severity::Warning), []);
}

#[test]
fn team581_moves_in_its_short_runs_only() {
    let Some(log) = axis("frc/team581-arm.json") else {
        return;
    };
    assert_eq!(log.runs.len(), 4);
    let found = kinds(&log, Severity::Warning);
    assert!(found.contains(&(FaultKind::ShortRun, "")), "{found:?}");
    assert!(found.contains(&(FaultKind::Motionless, "")), "{found:?}");
}

#[test]
fn dc_motor_and_silverbox_are_clean() {
    let Some(source) = open("dc-motor-deadzone/dc_motor_staircase.csv") else {
        return;
    };
    let log = LogMap {
        inputs: [("voltage".into(), named("u_cmd_V", None))].into(),
        ..LogMap::default()
    };
    let recording = mapped(&source, &AXIS_INPUTS, &AXIS_SIGNALS, &log);
    assert_eq!(recording.faults, []);
    assert_eq!(recording.runs.len(), 1);

    let Some(source) = open("silverbox/silverbox_snls80mV.csv") else {
        return;
    };
    let inputs = [Signal::new("u", "u", "V", ".")];
    let signals = [Signal::new("y", "y", "V", ".")];
    let recording = mapped(&source, &inputs, &signals, &LogMap::default());
    assert_eq!(recording.faults, []);
    assert!((recording.runs[0].duration() - 214.7).abs() < 0.1);
}

#[test]
fn emps_is_clean() {
    for file in [
        "emps/emps_estimation.csv",
        "emps/emps_validation_pulses.csv",
    ] {
        let Some(source) = open(file) else { return };
        let inputs = [Signal::new("force", "f", "N", ".")];
        let signals = [Signal::new("position", "q", "m", ".")];
        let position = Measured {
            column: Some("pos".into()),
            ..Measured::default()
        };
        let log = LogMap {
            measured: [("position".into(), position)].into(),
            ..LogMap::default()
        };
        let recording = mapped(&source, &inputs, &signals, &log);
        assert_eq!(kinds(&recording, Severity::Warning), []);
        assert_eq!(recording.runs.len(), 1);
        assert!((recording.runs[0].duration() - 24.84).abs() < 1e-9);
    }
}
