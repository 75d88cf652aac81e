//! Injuries for files: the same ones on every machine.

use crate::Random;

/// Pieces that hurt: numbers at the ends of their range, quotes, brackets, halves of characters.
const PIECES: [&str; 24] = [
    "nan",
    "-inf",
    "1e999",
    "1e-320",
    "-0",
    "9999999999999999999999",
    "\"",
    "'",
    "\\",
    "#",
    "[",
    "]",
    "{",
    "}",
    "[[",
    "=",
    ",",
    "\n",
    "\r",
    "\0",
    "\t",
    "µ",
    "\u{202e}",
    "null",
];

/// `bytes` with one to five injuries.
pub fn damaged(bytes: &[u8], random: &mut Random) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    for _ in 0..=random.below(5) {
        let at = random.below(bytes.len().max(1)).min(bytes.len());
        let end = (at + 1 + random.below(12)).min(bytes.len());
        match random.below(7) {
            0 => bytes.truncate(at),
            1 => drop(bytes.drain(at..end)),
            2 => {
                let copy = bytes[at..end].to_vec();
                bytes.splice(at..at, copy);
            }
            3 => {
                if let Some(byte) = bytes.get_mut(at) {
                    *byte = random.bits() as u8;
                }
            }
            4 => {
                // Swap two stretches of a line or more.
                let other = random.below(bytes.len().max(1)).min(bytes.len());
                let (low, high) = (at.min(other), at.max(other));
                bytes[low..high].rotate_left((high - low) / 2);
            }
            5 => {
                // A number is replaced.
                let digit = |b: &u8| b.is_ascii_digit();
                if let Some(from) = bytes[at..].iter().position(digit).map(|p| at + p) {
                    let length = bytes[from..].iter().take_while(|b| digit(b)).count();
                    let piece = PIECES[random.below(6)].bytes();
                    bytes.splice(from..from + length, piece);
                }
            }
            _ => {
                let piece = PIECES[random.below(PIECES.len())].bytes();
                bytes.splice(at..at, piece);
            }
        }
    }
    bytes
}
