//! Robots with known answers, for the tests of this crate.

use loopsight_model::model::Model;
use loopsight_model::registry::{BuildError, DriverContext, DriverPart, HostDriver};
use loopsight_model::run::Run;
use loopsight_plants as _;

/// Half track and wheel radius of [`twil`], m.
pub(crate) const HALF_TRACK: f64 = 0.131;
pub(crate) const WHEEL: f64 = 0.05;

/// The Twil without its products of velocities: two first-order lags, known in closed form.
pub(crate) fn twil(sensor_v: &str, sensor_omega: &str) -> Model {
    model(&format!(
        "[plant.ddmr]\nK_A = -15.146\nK_B = 0.0\nK_C = 0.136\nK_D = -9.573\nK_E = 0.0\n\
         K_F = 0.656\nhalf_track = {HALF_TRACK}\nwheel_radius = {WHEEL}\n\
         [log.measured.linear_velocity]\nsensor = {sensor_v}\n\
         [log.measured.angular_velocity]\nsensor = {sensor_omega}\n"
    ))
}

/// [`twil`] with the encoders of the paper on its wheels.
pub(crate) fn twil_encoders() -> Model {
    let encoder = |right: f64, left: f64| {
        format!(
            "{{ encoder_counts = {{ counts_per_revolution = 8192.0, \
             of = {{ shaft_angle_right = {right:?}, shaft_angle_left = {left:?} }} }} }}"
        )
    };
    let (half, yaw) = (WHEEL / 2.0, WHEEL / (2.0 * HALF_TRACK));
    twil(&encoder(half, half), &encoder(yaw, -yaw))
}

pub(crate) fn model(toml: &str) -> Model {
    Model::from_toml("model.toml", toml).unwrap().0
}

/// Builds a driver for `model` at 100 Hz; `robot` and `runs` are what files would give.
pub(crate) fn build(
    part: &dyn DriverPart,
    model: &Model,
    robot: Option<&Model>,
    runs: &[Run],
) -> Result<HostDriver, BuildError> {
    within(model, robot, runs, |context| part.build(context))
}

/// Hands what [`build`] builds drivers with to `use_it`.
pub(crate) fn within<T>(
    model: &Model,
    robot: Option<&Model>,
    runs: &[Run],
    use_it: impl FnOnce(&DriverContext<'_>) -> T,
) -> T {
    use_it(&DriverContext {
        model,
        period: 0.01,
        load_model: &|path| {
            robot
                .cloned()
                .ok_or_else(|| BuildError::at("model", format!("no {path}")))
        },
        load_runs: &|_, _| Ok(runs.to_vec()),
        read_column: &|path, _| Err(BuildError::at("path", format!("no {path}"))),
    })
}

/// A voltage that turns the wheels against each other, with jumps.
pub(crate) fn voltages(n: usize) -> Vec<f64> {
    (0..n)
        .flat_map(|k| {
            let right = if (k / 37) % 2 == 0 { 9.0 } else { -9.0 };
            let left = if (k / 53) % 2 == 0 { 9.0 } else { -9.0 };
            [right, left]
        })
        .collect()
}

pub(crate) fn instants(n: usize) -> Vec<f64> {
    (0..n).map(|k| 0.01 * k as f64).collect()
}
