//! Frames: a checksum that detects errors of the line, and a byte that separates messages.

use core::fmt;

use crc::{CRC_32_ISCSI, Crc};
use postcard::ser_flavors::{Cobs, Slice, crc::CrcModifier};
use serde::{Deserialize, Serialize, de::DeserializeOwned};

use crate::Measured;

/// Longest message with its checksum, bytes.
pub const MESSAGE: usize = 896;
/// Longest frame, bytes: one more per 254, one at the start, and the zero.
pub const LONGEST: usize = MESSAGE + MESSAGE / 254 + 2;

/// CRC-32C: all errors of up to five bits are noticed in messages of up to 655 bytes (all but a very
/// full configuration), of up to three bits in longer ones; of others one in four thousand million is
/// not.
///
/// Reference: P. Koopman (2002), "32-bit cyclic redundancy codes for Internet applications",
/// International Conference on Dependable Systems and Networks, 459–468, table 1.
static SUM: Crc<u32> = Crc::<u32>::new(&CRC_32_ISCSI);

/// Why a frame has no message, or a message makes no frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum FrameError {
    /// More bytes than [`LONGEST`], or than the buffer holds.
    TooLong,
    /// Bytes of the frame are missing.
    Cut,
    /// The checksum is wrong, or the bytes are not a message.
    Broken,
}

impl fmt::Display for FrameError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            FrameError::TooLong => "the frame is too long",
            FrameError::Cut => "bytes of the frame are missing",
            FrameError::Broken => "the frame's checksum is wrong",
        })
    }
}

impl core::error::Error for FrameError {}

/// Writes the frame of `message` into `buffer`; returns its length.
///
/// # Errors
///
/// [`FrameError::TooLong`] if the message does not fit; the messages of this crate do.
pub fn encode<T: Serialize>(message: &T, buffer: &mut [u8; LONGEST]) -> Result<usize, FrameError> {
    // Checksum and separators are made as the bytes come: no copy of the message, and no second buffer to clear.
    let full = |_| FrameError::TooLong;
    let cobs = Cobs::try_new(Slice::new(buffer)).map_err(full)?;
    let sum = CrcModifier::new(cobs, SUM.digest());
    let frame = postcard::serialize_with_flavor(message, sum).map_err(full)?;
    Ok(frame.len())
}

/// Finds frames in a stream of bytes.
#[derive(Clone, Debug)]
pub struct Decoder {
    buffer: [u8; LONGEST],
    length: usize,
    /// More came than fits: all is dropped up to the next zero.
    overrun: bool,
}

impl Default for Decoder {
    fn default() -> Self {
        Self {
            buffer: [0; LONGEST],
            length: 0,
            overrun: false,
        }
    }
}

impl Decoder {
    /// Takes one byte. When the byte ends a frame, returns its message or what is wrong with it.
    pub fn take<T: DeserializeOwned>(&mut self, byte: u8) -> Option<Result<T, FrameError>> {
        let whole = self.whole(byte)?;
        Some(whole.and_then(|frame| frame.message()))
    }

    /// Takes one byte. When the byte ends a frame, returns that if its checksum is right.
    #[inline]
    pub fn whole(&mut self, byte: u8) -> Option<Result<Frame<'_>, FrameError>> {
        if byte != 0 {
            match self.buffer.get_mut(self.length) {
                Some(to) => {
                    *to = byte;
                    self.length += 1;
                }
                None => self.overrun = true,
            }
            return None;
        }
        self.end()
    }

    /// A frame is over. A function of its own: all bytes but one have no use for it.
    #[inline(never)]
    fn end(&mut self) -> Option<Result<Frame<'_>, FrameError>> {
        let (length, overrun) = (self.length, self.overrun);
        self.clear();
        if overrun {
            return Some(Err(FrameError::TooLong));
        }
        // Zeros in a row are no frames: a line may begin with one.
        (length > 0).then(|| Frame::new(&mut self.buffer[..length]))
    }

    /// Forgets what has come of a frame.
    pub fn clear(&mut self) {
        self.length = 0;
        self.overrun = false;
    }

    /// True in the middle of a frame.
    pub fn is_open(&self) -> bool {
        self.length > 0 || self.overrun
    }
}

/// A message in its bytes, whose checksum was right.
#[derive(Clone, Copy, Debug)]
pub struct Frame<'a>(&'a [u8]);

impl<'a> Frame<'a> {
    fn new(frame: &'a mut [u8]) -> Result<Self, FrameError> {
        let length = cobs::decode_in_place(frame).map_err(|_| FrameError::Cut)?;
        let all = frame.get(..length).ok_or(FrameError::Cut)?;
        let (plain, sum) = all.split_last_chunk().ok_or(FrameError::Broken)?;
        if SUM.checksum(plain) != u32::from_le_bytes(*sum) {
            return Err(FrameError::Broken);
        }
        Ok(Self(plain))
    }

    /// The message.
    ///
    /// # Errors
    ///
    /// [`FrameError::Broken`] where the bytes are another one, or more than one.
    pub fn message<T: DeserializeOwned>(self) -> Result<T, FrameError> {
        match postcard::take_from_bytes(self.0) {
            Ok((message, [])) => Ok(message),
            _ => Err(FrameError::Broken),
        }
    }

    /// The step, where the message is a [`Request::Step`](crate::Request::Step). A request has room for a configuration, and is
    /// copied from hand to hand; nearly all are steps, which are small.
    pub fn step(self) -> Option<Measured> {
        match self.message() {
            Ok(Kind::Step(step)) => Some(step),
            _ => None,
        }
    }
}

/// The kinds of [`Request`](crate::Request), in its order.
#[derive(Deserialize)]
enum Kind {
    Hello,
    Configure,
    Step(Measured),
    Stop,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Hello, Request};

    /// What is written as the bytes come is what copies would make of them, at every length about a separator's.
    #[test]
    fn a_frame_is_checksum_and_separators_one_after_the_other() {
        for length in (0..8).chain(240..264).chain(500..520) {
            let message = heapless::Vec::<u8, 600>::from_iter((0..length).map(|i| (i % 5) as u8));
            let mut buffer = [7; LONGEST];
            let found = encode(&message, &mut buffer).map(|length| &buffer[..length]);
            let (mut plain, mut expected) = ([0; MESSAGE], [0; LONGEST]);
            let plain = postcard::to_slice_crc32(&message, &mut plain, SUM.digest());
            let length = plain.map(|plain| cobs::encode(plain, &mut expected));
            let length = length.unwrap_or(0);
            assert_eq!(found, Ok(&expected[..=length]));
        }
    }

    #[test]
    fn a_step_is_found_and_nothing_else_is_one() {
        let list = |values: &[f32]| values.iter().copied().collect();
        let step = Measured {
            session: 7,
            tick: 300,
            age_us: 0,
            supply: 12.0,
            measured: list(&[0.1, -2.0]),
            reference: list(&[0.2, 0.0]),
        };
        let hello = Hello {
            version: 1,
            session: 7,
        };
        for (request, expected) in [
            (Request::Step(step.clone()), Some(step)),
            (Request::Hello(hello), None),
            (Request::Stop { session: 7 }, None),
        ] {
            let (mut buffer, mut decoder) = ([0; LONGEST], Decoder::default());
            let length = encode(&request, &mut buffer).unwrap_or(0);
            let mut ends = 0;
            for byte in &buffer[..length] {
                if let Some(Ok(frame)) = decoder.whole(*byte) {
                    assert_eq!(frame.step(), expected);
                    assert_eq!(frame.message(), Ok(request.clone()));
                    ends += 1;
                }
            }
            assert_eq!(ends, 1);
        }
    }
}
