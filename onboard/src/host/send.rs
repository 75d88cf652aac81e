//! Sends a loop file's configuration to a robot without running the loop.

use std::any::Any;

use loopsight_link::Configuration;
use loopsight_model::loop_file::LoopFile;
use loopsight_model::model::Model;
use loopsight_model::registry::BuildError;

use super::conversation::Conversation;
use super::{Aboard, Line, LineError, Serial};

/// A robot's acknowledgement of its configuration.
#[derive(Clone, Debug, PartialEq)]
pub struct Acknowledged {
    /// The line that was used.
    pub line: String,
    /// Plant of its firmware.
    pub plant: String,
    /// Period of its firmware, s.
    pub period_s: f64,
    /// It is driving, and goes on with the new configuration. Otherwise it waits for its first step.
    pub runs: bool,
    /// It was driving for another host, and was stopped by this.
    pub interrupted: bool,
    /// The configuration.
    pub configuration: Configuration,
}

/// Why a robot was not configured.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SendError {
    /// The loop file's law runs here.
    #[error("the law of this loop file, `{found}`, runs here: expected `[controller.aboard]`")]
    NotAboard {
        /// The controller that it has.
        found: &'static str,
    },
    /// Nothing says where the robot is.
    #[error("nothing says at which line the robot is: give `--line`, or `line` in the loop file")]
    NoLine,
    /// The table of the controller cannot be told to a robot.
    #[error(transparent)]
    Table(BuildError),
    /// The line, or the robot at it.
    #[error(transparent)]
    Line(#[from] LineError),
}

/// Sends a loop file's model, effects, learning, law and safety to its robot: at `line`, or where the file says.
/// That is the `door` if a run has opened it, else the robot's own line.
///
/// # Errors
///
/// See [`SendError`].
pub fn send(file: &LoopFile, model: &Model, line: Option<&str>) -> Result<Acknowledged, SendError> {
    let controller: &dyn Any = file.controller.as_ref();
    let Some(aboard) = controller.downcast_ref::<Aboard>() else {
        let found = file.controller.meta().id;
        return Err(SendError::NotAboard { found });
    };
    let configuration = aboard.configuration(model, file.period_s);
    let configuration = configuration.map_err(SendError::Table)?;
    let driver: &dyn Any = file.driver.as_ref();
    let (own, baud, timeout_s) = match driver.downcast_ref::<Serial>() {
        Some(serial) => (Some(&serial.line), serial.baud, serial.timeout_s),
        None => (aboard.line.as_ref(), aboard.baud, aboard.timeout_s),
    };
    let places = match line {
        Some(line) => vec![line],
        None => aboard.door.iter().chain(own).map(String::as_str).collect(),
    };
    for place in places {
        let line = Line::at(place, baud, timeout_s);
        let mut robot = Conversation::new(line, configuration.clone(), file.period_s);
        let greeted = match robot.greet() {
            // Nobody has opened the door, so nobody runs the robot.
            Err(LineError::Missing { .. } | LineError::Nobody { .. })
                if line_is_door(aboard, place) && own.is_some() =>
            {
                continue;
            }
            other => other?,
        };
        robot.configure()?;
        return Ok(Acknowledged {
            line: place.to_owned(),
            plant: greeted.welcome.plant.as_str().to_owned(),
            period_s: f64::from(greeted.welcome.period_us) * 1e-6,
            runs: greeted.runs,
            interrupted: greeted.interrupted,
            configuration,
        });
    }
    Err(SendError::NoLine)
}

fn line_is_door(aboard: &Aboard, place: &str) -> bool {
    aboard.door.as_deref() == Some(place)
}
