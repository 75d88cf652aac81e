//! A robot that runs its loop itself, at a serial port: one of a pair of pseudo terminals.

#![cfg(unix)]
#![allow(clippy::unwrap_used, clippy::panic, reason = "tests")]

mod desk;
mod twil;

use std::path::{Path, PathBuf};

use desk::Desk;
use loopsight_controllers as _;
use loopsight_core::TickError;
use loopsight_drivers as _;
use loopsight_link::{Decoder, Hello, LONGEST, Reply, Request, Welcome, encode};
use loopsight_model::config::TomlSource;
use loopsight_model::loop_file::{Composed, LoopFile};
use loopsight_model::model::Model;
use loopsight_model::registry::{BuildError, DriverContext};

const LOOP: &str = r#"
model = "model.toml"
period_s = 0.01

[driver.serial]
line = "@"
timeout_s = 0.5

[controller.aboard]
law = { settling_time_s = 0.45, damping = 1.0, rule = "paper", limit = 12.0 }

[controller.aboard.rls]
forgetting = 0.999

[reference]
linear_velocity = { sine = { amplitude = 0.1, frequency_hz = 0.3 } }
angular_velocity = { sine = { amplitude = 0.5, frequency_hz = 0.2 } }
"#;

const TOLD: [&str; 7] = ["K_A", "K_B", "K_C", "K_D", "K_E", "K_F", "supply"];

fn composed(line: &Path, text: &str) -> Result<Composed, String> {
    let text = text.replace('@', &line.display().to_string());
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/twil-firmware");
    let source = TomlSource::parse("loop.toml", &text).map_err(|e| e.to_string())?;
    let file = LoopFile::parse(&source).map_err(|e| e.to_string())?;
    let load = |name: &str| Model::load(&folder.join(name)).unwrap().0;
    let model = load(&file.model);
    let context = DriverContext {
        model: &model,
        period: file.period_s,
        load_model: &|name| Ok(load(name)),
        load_runs: &|_, _| Err(BuildError::at("", "no runs here")),
        read_column: &|_, _| Err(BuildError::at("", "no columns here")),
    };
    file.compose(&source, &model, &context)
        .map_err(|e| e.to_string())
}

/// What the first ticks of a loop end with, in the words that a person reads.
fn end_of(line: &Path, text: &str) -> String {
    let mut composed = composed(line, text).unwrap();
    for index in 0..10_000 {
        let end = match composed.tick(f64::from(index) * 0.01) {
            Ok(_) => continue,
            Err(TickError::Driver(error)) => error.to_string(),
            Err(TickError::Control(_)) => composed.host.controller.remark().unwrap().to_owned(),
            Err(other) => panic!("{other:?}"),
        };
        return end;
    }
    panic!("the loop goes on")
}

/// What is read is what the robot did: its references are the host's of one period before, its measurements
/// follow from its commands, and what it learned is told.
#[test]
fn a_robot_with_a_body_of_its_own_is_told_and_heard() {
    let (line, thread) = Desk::with_body().at_port();
    let mut composed = composed(&line, LOOP).unwrap();
    let quantities = composed.host.controller.quantities().to_vec();
    let names: Vec<_> = quantities.iter().map(|q| q.name).collect();
    assert_eq!(names, TOLD);
    let wanted =
        |time: f64| [0.1, 0.5].map(|a| a * (TAU * time * [0.3, 0.2][(a > 0.3) as usize]).sin());
    let (mut body, mut error, mut moved) = (twil::Body::default(), 0.0, 0.0);
    let mut expected = [0.0f32; 2];
    for index in 0..1500 {
        let time = f64::from(index) * 0.01;
        let step = composed.tick(time).unwrap();
        assert!(step.sample.fresh);
        assert_eq!(step.command, step.applied);
        assert_eq!(step.measured, expected.map(f64::from));
        let heard = if index == 0 {
            [0.0; 2]
        } else {
            wanted(time - 0.01)
        };
        for (followed, heard) in step.reference.iter().zip(heard) {
            assert!(
                (followed - heard).abs() < 1e-7,
                "{time} s: {followed} {heard}"
            );
        }
        error += (step.measured[0] - step.reference[0]).powi(2);
        moved += step.reference[0].powi(2);
        let volts = [step.applied[0] as f32, step.applied[1] as f32];
        expected = body.drive(&volts);
    }
    assert!(error < 0.1 * moved, "{error} of {moved}");
    // The model is the robot without its friction: so it moves away from where it started.
    let told = composed.host.controller.told();
    assert_eq!(told[6], 12.0);
    for (value, quantity) in told.iter().zip(&quantities).take(6) {
        let start = quantity.start.unwrap();
        assert!((value - start).abs() > 1e-6, "{}: {value}", quantity.name);
    }
    composed.host.stop().unwrap();
    drop(composed);
    thread.join().unwrap();
}

const TAU: f64 = std::f64::consts::TAU;

/// Ticks of which nothing arrived are there, as ones with nothing new.
#[test]
fn messages_that_get_lost_leave_stale_samples() {
    let mut desk = Desk::with_body();
    desk.loses = vec![100, 101, 102, 250];
    let lost = desk.loses.clone();
    let (line, thread) = desk.at_port();
    let mut composed = composed(&line, LOOP).unwrap();
    let mut before = Vec::new();
    for index in 0..400 {
        let step = composed.tick(f64::from(index) * 0.01).unwrap();
        assert_eq!(step.sample.fresh, !lost.contains(&index), "{index}");
        if !step.sample.fresh {
            assert_eq!(step.measured, before);
        }
        before = step.measured.to_vec();
    }
    drop(composed);
    thread.join().unwrap();
}

#[test]
fn the_reason_of_a_robot_that_stops_is_told() {
    let mut desk = Desk::with_body();
    desk.supply = |tick| if tick < 200 { 12.0 } else { 9.0 };
    let (line, thread) = desk.at_port();
    let weak = LOOP.replace(
        "[reference]",
        "[controller.aboard.safety]\nleast_supply_v = 9.6\n[reference]",
    );
    let end = end_of(&line, &weak);
    assert!(
        end.contains("the supply is below its least voltage"),
        "{end}"
    );
    thread.join().unwrap();

    // A robot without sensors, and one that has them and is measured by its host.
    let (line, thread) = Desk::measured().at_socket();
    let end = end_of(&line, LOOP);
    assert!(
        end.contains("this robot has no sensors of its own"),
        "{end}"
    );
    thread.join().unwrap();
    let (line, thread) = Desk::with_body().at_socket();
    let measured = LOOP
        .replace(
            "serial]\nline = \"@\"\ntimeout_s = 0.5",
            "simulated]\nmodel = \"robot.toml\"",
        )
        .replace("aboard]\n", "aboard]\nline = \"@\"\n");
    let end = end_of(&line, &measured);
    assert!(end.contains("this robot measures itself"), "{end}");
    thread.join().unwrap();
}

#[test]
fn what_is_wrong_with_a_line_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let of = |name: &str| folder.path().join(name);
    let end = end_of(&of("ttyACM7"), LOOP);
    assert!(
        end.contains("there is no line `") && end.contains("serial port"),
        "{end}"
    );
    std::fs::write(of("text"), "no line").unwrap();
    for (path, expected) in [
        (of("text"), "is an ordinary file, expected a serial port"),
        (
            folder.path().to_owned(),
            "is a folder, expected a serial port",
        ),
        (
            PathBuf::from("/dev/null"),
            "is a device of another kind, expected a serial port",
        ),
    ] {
        let end = end_of(&path, LOOP);
        assert!(end.contains(expected), "{end}");
    }
    let left = of("left");
    drop(std::os::unix::net::UnixListener::bind(&left).unwrap());
    let end = end_of(&left, LOOP);
    assert!(end.contains("nobody listens at the socket"), "{end}");
    // Nobody is at the other end, or somebody who says nothing that can be read.
    let (_other, port) = serialport::TTYPort::pair().unwrap();
    let name = PathBuf::from(serialport::SerialPort::name(&port).unwrap());
    let end = end_of(&name, LOOP);
    assert!(
        end.contains("has not answered for 0.5 s") && end.contains("115200 baud"),
        "{end}"
    );
}

#[test]
fn a_robot_that_was_built_otherwise_is_refused() {
    let (line, thread) = Desk::of_period(20_000).at_port();
    let end = end_of(&line, LOOP);
    assert!(end.contains("a period of 0.02 s, expected 0.01 s"), "{end}");
    thread.join().unwrap();

    let socket = tempfile::tempdir().unwrap();
    let path = socket.path().join("old.line");
    let listener = std::os::unix::net::UnixListener::bind(&path).unwrap();
    let old = std::thread::spawn(move || {
        use std::io::{Read as _, Write as _};
        let (mut line, _) = listener.accept().unwrap();
        let mut decoder = Decoder::default();
        let mut byte = [0];
        while let Ok(1) = line.read(&mut byte) {
            if let Some(Ok(Request::Hello(hello))) = decoder.take(byte[0]) {
                let welcome = Welcome {
                    hello: Hello {
                        version: 1,
                        ..hello
                    },
                    period_us: 10_000,
                    plant: "ddmr".try_into().unwrap(),
                };
                let mut frame = [0; LONGEST];
                let length = encode(&Reply::Hello(welcome), &mut frame).unwrap();
                line.write_all(&frame[..length]).unwrap();
            }
        }
    });
    let end = end_of(&path, LOOP);
    assert!(
        end.contains("speaks version 1 of the protocol, expected 2"),
        "{end}"
    );
    old.join().unwrap();
}

#[test]
fn mistakes_are_pointed_at() {
    let cases = [
        (
            "[controller.aboard]\n",
            "[controller.aboard]\nline = \"x\"\n",
            "stands in `[driver.serial]`",
        ),
        ("timeout_s = 0.5", "timeout_s = 0.0", "above 0 s"),
        ("timeout_s = 0.5", "baud = 0", "`baud` is 0"),
        (
            "[reference]",
            "[limits]\nvoltage_left = { magnitude = 9.0 }\n[reference]",
            "nothing here can hold its inputs",
        ),
        (
            "[reference]",
            "[controller.aboard.safety]\nleast_supply_v = -1.0\n[reference]",
            "from 0 V upwards",
        ),
        (
            "serial]\nline = \"@\"\ntimeout_s = 0.5",
            "simulated]\nmodel = \"robot.toml\"",
            "at which line is the robot?",
        ),
    ];
    for (from, to, expected) in cases {
        let changed = LOOP.replace(from, to);
        assert_ne!(changed, LOOP, "{from}");
        let said = composed(Path::new("/nowhere"), &changed).err().unwrap();
        assert!(said.contains(expected), "{said}");
    }
    let (before, _) = LOOP.split_once("[controller.aboard]").unwrap();
    let pid = format!(
        "{before}[controller.feedback_linearizing_pi]\nsettling_time_s = 0.45\nlimit = 12.0\n"
    );
    let said = composed(Path::new("/nowhere"), &pid).err().unwrap();
    assert!(
        said.contains("runs its law itself, and `feedback_linearizing_pi` runs here"),
        "{said}"
    );
}
