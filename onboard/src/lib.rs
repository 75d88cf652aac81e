//! The loop aboard a robot: plant, effects, learning and control law in fixed sizes, in `f32`, without `std`
//! and without an allocator; and the conversation that configures, runs and stops it.
//!
//! It is the same loop as on a desk: [`loopsight_core::Loop`] with [`loopsight_estimators::Rls`] under
//! [`loopsight_core::learning::Guarded`] and [`loopsight_controllers::FeedbackLinearizingPi`], over the same
//! source of every plant and effect. What a host does by probing a composed model is done here with a plant's
//! [`loopsight_core::ControlAffine`] view, so that it fits a microcontroller.
//!
//! Nothing here knows a board. What a board adds is a serial line, a timer and motors:
//!
//! ```text
//! bytes from the line ──► Session::take ──► replies, to the line
//! once per period     ──► Session::elapsed          the watchdog
//!                      or Session::sensed           the watchdog and a tick, with sensors of the board's own
//! Session::output     ──► motors; none: at rest
//! ```
//!
//! On a host the same [`Session`] is the twin that a firmware is held against, digit for digit.

#![cfg_attr(not(feature = "std"), no_std)]

mod effects;
mod efforts;
#[cfg(feature = "std")]
mod host;
mod learner;
mod model;
mod port;
mod robot;
mod session;
mod watch;

pub use effects::Known;
pub use efforts::Efforts;
#[cfg(feature = "std")]
pub use host::{Aboard, Acknowledged, Line, LineError, SafetySettings, SendError, Serial, send};
pub use learner::Learner;
pub use loopsight_link::Attachment;
pub use model::Model;
pub use port::{Port, Prompted};
pub use robot::Robot;
pub use session::{Meter, Sensors, Session};

/// The conversation of a Twil: a differential drive with two motors, whose equations have three parameters in
/// each row, measuring its forward speed and yaw rate.
pub type Twil<M> = Session<loopsight_plants::Ddmr, M, 6, 2, 4, 8, 12, 3>;
