//! The role of a driver: what stands between the loop and the robot.

use core::fmt;

use crate::Real;

/// One measurement.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample<S> {
    /// When it was taken, s since the driver started.
    pub time: S,
    /// False when the values are older than the tick that reads them. An estimator must not learn from them.
    pub fresh: bool,
}

/// The kinds of driver errors a loop can tell apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum DriverFault {
    /// The recording or the simulated time is over: the normal end of a run.
    Finished,
    /// The link to the robot is gone.
    Disconnected,
    /// The robot refused the command (NaN, out of range).
    Rejected,
    /// A bus, pin or file error.
    Io,
}

impl fmt::Display for DriverFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            DriverFault::Finished => "the run is over",
            DriverFault::Disconnected => "the robot does not answer",
            DriverFault::Rejected => "the robot refused the command",
            DriverFault::Io => "input or output failed",
        })
    }
}

impl core::error::Error for DriverFault {}

/// An error of a driver; `kind` lets a loop react without knowing the driver.
pub trait DriverError: fmt::Debug {
    /// The kind of error.
    fn kind(&self) -> DriverFault;
}

impl DriverError for DriverFault {
    fn kind(&self) -> DriverFault {
        *self
    }
}

/// Reads sensors, writes actuators. Nothing here allocates or blocks longer than the hardware must.
pub trait Driver<S: Real>: Send {
    /// The driver's own error.
    type Error: DriverError;
    /// Reads the measured signals in the order the driver was built for.
    ///
    /// # Errors
    ///
    /// The robot cannot be read; [`DriverError`] says what kind of fault it is. At the end of a recording that is
    /// [`DriverFault::Finished`].
    fn read(&mut self, measured: &mut [S]) -> Result<Sample<S>, Self::Error>;
    /// Applies the inputs until the next write. Returns what was really applied in `applied`
    /// (limits, slew) so that the log holds what the plant saw.
    ///
    /// # Errors
    ///
    /// The command is not finite or the robot does not take it; [`DriverError`] says what kind of fault it is.
    fn write(&mut self, command: &[S], applied: &mut [S]) -> Result<(), Self::Error>;
    /// Brings the actuators to rest. Called at every end of a loop, also after an error.
    ///
    /// # Errors
    ///
    /// The actuators may not be at rest: the robot did not take the command.
    fn safe_stop(&mut self) -> Result<(), Self::Error>;
}

#[cfg(feature = "std")]
impl<S: Real, D: Driver<S> + ?Sized> Driver<S> for Box<D> {
    type Error = D::Error;
    fn read(&mut self, measured: &mut [S]) -> Result<Sample<S>, Self::Error> {
        (**self).read(measured)
    }
    fn write(&mut self, command: &[S], applied: &mut [S]) -> Result<(), Self::Error> {
        (**self).write(command, applied)
    }
    fn safe_stop(&mut self) -> Result<(), Self::Error> {
        (**self).safe_stop()
    }
}
