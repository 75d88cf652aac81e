//! The engine behind the Python package `loopsight`: classes around the library of the same name, and no
//! mathematics. The package in `package/loopsight` gives them the shape that Python users expect.

mod answer;
mod error;
mod log;
mod model;
mod questions;
mod session;
mod watched;

use pyo3::prelude::*;

#[pymodule]
mod _engine {
    #[pymodule_export]
    use crate::answer::Answer;
    #[pymodule_export]
    use crate::log::Log;
    #[pymodule_export]
    use crate::model::Model;
    #[pymodule_export]
    use crate::questions::{check, explain, inspect, page_style, parts, run};
    #[pymodule_export]
    use crate::session::Session;
}
