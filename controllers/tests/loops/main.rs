//! Whole loops on simulated robots, composed from TOML as a user would.

#![allow(
    clippy::unwrap_used,
    reason = "what is built here is right, and a panic is how this program fails"
)]

mod compensation;
mod example;
mod random;
mod tracking;
mod truth;

use loopsight_controllers as _;
use loopsight_core::Plant;
use loopsight_drivers as _;
use loopsight_estimators as _;
use loopsight_model::config::TomlSource;
use loopsight_model::loop_file::{Composed, LoopFile};
use loopsight_model::model::Model;
use loopsight_model::registry::{BuildError, DriverContext};
use loopsight_plants::Ddmr;

/// The paper's robot, its velocities as they are.
pub(crate) const TWIL: &str = <Ddmr as Plant>::META.example;

/// Its velocities as they are at the instant.
pub(crate) const INSTANT: &str = "[log.measured]
linear_velocity = { sensor = \"instantaneous\" }
angular_velocity = { sensor = \"instantaneous\" }
";

/// Its velocities from encoders.
pub(crate) const ENCODERS: &str = "[log.measured.linear_velocity]
sensor = { encoder_counts = { counts_per_revolution = 8192.0, of = { shaft_angle_right = 0.025, shaft_angle_left = 0.025 } } }
[log.measured.angular_velocity]
sensor = { encoder_counts = { counts_per_revolution = 8192.0, of = { shaft_angle_right = 0.19083969, shaft_angle_left = -0.19083969 } } }
";

pub(crate) fn model(text: &str) -> Model {
    Model::from_toml("model.toml", text).unwrap().0
}

/// An effect as it stands in a model file.
pub(crate) fn effect(text: &str) -> String {
    format!("[[effect]]\n{text}\n")
}

/// The loop `text` around `model`; the driver's `robot.toml` is `robot`.
pub(crate) fn compose(text: &str, model: &Model, robot: &Model) -> Composed {
    let source = TomlSource::parse("loop.toml", text).unwrap();
    let file = LoopFile::parse(&source).unwrap();
    let load_model = |_: &str| Ok(robot.clone());
    let load_runs = |name: &str, _: &Model| Err(BuildError::at("recording", name));
    let context = DriverContext {
        model,
        period: file.period_s,
        load_model: &load_model,
        load_runs: &load_runs,
        read_column: &|path, _| Err(BuildError::at("path", format!("no {path}"))),
    };
    file.compose(&source, model, &context).unwrap()
}

/// What a loop did: one row per tick.
#[derive(Debug, Default)]
pub(crate) struct Trace {
    pub(crate) reference: Vec<Vec<f64>>,
    pub(crate) measured: Vec<Vec<f64>>,
    pub(crate) applied: Vec<Vec<f64>>,
}

impl Trace {
    /// Root mean square of the error of the `i`-th controlled state from `from` s on.
    pub(crate) fn rms(&self, i: usize, from: usize) -> f64 {
        let errors = (self.reference.iter().zip(&self.measured)).skip(from);
        let squares: Vec<f64> = errors.map(|(r, y)| (r[i] - y[i]).powi(2)).collect();
        (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
    }

    /// Greatest size of the `i`-th controlled state's error from the tick `from` on.
    pub(crate) fn worst(&self, i: usize, from: usize) -> f64 {
        let errors = (self.reference.iter().zip(&self.measured)).skip(from);
        errors.fold(0.0, |a, (r, y)| a.max((r[i] - y[i]).abs()))
    }
}

/// Runs a loop for `ticks`.
pub(crate) fn run(text: &str, model: &Model, robot: &Model, ticks: usize) -> Trace {
    let mut composed = compose(text, model, robot);
    let mut trace = Trace::default();
    let period = composed.host.period();
    for k in 0..ticks {
        let step = composed.tick(k as f64 * period).unwrap();
        trace.reference.push(step.reference.to_vec());
        trace.measured.push(step.measured.to_vec());
        trace.applied.push(step.applied.to_vec());
    }
    trace
}
