//! Reasons why a robot stopped, or refused to begin.

use core::fmt;

use serde::{Deserialize, Serialize};

/// Why a robot came to rest.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Reason {
    /// The host asked for it.
    Asked,
    /// No valid step came in time.
    LinkLost,
    /// The host greeted again in the middle of a run.
    HostRestarted,
    /// A message of another session, or before any greeting: this robot was restarted.
    OtherSession,
    /// A step before a configuration.
    NotConfigured,
    /// A step is out of order.
    OutOfOrder {
        /// Number of the tick that was expected.
        expected: u32,
        /// Number that came.
        found: u32,
    },
    /// The measurements have been too old for too long.
    Stale,
    /// A wheel is driven and its encoder does not count; index of its input.
    EncoderLost(u8),
    /// A measurement or a reference is not finite, or values are missing.
    NotFinite,
    /// The supply is below its least voltage.
    SupplyLow,
    /// The control law had no command.
    NoCommand,
    /// The host speaks another version.
    Version {
        /// Version of this robot.
        expected: u16,
        /// Version of the host.
        found: u16,
    },
    /// The configuration cannot be used.
    Configuration(Unusable),
    /// A step without a measurement, and this robot has no sensors of its own.
    NoSensors,
    /// A step with a measurement, and this robot measures itself.
    OwnSensors,
    /// The robot's own motors or encoders failed.
    Hardware,
}

/// What is wrong with a configuration.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Unusable {
    /// Another plant than the one this firmware was built for.
    Plant,
    /// Parameters that are not finite, too few or too many.
    Parameters,
    /// An effect this firmware does not know, by its position.
    Effect(u8),
    /// A channel on which this firmware compensates nothing, by the effect's position.
    Channel(u8),
    /// An effect that reads what this robot does not know (a pose, a supply, the time), by its position.
    Reads(u8),
    /// Settings of the learning.
    Learning,
    /// Gains or limits of the control law.
    Controller,
    /// Settings of the safety.
    Safety,
    /// What the loop file of the run does not declare changeable while the robot drives.
    NotChangeable,
}

impl Reason {
    /// Identifier, for logs.
    pub const fn id(self) -> &'static str {
        match self {
            Reason::Asked => "asked",
            Reason::LinkLost => "link_lost",
            Reason::HostRestarted => "host_restarted",
            Reason::OtherSession => "other_session",
            Reason::NotConfigured => "not_configured",
            Reason::OutOfOrder { .. } => "out_of_order",
            Reason::Stale => "stale",
            Reason::EncoderLost(_) => "encoder_lost",
            Reason::NotFinite => "not_finite",
            Reason::SupplyLow => "supply_low",
            Reason::NoCommand => "no_command",
            Reason::NoSensors => "no_sensors",
            Reason::OwnSensors => "own_sensors",
            Reason::Hardware => "hardware",
            Reason::Version { .. } => "version",
            Reason::Configuration(_) => "configuration",
        }
    }
}

impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Reason::Asked => f.write_str("the host asked for it"),
            Reason::LinkLost => f.write_str("no step came from the host in time"),
            Reason::HostRestarted => f.write_str("the host was restarted"),
            Reason::OtherSession => {
                f.write_str("the message belongs to another session: the robot was restarted")
            }
            Reason::NotConfigured => f.write_str("a step came before any configuration"),
            Reason::OutOfOrder { expected, found } => {
                write!(f, "step {found} came where {expected} was expected")
            }
            Reason::Stale => f.write_str("the measurements have been too old for too long"),
            Reason::EncoderLost(i) => write!(
                f,
                "input {i} drives a motor whose encoder does not count: is the encoder connected?"
            ),
            Reason::NotFinite => f.write_str("a measurement or a reference is not a number"),
            Reason::SupplyLow => f.write_str("the supply is below its least voltage"),
            Reason::NoCommand => f.write_str("the control law had no command"),
            Reason::NoSensors => f.write_str(
                "the host measured nothing, and this robot has no sensors of its own: drive it with \
                 `[controller.aboard]` and another driver than `serial`",
            ),
            Reason::OwnSensors => f.write_str(
                "the host handed a measurement over, and this robot measures itself: drive it with \
                 `[driver.serial]`",
            ),
            Reason::Hardware => f.write_str("the robot's own motors or encoders failed"),
            Reason::Version { expected, found } => write!(
                f,
                "the host speaks version {found} of the protocol, expected {expected}"
            ),
            Reason::Configuration(what) => write!(f, "the configuration cannot be used: {what}"),
        }
    }
}

impl fmt::Display for Unusable {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Unusable::Plant => f.write_str("this firmware is for another plant"),
            Unusable::Parameters => f.write_str("the values of the plant's parameters"),
            Unusable::Effect(i) => write!(f, "effect {i} is not known to this firmware"),
            Unusable::Channel(i) => {
                write!(f, "effect {i} acts where this firmware compensates nothing")
            }
            Unusable::Reads(i) => write!(f, "effect {i} reads what this robot does not know"),
            Unusable::Learning => f.write_str("the settings of the learning"),
            Unusable::Controller => f.write_str("gains or limits of the control law"),
            Unusable::Safety => f.write_str("the settings of the safety"),
            Unusable::NotChangeable => f.write_str(
                "what the loop file of the run does not declare `changeable` while the robot drives",
            ),
        }
    }
}
