//! Every bad input ends with a message and exit status 2: never with a panic, and never with a
//! result. The message says where, and what would have been right.

#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a command that breaks its word is how this program fails"
)]

mod bounded;
mod defaults;
mod files;
mod logs;
mod loops;
mod models;
mod requests;

use std::ffi::OsStr;
use std::path::PathBuf;
use std::time::Duration;

use assert_cmd::Command;
use loopsight_tests::{repository, twil_path};
use tempfile::TempDir;

const PROGRAM: &str = env!("CARGO_BIN_EXE_loopsight-under-test");

/// A folder with files that are right, to be spoilt.
struct Desk(TempDir);

const EXPERIMENT: &str = "duration_s = 2.0\nperiod_s = 0.01\n\n[inputs]\n\
    voltage_right = { prbs = { amplitude = 9.0, hold_s = 0.5, seed = 3 } }\n";

const LOOP: &str = "model = \"model.toml\"\nperiod_s = 0.01\nduration_s = 1.0\nlog = \"run.csv\"\n\n\
    [driver.simulated]\nlimit = 12.0\n\n\
    [controller.feedback_linearizing_pi]\nsettling_time_s = 0.45\n\n\
    [reference]\nlinear_velocity = { steps = { at = [[0.5, 0.1]] } }\n";

impl Desk {
    fn new() -> Self {
        let desk = Self(tempfile::tempdir().unwrap());
        desk.write("model.toml", model_text());
        desk.write("experiment.toml", EXPERIMENT);
        desk.write("loop.toml", LOOP);
        desk.write("log.csv", log_text());
        std::fs::create_dir(desk.path("folder")).unwrap();
        desk.write("binary", [0x7f, b'E', b'L', b'F', 0, 1, 0xff, 0xfe, 0]);
        desk
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn write(&self, name: &str, bytes: impl AsRef<[u8]>) {
        std::fs::write(self.path(name), bytes).unwrap();
    }

    fn output(&self, arguments: &[&OsStr]) -> std::process::Output {
        Command::new(PROGRAM)
            .current_dir(self.0.path())
            .args(arguments)
            .env("COLUMNS", "100")
            .timeout(Duration::from_secs(20))
            .output()
            .unwrap()
    }

    /// Runs what must be refused as a bad request; returns the message.
    fn refused(&self, arguments: &[&str]) -> String {
        let words: Vec<&OsStr> = arguments.iter().map(OsStr::new).collect();
        self.refused_words(&words)
    }

    fn refused_words(&self, arguments: &[&OsStr]) -> String {
        let output = self.output(arguments);
        let text = String::from_utf8_lossy(&output.stderr).into_owned();
        let shown = String::from_utf8_lossy(&output.stdout);
        assert_eq!(
            output.status.code(),
            Some(2),
            "{arguments:?}: {text}{shown}"
        );
        assert!(
            text.chars().count() > 10 && !text.contains("panicked"),
            "{arguments:?}: {text}"
        );
        text
    }

    /// As [`Desk::refused`], with words that the message must hold.
    fn refused_saying(&self, arguments: &[&str], words: &[&str]) {
        let text = self.refused(arguments);
        for word in words {
            assert!(
                text.contains(word),
                "{arguments:?}: `{word}` is not in: {text}"
            );
        }
    }
}

fn model_text() -> String {
    std::fs::read_to_string(twil_path()).unwrap()
}

/// Two seconds of the example's log.
fn log_text() -> String {
    let text = std::fs::read_to_string(repository().join("examples/twil/prbs.csv")).unwrap();
    text.lines().take(202).map(|l| format!("{l}\n")).collect()
}

/// The log with one field changed; line and field from 1.
fn with_field(line: usize, field: usize, value: &str) -> String {
    edit_fields(|at, i| (at == line && i + 1 == field).then_some(value))
}

fn edit_fields<'a>(new: impl Fn(usize, usize) -> Option<&'a str>) -> String {
    let text = log_text();
    let edited = text.lines().enumerate().map(|(at, row)| {
        let fields: Vec<&str> = row
            .split(',')
            .enumerate()
            .map(|(i, old)| new(at + 1, i).unwrap_or(old))
            .collect();
        format!("{}\n", fields.join(","))
    });
    edited.collect()
}

#[test]
fn what_is_right_is_accepted() {
    let desk = Desk::new();
    for arguments in [
        &[
            "check",
            "model.toml",
            "experiment.toml",
            "loop.toml",
            "log.csv",
        ][..],
        &["compare", "model.toml", "log.csv"],
        &["run", "loop.toml"],
    ] {
        let words: Vec<&OsStr> = arguments.iter().map(OsStr::new).collect();
        let output = desk.output(&words);
        let text = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(0), "{arguments:?}: {text}");
    }
}
