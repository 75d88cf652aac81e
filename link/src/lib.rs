//! What a host and a robot say to each other over a serial line: messages, frames, a handshake.
//!
//! ```text
//! frame = COBS(postcard(message) + CRC-32C) + 0x00
//! ```
//!
//! A zero byte ends every frame and occurs nowhere else, so whoever joins in the middle, or lost
//! bytes, is in step again with the next frame. COBS itself notices no flipped bit; the sum does, and
//! nothing whose sum is wrong is ever looked at.
//!
//! **Conversation.** Each side speaks when spoken to, but for what a robot has to say of itself.
//!
//! ```text
//! host                                    robot
//! Hello { version, session }      ──►
//!                                 ◄──     Hello { version, session, period_us, name }
//! Configure { session, .. }       ──►
//!                                 ◄──     Configured { session }  or  Stopped { reason }
//! Step { session, tick, .. }      ──►                                             once per period
//!                                 ◄──     Act { session, tick, .. }
//! Stop { session }                ──►
//!                                 ◄──     Stopped { session, tick, reason }
//! ```
//!
//! A robot without sensors is measured by its host, and answers each step. A robot with motors and encoders
//! of its own ticks by its own timer from the first step on: steps, without a measurement, tell it the
//! reference and that its host is there; each of its ticks is said by an Act, with what was measured.
//!
//! The host draws a session's number at random. What carries another one than that of the last
//! greeting is answered with a stop: so each side notices when the other was started anew. [`Hello`] is
//! the same in all versions.
//!
//! Numbers of a robot's loop are `f32`; they travel bit by bit. Units are SI; times of the line are
//! whole microseconds.
//!
//! No `std`, no allocator.

#![no_std]

mod configuration;
mod frame;
mod message;
mod reason;

pub use configuration::{
    Attachment, CHANNELS, Configuration, ControllerGains, EFFECTS, Learning, NAME, PARAMETERS,
    SIGNALS, Safety,
};
pub use frame::{Decoder, FrameError, LONGEST, MESSAGE, encode};
pub use message::{Act, Hello, Measured, Note, Reply, Request, Sensed, Signals, Values, Welcome};
pub use reason::{Reason, Unusable};

/// Version of the messages. Either side refuses another one.
pub const VERSION: u16 = 2;
