//! The quick way through a table of plain numbers, in pieces of text that all cores read at once.
//!
//! It is taken from the second row on, where the general reader has found the names, the units and the columns of words.
//! A line without quotes is split at its separators; a number is read while its end is looked for. Whatever is not as
//! plain as that (a quote, a lone carriage return, a row of another width, a field that is no number) ends it, and the
//! general reader reads the whole text again: so values, lines and messages are always those of that one.
//!
//! ```text
//! value = m · 10ᵉ      exact where m < 2⁵³ and |e| ≤ 22: both are doubles, and one operation rounds once
//! ```
//!
//! (Clinger, "How to read floating point numbers accurately", PLDI 1990.) Other numbers are those of the standard library.

use memchr::{memchr, memchr_iter, memchr2, memchr2_iter};
use rayon::prelude::*;

use super::RowLines;
use crate::dialect;

/// Bytes of text that one core reads at a time: what its cache holds, with the numbers of it.
const PIECE: usize = 1 << 17;
/// Pieces of a batch. What they hold is copied into the table before the next batch, so little is held twice.
const BATCH: usize = 64;
/// Integers below this are doubles: 2⁵³.
const EXACT: u64 = 1 << 53;
/// Powers of ten that are doubles.
const POWERS: [f64; 23] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16,
    1e17, 1e18, 1e19, 1e20, 1e21, 1e22,
];
/// Digits that fit into 64 bits.
const DIGITS: usize = 19;

/// What is not plain.
pub(super) struct Unusual;

/// How the rows of a table are written.
#[derive(Clone, Copy)]
pub(super) struct Rows {
    pub(super) delimiter: u8,
    /// Fields of a row.
    pub(super) width: usize,
}

/// The values of some text, and where they stand.
#[derive(Default)]
struct Piece {
    values: Vec<f64>,
    lines: RowLines,
    /// Line ends.
    ends: usize,
}

impl Rows {
    /// Whether a table with this separator can be read this way.
    pub(super) fn plain(self) -> bool {
        matches!(self.delimiter, b',' | b';' | b'\t') && self.width > 0
    }

    /// Reads numbers, on all cores, behind those of `values`; `line` is the one where `text` begins.
    pub(super) fn numbers(
        self,
        text: &str,
        line: usize,
        values: &mut Vec<f64>,
        lines: &mut RowLines,
    ) -> Result<(), Unusual> {
        self.reserve(text, values);
        let number = |field: &str| dialect::number(field, self.delimiter);
        let (mut rest, mut line) = (text, line);
        // Their room serves every batch.
        let mut pieces: Vec<Piece> = Vec::new();
        while !rest.is_empty() {
            let texts = cut(&mut rest);
            pieces.resize_with(texts.len().max(pieces.len()), Piece::default);
            (texts.par_iter().zip(&mut pieces))
                .try_for_each(|(text, piece)| self.read(text, &[], |_, f, _| number(f), piece))?;
            for piece in pieces.iter().take(texts.len()) {
                values.extend_from_slice(&piece.values);
                lines.extend(&piece.lines, line - 1);
                line += piece.ends;
            }
        }
        Ok(())
    }

    /// The same with columns of words or times among them, one row after the other: `value` is asked for each field
    /// that is not a plain number, and for each one of the columns `words`.
    pub(super) fn mixed(
        self,
        text: &str,
        line: usize,
        words: &[usize],
        mut value: impl FnMut(usize, &str, usize) -> Option<f64>,
        (values, lines): (&mut Vec<f64>, &mut RowLines),
    ) -> Result<(), Unusual> {
        self.reserve(text, values);
        let (mut rest, mut line) = (text, line);
        let mut piece = Piece::default();
        while !rest.is_empty() {
            for text in cut(&mut rest) {
                let before = line - 1;
                let asked = |at: usize, field: &str, of: usize| value(at, field, before + of);
                self.read(text, words, asked, &mut piece)?;
                values.extend_from_slice(&piece.values);
                lines.extend(&piece.lines, before);
                line += piece.ends;
            }
        }
        Ok(())
    }

    /// Room for the values of all lines: no more than the text can hold, since a row has a byte and more for each field.
    fn reserve(self, text: &str, values: &mut Vec<f64>) {
        let rows = 1 + memchr_iter(b'\n', text.as_bytes()).count();
        values.reserve((rows * self.width).min(text.len() + 1));
    }

    /// Reads whole lines, the first of which is line 1.
    fn read(
        self,
        text: &str,
        words: &[usize],
        mut value: impl FnMut(usize, &str, usize) -> Option<f64>,
        out: &mut Piece,
    ) -> Result<(), Unusual> {
        let bytes = text.as_bytes();
        let ends_line = |at: usize| bytes.get(at + 1) == Some(&b'\n');
        if memchr2_iter(b'"', b'\r', bytes).any(|at| bytes[at] == b'"' || !ends_line(at)) {
            return Err(Unusual);
        }
        out.values.clear();
        out.lines = RowLines::default();
        let (mut at, mut line) = (0, 1);
        while let Some(first) = bytes.get(at) {
            // Blank lines and comments.
            let skipped = match first {
                b'\n' => Some(at),
                b'\r' => Some(at + 1),
                b'#' => Some(memchr(b'\n', &bytes[at..]).map_or(bytes.len(), |n| at + n)),
                _ => None,
            };
            if let Some(end) = skipped {
                line += usize::from(end < bytes.len());
                at = end + 1;
                continue;
            }
            for column in 0..self.width {
                let last = column + 1 == self.width;
                let field = Field::new(text, at, self.delimiter);
                let number = match words.contains(&column) {
                    true => None,
                    false => field.number().filter(|(_, end)| field.ends(*end)),
                };
                let (read, end) = match number {
                    Some(found) => found,
                    None => {
                        let (text, end) = field.text();
                        // A row of one empty field is none.
                        if self.width == 1 && text.is_empty() {
                            return Err(Unusual);
                        }
                        (value(column, text, line).ok_or(Unusual)?, end)
                    }
                };
                out.values.push(read);
                let separated = bytes.get(end) == Some(&self.delimiter);
                at = match (last, separated) {
                    (false, true) => end + 1,
                    (true, false) => end,
                    // A separator at the end of a row closes its last field.
                    (true, true) => {
                        let (text, end) = Field::new(text, end + 1, self.delimiter).text();
                        if !text.is_empty() || bytes.get(end) == Some(&self.delimiter) {
                            return Err(Unusual);
                        }
                        end
                    }
                    (false, false) => return Err(Unusual),
                };
            }
            at += usize::from(bytes.get(at) == Some(&b'\r'));
            out.lines.push(line);
            line += usize::from(at < bytes.len());
            at += 1;
        }
        out.ends = line - 1;
        Ok(())
    }
}

/// Takes a batch of pieces off the text: each ends with a line, or with the text.
fn cut<'t>(rest: &mut &'t str) -> Vec<&'t str> {
    let mut pieces = Vec::with_capacity(BATCH);
    while pieces.len() < BATCH && !rest.is_empty() {
        let ahead = rest.as_bytes().get(PIECE..);
        let end = ahead.and_then(|ahead| memchr(b'\n', ahead));
        let (piece, behind) = match end {
            // A line feed is never a part of another character.
            Some(end) => rest.split_at(PIECE + end + 1),
            None => (*rest, ""),
        };
        pieces.push(piece);
        *rest = behind;
    }
    pieces
}

/// A field that begins somewhere.
struct Field<'t> {
    text: &'t str,
    at: usize,
    delimiter: u8,
}

impl<'t> Field<'t> {
    fn new(text: &'t str, at: usize, delimiter: u8) -> Self {
        Self {
            text,
            at,
            delimiter,
        }
    }

    /// Whether a field ends there.
    fn ends(&self, at: usize) -> bool {
        match self.text.as_bytes().get(at) {
            Some(b) => *b == self.delimiter || matches!(b, b'\n' | b'\r'),
            None => true,
        }
    }

    /// What stands in it without the spaces around it, and where it ends.
    fn text(&self) -> (&'t str, usize) {
        let bytes = self.text.as_bytes().get(self.at..).unwrap_or_default();
        let length = memchr2(self.delimiter, b'\n', bytes).unwrap_or(bytes.len());
        let end = self.at + length;
        let field = self.text.get(self.at..end).unwrap_or_default().trim();
        (field, end)
    }

    /// A plain number at the beginning of the field, and where it ends: sign, digits, a point, digits, an exponent. The
    /// point may be a comma where commas do not separate.
    #[inline]
    fn number(&self) -> Option<(f64, usize)> {
        let bytes = self.text.as_bytes();
        let mut at = self.at;
        let negative = bytes.get(at) == Some(&b'-');
        at += usize::from(negative || bytes.get(at) == Some(&b'+'));
        let mut mantissa = 0u64;
        let from = at;
        digits(bytes, &mut at, &mut mantissa);
        let mut count = at - from;
        let mut exponent = 0i32;
        let comma = match bytes.get(at) {
            Some(b'.') => Some(false),
            Some(b',') if self.delimiter != b',' => Some(true),
            _ => None,
        };
        if comma.is_some() {
            at += 1;
            let from = at;
            digits(bytes, &mut at, &mut mantissa);
            count += at - from;
            exponent = -i32::try_from(at - from).ok()?;
        }
        if count == 0 {
            return None;
        }
        if let Some(b'e' | b'E') = bytes.get(at) {
            at += 1;
            let minus = bytes.get(at) == Some(&b'-');
            at += usize::from(minus || bytes.get(at) == Some(&b'+'));
            let (from, mut power) = (at, 0u64);
            digits(bytes, &mut at, &mut power);
            if at == from || at - from > 4 {
                return None;
            }
            let power = i32::try_from(power).ok()?;
            exponent += if minus { -power } else { power };
        }
        let size = exponent.unsigned_abs() as usize;
        if count > DIGITS || mantissa >= EXACT || size >= POWERS.len() {
            let text = self.text.get(self.at..at)?;
            let value = match comma {
                Some(true) => text.replacen(',', ".", 1).parse(),
                _ => text.parse(),
            };
            return Some((value.ok()?, at));
        }
        let (whole, power) = (mantissa as f64, POWERS[size]);
        let value = match exponent < 0 {
            true => whole / power,
            false => whole * power,
        };
        Some((if negative { -value } else { value }, at))
    }
}

/// Adds digits to a number as long as there are any. What overflows is counted, and read in another way.
#[inline]
fn digits(bytes: &[u8], at: &mut usize, number: &mut u64) {
    while let Some(digit) = bytes.get(*at).map(|b| b.wrapping_sub(b'0')) {
        if digit > 9 {
            break;
        }
        *number = number.wrapping_mul(10).wrapping_add(u64::from(digit));
        *at += 1;
    }
}
