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

mod affine_plant;
mod effects;
mod efforts;
mod estimator;
#[cfg(feature = "std")]
mod host;
mod law;
mod learner;
mod parts;
mod port;
mod robot;
mod session;
mod watch;

pub use affine_plant::AffinePlant;
pub use effects::{EffectSet, acts_aboard};
pub use efforts::Efforts;
pub use estimator::{OnboardEstimator, RowEstimator};
#[cfg(feature = "std")]
pub use host::{Aboard, Acknowledged, Line, LineError, SafetySettings, SendError, Serial, send};
pub use law::OnboardLaw;
pub use learner::Learner;
pub use loopsight_link::Attachment;
pub use parts::{Parts, PerEffort, PerInput, PerParameter, PerRow, PerState, Twil};
pub use port::{Port, Prompted};
pub use robot::{Done, Robot};
pub use session::{Meter, Sensors, Session};

/// What [`aboard!`] needs.
#[doc(hidden)]
pub mod __private {
    pub use crate::effects::{contribution, most_reads};
    pub use loopsight_controllers::FeedbackLinearizingPi;
    pub use loopsight_core::learning::Guarded;
    pub use loopsight_core::{Effect, EffectMeta, Plant, Real};
    pub use loopsight_link::PARAMETERS;
    pub use loopsight_plants::effects;
    pub use nalgebra::Const;
}
