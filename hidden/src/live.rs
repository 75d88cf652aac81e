//! A machine that is driven as one goes, by a loop.

use crate::driven::{Driven, ELECTRICAL_TIME_CONSTANT};
use crate::error::HiddenError;
use crate::experiment::PERIOD;
use crate::hide::hide;
use crate::machine::{Machine, STEP};
use crate::odometry::Odometry;
use crate::physics::Physics;
use crate::random::Random;
use crate::recording::STEPS;
use crate::robot::Kind;
use crate::truth::Concealed;
use crate::{Hidden, Robot};

/// A machine of motors and wheels in motion, one sampling period at a time: what [`crate::record`]
/// records, for loops whose commands depend on what they measure.
///
/// ```
/// use loopsight_hidden::{Hidden, Live, Robot};
/// let mut robot = Live::new(Robot::Twil, &[(Hidden::CoulombFriction, 1.0)], 1)?;
/// for _ in 0..100 {
///     robot.drive([0.5, 0.5]);
/// }
/// // Half a volt does not overcome the friction: it sticks.
/// assert_eq!(robot.sample(), [0.0, 0.0]);
/// # Ok::<(), loopsight_hidden::HiddenError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Live {
    pub(crate) machine: Machine,
    pub(crate) odometry: Odometry,
    pub(crate) hidden: Vec<Concealed>,
    pub(crate) signals: usize,
    /// Periods from a command to its line in a log.
    pub(crate) logged_late: usize,
}

impl Live {
    /// `robot` at rest, hiding `effects` (of the sizes given); the seed says where the marks of its
    /// encoders are.
    ///
    /// # Errors
    ///
    /// [`HiddenError::NotHere`] or [`HiddenError::Size`] when the machine cannot have the effect,
    /// [`HiddenError::NotDriven`] where it is none of motors and wheels.
    pub fn new(robot: Robot, effects: &[(Hidden, f64)], seed: u64) -> Result<Self, HiddenError> {
        match robot.kind() {
            Kind::Driven(driven) => {
                Self::with_winding(driven, effects, seed, ELECTRICAL_TIME_CONSTANT)
            }
            Kind::Rig(_) => Err(HiddenError::NotDriven(robot.name())),
        }
    }

    /// The same with windings of another time constant, s.
    pub(crate) fn with_winding(
        driven: Driven,
        effects: &[(Hidden, f64)],
        seed: u64,
        time_constant: f64,
    ) -> Result<Self, HiddenError> {
        let mut physics = Physics::clean(driven);
        // The windings' formulas have no zero to divide by below a nanosecond.
        physics.motor.inductance = time_constant.max(1e-9) * physics.motor.resistance;
        let hidden = effects
            .iter()
            .map(|(effect, size)| hide(&mut physics, *effect, *size))
            .collect::<Result<Vec<Concealed>, HiddenError>>()?;
        let mut random = Random::new(seed, 1);
        let phase = [random.uniform(), random.uniform()];
        Ok(Self {
            odometry: Odometry::new(physics.odometry, phase, STEP),
            signals: physics.odometry.signals,
            logged_late: physics.logged_late,
            hidden,
            machine: Machine::new(physics),
        })
    }

    /// Applies `commands`, V, for one sampling period.
    pub fn drive(&mut self, commands: [f64; 2]) {
        for step in 1..=STEPS {
            self.machine.step(commands);
            self.odometry.step(self.machine.angles(), step == STEPS);
        }
    }

    /// What is measured at the end of that period, by counts.
    pub fn sample(&mut self) -> [f64; 2] {
        self.odometry.sample(PERIOD).0
    }

    /// What is hidden, in the order given.
    pub fn hidden(&self) -> &[Concealed] {
        &self.hidden
    }
}
