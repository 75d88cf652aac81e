//! The configuration: everything a robot needs before it may move.

use heapless::{String, Vec};
use serde::{Deserialize, Serialize};

use crate::message::{Signals, Values};

/// Most controlled states, inputs or measured signals.
pub const SIGNALS: usize = 4;
/// Most parameters of a plant.
pub const PARAMETERS: usize = 12;
/// Most effects of a model.
pub const EFFECTS: usize = 4;
/// Most channels one effect acts on.
pub const CHANNELS: usize = 4;
/// Longest name of a plant or an effect, bytes.
pub const NAME: usize = 24;

/// The loop of a robot: model, learning, control law, safety. Taken as a whole, or not at all.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Configuration {
    /// Identifier of the plant, as in `[plant.<id>]`.
    pub plant: String<NAME>,
    /// Values of the parameters of its equations, in the order in which the plant declares them.
    pub parameters: Values,
    /// The effects that are compensated.
    pub effects: Vec<Attachment, EFFECTS>,
    /// For each controlled state the change over which dry friction takes its direction, in the
    /// state's unit.
    pub bands: Signals,
    /// The measurements are means over the period, as speeds from encoder counts are.
    pub means: bool,
    /// What is learned; `None` learns nothing.
    pub learning: Option<Learning>,
    /// The control law.
    pub controller: ControllerGains,
    /// When the robot stops by itself.
    pub safety: Safety,
}

/// An effect of the model, and where it acts.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Attachment {
    /// Identifier of the effect, as in `[effect.<id>]`.
    pub id: String<NAME>,
    /// Positions of its channels in the plant's declaration.
    pub channels: Vec<u8, CHANNELS>,
    /// Values of its parameters, in the order in which the effect declares them.
    pub values: Values,
}

/// Recursive least squares, one per controlled state, guarded.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Learning {
    /// Forgetting, in (0, 1].
    pub forgetting: f64,
    /// The covariance starts as this multiple of the identity.
    pub initial_covariance: f64,
    /// Greatest variance; at least the initial one.
    pub covariance_limit: f64,
    /// Least value of each parameter of the plant.
    pub low: Values,
    /// Greatest value of each parameter of the plant.
    pub high: Values,
    /// Size of a noticeable change of each parameter of the plant.
    pub scale: Values,
    /// Innovations up to this size teach nothing, one per controlled state, of its unit per second.
    pub dead_zone: Signals,
    /// Least excitation, one per controlled state, of its unit per second; 0: every sample is learned from.
    pub least_excitation: Signals,
    /// Samples over which excitation and noise are averaged.
    pub window: f64,
    /// The control law uses what was learned.
    pub certainty_equivalence: bool,
}

/// The feedback-linearising PI law, one pair of gains per controlled state.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ControllerGains {
    /// `K_p` of `H(s)`, 1/s.
    pub proportional: Vec<f64, SIGNALS>,
    /// `K_i` of `H(s)`, 1/s².
    pub integral: Vec<f64, SIGNALS>,
    /// Largest command, one per input, in its unit.
    pub limit: Vec<f64, SIGNALS>,
}

/// When a robot stops by itself.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Safety {
    /// Periods without a valid step until the motors are let go.
    pub watchdog_ticks: u16,
    /// A measurement older than this is stale: nothing is learned from it, µs.
    pub stale_us: u32,
    /// Stale measurements one after the other until the robot stops.
    pub stale_ticks: u16,
    /// Least voltage of the supply, V.
    pub least_supply: f32,
    /// Periods in which an input of more than `encoder_input` moves nothing until the encoder counts as
    /// disconnected.
    pub encoder_ticks: u16,
    /// An input of this size turns every wheel, in the unit of the inputs.
    pub encoder_input: f32,
}
