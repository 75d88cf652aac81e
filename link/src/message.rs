//! The messages.

use heapless::{String, Vec};
use serde::{Deserialize, Serialize};

use crate::configuration::{Configuration, NAME, PARAMETERS, SIGNALS};
use crate::reason::Reason;

/// One number per signal.
pub type Signals = Vec<f32, SIGNALS>;
/// One number per parameter.
pub type Values = Vec<f32, PARAMETERS>;

/// A message from the host.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[allow(
    clippy::large_enum_variant,
    reason = "there is no allocator to put the configuration behind, and one message at a time"
)]
pub enum Request {
    /// The greeting; the first of all messages in all versions.
    Hello(Hello),
    /// The configuration of the loop.
    Configure {
        /// Number of the session.
        session: u32,
        /// All of it.
        configuration: Configuration,
    },
    /// One tick of the loop.
    Step(Measured),
    /// Stop the motors.
    Stop {
        /// Number of the session.
        session: u32,
    },
}

/// The greeting.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Hello {
    /// [`crate::VERSION`] of who speaks.
    pub version: u16,
    /// A number drawn at random by the host.
    pub session: u32,
}

/// What a robot answers to the greeting.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Welcome {
    /// The greeting, with the robot's version.
    pub hello: Hello,
    /// The period the robot was built for, µs.
    pub period_us: u32,
    /// Identifier of the plant the robot was built for.
    pub plant: String<NAME>,
}

/// A step of the host: measurement and reference of a tick.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Measured {
    /// Number of the session.
    pub session: u32,
    /// Number of the tick, from 0, one more each time.
    pub tick: u32,
    /// Age of the measurement, µs.
    pub age_us: u32,
    /// Voltage of the supply, V.
    pub supply: f32,
    /// What was measured: the controlled states first. Empty for a robot with sensors of its own, which
    /// ticks by its own timer and takes the reference only.
    pub measured: Signals,
    /// Reference of the controlled states.
    pub reference: Signals,
}

/// What a robot with sensors of its own measured at a tick, and the reference it followed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sensed {
    /// Voltage of the supply, V.
    pub supply: f32,
    /// What it measured: the controlled states.
    pub measured: Signals,
    /// The reference: the last one that it heard.
    pub reference: Signals,
}

/// What a robot did in a tick.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Act {
    /// Number of the session.
    pub session: u32,
    /// Number of the tick.
    pub tick: u32,
    /// The inputs that the motors get.
    pub command: Signals,
    /// The plant's parameters, the learned ones as they are estimated now.
    pub parameters: Values,
    /// An input was clamped to its limit.
    pub saturated: bool,
    /// The command is the last one that could be computed.
    pub held: bool,
    /// Controlled states whose estimator learned from this tick, one bit each.
    pub learned: u8,
    /// Cost of the tick before, in the robot's own unit (its README says which); 0 if not known.
    pub cost: u32,
    /// What the tick began with, where the robot measured it itself.
    pub sensed: Option<Sensed>,
}

/// A message from the robot.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Reply {
    /// Answer to the greeting; the first of all messages in all versions.
    Hello(Welcome),
    /// The configuration is in use.
    Configured {
        /// Number of the session.
        session: u32,
    },
    /// Answer to a step; of a robot with sensors of its own, what it did in a period.
    Act(Act),
    /// The robot is at rest, and why.
    Stopped {
        /// Number of the session; 0 before any.
        session: u32,
        /// Number of the tick that comes next.
        tick: u32,
        /// Why.
        reason: Reason,
    },
    /// A line for the log.
    Log(Note),
}

/// A line for the log.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Note {
    /// Frames that were dropped since the last note: broken, cut or too long.
    Dropped(u32),
    /// The robot was reset and waits for a greeting.
    Started,
    /// From a host on behalf of the robot that it runs: the robot drives, and goes on with what was sent.
    Runs,
    /// From a host that talks to another program: try again later.
    Busy,
}
