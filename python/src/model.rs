//! A model, as Python has it.

use std::path::PathBuf;

use pyo3::prelude::*;

use crate::error::raised;

/// A plant with effects, sensors and parameter values, made from TOML.
#[pyclass(frozen, module = "loopsight", from_py_object)]
#[derive(Clone)]
pub struct Model(pub(crate) loopsight::Model);

/// Name, symbol, unit, sentence, value, range, and whether a fit estimates it.
type Parameter = (
    String,
    &'static str,
    String,
    &'static str,
    Option<f64>,
    [f64; 2],
    bool,
);

#[pymethods]
impl Model {
    #[staticmethod]
    fn from_file(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        let model = loopsight::Model::from_file(path);
        model.map(Self).map_err(|error| raised(py, &error))
    }

    #[staticmethod]
    #[pyo3(signature = (text, name="model.toml"))]
    fn from_toml(py: Python<'_>, text: &str, name: &str) -> PyResult<Self> {
        let model = loopsight::Model::from_toml(name, text);
        model.map(Self).map_err(|error| raised(py, &error))
    }

    #[staticmethod]
    fn from_plant(py: Python<'_>, plant: &str) -> PyResult<Self> {
        let model = loopsight::Model::of_plant(plant);
        model.map(Self).map_err(|error| raised(py, &error))
    }

    #[getter]
    fn name(&self) -> &str {
        self.0.name()
    }

    #[getter]
    fn file(&self) -> &str {
        self.0.file()
    }

    #[getter]
    fn plant(&self) -> &'static str {
        self.0.plant()
    }

    #[getter]
    fn effects(&self) -> Vec<(&'static str, Vec<&'static str>)> {
        self.0.effects().collect()
    }

    fn parameters(&self) -> Vec<Parameter> {
        let parameters = self.0.parameters();
        parameters
            .map(|p| {
                let (name, unit) = (p.name.to_owned(), p.unit.to_owned());
                (name, p.symbol, unit, p.doc, p.value, p.range, p.estimated)
            })
            .collect()
    }

    fn value(&self, name: &str) -> Option<f64> {
        self.0.value(name)
    }

    fn with_value(&self, py: Python<'_>, name: &str, value: f64) -> PyResult<Self> {
        let model = self.0.with_value(name, value);
        model.map(Self).map_err(|error| raised(py, &error))
    }

    fn to_toml(&self) -> &str {
        self.0.to_toml()
    }

    fn save(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        let written = self.0.save(path);
        written.map(|_| ()).map_err(|error| raised(py, &error))
    }
}
