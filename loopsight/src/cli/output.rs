//! Results as text and as JSON.

use std::io::Write as _;

use crate::answers::Answer;
use crate::error::Result;
pub(crate) use crate::words::report::columns;

/// Something for the person at the terminal that is not the result: standard error. A closed pipe is not an error
/// here either.
pub(crate) fn note(text: &str) {
    let _ = writeln!(std::io::stderr().lock(), "{text}");
}

/// The result: standard output. A closed pipe is not an error.
pub(crate) fn result(text: &str) {
    let mut out = std::io::stdout().lock();
    let _ = out.write_all(text.as_bytes());
    let _ = out.write_all(b"\n");
}

/// An answer: as text on standard output, or as JSON there and the text on standard error.
pub(crate) fn answer(answer: &impl Answer, text: &str, json: bool) -> Result<()> {
    if json {
        note(text);
        result(&answer.to_json()?);
    } else {
        result(text);
    }
    Ok(())
}

/// The command as it was typed, for the foot of a page.
pub(crate) fn command_line() -> String {
    let words: Vec<String> = std::env::args_os()
        .skip(1)
        .map(|w| w.to_string_lossy().into_owned())
        .map(|w| if w.contains(' ') { format!("'{w}'") } else { w })
        .collect();
    format!("loopsight {}", words.join(" "))
}
