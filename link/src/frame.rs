//! Frames: a checksum that detects errors of the line, and a byte that separates messages.

use core::fmt;

use crc::{CRC_32_ISCSI, Crc};
use serde::{Serialize, de::DeserializeOwned};

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
    let mut plain = [0; MESSAGE];
    let plain = postcard::to_slice_crc32(message, &mut plain, SUM.digest())
        .map_err(|_| FrameError::TooLong)?;
    let length = cobs::encode(plain, buffer);
    let end = buffer.get_mut(length).ok_or(FrameError::TooLong)?;
    *end = 0;
    Ok(length + 1)
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
        let (length, overrun) = (self.length, self.overrun);
        self.clear();
        if overrun {
            return Some(Err(FrameError::TooLong));
        }
        // Zeros in a row are no frames: a line may begin with one.
        (length > 0).then(|| decode(&mut self.buffer[..length]))
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

fn decode<T: DeserializeOwned>(frame: &mut [u8]) -> Result<T, FrameError> {
    let length = cobs::decode_in_place(frame).map_err(|_| FrameError::Cut)?;
    let plain = frame.get(..length).ok_or(FrameError::Cut)?;
    // The checksum covers the whole frame: bytes after the message are an error.
    match postcard::take_from_bytes_crc32(plain, SUM.digest()) {
        Ok((message, [])) => Ok(message),
        _ => Err(FrameError::Broken),
    }
}
