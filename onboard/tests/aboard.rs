//! A loop file whose law runs at the other end of a line: here a thread with the same code as the firmware.

#![cfg(unix)]
#![allow(clippy::unwrap_used, clippy::panic, reason = "tests")]

mod desk;
mod twil;

use std::path::{Path, PathBuf};
use std::thread::JoinHandle;

use desk::Desk;
use loopsight_core::{ControlError, TickError};
use loopsight_drivers as _;
use loopsight_model::config::TomlSource;
use loopsight_model::loop_file::{Composed, LoopFile};
use loopsight_model::model::Model;
use loopsight_model::registry::{BuildError, DriverContext, effects};
use loopsight_onboard::{EffectSet, Parts, Twil, acts_aboard};
use loopsight_plants as _;

/// A robot at a socket: it hears `steps` steps, and then hangs up.
fn robot(steps: usize) -> (PathBuf, JoinHandle<()>) {
    let mut desk = Desk::measured();
    desk.steps = steps;
    desk.at_socket()
}

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/twil-firmware")
}

/// The example's loop with its line at `socket`, `change`d, and with friction known to it or not.
fn compose(
    socket: &Path,
    model: &str,
    change: impl Fn(String) -> String,
) -> Result<(LoopFile, Composed), String> {
    let text = std::fs::read_to_string(folder().join("loop.toml")).unwrap();
    // Tests run side by side: none of them opens the example's door.
    let text: String = text
        .split_inclusive('\n')
        .filter(|line| !line.starts_with("door"))
        .collect();
    let text = change(text.replace("/tmp/twil.line", &socket.display().to_string()));
    let source = TomlSource::parse("loop.toml", &text).map_err(|e| e.to_string())?;
    let file = LoopFile::parse(&source).map_err(|e| e.to_string())?;
    let load = |name: &str| Model::load(&folder().join(name)).unwrap().0;
    let model = load(model);
    let context = DriverContext {
        model: &model,
        period: 0.01,
        load_model: &|name| Ok(load(name)),
        load_runs: &|_, _| Err(BuildError::at("", "no runs here")),
        read_column: &|_, _| Err(BuildError::at("", "no columns here")),
    };
    let composed = file.compose(&source, &model, &context);
    Ok((file, composed.map_err(|e| e.to_string())?))
}

/// Sum of the squared distances of the forward speed from what the law promises, over the example's 45 s.
fn error(file: &LoopFile, composed: &mut Composed) -> f64 {
    let (mut references, mut measured) = ([vec![], vec![]], Vec::new());
    for index in 0..4500 {
        let step = composed.tick(f64::from(index) * 0.01).unwrap();
        for (list, value) in references.iter_mut().zip(step.reference) {
            list.push(*value);
        }
        measured.push(step.measured[0]);
    }
    let ideal = file.controller.ideal(&references, 0.01).unwrap();
    let distances = measured.iter().zip(&ideal[0]).map(|(y, i)| (y - i).powi(2));
    distances.sum()
}

/// The same loop file drives the robot at the end of the line as one that knows of its friction, and one
/// that does not; as on a host, to know is better.
#[test]
fn a_loop_file_drives_what_is_at_the_end_of_the_line() {
    let mut errors = [0.0; 2];
    for (error_of, model) in errors.iter_mut().zip(["model.toml", "robot.toml"]) {
        let (socket, thread) = robot(usize::MAX);
        let (file, mut composed) = compose(&socket, model, |text| text).unwrap();
        *error_of = error(&file, &mut composed);
        drop(composed);
        thread.join().unwrap();
    }
    let [without, with] = errors;
    assert!(with < 0.25 * without, "{with} {without}");
}

/// Commands of the law aboard are those of the law on the host, but for single precision.
#[test]
fn the_law_aboard_is_the_law_on_the_host() {
    let (socket, thread) = robot(usize::MAX);
    // Exact speeds: a count more or less would be another run.
    let exact = |text: String| text.replace("seed = 6", "quantize = false");
    let (_, mut aboard) = compose(&socket, "robot.toml", exact).unwrap();
    let here = |text: String| {
        let text = exact(text);
        let (before, rest) = text.split_once("[controller.aboard]").unwrap();
        let (_, after) = rest.split_once("[reference]").unwrap();
        let law = "settling_time_s = 0.45\ndamping = 1.0\nrule = \"paper\"\nlimit = 12.0";
        format!("{before}[controller.feedback_linearizing_pi]\n{law}\n[reference]{after}")
    };
    let (_, mut host) = compose(&socket, "robot.toml", here).unwrap();
    for index in 0..4500 {
        let time = f64::from(index) * 0.01;
        let there = aboard.tick(time).unwrap().command.to_vec();
        let here = host.tick(time).unwrap().command.to_vec();
        for (a, b) in there.iter().zip(&here) {
            assert!((a - b).abs() < 1e-3, "{time} s: {there:?} {here:?}");
        }
    }
    drop(aboard);
    thread.join().unwrap();
}

#[test]
fn a_robot_that_hangs_up_ends_the_loop() {
    let (socket, thread) = robot(10);
    let (_, mut composed) = compose(&socket, "model.toml", |text| text).unwrap();
    for index in 0..10 {
        composed.tick(f64::from(index) * 0.01).unwrap();
    }
    let end = composed.tick(0.1).unwrap_err();
    assert!(
        matches!(end, TickError::Control(ControlError::NoAnswer)),
        "{end:?}"
    );
    thread.join().unwrap();
    let (_, mut composed) = compose(Path::new("/nowhere.line"), "model.toml", |text| text).unwrap();
    let end = composed.tick(0.0).unwrap_err();
    assert!(
        matches!(end, TickError::Control(ControlError::NoAnswer)),
        "{end:?}"
    );
}

/// The robot is told how old a measurement is: a few that are lost it drives over, and it comes to rest where
/// nothing fresh comes any more.
#[test]
fn lost_samples_are_told() {
    for (fault, expected) in [
        ("{ stale = { share = 0.2 } }", None),
        ("{ stale = { share = 1.0, start_s = 2.0 } }", Some(221)),
    ] {
        let (socket, thread) = robot(usize::MAX);
        let lossy =
            |text: String| text.replace("seed = 6", &format!("seed = 6\nfault = [{fault}]"));
        let (_, mut composed) = compose(&socket, "model.toml", lossy).unwrap();
        let end = (0..400).find_map(|index| {
            let error = composed.tick(f64::from(index) * 0.01).err()?;
            Some((index, error))
        });
        match (end, expected) {
            (None, None) => {}
            // 0.2 s of them are 20 ticks.
            (Some((index, TickError::Control(ControlError::AtRest("stale")))), Some(at)) => {
                assert!((at - 2..=at).contains(&index), "{index}");
                let said = composed.host.controller.remark().unwrap();
                assert!(said.contains("too old for too long"), "{said}");
            }
            other => panic!("{other:?}"),
        }
        drop(composed);
        thread.join().unwrap();
    }
}

#[test]
fn mistakes_are_pointed_at() {
    let cases = [
        (
            "rule = \"paper\", limit",
            "open_loop_acceleration = [1.0, 1.0], limit",
            "open_loop",
        ),
        ("limit = 12.0 }", "limit = [12.0] }", "a list of 2"),
        ("watchdog_s = 5.0", "watchdog_s = 0.0", "above 0 s"),
        ("watchdog_s = 5.0", "encoder_input = -1.0", "above 0"),
        (
            "[reference]\n",
            "[controller.aboard.rls]\nforgetting = 2.0\n[reference]\n",
            "forgetting",
        ),
        (
            "[reference]\n",
            "[controller.aboard.rls]\nrule = \"variable\"\nforgetting = 0.9\n[reference]\n",
            "expected `constant`",
        ),
    ];
    for (from, to, expected) in cases {
        let changed = |text: String| {
            let changed = text.replace(from, to);
            assert_ne!(changed, text, "{from}");
            changed
        };
        let said = compose(Path::new("/nowhere"), "model.toml", changed)
            .err()
            .unwrap();
        assert!(said.contains(expected), "{said}");
    }
}

/// An effect of the library that can act aboard is compiled into the Twil's firmware, and no other is.
#[test]
fn the_firmware_lists_every_effect_that_can_act_aboard() {
    type Aboard = <Twil as Parts>::Effects;
    let (mut can, mut listed) = (Vec::new(), Vec::new());
    for meta in effects() {
        can.extend(acts_aboard(meta).then_some(meta.id));
        listed.extend(Aboard::named(meta.id).map(|effect| effect.meta().id));
    }
    assert!(!can.is_empty());
    assert_eq!(can, listed);
}
