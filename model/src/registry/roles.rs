//! Estimators, controllers and drivers as they stand in a file.

use std::any::Any;
use std::fmt::Debug;

use loopsight_core::{Controller, Driver, DriverError, DriverFault, Estimator};

use super::build_error::BuildError;
use super::meta::PartMeta;
use crate::excitation::ReadColumn;
use crate::model::Model;
use crate::run::Run;

/// A recursive estimator as it stands in a file: `[estimator.<id>]`.
#[typetag::serde]
pub trait EstimatorPart: Debug + Send + Sync {
    /// The declaration.
    fn meta(&self) -> &'static PartMeta;
    /// Builds one for `theta.len()` parameters, starting from `theta`.
    ///
    /// # Errors
    ///
    /// [`BuildError`] where a setting is out of its range.
    fn build(&self, theta: &[f64]) -> Result<Box<dyn Estimator<f64>>, BuildError>;
}

/// A controller as it stands in a file: `[controller.<id>]`.
#[typetag::serde]
pub trait ControllerPart: Debug + Send + Sync + Any {
    /// The declaration.
    fn meta(&self) -> &'static PartMeta;
    /// Builds it for a model and a period (s).
    ///
    /// # Errors
    ///
    /// [`BuildError`] where a setting is out of its range or does not suit the model.
    fn build(&self, model: &Model, period: f64) -> Result<Box<dyn Controller<f64>>, BuildError>;
    /// Sentences for reports: what was asked for and what the design will give.
    fn notes(&self) -> Vec<String> {
        Vec::new()
    }
    /// True where the controller inverts the model it is given, so that effects in the model file
    /// change its commands.
    fn inverts_model(&self) -> bool {
        false
    }
    /// True where its settings say how large its commands get: the loop needs no `[limits]` then to drive a robot.
    fn is_limited(&self) -> bool {
        false
    }
    /// What the design promises: the controlled signals from rest, sampled with `period` (s), for
    /// `references` (one list of samples per controlled signal), without limits or disturbances.
    /// `None` where the design promises nothing of that kind.
    fn ideal(&self, references: &[Vec<f64>], period: f64) -> Option<Vec<Vec<f64>>> {
        let _ = (references, period);
        None
    }
}

/// The error of a driver chosen at run time.
#[derive(Clone, Debug, thiserror::Error)]
#[error("{message}")]
pub struct HostDriverError {
    /// The kind.
    pub fault: DriverFault,
    /// What happened.
    pub message: String,
}

impl DriverError for HostDriverError {
    fn kind(&self) -> DriverFault {
        self.fault
    }
}

/// A driver chosen at run time.
pub type HostDriver = Box<dyn Driver<f64, Error = HostDriverError>>;

/// Loads the runs of a recording for a model, by a path relative to the loop file.
pub type LoadRuns<'a> = dyn Fn(&str, &Model) -> Result<Vec<Run>, BuildError> + 'a;

/// What a driver may need to be built.
pub struct DriverContext<'a> {
    /// The loop's model: its inputs and measured signals are what the driver serves.
    pub model: &'a Model,
    /// The loop's period, s.
    pub period: f64,
    /// Loads another model file, by a path relative to the loop file.
    pub load_model: &'a dyn Fn(&str) -> Result<Model, BuildError>,
    /// Loads the runs of a recording for `model`, by a path relative to the loop file.
    pub load_runs: &'a LoadRuns<'a>,
    /// Reads a column of a table, by a path relative to the loop file.
    pub read_column: &'a ReadColumn<'a>,
}

/// A loop's driver and controller, or which of the two cannot be built.
pub type Halves = Result<(HostDriver, Box<dyn Controller<f64>>), HalfError>;

/// The half of a loop that cannot be built.
#[derive(Clone, Debug, PartialEq)]
pub enum HalfError {
    /// The driver's table.
    Driver(BuildError),
    /// The controller's table.
    Controller(BuildError),
}

/// A driver as it stands in a file: `[driver.<id>]`.
#[typetag::serde]
pub trait DriverPart: Debug + Send + Sync + Any {
    /// The declaration.
    fn meta(&self) -> &'static PartMeta;
    /// Builds it.
    ///
    /// # Errors
    ///
    /// [`BuildError`] where a setting is out of its range or does not suit the model, or a file cannot be read.
    fn build(&self, context: &DriverContext<'_>) -> Result<HostDriver, BuildError>;
    /// True when the driver's time is simulated: the loop then runs as fast as it can.
    fn is_simulated(&self) -> bool;
    /// True where the measurements depend on the commands. Those of a log that is played back do not, so they cannot
    /// show whether a loop goes the wrong way.
    fn is_driven(&self) -> bool {
        true
    }
    /// Longest integration step of the robot that it simulates, s; none where it simulates none.
    fn simulates_with(&self) -> Option<f64> {
        None
    }
    /// True where its settings say how large the inputs get that it takes.
    fn is_limited(&self) -> bool {
        false
    }
    /// True where the robot runs the loop's law itself, by a timer of its own: its readings keep the time, and
    /// [`DriverPart::build_with`] makes the controller.
    fn runs_law(&self) -> bool {
        false
    }
    /// Builds it, and the controller of the same loop: each by itself, where they need not know of each
    /// other.
    ///
    /// # Errors
    ///
    /// [`HalfError`], which says whether the driver or the controller cannot be built.
    fn build_with(&self, controller: &dyn ControllerPart, context: &DriverContext<'_>) -> Halves {
        let controller = controller
            .build(context.model, context.period)
            .map_err(HalfError::Controller)?;
        Ok((self.build(context).map_err(HalfError::Driver)?, controller))
    }
}
