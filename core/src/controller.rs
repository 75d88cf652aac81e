//! The role of a controller.

use core::fmt;

use crate::{Observation, Real, Sample, Tick};

/// What a controller says of the command it wrote.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Command {
    /// At least one actuator was asked for more than it can give.
    pub saturated: bool,
    /// The command is the last safe one, held because no better could be computed.
    pub held: bool,
}

/// Something that a controller tells beside its commands: what it learned itself, what it measured.
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
    /// What computes the commands elsewhere, aboard a robot, does not answer.
    NoAnswer,
    /// What computes the commands elsewhere has come to rest; its reason.
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
/// `u` are the inputs at the plant. What lies between a command and them (a dead zone, a supply that
/// sags) is inverted by [`AffineModel::invert`]; what makes commands or measurements late is made up
/// for by [`AffineModel::track`]. A model without any of that implements the first two methods only.
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
    /// Says where the controlled states are wanted: what depends on the direction of a motion that
    /// has hardly begun (dry friction) is taken in that direction, until the next call.
    fn aim(&mut self, wanted: &[S]) {
        let _ = wanted;
    }
    /// Replaces the inputs wanted at the plant by the commands that bring them about at `y`. False
    /// where no command does; the nearest are written.
    fn invert(&mut self, y: &[S], input: &mut [S]) -> bool {
        let _ = (y, input);
        true
    }
    /// Replaces commands by what they come to at the plant at `y`: the other way round.
    fn pass(&mut self, y: &[S], command: &mut [S]) {
        let _ = (y, command);
    }
    /// Time from now until the plant feels a command that is written now, s: references that are known
    /// before their time should be asked for that much earlier.
    fn ahead(&self) -> S {
        S::zero()
    }
    /// Takes what happened since the tick before. `controlled` holds the controlled states as
    /// measured; it is replaced by the states that the next command will meet, where the model knows
    /// better.
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
    /// Replaces the loop's references by those of the last step, where the controller makes its own
    /// (it follows a path): what was tracked, for logs and whoever watches over the loop.
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
    /// What there is to say of the last step beyond its result: why it failed, what happened meanwhile.
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
