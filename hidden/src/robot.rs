//! The machines there are.

use crate::driven::{Driven, ELECTRICAL_TIME_CONSTANT};
use crate::effect::Hidden;
use crate::experiment::Experiment;
use crate::machines::{self, Sheet};

/// A machine that can hide an effect. Each has a plant of its own that it is compared with.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Robot {
    /// Differential-drive robot after the Twil: two geared DC motors, odometry. Plant: `ddmr`.
    Twil,
    /// One geared DC motor turning one inertia: a lift, a flywheel. Plant: `dc_axis`.
    Axis,
    /// A mass on a spring, moved by a voice coil. Plant: `oscillator`.
    Oscillator,
    /// Two tanks, one above the other, and a pump. Plant: `tank_pair`.
    TankPair,
    /// A joint that gravity pulls at, behind a gear motor. Plant: `arm`.
    Arm,
    /// A slide on a ball screw under a position loop. Plant: `servo_axis`.
    ServoAxis,
    /// A pole balanced on a cart. Plant: `cart_pole`.
    CartPole,
    /// A motor and a load with a long shaft between them. Plant: `flexible_joint`.
    FlexibleJoint,
    /// A joint on a motor whose current is controlled. Plant: `torque_axis`.
    TorqueAxis,
    /// A heating element in a block of metal. Plant: `thermal`.
    Thermal,
    /// A rod that swings at the end of a turning arm. Plant: `rotary_pendulum`.
    RotaryPendulum,
    /// A rod that a fan lifts. Plant: `propeller_pendulum`.
    PropellerPendulum,
}

/// How a machine is simulated.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Kind {
    /// Motors, shafts and wheels: [`crate::machine`].
    Driven(Driven),
    /// One command, in a file of its own: [`crate::machines`].
    Rig(&'static Sheet),
}

impl Robot {
    /// All of them.
    pub const ALL: [Robot; 12] = [
        Self::Twil,
        Self::Axis,
        Self::Oscillator,
        Self::TankPair,
        Self::Arm,
        Self::ServoAxis,
        Self::CartPole,
        Self::FlexibleJoint,
        Self::TorqueAxis,
        Self::Thermal,
        Self::RotaryPendulum,
        Self::PropellerPendulum,
    ];

    pub(crate) fn kind(self) -> Kind {
        match self {
            Robot::Twil => Kind::Driven(Driven::Twil),
            Robot::Axis => Kind::Driven(Driven::Axis),
            Robot::Oscillator => Kind::Rig(&machines::OSCILLATOR),
            Robot::TankPair => Kind::Rig(&machines::TANK_PAIR),
            Robot::Arm => Kind::Rig(&machines::ARM),
            Robot::ServoAxis => Kind::Rig(&machines::SERVO_AXIS),
            Robot::CartPole => Kind::Rig(&machines::CART_POLE),
            Robot::FlexibleJoint => Kind::Rig(&machines::FLEXIBLE_JOINT),
            Robot::TorqueAxis => Kind::Rig(&machines::TORQUE_AXIS),
            Robot::Thermal => Kind::Rig(&machines::THERMAL),
            Robot::RotaryPendulum => Kind::Rig(&machines::ROTARY_PENDULUM),
            Robot::PropellerPendulum => Kind::Rig(&machines::PROPELLER_PENDULUM),
        }
    }

    /// Name in messages and file names.
    pub fn name(self) -> &'static str {
        match self.kind() {
            Kind::Driven(driven) => driven.name(),
            Kind::Rig(sheet) => sheet.name,
        }
    }

    /// What is shown on a machine that is none of motors and wheels.
    pub(crate) fn rig_effects(self) -> &'static [Hidden] {
        match self.kind() {
            Kind::Driven(_) => &[],
            Kind::Rig(sheet) => sheet.shows,
        }
    }

    /// Name of a recording of this machine that hides `effect`, or nothing: `coulomb_friction`,
    /// `arm_coulomb_friction`, `nothing_axis`.
    pub fn case(self, effect: Option<Hidden>) -> String {
        match (self.kind(), effect) {
            (_, None) => format!("nothing_{}", self.name()),
            (Kind::Driven(_), Some(effect)) => effect.id().to_owned(),
            (Kind::Rig(_), Some(effect)) => format!("{}_{}", self.name(), effect.id()),
        }
    }

    /// What its committed recordings are fitted to, with this hidden in it; they are judged on
    /// [`Experiment::MultiLevel`].
    pub fn lesson(self, hidden: Option<Hidden>) -> Experiment {
        match (self.kind(), hidden) {
            // A pseudo-random binary sequence never rests at zero, never creeps and has one size.
            (_, Some(Hidden::BridgeCoast | Hidden::PulseCoast | Hidden::LugreFriction))
            | (Kind::Rig(_), _) => Experiment::Mixed,
            (Kind::Driven(_), _) => Experiment::Prbs,
        }
    }

    /// Header of its logs.
    pub(crate) fn columns(self) -> &'static [&'static str] {
        match self.kind() {
            Kind::Driven(driven) => driven.columns(),
            Kind::Rig(sheet) => sheet.columns,
        }
    }

    /// A model file for `loopsight`: the true parameters, rounded, as a first guess, and the true
    /// sensor.
    pub fn model_toml(self) -> String {
        match self.kind() {
            Kind::Driven(driven) => driven.model_toml(),
            Kind::Rig(sheet) => (sheet.build)([0.0; 2], ELECTRICAL_TIME_CONSTANT).model_toml(),
        }
    }
}
