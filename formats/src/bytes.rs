//! Bytes taken one after the other, never beyond the end.

use std::io::Read;

use crate::error::FormatError;
use crate::input::Input;

/// A slice that is read from front to back; whatever is not there is `None`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bytes<'b> {
    data: &'b [u8],
    at: usize,
}

macro_rules! numbers {
    ($($name:ident $type:ty),*) => {
        $(pub(crate) fn $name(&mut self) -> Option<$type> {
            self.array().map(<$type>::from_le_bytes)
        })*
    };
}

impl<'b> Bytes<'b> {
    pub(crate) fn new(data: &'b [u8]) -> Self {
        Self { data, at: 0 }
    }

    #[cfg(feature = "arrow")]
    pub(crate) fn at(&self) -> usize {
        self.at
    }

    pub(crate) fn left(&self) -> usize {
        self.data.len() - self.at
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.left() == 0
    }

    pub(crate) fn take(&mut self, n: usize) -> Option<&'b [u8]> {
        let end = self.at.checked_add(n)?;
        let taken = self.data.get(self.at..end)?;
        self.at = end;
        Some(taken)
    }

    pub(crate) fn rest(&mut self) -> &'b [u8] {
        let rest = self.data.get(self.at..).unwrap_or_default();
        self.at = self.data.len();
        rest
    }

    pub(crate) fn array<const N: usize>(&mut self) -> Option<[u8; N]> {
        self.take(N)?.try_into().ok()
    }

    numbers!(u8 u8, u16 u16, u32 u32, u64 u64);

    /// A text behind its length in four bytes.
    pub(crate) fn text32(&mut self) -> Option<&'b [u8]> {
        let n = self.u32()?;
        self.take(usize::try_from(n).ok()?)
    }
}

/// Whole numbers of 1 to 8 bytes, little-endian.
pub(crate) fn little(bytes: &[u8]) -> u64 {
    bytes
        .iter()
        .rev()
        .fold(0, |sum, b| (sum << 8) | u64::from(*b))
}

/// An input that is read from front to back in pieces, each held until the next one is asked for.
pub(crate) struct Stream<'i> {
    input: &'i mut Input,
    at: u64,
    buffer: Vec<u8>,
}

impl<'i> Stream<'i> {
    pub(crate) fn new(input: &'i mut Input) -> Result<Self, FormatError> {
        input.rewind()?;
        Ok(Self {
            input,
            at: 0,
            buffer: Vec::new(),
        })
    }

    /// Bytes read so far.
    pub(crate) fn at(&self) -> u64 {
        self.at
    }

    /// Bytes still to come.
    pub(crate) fn left(&self) -> u64 {
        self.input.size().saturating_sub(self.at)
    }

    /// The next `n` bytes, or nothing where there are fewer.
    pub(crate) fn take(&mut self, n: u64) -> Result<Option<&[u8]>, FormatError> {
        let Some(n) = usize::try_from(n).ok().filter(|n| *n as u64 <= self.left()) else {
            return Ok(None);
        };
        self.buffer.resize(n, 0);
        match self.input.read_exact(&mut self.buffer) {
            Ok(()) => {}
            Err(e) if e.kind() == std::io::ErrorKind::UnexpectedEof => return Ok(None),
            Err(e) => return Err(self.input.io(&e)),
        }
        self.at += n as u64;
        Ok(Some(&self.buffer))
    }

    /// Leaves out `n` bytes; false where there are fewer.
    pub(crate) fn skip(&mut self, n: u64) -> Result<bool, FormatError> {
        if n > self.left() {
            return Ok(false);
        }
        let mut left = n;
        while left > 0 {
            let step = left.min(1 << 16);
            if self.take(step)?.is_none() {
                return Ok(false);
            }
            left -= step;
        }
        Ok(true)
    }

    /// Starts anew at a byte.
    pub(crate) fn seek(&mut self, at: u64) -> Result<(), FormatError> {
        use std::io::{Seek, SeekFrom};
        let sought = self.input.seek(SeekFrom::Start(at));
        sought.map_err(|e| self.input.io(&e))?;
        self.at = at;
        Ok(())
    }

    pub(crate) fn name(&self) -> &str {
        self.input.name()
    }
}
