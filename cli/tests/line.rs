//! The command beside a robot at the end of a line: the firmware's code in a thread.

#![cfg(unix)]
#![allow(clippy::unwrap_used, clippy::panic, reason = "tests")]

#[path = "../../onboard/tests/desk/mod.rs"]
mod desk;
#[path = "../../onboard/tests/twil/mod.rs"]
mod twil;

use std::path::Path;
use std::process::{Command, Output};

use desk::Desk;

/// A robot of its own at `@`: what it is told is the example's model, which knows of no friction.
const LOOP: &str = r#"
model = "model.toml"
period_s = 0.01
duration_s = 20.0
log = "log.csv"

[driver.serial]
line = "@"

[controller.aboard]
law = { settling_time_s = 0.45, damping = 1.0, rule = "paper", limit = 12.0 }

[reference]
linear_velocity = { multi_level = { amplitude = 0.15, hold_s = 1.0, levels = 7, seed = 3 } }
angular_velocity = { multi_level = { amplitude = 0.8, hold_s = 0.7, levels = 7, seed = 4 } }
"#;

fn loopsight(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_loopsight"))
        .current_dir(folder)
        .env("NO_COLOR", "1")
        .args(arguments)
        .output()
        .unwrap()
}

/// What a command that works says on standard output.
fn said(folder: &Path, arguments: &[&str]) -> String {
    let output = loopsight(folder, arguments);
    let text = String::from_utf8(output.stdout).unwrap();
    let complaint = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{arguments:?}: {text}{complaint}");
    text
}

fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let example =
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/twil-firmware/model.toml");
    std::fs::copy(example, folder.path().join("model.toml")).unwrap();
    folder
}

fn write(folder: &Path, name: &str, text: &str, line: &Path) {
    let text = text.replace('@', &line.display().to_string());
    std::fs::write(folder.join(name), text).unwrap();
}

/// The log of a robot at a serial port goes straight into a diagnosis, which finds what its model lacks.
#[test]
fn the_log_of_a_robot_at_a_serial_port_is_diagnosed() {
    let (line, thread) = Desk::with_friction([1.6, 0.3]).at_port();
    let folder = folder();
    write(folder.path(), "loop.toml", LOOP, &line);
    said(folder.path(), &["check", "loop.toml"]);
    let text = said(folder.path(), &["run", "loop.toml"]);
    thread.join().unwrap();
    assert!(text.contains("2000 ticks"), "{text}");
    let text = said(folder.path(), &["diagnose", "model.toml", "log.csv"]);
    let found = "The model lacks coulomb_friction at wheel.right and wheel.left";
    assert!(text.contains(found), "{text}");
}

#[test]
fn a_robot_that_is_not_there_fails_in_words() {
    let folder = folder();
    write(folder.path(), "loop.toml", LOOP, Path::new("/dev/ttyNONE7"));
    let output = loopsight(folder.path(), &["run", "loop.toml"]);
    let complaint = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{complaint}");
    assert!(
        complaint.contains("there is no line `/dev/ttyNONE7`"),
        "{complaint}"
    );
    // It cannot be brought up motor by motor.
    let output = loopsight(folder.path(), &["bringup", "loop.toml"]);
    let complaint = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{complaint}");
    assert!(complaint.contains("runs its loop itself"), "{complaint}");
}
