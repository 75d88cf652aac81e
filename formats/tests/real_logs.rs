//! Real logs, where their folder is there: they are no part of the project.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a test may panic"
)]

use std::path::PathBuf;

use loopsight_formats::{Format, Input, Log, read};

/// A file of the folder of real measurements.
fn open(file: &str) -> Log {
    let folder = std::env::var_os("LOOPSIGHT_DATA").expect("LOOPSIGHT_DATA names the folder");
    read(Input::open(&PathBuf::from(folder).join(file)).unwrap()).unwrap()
}

/// Number of values, and the sum of those that are finite.
fn figures(log: &Log, path: &str) -> (usize, f64) {
    let values = log.find(path).unwrap().numbers().unwrap();
    let sum = values.iter().filter(|v| v.is_finite()).sum();
    (values.len(), sum)
}

/// Figures by WPILib's own reader (wpiutil 2026.2.2) where it knows the type.
#[test]
#[ignore = "needs the real measurements: LOOPSIGHT_DATA=… cargo test -- --ignored"]
fn a_drive_with_the_frames_of_its_motor_controllers() {
    let log = open("formats/frc-drive-2024.wpilog");
    assert_eq!(log.format, Format::Wpilog);
    assert_eq!((log.cut.as_ref(), log.channels.len()), (None, 120));
    let speed = "NT:/SmartDashboard/Left Encoder Speed (M/s)";
    assert_eq!(figures(&log, speed), (1866, 573.725_307_474_819_6));
    let state = log.find("sysid-test-state-DriveSubsystem").unwrap();
    let words = state.texts().unwrap().words();
    assert!(
        words.contains(&"quasistatic-forward".to_owned()),
        "{words:?}"
    );
    // Each of the four motor controllers has a duty, a voltage, a current, a speed and a position.
    for device in 11..=14 {
        for quantity in [
            "AppliedOutputVoltage",
            "MotorVelocityRPM",
            "MotorPositionRotations",
        ] {
            let path = format!("NT:/URCL/SparkMax-{device}/{quantity}");
            assert!(figures(&log, &path).0 > 3000, "{path}");
        }
    }
    assert_eq!(
        figures(&log, "NT:/URCL/SparkMax-13/BusVoltage"),
        (3518, 44_222.148_437_5)
    );
}

/// Figures by pyulog 1.3.0.
#[test]
#[ignore = "needs the real measurements: LOOPSIGHT_DATA=… cargo test -- --ignored"]
fn a_flight_with_all_its_topics() {
    let log = open("formats/px4-small.ulg");
    assert_eq!(log.format, Format::Ulog);
    assert_eq!((log.channels.len(), log.clocks.len()), (1100, 71));
    // Sums in another order: they agree to the rounding of two thousand terms.
    let (readings, sum) = figures(&log, "actuator_controls_0.control[0]");
    assert_eq!(readings, 1812);
    assert!((sum + 51.047_629_421_756_86).abs() < 1e-9, "{sum}");
}

/// Figures by SciPy 1.17.1.
#[test]
#[ignore = "needs the real measurements: LOOPSIGHT_DATA=… cargo test -- --ignored"]
fn files_of_a_laboratory() {
    let log = open("lab/aeropendulum-identification.mat");
    assert_eq!(figures(&log, "yrad"), (4812, 1_952.662_436_169_497_1));
    assert!(log.notes[0].contains("idnlarx"), "{:?}", log.notes);
    let log = open("lab/dc-motor-aprbs.mat");
    assert_eq!(figures(&log, "y"), (4801, 3_521_882.444_306_896));
}
