//! The adaptive loop aboard a robot: plant, effects, learning and control law in fixed sizes, in `f32`, without
//! `std` and without an allocator. And the conversation that configures, runs and stops it.
//!
//! It is the same loop as on a host: [`loopsight_core::Loop`] with an estimator under
//! [`loopsight_core::learning::Guarded`] and a control law, over the same source of every plant and effect. A host
//! probes a composed model at run time. Here a plant's [`loopsight_core::ControlAffine`] view does that work, so that
//! it fits a microcontroller.
//!
//! What is compiled in is listed once, by [`aboard!`]. The list is a type; [`Twil`] is the library's own. A board adds a
//! serial line, a timer and motors:
//!
//! ```text
//! bytes from the line ──► Session::take ──► replies, to the line
//! once per period     ──► Session::elapsed          the watchdog
//!                      or Session::sensed           the watchdog and a tick, with sensors of the board's own
//! Session::output     ──► motors; none: at rest
//! ```
//!
//! ```
//! use loopsight_link::{Hello, LONGEST, Reply, Request, VERSION, encode};
//! use loopsight_onboard::{Session, Twil};
//!
//! let mut robot = Session::<Twil, _>::new(10_000, ());
//! let mut frame = [0; LONGEST];
//! let hello = Request::Hello(Hello { version: VERSION, session: 7 });
//! let length = encode(&hello, &mut frame)?;
//! let mut said = Vec::new();
//! for byte in &frame[..length] {
//!     robot.take(*byte, &mut |reply| said.push(reply.clone()));
//! }
//! assert!(matches!(&said[..], [Reply::Hello(welcome)] if welcome.plant == "ddmr"));
//! assert!(robot.output().is_none(), "at rest until it is configured");
//! # Ok::<(), loopsight_link::FrameError>(())
//! ```
//!
//! `examples/twil-firmware` in the repository is a whole firmware. On a host the same [`Session`] is its twin: both
//! give the same commands and parameters, digit for digit.
//!
//! | feature | what it adds |
//! |---|---|
//! | `std` (default) | the host's end of the line: the controller `aboard` and the driver `serial` of a loop file, and `send` |

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
pub use host::{
    Aboard, Acknowledged, Changeable, Line, LineError, SafetySettings, SendError, Serial, send,
};
pub use law::OnboardLaw;
pub use learner::Learner;
pub use loopsight_link::Attachment;
pub use parts::{Parts, PerEffort, PerInput, PerParameter, PerRow, PerState, Twil};
pub use port::{Port, Prompted};
pub use robot::Robot;
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
