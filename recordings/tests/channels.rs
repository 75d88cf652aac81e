//! Logs of other programs, whose channels have time stamps of their own or none at all.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use std::collections::BTreeMap;

use loopsight_core::Signal;
use loopsight_model::log_map::ColumnMap;
use loopsight_model::log_map::{LogMap, Measured};
use loopsight_recordings::{FaultKind, map, read_bytes};
use mcap::records::MessageHeader;
use mcap::{WriteOptions, Writer};

const INPUTS: [Signal; 1] = [Signal::new("voltage", "V", "V", "voltage")];
const SIGNALS: [Signal; 1] = [Signal::new("speed", "w", "rad/s", "speed")];

/// Messages in JSON with their topics and times (ms), as MCAP.
fn mcap(messages: impl IntoIterator<Item = (&'static str, u64, String)>) -> Vec<u8> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    let options = WriteOptions::new().compression(None);
    let mut writer = Writer::with_options(&mut bytes, options).unwrap();
    for (topic, milliseconds, text) in messages {
        let channel = writer
            .add_channel(0, topic, "json", &BTreeMap::new())
            .unwrap();
        let header = MessageHeader {
            channel_id: channel,
            sequence: 0,
            log_time: milliseconds * 1_000_000,
            publish_time: milliseconds * 1_000_000,
        };
        writer
            .write_to_known_channel(&header, text.as_bytes())
            .unwrap();
    }
    writer.finish().unwrap();
    drop(writer);
    bytes.into_inner()
}

/// A command every 100 ms, a sensor every 40 ms from 20 ms on.
fn two_clocks() -> Vec<u8> {
    let commands = (0..5).map(|k| ("command", 100 * k, format!("{{\"u\":{k}}}")));
    let speeds = (0..10).map(|k| ("sensor", 20 + 40 * k, format!("{{\"rpm\":{}}}", 60 * k)));
    mcap(commands.chain(speeds))
}

fn two_topics() -> LogMap {
    LogMap {
        inputs: BTreeMap::from([(
            "voltage".to_owned(),
            ColumnMap::Name("command.u".to_owned()),
        )]),
        measured: BTreeMap::from([(
            "speed".to_owned(),
            Measured {
                column: Some("sensor.rpm".to_owned()),
                unit: Some("rpm".to_owned()),
                ..Measured::default()
            },
        )]),
        ..LogMap::default()
    }
}

#[test]
fn an_input_holds_and_a_signal_counts_where_it_was_measured() {
    let source = read_bytes(&two_clocks(), "two.mcap").unwrap();
    let recording = map(&source, &INPUTS, &SIGNALS, &two_topics()).unwrap();
    let run = &recording.runs[0];
    // 0, 100, … 400 ms and 20, 60, … 380 ms; 100 and 300 ms belong to both.
    let stamps: Vec<f64> = run.time().iter().map(|t| (1000.0 * t).round()).collect();
    assert_eq!(
        stamps,
        [
            0., 20., 60., 100., 140., 180., 200., 220., 260., 300., 340., 380., 400.
        ]
    );
    assert_eq!(
        run.inputs(),
        [0., 0., 0., 1., 1., 1., 2., 2., 2., 3., 3., 3., 4.]
    );
    let measured = run.measured();
    assert!(measured[0].is_nan() && measured[6].is_nan() && measured[12].is_nan());
    assert!((measured[2] - std::f64::consts::TAU).abs() < 1e-12);
    assert_eq!(measured.iter().filter(|v| v.is_nan()).count(), 3);
    // What was never there is no fault of the log.
    let missing = |f: &&loopsight_recordings::Fault| f.kind == FaultKind::NotANumber;
    assert_eq!(recording.faults.iter().find(missing), None);
}

/// The length of the first record is beyond the file.
#[test]
fn a_log_without_channels_says_where_it_is_cut() {
    let mut bytes = two_clocks();
    bytes[9..17].fill(0xff);
    let source = read_bytes(&bytes, "two.mcap").unwrap();
    let error = map(&source, &INPUTS, &SIGNALS, &two_topics()).unwrap_err();
    let wanted =
        "two.mcap: this log has no channels; the file ends too early: a record at byte 8 is cut";
    assert_eq!(error.to_string(), wanted);
}

/// A driver lets the button go for 0.2 s and pushes it again: that test was made twice, and the robot was somewhere else
/// in between.
#[test]
fn a_test_that_is_made_again_is_another_run() {
    const STATE: &str = "sysid-test-state-Drive";
    let state = |ms: u64| match ms {
        1000..2500 | 2700..5000 => "dynamic-forward",
        _ => "none",
    };
    let each = (0..300).map(|k| 20 * k);
    let messages = each.flat_map(|ms| {
        [
            (STATE, ms, format!("{{\"is\":\"{}\"}}", state(ms))),
            ("command", ms, format!("{{\"u\":{}}}", ms % 7)),
            ("sensor", ms, format!("{{\"rpm\":{ms}}}")),
        ]
    });
    let source = read_bytes(&mcap(messages), "tests.mcap").unwrap();
    let with_state = LogMap {
        run: Some(format!("{STATE}.is")),
        ..two_topics()
    };
    let recording = map(&source, &INPUTS, &SIGNALS, &with_state).unwrap();
    let runs: Vec<(&str, f64)> = (recording.runs.iter())
        .map(|run| (run.name(), (1000.0 * run.duration()).round()))
        .collect();
    let expected = [("dynamic-forward", 1480.0), ("dynamic-forward#2", 2280.0)];
    assert_eq!(runs, expected);
}

#[test]
fn a_channel_that_is_not_there_is_named_with_the_nearest() {
    let source = read_bytes(&two_clocks(), "two.mcap").unwrap();
    let mut wrong = two_topics();
    let column = ColumnMap::Name("comand.u".to_owned());
    wrong.inputs.insert("voltage".to_owned(), column);
    let error = map(&source, &INPUTS, &SIGNALS, &wrong)
        .unwrap_err()
        .to_string();
    assert!(error.contains("did you mean `command/u`?"), "{error}");
}

#[test]
fn a_flipped_bit_is_found_by_the_checksum() {
    let whole = two_clocks();
    let text = whole.windows(8).position(|w| w == b"{\"rpm\":6").unwrap();
    let mut flipped = whole.clone();
    flipped[text + 7] ^= 1;
    let error = read_bytes(&flipped, "two.mcap").unwrap_err().to_string();
    assert!(
        error.contains("two.mcap") && error.contains("at byte"),
        "{error}"
    );
}

#[test]
fn rows_without_time_stamps_have_a_period() {
    // Two rows of a NumPy table: a voltage and a speed.
    let header = "{'descr': [('voltage', '<f8'), ('speed', '<f8')], 'fortran_order': False, 'shape': (3,), }";
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    let padded = format!("{header:<117}\n");
    bytes.extend((padded.len() as u16).to_le_bytes());
    bytes.extend(padded.bytes());
    for value in [1.0_f64, 10.0, 2.0, 20.0, 3.0, 30.0] {
        bytes.extend(value.to_le_bytes());
    }
    let source = read_bytes(&bytes, "log.npy").unwrap();
    let error = map(&source, &INPUTS, &SIGNALS, &LogMap::default()).unwrap_err();
    assert!(error.to_string().contains("period_s"), "{error}");
    let log = LogMap {
        period_s: Some(0.5),
        ..LogMap::default()
    };
    let recording = map(&source, &INPUTS, &SIGNALS, &log).unwrap();
    assert_eq!(recording.runs[0].time(), [0.0, 0.5, 1.0]);
    assert_eq!(recording.runs[0].measured(), [10.0, 20.0, 30.0]);
    let none = LogMap {
        period_s: Some(0.0),
        ..LogMap::default()
    };
    let error = map(&source, &INPUTS, &SIGNALS, &none)
        .unwrap_err()
        .to_string();
    assert!(error.contains("expected a time above 0"), "{error}");
}

#[test]
fn time_that_runs_backwards_throughout_is_refused() {
    let rows: String = (0..40)
        .rev()
        .map(|k| format!("{},{},{}\n", 0.01 * f64::from(k), k % 7, k))
        .collect();
    let text = format!("time_s,voltage_V,speed_rad_per_s\n{rows}");
    let source = read_bytes(text.as_bytes(), "back.csv").unwrap();
    let error = map(&source, &INPUTS, &SIGNALS, &LogMap::default()).unwrap_err();
    let error = error.to_string();
    assert!(
        error.starts_with("back.csv: time runs backwards: in `time_s` 39 of 40 rows"),
        "{error}"
    );
}
