//! Loops composed from text, around robots that are nowhere in a file.

use loopsight_model::config::{ConfigError, TomlSource};
use loopsight_model::loop_file::{Composed, LoopFile};
use loopsight_model::model::Model;
use loopsight_model::registry::{BuildError, DriverContext};

use crate::PERIOD;

/// Ranges of `K_A` to `K_F` of robots of the Twil's kind.
pub const GAINS: [(f64, f64); 6] = [
    (-30.0, -5.0),
    (0.0, 0.05),
    (0.08, 0.3),
    (-30.0, -5.0),
    (-4.0, 0.0),
    (0.3, 0.8),
];

/// The loop `text` around `model`; the driver's model file, whatever its name, is `robot`.
pub fn composed(text: &str, model: &Model, robot: &str) -> Result<Composed, Box<ConfigError>> {
    let source = TomlSource::parse("loop.toml", text)?;
    LoopFile::parse(&source)?.compose(
        &source,
        model,
        &DriverContext {
            model,
            period: PERIOD,
            load_model: &|_| Ok(Model::from_toml("robot.toml", robot).unwrap().0),
            load_runs: &|_, _| Ok(Vec::new()),
            read_column: &|path, _| Err(BuildError::at("path", format!("no {path}"))),
        },
    )
}

/// A velocity loop of [`PERIOD`] with 12 V, and with `rest`, around `model`; as [`composed`]. Nobody watches where
/// `rest` has no `[supervisor]`.
pub fn velocity_loop(rest: &str, model: &Model, robot: &str) -> Composed {
    let watched = rest.contains("[supervisor]");
    let nobody = if watched { "" } else { "supervisor = false\n" };
    let text = format!(
        "model = \"model.toml\"\nperiod_s = {PERIOD}\n{nobody}\
         [controller.feedback_linearizing_pi]\nsettling_time_s = 0.45\nlimit = 12.0\n{rest}\n"
    );
    composed(&text, model, robot).unwrap()
}
