//! Chunks of MCAP: unpacked as far as their size allows, and checked.

use std::borrow::Cow;
use std::io::Read;

use crate::bytes::Bytes;
use crate::detect::Format;
use crate::error::FormatError;
use crate::input::{UNPACK_FACTOR, UNPACK_LEAST, too_large, unpack_zstd};

pub(super) struct Chunk<'c> {
    size: u64,
    crc: u32,
    compression: &'c [u8],
    records: &'c [u8],
}

impl<'c> Chunk<'c> {
    pub(super) fn parse(content: &'c [u8]) -> Option<Self> {
        let mut bytes = Bytes::new(content);
        let (_start, _end) = (bytes.u64()?, bytes.u64()?);
        let (size, crc) = (bytes.u64()?, bytes.u32()?);
        let compression = bytes.text32()?;
        let length = usize::try_from(bytes.u64()?).ok()?;
        Some(Self {
            size,
            crc,
            compression,
            records: bytes.take(length)?,
        })
    }

    /// The records; `at` is where the chunk stands in the file.
    pub(super) fn unpack(&self, at: u64, log: &str) -> Result<Cow<'c, [u8]>, FormatError> {
        let packed = self.records.len() as u64;
        let limit = UNPACK_LEAST.max(packed.saturating_mul(UNPACK_FACTOR));
        if self.size > limit {
            return Err(too_large(log, "an unpacked chunk", limit));
        }
        let damaged = |expected: &str, found: String| FormatError::Damaged {
            log: log.into(),
            format: Format::Mcap,
            position: at,
            expected: expected.into(),
            found: found.into(),
        };
        // One byte more than promised is enough to see that the promise is false.
        let most = self.size + 1;
        let mut data = Vec::new();
        let read = match self.compression {
            b"" => return self.checked(Cow::Borrowed(self.records), &damaged),
            b"lz4" => lz4_flex::frame::FrameDecoder::new(self.records)
                .take(most)
                .read_to_end(&mut data),
            b"zstd" => unpack_zstd(self.records, most, &mut data),
            other => {
                let name = String::from_utf8_lossy(other).into_owned();
                return Err(damaged(
                    "a chunk packed by lz4 or zstd",
                    format!("`{name}`"),
                ));
            }
        };
        if let Err(e) = read {
            return Err(damaged("a chunk that unpacks", e.to_string()));
        }
        self.checked(Cow::Owned(data), &damaged)
    }

    fn checked(
        &self,
        data: Cow<'c, [u8]>,
        damaged: &dyn Fn(&str, String) -> FormatError,
    ) -> Result<Cow<'c, [u8]>, FormatError> {
        if data.len() as u64 != self.size {
            let expected = format!("a chunk of {} bytes", self.size);
            return Err(damaged(&expected, data.len().to_string()));
        }
        // Zero: the writer computed none.
        if self.crc != 0 {
            let crc = crc32fast::hash(&data);
            if crc != self.crc {
                let expected = format!("a chunk with the checksum {:#010x}", self.crc);
                return Err(damaged(&expected, format!("{crc:#010x}")));
            }
        }
        Ok(data)
    }
}
