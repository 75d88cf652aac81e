//! `inspect -o` in a terminal: a pseudo-terminal with somebody who answers.

#![cfg(unix)]
#![allow(clippy::unwrap_used, clippy::panic, reason = "tests")]

use std::io::{Read as _, Write as _};
use std::process::{Command, Stdio};
use std::time::Duration;

use serialport::{SerialPort as _, TTYPort};

const LOG: &str = "t,u,omega,temp\n";

fn written(folder: &std::path::Path) {
    let (mut y, mut text) = (0.0, LOG.to_owned());
    for k in 0..600_u32 {
        let u = f64::from((k / 30 * 7) % 11) - 5.0;
        text.push_str(&format!(
            "{:.2},{u},{y:.5},{}\n",
            0.01 * f64::from(k),
            k % 3
        ));
        y += 0.01 * (12.0 * u - 3.0 * y);
    }
    std::fs::write(folder.join("log.csv"), text).unwrap();
}

/// What the command says in a terminal where somebody types these answers, one for each question.
fn in_a_terminal(folder: &std::path::Path, answers: &[&str]) -> String {
    let (mut person, terminal) = TTYPort::pair().unwrap();
    person.set_timeout(Duration::from_millis(50)).unwrap();
    let path = terminal.name().unwrap();
    let open = || {
        let file = std::fs::File::options().read(true).write(true).open(&path);
        Stdio::from(file.unwrap())
    };
    let mut child = Command::new(env!("CARGO_BIN_EXE_loopsight"))
        .current_dir(folder)
        .env("NO_COLOR", "1")
        .args(["inspect", "log.csv", "-o", "model.toml"])
        .stdin(open())
        .stdout(open())
        .stderr(open())
        .spawn()
        .unwrap();
    let (mut said, mut answered) = (String::new(), 0);
    let mut buffer = [0; 4096];
    for _ in 0..1200 {
        if let Ok(n) = person.read(&mut buffer) {
            said.push_str(&String::from_utf8_lossy(&buffer[..n]));
        }
        if said.matches("]\n").count() + said.matches("]\r\n").count() > answered {
            let answer = answers.get(answered).unwrap_or(&"");
            person.write_all(format!("{answer}\n").as_bytes()).unwrap();
            answered += 1;
        }
        if let Some(status) = child.try_wait().unwrap() {
            // What it said last may still be on the way.
            while let Ok(n) = person.read(&mut buffer) {
                said.push_str(&String::from_utf8_lossy(&buffer[..n]));
                if n == 0 {
                    break;
                }
            }
            assert!(status.success(), "{said}");
            return said;
        }
    }
    child.kill().unwrap();
    panic!("the command waits: {said}");
}

#[test]
fn in_a_terminal_what_is_open_is_asked() {
    let folder = tempfile::tempdir().unwrap();
    written(folder.path());
    // The plant, then whatever is open; Enter for all but the plant.
    let said = in_a_terminal(folder.path(), &["dc_axes", "dc_axis"]);
    for part in [
        "Which plant is it: dc_axis, arm, propeller_pendulum? [dc_axis]",
        "there is no `dc_axes`; did you mean `dc_axis`?",
        "In which unit is `omega`, the speed? [rad/s]",
        "model.toml is a model file",
    ] {
        assert!(said.contains(part), "{part} is not in {said}");
    }
    let model = std::fs::read_to_string(folder.path().join("model.toml")).unwrap();
    assert!(model.contains("[plant.dc_axis]"), "{model}");
    assert!(model.contains("unit = \"rad/s\""), "{model}");
}

#[test]
fn without_a_terminal_nothing_is_asked() {
    let folder = tempfile::tempdir().unwrap();
    written(folder.path());
    let output = Command::new(env!("CARGO_BIN_EXE_loopsight"))
        .current_dir(folder.path())
        .args(["inspect", "log.csv", "-o", "model.toml"])
        .stdin(Stdio::null())
        .output()
        .unwrap();
    assert!(output.status.success(), "{output:?}");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(!said.contains('?'), "{said}");
    let model = std::fs::read_to_string(folder.path().join("model.toml")).unwrap();
    assert!(model.contains("column = \"omega\""), "{model}");
    assert!(model.contains("# a guess; it could be"), "{model}");
}
