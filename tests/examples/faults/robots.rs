//! Robots that are not as they should be, in loops that learn and are watched.

use std::path::Path;
use std::time::{Duration, Instant};

use loopsight_core::{Driver, Sample, TickError};
use loopsight_hidden::{Hidden, Live, Robot};
use loopsight_model::loop_file::Composed;
use loopsight_model::model::Model;
use loopsight_model::registry::HostDriverError;
use loopsight_model::supervisor::{described, turning};
use loopsight_tests::loops::composed;
use loopsight_tests::{PERIOD, twil, twil_path};

use crate::{Desk, Row};

/// What the motors get at most, V.
const LIMIT: f64 = 12.0;

/// A hidden robot as a driver.
struct Machine {
    robot: Live,
    ticks: f64,
}

impl Driver<f64> for Machine {
    type Error = HostDriverError;

    fn read(&mut self, measured: &mut [f64]) -> Result<Sample<f64>, HostDriverError> {
        measured.copy_from_slice(&self.robot.sample());
        let time = self.ticks * PERIOD;
        Ok(Sample { time, fresh: true })
    }

    fn write(&mut self, command: &[f64], applied: &mut [f64]) -> Result<(), HostDriverError> {
        let held = [0, 1].map(|i| command[i].clamp(-LIMIT, LIMIT));
        applied.copy_from_slice(&held);
        self.robot.drive(held);
        self.ticks += 1.0;
        Ok(())
    }

    fn safe_stop(&mut self) -> Result<(), HostDriverError> {
        Ok(())
    }
}

fn text(driver: &str) -> String {
    format!(
        "model = \"model.toml\"\nperiod_s = {PERIOD}\n\
         [driver.simulated]\nmodel = \"robot.toml\"\nlimit = {LIMIT}\nseed = 5\n{driver}\
         [controller.feedback_linearizing_pi]\nsettling_time_s = 0.45\nlimit = {LIMIT}\n\
         [estimator.rls]\n[learning]\n[supervisor]\n\
         [reference]\n\
         linear_velocity = {{ multi_level = {{ amplitude = 0.2, hold_s = 1.5, levels = 5, seed = 7 }} }}\n\
         angular_velocity = {{ multi_level = {{ amplitude = 1.0, hold_s = 1.1, levels = 5, seed = 8 }} }}\n"
    )
}

/// What became of a loop.
struct Outcome {
    /// When and why it ended before its time.
    stopped: Option<(f64, String)>,
    /// Largest command, V, and farthest estimate from its start, in scales; NaN is infinitely far.
    largest: f64,
    farthest: f64,
}

/// Why a loop ended, as the command says it.
fn words(error: &TickError<HostDriverError>, model: &Model) -> String {
    let event = match error {
        TickError::Supervisor(event) => event,
        TickError::Driver(error) => return error.to_string(),
        TickError::Control(error) => return error.to_string(),
    };
    let signals = model.measured.iter().map(|m| (m.signal.id, m.signal.unit));
    let said = described(event, &signals.collect::<Vec<_>>(), &turning(model));
    let why = said.strip_prefix("stopped by the supervisor: ");
    why.unwrap_or(&said).to_owned()
}

fn drive(model: &Model, mut composed: Composed, seconds: f64) -> Outcome {
    let start = model.values();
    let mut outcome = Outcome {
        stopped: None,
        largest: 0.0,
        farthest: 0.0,
    };
    let most = |a: f64, b: f64| if b <= a { a } else { b };
    for k in 0..(seconds / PERIOD) as u64 {
        let time = k as f64 * PERIOD;
        match composed.tick(time) {
            Ok(step) => {
                outcome.largest = step
                    .applied
                    .iter()
                    .map(|u| u.abs())
                    .fold(outcome.largest, most);
            }
            Err(error) => {
                outcome.stopped = Some((time, words(&error, model)));
                break;
            }
        }
        if let Some(learned) = &composed.host.observer {
            let values = learned.values().iter().zip(&start).zip(&model.parameters);
            outcome.farthest = values
                .map(|((value, start), p)| (value - start).abs() / (p.declaration.scale * p.size))
                .fold(outcome.farthest, most);
        }
    }
    outcome
}

impl Outcome {
    fn bounded(&self) -> bool {
        self.largest <= LIMIT && self.farthest <= 10.0 + 1e-9
    }

    fn words(&self) -> String {
        let end = match &self.stopped {
            None => "ran to its end".to_owned(),
            Some((time, why)) => format!("stopped after {time:.2} s: {why}"),
        };
        format!(
            "{end}; at most {:.1} V, {:.2} scales from the start",
            self.largest, self.farthest
        )
    }
}

/// Sensors and motors, thirty seconds each; the fault begins at 10 s.
pub(crate) fn sensors() -> Vec<Row> {
    let model = twil();
    let robot = std::fs::read_to_string(twil_path()).unwrap();
    let reversed = robot.clone()
        + "\n[[effect]]\n[effect.expression]\nat = [\"input.right\", \"input.left\"]\nforce = \"-2 * nominal\"\n";
    let cases: [(&str, &str, &str, bool); 6] = [
        (
            "a measured velocity that keeps its value",
            "fault = [{ frozen = { signal = \"linear_velocity\", start_s = 10.0 } }]\n",
            &robot,
            true,
        ),
        (
            "an encoder that counts nothing",
            "fault = [{ dead_encoder = { of = \"shaft_angle_right\", start_s = 10.0 } }]\n",
            &robot,
            true,
        ),
        (
            "no fresh sample any more",
            "fault = [{ stale = { share = 1.0, start_s = 10.0 } }]\n",
            &robot,
            true,
        ),
        (
            "a fifth of the samples lost",
            "fault = [{ stale = { share = 0.2, start_s = 10.0 } }]\n",
            &robot,
            false,
        ),
        (
            "velocities with noise of a tenth of their size",
            "noise = { linear_velocity = 0.02, angular_velocity = 0.1 }\n",
            &robot,
            false,
        ),
        ("both motors reversed", "", &reversed, true),
    ];
    let rows = cases.iter().map(|(what, driver, robot, stops)| {
        let outcome = drive(
            &model,
            composed(&text(driver), &model, robot).unwrap(),
            30.0,
        );
        Row {
            what: (*what).to_owned(),
            happened: outcome.words(),
            promised: if *stops {
                "the loop stops, within the limits, with the reason"
            } else {
                "the loop goes on, within the limits; nothing is learned beyond ten scales"
            },
            kept: outcome.bounded() && outcome.stopped.is_some() == *stops,
        }
    });
    rows.collect()
}

/// How long it takes until two faults are found, by the instant at which they begin.
pub(crate) fn instants() -> Vec<Row> {
    let model = twil();
    let robot = std::fs::read_to_string(twil_path()).unwrap();
    let rows = [
        (
            "an encoder that counts nothing",
            "dead_encoder = { of = \"shaft_angle_right\",",
        ),
        (
            "a measured velocity that keeps its value",
            "frozen = { signal = \"linear_velocity\",",
        ),
    ]
    .map(|(what, fault)| {
        let mut found: Vec<f64> = (0..INSTANTS)
            .filter_map(|k| {
                let start = 10.0 + 0.1 * f64::from(k);
                let driver = format!("fault = [{{ {fault} start_s = {start} }} }}]\n");
                let composed = composed(&text(&driver), &model, &robot).unwrap();
                let (time, _) = drive(&model, composed, 30.0).stopped?;
                Some(time - start)
            })
            .collect();
        found.sort_by(f64::total_cmp);
        let at = |share: f64| found[(share * (found.len().max(1) - 1) as f64) as usize];
        Row {
            what: format!("{what}, from {INSTANTS} instants between 10 and 20 s on"),
            happened: format!(
                "{} stopped; after {:.2} s (median), {:.2} s (9 of 10), {:.2} s (the last)",
                found.len(),
                at(0.5),
                at(0.9),
                at(1.0)
            ),
            promised: "the loop stops",
            kept: found.len() == INSTANTS as usize && found[0] > 0.0,
        }
    });
    rows.into()
}

/// Instants at which a fault begins.
const INSTANTS: u8 = 100;

/// Every effect that a Twil can hide, in thirty seconds each.
pub(crate) fn hidden() -> Vec<Row> {
    let model = twil();
    let robot = std::fs::read_to_string(twil_path()).unwrap();
    let (mut driven, mut stopped, mut beyond) = (0, Vec::new(), Vec::new());
    for effect in Hidden::ALL {
        let Ok(live) = Live::new(Robot::Twil, &[(*effect, 1.0)], 1) else {
            continue;
        };
        let mut composed = composed(&text(""), &model, &robot).unwrap();
        composed.host.driver = Box::new(Machine {
            robot: live,
            ticks: 0.0,
        });
        let outcome = drive(&model, composed, 30.0);
        driven += 1;
        if outcome.stopped.is_some() {
            stopped.push(format!("{effect}: {}", outcome.words()));
        }
        if !outcome.bounded() {
            beyond.push(effect.to_string());
        }
    }
    let mut happened = format!(
        "{} beyond the limits or ten scales, {} stopped",
        beyond.len(),
        stopped.len()
    );
    if !stopped.is_empty() {
        happened.push_str(&format!(" ({})", stopped.join("; ")));
    }
    vec![Row {
        what: format!("{driven} hidden robots, each with another effect that the model lacks"),
        happened,
        promised: "commands within the limits, estimates within ten scales",
        kept: driven > 10 && beyond.is_empty(),
    }]
}

/// A robot behind a line that takes every byte and never answers.
pub(crate) fn blocks(program: &Path) -> Vec<Row> {
    let desk = Desk::new(program);
    let socket = desk.path("line");
    let listener = std::os::unix::net::UnixListener::bind(&socket).unwrap();
    let silent = std::thread::spawn(move || {
        let visitor = listener.accept();
        std::thread::sleep(Duration::from_secs(15));
        drop(visitor);
    });
    desk.write(
        "aboard.toml",
        "model = \"model.toml\"\nperiod_s = 0.01\nduration_s = 4.0\n\
         [driver.simulated]\nlimit = 12.0\n\
         [controller.aboard]\nline = \"line\"\nlaw = { settling_time_s = 0.45, limit = 12.0 }\n\
         [reference]\nlinear_velocity = { constant = 0.1 }\n",
    );
    let from = Instant::now();
    let mut command = desk.command(&["run", "aboard.toml"]);
    let output = command
        .stderr(std::process::Stdio::piped())
        .output()
        .unwrap();
    let took = from.elapsed();
    drop(silent);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    let said: Vec<&str> = said.split_whitespace().collect();
    vec![Row {
        what: "a robot that takes every byte and never answers".to_owned(),
        happened: format!(
            "status {} after {:.1} s: {}",
            output.status.code().unwrap_or(-1),
            took.as_secs_f64(),
            said.join(" ").replace('|', "/")
        ),
        promised: "an error in words, no wait without end",
        kept: output.status.code() == Some(1) && took < Duration::from_secs(10),
    }]
}
