//! A log, as Python has it.

use std::ops::Range;
use std::path::PathBuf;

use numpy::{IntoPyArray, PyArray1, PyReadonlyArray1};
use pyo3::prelude::*;

use crate::error::{raised, refused};

/// What was applied to a machine and what was measured.
#[pyclass(frozen, module = "loopsight", from_py_object)]
#[derive(Clone)]
pub struct Log(pub(crate) loopsight::Log);

/// The columns of a run: each with name, unit and values. Without a unit the name says it at its end.
type Columns<'py> = Vec<(String, Option<String>, PyReadonlyArray1<'py, f64>)>;

#[pymethods]
impl Log {
    #[staticmethod]
    fn read(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        let log = py.detach(|| loopsight::Log::read(path));
        log.map(Self).map_err(|error| raised(py, &error))
    }

    #[staticmethod]
    fn from_bytes(py: Python<'_>, bytes: &[u8], name: &str) -> PyResult<Self> {
        let log = loopsight::Log::from_bytes(name, bytes);
        log.map(Self).map_err(|error| raised(py, &error))
    }

    #[staticmethod]
    fn from_columns(
        py: Python<'_>,
        name: &str,
        runs: Vec<(String, Columns<'_>)>,
    ) -> PyResult<Self> {
        let mut log = loopsight::Log::in_memory(name);
        for (run, columns) in &runs {
            log = log.run(run);
            for (column, unit, values) in columns {
                let values = values.as_slice()?;
                log = match unit {
                    Some(unit) => log.column(column, unit, values),
                    None => log.header(column, values),
                };
            }
        }
        // The lock is kept: nobody changes the arrays while they are copied.
        let log = log.build();
        log.map(Self).map_err(|error| raised(py, &error))
    }

    #[getter]
    fn name(&self) -> &str {
        self.0.name()
    }

    #[getter]
    fn columns(&self) -> Vec<String> {
        self.0.columns()
    }

    #[getter]
    fn runs(&self) -> usize {
        self.0.runs()
    }

    #[getter]
    fn rows(&self) -> usize {
        self.0.rows()
    }

    fn column<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyArray1<f64>>> {
        match self.0.column(name) {
            Some(values) => Ok(values.into_pyarray(py)),
            None => Err(refused(
                py,
                &format!(
                    "{} has no column `{name}`, expected one of {}",
                    self.0.name(),
                    self.0.columns().join(", ")
                ),
            )),
        }
    }

    fn part(&self, start: usize, end: usize) -> Self {
        Self(self.0.part(Range { start, end }))
    }

    fn without_runs(&self, py: Python<'_>, names: Vec<String>) -> PyResult<Self> {
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        let log = self.0.clone().without_runs(&names);
        log.map(Self).map_err(|error| raised(py, &error))
    }

    fn save(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        let written = py.detach(|| self.0.save(path));
        written.map(|_| ()).map_err(|error| raised(py, &error))
    }
}
