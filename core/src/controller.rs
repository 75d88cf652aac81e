//! The role of a controller.

use core::fmt;

use crate::{Observation, Real, Sample, Tick};

/// What a controller says of the command it wrote.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Command {
    /// At least one actuator was asked for more than it can give.
    pub saturated: bool,
    /// The command is the last safe one, repeated because no new one could be computed.
    pub held: bool,
}

/// A quantity that a controller reports beside its commands: something that it learned or measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quantity<S> {
    /// Its name.
    pub name: &'static str,
    /// Its SI unit.
    pub unit: &'static str,
    /// The value it starts from, of a parameter that is learned; `None` of what is measured.
    pub start: Option<S>,
}

/// Why a controller could not compute a command. The loop stops safely on it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum ControlError {
    /// Slices of other lengths than those the controller was built for.
    Sizes,
    /// The robot that computes the commands itself does not answer.
    NoAnswer,
    /// The robot that computes the commands itself has come to rest; its reason.
    AtRest(&'static str),
}

impl fmt::Display for ControlError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            ControlError::Sizes => f.write_str("signals do not fit the controller's sizes"),
            ControlError::NoAnswer => f.write_str("the robot does not answer"),
            ControlError::AtRest(why) => write!(f, "the robot has come to rest: {why}"),
        }
    }
}

impl core::error::Error for ControlError {}

/// A plant seen by a controller: `dy/dt = f(y) + G(y) u` for the controlled states `y`.
///
/// `u` are the inputs at the plant. [`AffineModel::invert`] inverts what lies between a command and them, such as a
/// dead zone or a supply that sags. [`AffineModel::track`] compensates delays of commands and measurements. A model
/// with neither implements only the first two methods.
pub trait AffineModel<S: Real> {
    /// Number of controlled states, equal to the number of inputs.
    fn size(&self) -> usize;
    /// Drift `f` (length `size`) and input matrix `G` (row by row, `size * size`) at `y`.
    fn evaluate(&mut self, y: &[S], drift: &mut [S], input_matrix: &mut [S]);
    /// Takes the value that was learned for a parameter (by its index in the model), for every
    /// [`AffineModel::evaluate`] from now on. A model that learns nothing ignores it.
    fn learn(&mut self, parameter: usize, value: S) {
        let _ = (parameter, value);
    }
    /// The same for the values of all parameters, from the first one on.
    fn learn_all(&mut self, values: &[S]) {
        for (parameter, value) in values.iter().enumerate() {
            self.learn(parameter, *value);
        }
    }
    /// Sets where the controlled states are wanted, until the next call. Effects that depend on the direction of a
    /// motion that has hardly begun (dry friction) are evaluated in the wanted direction.
    fn aim(&mut self, wanted: &[S]) {
        let _ = wanted;
    }
    /// Replaces the inputs wanted at the plant by the commands that bring them about at `y`. False
    /// where no command does; the nearest are written.
    fn invert(&mut self, y: &[S], input: &mut [S]) -> bool {
        let _ = (y, input);
        true
    }
    /// Replaces commands by the inputs that they cause at the plant at `y`: the inverse of [`AffineModel::invert`].
    fn pass(&mut self, y: &[S], command: &mut [S]) {
        let _ = (y, command);
    }
    /// Delay until a command that is written now acts on the plant, s. References that are known in advance should be
    /// given to the controller that much earlier.
    fn ahead(&self) -> S {
        S::zero()
    }
    /// Takes what happened since the tick before. `controlled` are the controlled states as measured. A model that
    /// predicts replaces them by the states at the time when the next command acts.
    ///
    /// The loop calls it before every step of the controller, after [`AffineModel::learn`]; at the
    /// first tick nothing was asked for or applied before.
    fn track(&mut self, seen: &Observation<'_, S>, controlled: &mut [S]) {
        let _ = (seen, controlled);
    }
}

/// Computes the command from reference, measurement and model.
///
/// Implementations allocate nothing in [`Controller::step`].
pub trait Controller<S: Real>: Send {
    /// Writes the command (one value per input, in the input's unit).
    ///
    /// `reference` and `measured` hold the controlled states.
    ///
    /// # Errors
    ///
    /// [`ControlError`] where no command can be computed. The loop then stops safely.
    fn step(
        &mut self,
        tick: &Tick<S>,
        reference: &[S],
        measured: &[S],
        model: &mut dyn AffineModel<S>,
        command: &mut [S],
    ) -> Result<Command, ControlError>;
    /// Takes how old the measurement of the next step is, where that matters to it.
    fn sampled(&mut self, sample: &Sample<S>) {
        let _ = sample;
    }
    /// Replaces the loop's references by those of the last step, where the controller makes its own (it follows a
    /// path). Logs and the supervisor need them.
    fn demand(&self, reference: &mut [S]) {
        let _ = reference;
    }
    /// What the controller tells beside its commands, for logs.
    fn quantities(&self) -> &[Quantity<S>] {
        &[]
    }
    /// Values of [`Controller::quantities`] at the last step; NaN where not known.
    fn told(&self) -> &[S] {
        &[]
    }
    /// Remarks on the last step: why it failed, what happened meanwhile.
    fn remark(&self) -> Option<&str> {
        None
    }
    /// Forgets integrators and the last command.
    fn reset(&mut self);
}

#[cfg(feature = "std")]
impl<S: Real, C: Controller<S> + ?Sized> Controller<S> for Box<C> {
    fn step(
        &mut self,
        tick: &Tick<S>,
        reference: &[S],
        measured: &[S],
        model: &mut dyn AffineModel<S>,
        command: &mut [S],
    ) -> Result<Command, ControlError> {
        (**self).step(tick, reference, measured, model, command)
    }
    fn sampled(&mut self, sample: &Sample<S>) {
        (**self).sampled(sample);
    }
    fn demand(&self, reference: &mut [S]) {
        (**self).demand(reference);
    }
    fn quantities(&self) -> &[Quantity<S>] {
        (**self).quantities()
    }
    fn told(&self) -> &[S] {
        (**self).told()
    }
    fn remark(&self) -> Option<&str> {
        (**self).remark()
    }
    fn reset(&mut self) {
        (**self).reset();
    }
}
