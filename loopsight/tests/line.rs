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

/// Waits until the door of a run is open, at most five seconds.
fn wait_for(door: &Path) {
    let opened = (0..1000).any(|_| {
        std::thread::sleep(std::time::Duration::from_millis(5));
        door.exists()
    });
    assert!(opened);
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
    let log = std::fs::read_to_string(folder.path().join("log.csv")).unwrap();
    let (names, _) = log.split_once('\n').unwrap();
    assert!(names.ends_with("fresh_1,aboard_supply_V"), "{names}");
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

/// Firmware that does not look at its own sensors: the host does.
#[test]
fn a_robot_that_measures_no_number_fails_in_words() {
    let mut desk = Desk::with_body();
    desk.mad_from = Some(50);
    let (line, thread) = desk.at_port();
    let folder = folder();
    write(folder.path(), "loop.toml", LOOP, &line);
    let output = loopsight(folder.path(), &["run", "loop.toml"]);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(said.contains("sent NaN among its measurements"), "{said}");
    thread.join().unwrap();
}

/// What the file of a run does not declare changeable stays, and the robot drives on with it.
#[test]
fn what_is_not_declared_changeable_is_refused_at_the_door() {
    let folder = folder();
    let mut desk = Desk::with_body();
    desk.by_clock = true;
    let (line, thread) = desk.at_port();
    let door = folder.path().join("door");
    let with_door = LOOP
        .replace(
            "[reference]",
            "[controller.aboard.safety]\nwatchdog_s = 5.0\n\n[reference]",
        )
        .replace(
            "[controller.aboard]\n",
            &format!("[controller.aboard]\ndoor = \"{}\"\n", door.display()),
        )
        .replace("duration_s = 20.0", "duration_s = 4.0");
    write(folder.path(), "loop.toml", &with_door, &line);
    let faster = with_door.replace("settling_time_s = 0.45", "settling_time_s = 0.3");
    write(folder.path(), "faster.toml", &faster, &line);
    std::thread::scope(|scope| {
        let run = scope.spawn(|| said(folder.path(), &["run", "loop.toml"]));
        wait_for(&door);
        let output = loopsight(folder.path(), &["send", "faster.toml"]);
        let complaint = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(1), "{complaint}");
        assert!(
            complaint.contains("does not declare `changeable`"),
            "{complaint}"
        );
        let text = run.join().unwrap();
        assert!(
            text.contains("another model was refused at the door"),
            "{text}"
        );
        assert!(text.contains("400 ticks"), "{text}");
    });
    thread.join().unwrap();
}

/// A robot that waits takes what it is sent, and says so; what it does not know is refused by name.
#[test]
fn a_robot_that_waits_is_sent_a_model() {
    let folder = folder();
    let friction = "\n[[effect]]\n[effect.coulomb_friction]\nat = [\"wheel.right\", \"wheel.left\"]\nlevel = 1.5\n";
    let model = std::fs::read_to_string(folder.path().join("model.toml")).unwrap();
    std::fs::write(folder.path().join("model.toml"), model.clone() + friction).unwrap();
    let (line, thread) = Desk::with_body().at_port();
    write(folder.path(), "loop.toml", LOOP, Path::new("/dev/ttyNONE7"));
    let line = line.display().to_string();
    let text = said(folder.path(), &["send", "loop.toml", "--line", &line]);
    let first = format!("the robot at {line} (ddmr, every 0.01 s) took it, and is at rest\n");
    assert!(text.starts_with(&first), "{text}");
    let told = "coulomb_friction at wheel.right, wheel.left: level 1.5 V, width 0.1 rad/s";
    assert!(text.contains(told), "{text}");
    thread.join().unwrap();

    // Nothing of this reaches a line.
    let lag =
        "\n[[effect]]\n[effect.actuator_lag]\nat = [\"input.right\", \"input.left\"]\nlag = 0.05\n";
    std::fs::write(folder.path().join("model.toml"), model + lag).unwrap();
    let output = loopsight(folder.path(), &["send", "loop.toml"]);
    let complaint = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{complaint}");
    let expected = "the effect `actuator_lag` of the model is not known aboard";
    assert!(complaint.contains(expected), "{complaint}");
    let (before, _) = LOOP.split_once("[controller.aboard]").unwrap();
    let here = "[controller.feedback_linearizing_pi]\nsettling_time_s = 0.45\nlimit = 12.0\n";
    std::fs::write(folder.path().join("here.toml"), before.to_owned() + here).unwrap();
    let output = loopsight(folder.path(), &["send", "here.toml"]);
    let complaint = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{complaint}");
    assert!(complaint.contains("runs here"), "{complaint}");
}

/// A robot that drives by its own timer is told a better model through the run that drives it, and goes on; the
/// log has every tick, each of them fresh, and says when it was told.
#[test]
fn a_robot_that_drives_is_sent_a_better_model() {
    let folder = folder();
    let mut desk = Desk::with_friction([1.6, 0.3]);
    // By its own timer, as on a board: there is time for a second command.
    desk.by_clock = true;
    let (line, thread) = desk.at_port();
    let door = folder.path().join("door");
    // This machine may be busy with other things.
    let patient = "[controller.aboard.safety]\nwatchdog_s = 5.0\n\n[reference]";
    let with_door = LOOP
        .replace("[reference]", patient)
        .replace(
            "[controller.aboard]\n",
            &format!(
                "[controller.aboard]\ndoor = \"{}\"\nchangeable = {{ effects = [\"coulomb_friction\"] }}\n",
                door.display()
            ),
        )
        .replace("duration_s = 20.0", "duration_s = 6.0");
    write(folder.path(), "loop.toml", &with_door, &line);
    let friction = "\n[[effect]]\n[effect.coulomb_friction]\nat = [\"wheel.right\", \"wheel.left\"]\nlevel = 1.6\nwidth = 0.3\n";
    let model = std::fs::read_to_string(folder.path().join("model.toml")).unwrap();
    std::fs::write(folder.path().join("better.toml"), model + friction).unwrap();
    write(
        folder.path(),
        "better_loop.toml",
        &with_door.replace("\"model.toml\"", "\"better.toml\""),
        &line,
    );
    let run = std::thread::scope(|scope| {
        let run = scope.spawn(|| said(folder.path(), &["run", "loop.toml"]));
        wait_for(&door);
        let text = said(folder.path(), &["send", "better_loop.toml"]);
        let first = format!(
            "the robot at {} (ddmr, every 0.01 s) drives on with it\n",
            door.display()
        );
        assert!(text.starts_with(&first), "{text}");
        run.join().unwrap()
    });
    thread.join().unwrap();
    let event = "the robot was told another model, with coulomb_friction";
    assert!(run.contains(event), "{run}");
    let log = std::fs::read_to_string(folder.path().join("log.csv")).unwrap();
    let told: Vec<_> = log.lines().filter(|l| l.contains(event)).collect();
    assert_eq!(told.len(), 1, "{told:?}");
    let mut rows = log.lines().filter(|l| !l.starts_with('#'));
    let names: Vec<_> = rows.next().unwrap().split(',').collect();
    let fresh = names.iter().position(|n| *n == "fresh_1").unwrap();
    let rows: Vec<_> = rows.map(|row| row.split(',').nth(fresh).unwrap()).collect();
    assert_eq!(rows, ["1"; 600]);
    assert!(!door.exists());
}
