//! What can be asked without a session.

use std::path::PathBuf;

use loopsight::{InspectOptions, ListOptions, LogTo, Loop, PartRole, RunOptions, Session};
use pyo3::prelude::*;

use crate::answer::{Answer, long};
use crate::error::{raised, refused};
use crate::log::Log;
use crate::watched::Told;

fn plain<A: loopsight::Answer>(py: Python<'_>, answer: loopsight::Result<A>) -> PyResult<Answer> {
    answer
        .and_then(|answer| Answer::plain(&answer))
        .map_err(|error| raised(py, &error))
}

/// What is in a log, and which plants could fit it.
#[pyfunction]
pub(crate) fn inspect(
    py: Python<'_>,
    log: &Log,
    plant: Option<String>,
    inputs: Vec<String>,
    outputs: Vec<String>,
    period_s: Option<f64>,
) -> PyResult<Answer> {
    let mut options = InspectOptions::default();
    options.period_s = period_s;
    if let Some(plant) = plant {
        options = options.plant(plant);
    }
    options = inputs.into_iter().fold(options, InspectOptions::input);
    options = outputs.into_iter().fold(options, InspectOptions::measure);
    plain(py, py.detach(|| loopsight::inspect(&log.0, &options)))
}

/// Everything about a part: equation, parameters, where it fits.
#[pyfunction]
pub(crate) fn explain(py: Python<'_>, id: &str) -> PyResult<Answer> {
    plain(py, loopsight::explain(id))
}

/// What can be composed.
#[pyfunction]
#[pyo3(signature = (role=None, plant=None))]
pub(crate) fn parts(py: Python<'_>, role: Option<&str>, plant: Option<&str>) -> PyResult<Answer> {
    if let (None | Some("effect"), Some(plant)) = (role, plant) {
        return plain(py, loopsight::effects_for(plant));
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
    plain(py, Ok(loopsight::list(&options)))
}

/// The style of every page: CSS.
#[pyfunction]
pub(crate) fn page_style() -> &'static str {
    loopsight::PAGE_STYLE
}

/// Whether files say what can be.
#[pyfunction]
pub(crate) fn check(py: Python<'_>, files: Vec<PathBuf>) -> PyResult<Answer> {
    plain(py, Ok(loopsight::check(files)))
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
    long(py, Told::default(), work)
}
