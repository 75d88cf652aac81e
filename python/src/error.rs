//! Errors as a Python exception, with the place where the mistake is. The exception itself is written in
//! Python (`package/loopsight/_error.py`): the stable interface of Python 3.10 cannot subclass one.

use pyo3::prelude::*;
use pyo3::types::PyDict;

/// The line of a text in which `at` (bytes) lies.
fn line_at(text: &str, at: usize) -> Option<&str> {
    let start = text.get(..at)?.rfind('\n').map_or(0, |newline| newline + 1);
    text.get(start..)?.lines().next()
}

/// Makes the exception of a message and what else is known.
fn made(py: Python<'_>, message: &str, known: &Bound<'_, PyDict>) -> PyErr {
    let class = py
        .import("loopsight._error")
        .and_then(|module| module.getattr("Error"));
    match class.and_then(|class| class.call((message,), Some(known))) {
        Ok(value) => PyErr::from_value(value),
        Err(error) => error,
    }
}

/// The exception of a library error.
pub(crate) fn raised(py: Python<'_>, error: &loopsight::Error) -> PyErr {
    let known = PyDict::new(py);
    let excerpt = error
        .excerpt()
        .and_then(|(text, span)| line_at(text, span.start));
    let set = || -> PyResult<()> {
        known.set_item("help", error.help())?;
        known.set_item("file", error.file())?;
        known.set_item("line", error.line())?;
        known.set_item("column", error.column())?;
        known.set_item("excerpt", excerpt)?;
        known.set_item("exit_status", error.exit_status())?;
        known.set_item("shown", error.to_string())
    };
    match set() {
        Ok(()) => made(py, error.message(), &known),
        Err(error) => error,
    }
}

/// A request that this package itself refuses.
pub(crate) fn refused(py: Python<'_>, message: &str) -> PyErr {
    made(py, message, &PyDict::new(py))
}
