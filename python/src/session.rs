//! A model and the logs of one machine, as Python has them.

use std::path::PathBuf;

use loopsight::{
    AddOptions, Ask, CompareOptions, DiagnoseOptions, Experiment, ExperimentOptions, FitOptions,
    ImproveOptions, Method, Scheme, SimulateOptions,
};
use pyo3::prelude::*;

use crate::answer::{Answer, answered, long};
use crate::error::{raised, refused};
use crate::log::Log;
use crate::model::Model;
use crate::watched::Told;

/// A model and the logs of one machine.
#[pyclass(frozen, module = "loopsight._engine")]
pub struct Session(loopsight::Session);

/// A function of the caller that long work calls, if there is one.
type Callback<'a, 'py> = Option<&'a Bound<'py, PyAny>>;

#[pymethods]
impl Session {
    #[new]
    #[pyo3(signature = (model, log, also, test, report))]
    fn new(
        py: Python<'_>,
        model: Option<Model>,
        log: Option<Log>,
        also: Vec<Log>,
        test: Option<Log>,
        report: Option<Log>,
    ) -> PyResult<Self> {
        let made = py.detach(|| {
            let mut session = match (model, log) {
                (Some(model), Some(log)) => loopsight::Session::new(model.0, log.0)?,
                (None, Some(log)) => loopsight::Session::of_log(log.0)?,
                (Some(model), None) => loopsight::Session::of_model(model.0),
                (None, None) => return Ok(None),
            };
            for log in also {
                session = session.also(log.0)?;
            }
            if let Some(log) = test {
                session = session.test(log.0)?;
            }
            match report {
                Some(log) => session.report(log.0).map(Some),
                None => Ok(Some(session)),
            }
        });
        match made {
            Ok(Some(session)) => Ok(Self(session)),
            Ok(None) => Err(refused(py, "neither a model nor a log was given")),
            Err(error) => Err(raised(py, &error)),
        }
    }

    #[getter]
    fn model(&self) -> Model {
        Model(self.0.model().clone())
    }

    /// Sentences of what is wrong with the logs, each with its weight.
    fn faults(&self) -> Vec<(String, String)> {
        let faults = self.0.faults();
        let shown = |fault: &loopsight::answers::LogFault| {
            let severity = format!("{:?}", fault.severity).to_lowercase();
            (severity, fault.detail.clone())
        };
        faults.iter().map(shown).collect()
    }

    fn compare(
        &self,
        py: Python<'_>,
        series: bool,
        progress: Callback<'_, '_>,
    ) -> PyResult<Answer> {
        let work = |watch| {
            let options = CompareOptions::default().series(series).watch(watch);
            self.0.compare(&options)
        };
        long(py, progress.into(), work)
    }

    fn fit(
        &self,
        py: Python<'_>,
        method: &str,
        regression: Option<&str>,
        max_iterations: Option<u64>,
        series: bool,
        progress: Callback<'_, '_>,
    ) -> PyResult<Answer> {
        let mut options = FitOptions::default().series(series).method(match method {
            "output-error" => Method::OutputError,
            "rls" => Method::Rls,
            other => {
                let why = format!("method is `{other}`, expected `output-error` or `rls`");
                return Err(refused(py, &why));
            }
        });
        match regression {
            None => {}
            Some("integrated") => options = options.regression(Scheme::Integrated),
            Some("euler") => options = options.regression(Scheme::Euler),
            Some(other) => {
                let why = format!("regression is `{other}`, expected `integrated` or `euler`");
                return Err(refused(py, &why));
            }
        }
        if let Some(most) = max_iterations {
            options = options.max_iterations(most);
        }
        let work = |watch| self.0.fit(&options.watch(watch));
        long(py, progress.into(), work)
    }

    fn diagnose(
        &self,
        py: Python<'_>,
        series: bool,
        progress: Callback<'_, '_>,
        early: Callback<'_, '_>,
    ) -> PyResult<Answer> {
        let work = |watch| {
            let options = DiagnoseOptions::default().series(series).watch(watch);
            self.0.diagnose(&options)
        };
        long(py, Told { progress, early }, work)
    }

    fn improve(
        &self,
        py: Python<'_>,
        discover: bool,
        series: bool,
        progress: Callback<'_, '_>,
        early: Callback<'_, '_>,
    ) -> PyResult<Answer> {
        let work = |watch| {
            let options = ImproveOptions::default()
                .discover(discover)
                .series(series)
                .watch(watch);
            self.0.improve(&options)
        };
        long(py, Told { progress, early }, work)
    }

    fn add(&self, py: Python<'_>, effect: &str, at: Vec<String>) -> PyResult<Answer> {
        answered(py, self.0.add(&AddOptions::new(effect).at(at)))
    }

    #[expect(clippy::too_many_arguments, reason = "the options, by name")]
    fn experiment(
        &self,
        py: Python<'_>,
        pin: Option<String>,
        separate: Option<(String, String)>,
        is_there: Option<String>,
        limit: Option<f64>,
        period_s: f64,
        duration_s: Option<f64>,
        progress: Callback<'_, '_>,
    ) -> PyResult<Answer> {
        let ask = match (pin, separate, is_there) {
            (None, None, None) => Ask::All,
            (Some(name), None, None) => Ask::Pin(name),
            (None, Some((first, second)), None) => Ask::Separate(first, second),
            (None, None, Some(effect)) => Ask::IsThere(effect),
            _ => {
                let why = "an experiment answers one question: pin, separate or is_there";
                return Err(refused(py, why));
            }
        };
        let mut options = ExperimentOptions::default().ask(ask).period_s(period_s);
        options.limit = limit;
        options.duration_s = duration_s;
        let work = |watch| self.0.experiment(&options.watch(watch));
        long(py, progress.into(), work)
    }

    fn simulate(
        &self,
        py: Python<'_>,
        file: Option<PathBuf>,
        toml: Option<&str>,
    ) -> PyResult<Answer> {
        let experiment = match (file, toml) {
            (Some(path), None) => Experiment::from_file(path),
            (None, Some(text)) => Experiment::from_toml("experiment.toml", text),
            _ => return Err(refused(py, "an experiment is a file, or a text")),
        };
        let experiment = experiment.map_err(|error| raised(py, &error))?;
        let options = SimulateOptions::new(experiment);
        answered(py, py.detach(|| self.0.simulate(&options)))
    }
}
