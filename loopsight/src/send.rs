//! Sending a model and a law to a robot at the end of a line.

use loopsight_model::loop_file::placed;
use loopsight_onboard::SendError;

use crate::answers::SendAnswer;
use crate::error::{Error, Result};
use crate::run::Loop;
use crate::session::Session;

/// How a model and a law are sent to a robot.
#[derive(Clone, Debug, Default)]
#[non_exhaustive]
pub struct SendOptions {
    /// Serial port or unix socket of the robot, or the `door` of a run: by default what the loop file
    /// says, its `door` first.
    pub line: Option<String>,
}

impl SendOptions {
    /// Serial port or unix socket of the robot, or the `door` of a run.
    #[must_use]
    pub fn line(mut self, line: &str) -> Self {
        self.line = Some(line.to_owned());
        self
    }
}

impl Session {
    /// Sends the model of the session with its effects, and the law of `control`, to a robot, waiting or driving.
    ///
    /// # Errors
    ///
    /// The loop has no law for aboard or no line, or the robot refuses.
    pub fn send(&self, control: &Loop, options: &SendOptions) -> Result<SendAnswer> {
        let (file, source) = (&control.parsed, control.source()?);
        let model = &self.model.composed;
        let told = loopsight_onboard::send(file, model, options.line.as_deref());
        let told = told.map_err(|error| match error {
            SendError::Table(error) => {
                let id = file.controller.meta().id;
                placed(&source, &["controller".into(), id.into()], error).into()
            }
            SendError::NotAboard { .. } => {
                let message = error.to_string();
                source.error(&["controller".into()], &message, None).into()
            }
            SendError::NoLine => Error::request(error.to_string()),
            _ => Error::work(error.to_string()),
        })?;
        Ok(SendAnswer::new(&told, model))
    }
}
