//! What the readers make of small logs whose content is known.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a test may panic"
)]

mod common;

use common::mcap::Packed;
use loopsight_formats::{FormatError, Input, Log, read};

fn log(bytes: Vec<u8>) -> Log {
    read(Input::from_bytes(bytes, "log").unwrap()).unwrap()
}

fn numbers(log: &Log, path: &str) -> String {
    let channel = log.find(path);
    let paths = || {
        log.channels
            .iter()
            .map(|c| &c.info.path)
            .collect::<Vec<_>>()
    };
    let channel = channel.unwrap_or_else(|| panic!("{path} in {:?}", paths()));
    format!("{:?}", channel.numbers().unwrap())
}

fn texts(log: &Log, path: &str) -> String {
    let texts = log.find(path).unwrap().texts().unwrap();
    texts
        .iter()
        .map(|t| t.unwrap_or("-"))
        .collect::<Vec<_>>()
        .join(" ")
}

fn time(log: &Log, path: &str) -> String {
    format!("{:?}", log.time(log.find(path).unwrap()).unwrap())
}

#[test]
fn wpilog() {
    let log = log(common::wpilog());
    assert_eq!(numbers(&log, "u"), "[0.0, 1.0, 2.0, 3.0, 4.0, 5.0]");
    assert_eq!(time(&log, "u"), "[0.0, 0.001, 0.002, 0.003, 0.004, 0.005]");
    assert_eq!(log.find("u").unwrap().info.unit.as_deref(), Some("V"));
    assert_eq!(numbers(&log, "speeds[2]"), "[2.0, 3.0, 4.0, 5.0, 6.0, 7.0]");
    assert_eq!(texts(&log, "state"), "up up up down down down");
    assert_eq!(numbers(&log, "pose.n[0]"), "[0.0, 1.0, 2.0, 3.0, 4.0, 5.0]");
    assert_eq!(numbers(&log, "pose.c"), "[5.0, 5.0, 5.0, 5.0, 5.0, 5.0]");
    let speed = "NT:/URCL/SparkMax-11/MotorVelocityRPM";
    assert_eq!(
        numbers(&log, speed),
        "[0.0, 100.0, 200.0, 300.0, 400.0, 500.0]"
    );
    assert_eq!(log.find(speed).unwrap().info.unit.as_deref(), Some("rpm"));
    assert_eq!(
        numbers(&log, "NT:/URCL/SparkMax-11/BusVoltage"),
        "[12.0, 12.0, 12.0, 12.0, 12.0, 12.0]"
    );
}

#[test]
fn ulog() {
    let log = log(common::ulog());
    assert_eq!(
        numbers(&log, "battery.cells[1].v"),
        "[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]"
    );
    assert_eq!(
        numbers(&log, "battery.cells[0].flags[0]"),
        "[0.0, 1.0, 2.0, 3.0, 4.0, 5.0]"
    );
    assert_eq!(texts(&log, "battery.name"), "up up up up up up");
    assert_eq!(
        numbers(&log, "rate[1].n"),
        "[-0.0, -1.0, -2.0, -3.0, -4.0, -5.0]".replace("-0.0", "0.0")
    );
    assert_eq!(
        time(&log, "rate[1].x"),
        "[0.0, 0.001, 0.002, 0.003, 0.004, 0.005]"
    );
    assert_eq!(texts(&log, "logged_messages"), "hello");
}

#[test]
fn mcap_with_json() {
    for packed in [Packed::No, Packed::Lz4, Packed::Zstd] {
        let log = log(common::mcap::json(packed, true));
        assert_eq!(
            numbers(&log, "/drive/u"),
            "[0.0, 1.0, 2.0, 3.0, 4.0]",
            "{packed:?}"
        );
        assert_eq!(
            numbers(&log, "drive.deep.x[1]"),
            "[2.5, 2.5, 2.5, 2.5, 2.5]"
        );
        assert_eq!(
            numbers(&log, "/drive/speed[r]"),
            "[0.0, -1.0, -2.0, -3.0, -4.0]".replace("[0.0", "[-0.0")
        );
        assert_eq!(time(&log, "/drive/u"), "[0.0, 0.01, 0.02, 0.03, 0.04]");
    }
}

#[test]
fn mcap_with_ros_2() {
    let log = log(common::mcap::ros2(Packed::Zstd));
    assert_eq!(
        numbers(&log, "/joint_states/velocity[0]"),
        "[0.0, 1.0, 2.0, 3.0, 4.0]"
    );
    assert_eq!(
        numbers(&log, "/joint_states/velocity[left]"),
        "[0.0, 1.0, 2.0, 3.0, 4.0]"
    );
    assert_eq!(
        numbers(&log, "/joint_states/velocity[right]"),
        "[-0.0, -1.0, -2.0, -3.0, -4.0]"
    );
    assert_eq!(
        numbers(&log, "/joint_states/header/stamp"),
        "[0.0, 0.01, 0.02, 0.03, 0.04]"
    );
    assert_eq!(log.notes, [] as [&str; 0]);
}

#[test]
fn mcap_with_protobuf() {
    let log = log(common::mcap::protobuf());
    assert_eq!(numbers(&log, "/d/u"), "[0.0, 1.0, 2.0, 3.0, 4.0]");
    assert_eq!(numbers(&log, "/d/n"), "[0.0, 1.0, 2.0, 3.0, 4.0]");
    assert_eq!(numbers(&log, "/d/q[1]"), "[1.0, 2.0, 3.0, 4.0, 5.0]");
    assert_eq!(texts(&log, "/d/s"), "up up up up up");
}

#[test]
fn a_flipped_digit_is_found_by_the_checksum() {
    let mut bytes = common::mcap::json(Packed::No, true);
    let at = bytes.windows(6).position(|w| w == b"{\"u\":3").unwrap();
    bytes[at + 5] = b'8';
    let error = read(Input::from_bytes(bytes, "run.mcap").unwrap())
        .unwrap_err()
        .to_string();
    assert!(
        error.starts_with("run.mcap: damaged MCAP at byte"),
        "{error}"
    );
    assert!(error.contains("checksum"), "{error}");
}

#[test]
fn matlab() {
    let log = log(common::mat());
    assert_eq!(
        numbers(&log, "u"),
        "[0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0]"
    );
    assert_eq!(numbers(&log, "y(:,2)"), numbers(&log, "y[1]"));
    assert!(numbers(&log, "y[1]").starts_with("[110.0, 111.0"));
    assert_eq!(texts(&log, "s"), "hi");
    assert_eq!(numbers(&log, "d.b"), "[1.0, 2.0, 3.0]");
    assert_eq!(numbers(&log, "c[0]"), "[9.0]");
}

#[test]
fn numpy() {
    let table = log(common::npy_table());
    assert_eq!(numbers(&table, "t"), "[0.0, 0.01, 0.02, 0.03, 0.04]");
    assert_eq!(numbers(&table, "u[1]"), "[0.0, -1.0, -2.0, -3.0, -4.0]");
    assert_eq!(texts(&table, "s"), "ab ab ab ab ab");
    let archive = log(common::npz());
    assert_eq!(numbers(&archive, "y[1]"), "[1.0, 3.0, 5.0]");
    assert_eq!(numbers(&archive, "z[0]"), "[0.0, 2.0, 4.0]");
}

#[test]
#[cfg(feature = "parquet")]
fn parquet() {
    let log = log(common::tables::parquet());
    assert_eq!(
        numbers(&log, "t"),
        "[0.0, 0.001, 0.002, 0.003, 0.004, 0.005]"
    );
    assert_eq!(numbers(&log, "u"), "[0.0, 1.0, NaN, 3.0, 4.0, 5.0]");
    assert_eq!(numbers(&log, "pose.x"), "[0.5, 1.5, NaN, NaN, 4.5, 5.5]");
    assert_eq!(texts(&log, "s"), "up up up down down down");
}

#[test]
#[cfg(feature = "arrow")]
fn arrow() {
    let one = log(common::tables::arrow_stream());
    assert_eq!(numbers(&one, "u"), "[0.0, 1.0, NaN, 3.0, 4.0, 5.0]");
    assert_eq!(one.find("u").unwrap().info.unit.as_deref(), Some("V"));
    assert_eq!(numbers(&one, "t"), "[0.0, 0.01, 0.02, 0.03, 0.04, 0.05]");
    assert_eq!(texts(&one, "state"), "up up down down up up");
    for packed in [false, true] {
        let file = log(common::tables::arrow_file(packed));
        assert_eq!(file.find("pose.x").unwrap().values.len(), 12);
        assert!(numbers(&file, "pose.x").ends_with("5.0, 0.0, 1.0, 2.0, 3.0, 4.0, 5.0]"));
    }
}

#[test]
#[cfg(feature = "hdf5")]
fn hdf5() {
    let log = log(include_bytes!("fixtures/small.h5").to_vec());
    assert!(numbers(&log, "/log/time_s").starts_with("[0.0, 0.1, 0.2"));
    assert_eq!(
        log.find("/log/time_s").unwrap().info.unit.as_deref(),
        Some("s")
    );
    assert!(numbers(&log, "/log/u[1]").starts_with("[1.0, 3.0, 5.0"));
    assert_eq!(numbers(&log, "/table.b"), "[-1.0, -2.0, -3.0, -4.0]");
    assert_eq!(texts(&log, "/names"), "up down");
}

#[test]
#[cfg(feature = "sqlite")]
fn sqlite() {
    let log = log(common::tables::sqlite());
    assert_eq!(numbers(&log, "/u/data"), "[0.0, 1.0, 2.0, 3.0, 4.0, 5.0]");
    assert_eq!(time(&log, "/u/data"), "[0.0, 0.01, 0.02, 0.03, 0.04, 0.05]");
}

#[test]
fn packed_files_are_unpacked() {
    for packed in [
        common::gzip(&common::wpilog()),
        common::zstd(&common::wpilog()),
    ] {
        let log = log(packed);
        assert_eq!(numbers(&log, "u"), "[0.0, 1.0, 2.0, 3.0, 4.0, 5.0]");
        assert_eq!(log.notes.len(), 1);
    }
    // Frame behind frame, as `cat a.zst b.zst` makes them.
    let text = b"time_s,u\n".to_vec();
    let mut two = common::zstd(&text);
    two.extend(common::zstd(b"0,1\n"));
    let input = Input::from_bytes(two, "log").unwrap();
    assert_eq!(input.into_bytes().unwrap(), b"time_s,u\n0,1\n");
}

#[test]
fn what_is_packed_out_of_proportion_is_refused() {
    let bomb = common::gzip(&vec![0; 40 << 20]);
    let error = Input::from_bytes(bomb, "bomb.gz").unwrap_err();
    assert!(matches!(error, FormatError::TooLarge { .. }), "{error}");
}

/// Whatever is before a cut is read, wherever the cut is.
#[test]
fn a_cut_log_is_read_up_to_the_cut() {
    let first = |log: &Log, path: &str| {
        let channel = log.find(path);
        channel.and_then(|c| c.numbers()).map_or(0, <[f64]>::len)
    };
    for (bytes, path) in [
        (common::wpilog(), "u"),
        (common::ulog(), "rate[1].x"),
        (common::mat(), "u"),
        (common::mcap::json(Packed::No, true), "/drive/u"),
    ] {
        let uncut = log(bytes.clone());
        assert!(uncut.cut.is_none(), "{path}: {:?}", uncut.cut);
        let whole = first(&uncut, path);
        let (mut seen, mut said) = (0, 0);
        for end in (bytes.len() / 3..bytes.len()).step_by(7) {
            let input = Input::from_bytes(bytes[..end].to_vec(), "cut").unwrap();
            let log = read(input).unwrap_or_else(|e| panic!("{path} at {end}: {e}"));
            let now = first(&log, path);
            assert!(now >= seen && now <= whole, "{path} at {end}: {now}");
            said += usize::from(log.cut.is_some());
            seen = now;
        }
        assert!(seen > 0, "{path}");
        // Between two records nothing is missing that could be seen.
        assert!(said > 0, "{path}: never called cut");
    }
}
