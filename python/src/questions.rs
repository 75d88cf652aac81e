//! What can be asked without a session.

use std::path::PathBuf;

use loopsight::{InspectOptions, ListOptions, LogTo, Loop, PartRole, RunOptions, Session};
use pyo3::prelude::*;

use crate::answer::{Answer, answered};
use crate::error::{raised, refused};
use crate::log::Log;
use crate::watched::watched;

fn plain(py: Python<'_>, answer: &impl loopsight::Answer) -> PyResult<Answer> {
    Answer::plain(answer).map_err(|error| raised(py, &error))
}

/// What is in a log, and which plants could fit it.
#[pyfunction]
pub(crate) fn inspect(
    py: Python<'_>,
    log: &Log,
    plant: Option<String>,
    inputs: Vec<String>,
    outputs: Vec<String>,
) -> PyResult<Answer> {
    let mut options = InspectOptions::default();
    if let Some(plant) = plant {
        options = options.plant(plant);
    }
    options = inputs.into_iter().fold(options, InspectOptions::input);
    options = outputs.into_iter().fold(options, InspectOptions::measure);
    let answer = py.detach(|| loopsight::inspect(&log.0, &options));
    match answer {
        Ok(answer) => plain(py, &answer),
        Err(error) => Err(raised(py, &error)),
    }
}

/// Everything about a part: equation, parameters, where it fits.
#[pyfunction]
pub(crate) fn explain(py: Python<'_>, id: &str) -> PyResult<Answer> {
    match loopsight::explain(id) {
        Ok(answer) => plain(py, &answer),
        Err(error) => Err(raised(py, &error)),
    }
}

/// What can be composed.
#[pyfunction]
#[pyo3(signature = (role=None, plant=None))]
pub(crate) fn parts(py: Python<'_>, role: Option<&str>, plant: Option<&str>) -> PyResult<Answer> {
    if let (None | Some("effect"), Some(plant)) = (role, plant) {
        let answer = loopsight::effects_for(plant);
        return plain(py, &answer.map_err(|error| raised(py, &error))?);
    }
    if plant.is_some() {
        return Err(refused(py, "only effects are listed for a plant"));
    }
    let mut options = ListOptions::default();
    if let Some(name) = role {
        let Some(role) = PartRole::ALL.into_iter().find(|role| role.name() == name) else {
            let known: Vec<&str> = PartRole::ALL.into_iter().map(PartRole::name).collect();
            let why = format!(
                "there are no `{name}`, expected one of {}",
                known.join(", ")
            );
            return Err(refused(py, &why));
        };
        options = options.role(role);
    }
    plain(py, &loopsight::list(&options))
}

/// Whether files say what can be.
#[pyfunction]
pub(crate) fn check(py: Python<'_>, files: Vec<PathBuf>) -> PyResult<Answer> {
    plain(py, &loopsight::check(files))
}

/// Runs a control loop.
#[pyfunction]
pub(crate) fn run(
    py: Python<'_>,
    file: PathBuf,
    log: Option<PathBuf>,
    nowhere: bool,
    series: bool,
) -> PyResult<Answer> {
    let log = match log {
        Some(path) => LogTo::File(path),
        None if nowhere => LogTo::Nowhere,
        None => LogTo::AsWritten,
    };
    let work = |watch| {
        let control = Loop::from_file(&file)?;
        let session = Session::of_model(control.model()?);
        let options = RunOptions::default()
            .log(log)
            .series(series)
            .stopped_by("Ctrl-C")
            .watch(watch);
        session.run(&control, &options)
    };
    let answer = watched(py, None, work)?;
    answered(py, Ok(answer), series)
}
