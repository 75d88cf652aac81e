//! MATLAB files of level 5: what `save` writes as v6 and v7.
//!
//! A header of 128 bytes, then data elements `type u32, size u32, content`, each a variable, most
//! of them packed by zlib. A variable is a channel; a matrix is one for each column (or row, where
//! those are fewer), with `y(:,2)` as another way to say `y[1]`; a structure has paths
//! (`data.signals.values`), a cell indices. Nothing has time stamps: a variable may be them.
//!
//! Reference: MathWorks, "MAT-File Format", chapter 1.

mod element;
mod matrix;

use std::io::Read;

use crate::detect::Format;
use crate::error::FormatError;
use crate::input::{Input, UNPACK_FACTOR, UNPACK_LEAST, too_large};
use crate::sink::Sink;
use element::{Bits, COMPRESSED, MATRIX};

const HEADER: usize = 128;

/// Reads all variables.
pub(crate) fn read(input: &mut Input, sink: &mut dyn Sink) -> Result<(), FormatError> {
    let name = input.name().to_owned();
    let size = input.size();
    input.rewind()?;
    let mut data = Vec::new();
    let read = input.read_to_end(&mut data);
    read.map_err(|e| input.io(&e))?;
    let big = data.get(126..128) == Some(b"MI");
    let mut bits = Bits::new(data.get(HEADER..).unwrap_or_default(), big);
    let limit = UNPACK_LEAST.max(size.saturating_mul(UNPACK_FACTOR));
    let mut left = limit;
    while !bits.is_empty() {
        let at = (HEADER + bits.at()) as u64;
        let Some((kind, length)) = bits.tag() else {
            sink.cut(at, "a variable");
            break;
        };
        let Some(content) = bits.take(length) else {
            sink.cut(at, "a variable");
            break;
        };
        let whole = match kind {
            COMPRESSED => {
                let mut unpacked = Vec::new();
                let packed = flate2::read::ZlibDecoder::new(content);
                let read = packed.take(left + 1).read_to_end(&mut unpacked);
                if let Err(e) = read {
                    return Err(damaged(
                        &name,
                        at,
                        "a variable that unpacks",
                        &e.to_string(),
                    ));
                }
                left = match left.checked_sub(unpacked.len() as u64) {
                    Some(left) => left,
                    None => return Err(too_large(&name, "the unpacked content", limit)),
                };
                let mut inner = Bits::new(&unpacked, big);
                match inner.tag() {
                    Some((MATRIX, n)) => match inner.take(n) {
                        Some(content) => matrix::variable(content, big, sink)?,
                        None => None,
                    },
                    _ => Some(()),
                }
            }
            MATRIX => {
                let done = matrix::variable(content, big, sink)?;
                bits.pad(length);
                done
            }
            // Elements of other types stand within variables only.
            _ => {
                bits.pad(length);
                Some(())
            }
        };
        if whole.is_none() {
            return Err(damaged(
                &name,
                at,
                "a variable",
                "one whose parts do not fit it",
            ));
        }
    }
    Ok(())
}

fn damaged(log: &str, position: u64, expected: &str, found: &str) -> FormatError {
    FormatError::Damaged {
        log: log.into(),
        format: Format::Mat5,
        position,
        expected: expected.into(),
        found: found.into(),
    }
}
