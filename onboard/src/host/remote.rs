//! A controller whose law runs at the other end of a line.

use loopsight_core::{AffineModel, Command, ControlError, Controller, Quantity, Sample, Tick};

use super::LineError;
use super::conversation::Conversation;
use super::told::Told;

/// Sends measurement and reference to the robot, and takes its command.
pub(super) struct Remote {
    robot: Conversation,
    /// The next step.
    tick: u32,
    /// Age of its measurement, periods.
    age: u32,
    told: Told,
    remark: Option<String>,
}

impl Remote {
    pub(super) fn new(robot: Conversation, told: Told) -> Self {
        Self {
            robot,
            tick: 0,
            age: 0,
            told,
            remark: None,
        }
    }

    fn ask(
        &mut self,
        reference: &[f64],
        measured: &[f64],
        command: &mut [f64],
    ) -> Result<Command, LineError> {
        self.robot.begin()?;
        self.remark = self.robot.serve()?;
        self.robot.step(self.tick, self.age, measured, reference)?;
        let act = loop {
            let act = self.robot.act(command.len())?;
            if act.tick == self.tick {
                break act;
            }
        };
        self.tick = self.tick.wrapping_add(1);
        Ok(self.told.take(&act, command))
    }
}

/// An error of the line as an error of the controller. [`Controller::remark`] has the words.
pub(super) fn kind(error: &LineError) -> ControlError {
    match error {
        LineError::AtRest { .. } | LineError::Refused { .. } => {
            ControlError::AtRest(error.reason().id())
        }
        LineError::Sizes { .. } => ControlError::Sizes,
        _ => ControlError::NoAnswer,
    }
}

impl Controller<f64> for Remote {
    fn step(
        &mut self,
        _tick: &Tick<f64>,
        reference: &[f64],
        measured: &[f64],
        _model: &mut dyn AffineModel<f64>,
        command: &mut [f64],
    ) -> Result<Command, ControlError> {
        self.ask(reference, measured, command).map_err(|error| {
            let kind = kind(&error);
            self.remark = Some(error.to_string());
            kind
        })
    }

    fn sampled(&mut self, sample: &Sample<f64>) {
        self.age = if sample.fresh {
            0
        } else {
            self.age.saturating_add(1)
        };
    }

    fn quantities(&self) -> &[Quantity<f64>] {
        self.told.quantities()
    }

    fn told(&self) -> &[f64] {
        self.told.values()
    }

    fn remark(&self) -> Option<&str> {
        self.remark.as_deref()
    }

    /// A new session begins with the next step.
    fn reset(&mut self) {
        self.robot.renew();
        self.tick = 0;
    }
}

impl Drop for Remote {
    /// Stops the robot at the end of a run. If it does not hear that, its watchdog stops it.
    fn drop(&mut self) {
        let _ = self.robot.stop();
    }
}
