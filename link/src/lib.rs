//! The protocol between a host and a robot on a serial line: messages, frames, a handshake.
//!
//! [`encode`] makes a frame of a message. A [`Decoder`] takes bytes as they come and finds the messages in them:
//!
//! ```
//! use loopsight_link::{Decoder, Hello, LONGEST, Request, VERSION, encode};
//!
//! let hello = Request::Hello(Hello { version: VERSION, session: 7 });
//! let mut frame = [0; LONGEST];
//! let length = encode(&hello, &mut frame)?;
//!
//! let mut decoder = Decoder::default();
//! let mut heard = frame[..length].iter().filter_map(|byte| decoder.take(*byte));
//! assert_eq!(heard.next(), Some(Ok(hello)));
//!
//! // A bit that the line flips is noticed: nothing is taken for a message.
//! frame[2] ^= 0b100;
//! let mut heard = frame[..length].iter().filter_map(|byte| decoder.take::<Request>(*byte));
//! assert!(heard.all(|message| message.is_err()));
//! # Ok::<(), loopsight_link::FrameError>(())
//! ```
//!
//! **Frames.**
//!
//! ```text
//! frame = COBS(postcard(message) + CRC-32C) + 0x00
//! ```
//!
//! A zero byte ends every frame and occurs nowhere else. A receiver that starts in the middle, or lost bytes, is
//! synchronous again with the next frame. COBS does not detect a flipped bit; the checksum does. A frame whose
//! checksum is wrong is dropped.
//!
//! **Conversation.** Each side speaks when spoken to. Only a robot with sensors of its own speaks by itself.
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
//! A robot without sensors is measured by its host, and answers each step. A robot with motors and encoders of
//! its own ticks by its own timer from the first step on. Its steps carry no measurement: they bring the
//! reference, and say that the host is there. It reports each of its ticks in an [`Act`], with what it measured.
//!
//! The host draws the number of a session at random. A message with another number than that of the last
//! greeting is answered with a stop, so each side notices when the other was restarted. [`Hello`] is the same in
//! all versions.
//!
//! The numbers of a robot's loop are `f32`, sent bit by bit. Units are SI. Ages of measurements are whole
//! microseconds.
//!
//! This crate has no features. It needs neither `std` nor an allocator.

#![no_std]

mod configuration;
mod frame;
mod message;
mod reason;

pub use configuration::{
    Attachment, CHANNELS, Configuration, ControllerGains, EFFECTS, Learning, NAME, PARAMETERS,
    SIGNALS, Safety,
};
pub use frame::{Decoder, Frame, FrameError, LONGEST, MESSAGE, encode};
pub use message::{Act, Hello, Measured, Note, Reply, Request, Sensed, Signals, Values, Welcome};
pub use reason::{Reason, Unusable};

/// Version of the messages. Either side refuses another one.
pub const VERSION: u16 = 2;
