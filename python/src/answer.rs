//! What the engine answers, of whatever kind.

use std::sync::{Arc, LazyLock};

use loopsight::Watch;
use loopsight::answers::{
    AddAnswer, CompareAnswer, DiagnoseAnswer, ExperimentAnswer, FitAnswer, ImproveAnswer,
    RunAnswer, Series, SeriesOf, SimulateAnswer,
};
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::error::{raised, refused};
use crate::log::Log;
use crate::model::Model;
use crate::watched::{Told, watched};

/// Makes the page of an answer; the argument stands at its foot.
type Page = dyn Fn(&str) -> String + Send + Sync;
/// The series of an answer, made once, when they are asked for.
type AllSeries = LazyLock<Vec<Series>, Box<dyn FnOnce() -> Vec<Series> + Send>>;

/// An answer: its JSON, and what else came with it.
#[pyclass(frozen, module = "loopsight._engine")]
pub struct Answer {
    json: String,
    model: Option<loopsight::Model>,
    log: Option<loopsight::Log>,
    series: Option<AllSeries>,
    page: Option<Box<Page>>,
}

#[pymethods]
impl Answer {
    /// Exactly what the command prints with ``--json``.
    fn to_json(&self) -> &str {
        &self.json
    }

    /// The model that came of it.
    #[getter]
    fn model(&self) -> Option<Model> {
        self.model.clone().map(Model)
    }

    /// The log that came of it.
    #[getter]
    fn log(&self) -> Option<Log> {
        self.log.clone().map(Log)
    }

    /// What was measured and what the model says: of which model, run, signal, unit, and the arrays `time_s`,
    /// `measured`, `model`, `residual`, `one_step`.
    fn series<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyDict>>> {
        let array = |values: &[f64]| PyArray1::from_slice(py, values);
        let Some(lazy) = &self.series else {
            return Ok(Vec::new());
        };
        let all = py.detach(|| LazyLock::force(lazy));
        let of = all.iter().map(|series| {
            let row = PyDict::new(py);
            let of = match series.of {
                SeriesOf::Model => "model",
                SeriesOf::Fitted => "fitted",
                SeriesOf::Nominal => "nominal",
                SeriesOf::Best => "best",
                _ => "other",
            };
            row.set_item("of", of)?;
            row.set_item("run", &series.run)?;
            row.set_item("signal", &series.signal)?;
            row.set_item("unit", &series.unit)?;
            row.set_item("time_s", array(&series.time_s))?;
            row.set_item("measured", array(&series.measured))?;
            row.set_item("model", array(&series.model))?;
            row.set_item("residual", array(&series.residual))?;
            row.set_item("one_step", array(&series.one_step))?;
            Ok(row)
        });
        of.collect()
    }

    /// Whether there is a page with pictures.
    #[getter]
    fn has_page(&self) -> bool {
        self.page.is_some()
    }

    /// A page with pictures (HTML) that opens offline; `command` stands at its foot.
    #[pyo3(signature = (command=""))]
    fn page(&self, py: Python<'_>, command: &str) -> PyResult<String> {
        match &self.page {
            Some(page) => Ok(py.detach(|| page(command))),
            None => Err(refused(py, "this answer has no page")),
        }
    }
}

impl Answer {
    /// An answer of numbers and words alone.
    pub(crate) fn plain(answer: &impl loopsight::Answer) -> loopsight::Result<Self> {
        Ok(Self {
            json: answer.to_json()?,
            model: None,
            log: None,
            series: None,
            page: None,
        })
    }

    fn with_model(self, model: Option<&loopsight::Model>) -> Self {
        Self {
            model: model.cloned(),
            ..self
        }
    }

    fn with_log(self, log: loopsight::Log) -> Self {
        Self {
            log: Some(log),
            ..self
        }
    }

    fn with_series(self, series: impl FnOnce() -> Vec<Series> + Send + 'static) -> Self {
        Self {
            series: Some(LazyLock::new(Box::new(series))),
            ..self
        }
    }

    fn with_page(self, page: impl Fn(&str) -> String + Send + Sync + 'static) -> Self {
        Self {
            page: Some(Box::new(page)),
            ..self
        }
    }
}

/// What an answer of the library becomes here.
pub(crate) trait IntoAnswer {
    fn into_answer(self) -> loopsight::Result<Answer>;
}

/// Answers with series and a page, both made when they are asked for, and with the model that `$model` finds in
/// them.
macro_rules! pictured {
    ($($answer:ident: $model:expr;)*) => {$(
        impl IntoAnswer for $answer {
            fn into_answer(self) -> loopsight::Result<Answer> {
                let model: fn(&$answer) -> Option<&loopsight::Model> = $model;
                let plain = Answer::plain(&self)?.with_model(model(&self));
                let this = Arc::new(self);
                let other = Arc::clone(&this);
                Ok(plain
                    .with_series(move || other.all_series())
                    .with_page(move |command| this.page(command)))
            }
        }
    )*};
}

pictured! {
    CompareAnswer: |_| None;
    FitAnswer: |answer| Some(answer.model());
    DiagnoseAnswer: |_| None;
    ImproveAnswer: |answer| answer.model();
}

impl IntoAnswer for RunAnswer {
    fn into_answer(self) -> loopsight::Result<Answer> {
        Ok(Answer::plain(&self)?.with_page(move |command| self.page(command)))
    }
}

impl IntoAnswer for AddAnswer {
    fn into_answer(self) -> loopsight::Result<Answer> {
        Ok(Answer::plain(&self)?.with_model(Some(self.model())))
    }
}

impl IntoAnswer for SimulateAnswer {
    fn into_answer(self) -> loopsight::Result<Answer> {
        Ok(Answer::plain(&self)?.with_log(self.log().clone()))
    }
}

impl IntoAnswer for ExperimentAnswer {
    fn into_answer(self) -> loopsight::Result<Answer> {
        let plain = Answer::plain(&self)?;
        if !self.answers() {
            return Ok(plain);
        }
        let time = self.time_s().to_vec();
        let mut inputs = loopsight::Log::in_memory("the plan").column("time", "s", time);
        for (name, unit, values) in self.inputs() {
            inputs = inputs.column(name, unit, values);
        }
        Ok(plain.with_log(inputs.build()?))
    }
}

/// Long work, watched, and its answer as Python gets it.
pub(crate) fn long<A: IntoAnswer + Send>(
    py: Python<'_>,
    told: Told<'_, '_>,
    work: impl FnOnce(Watch) -> loopsight::Result<A> + Send,
) -> PyResult<Answer> {
    let answer = watched(py, told, work)?;
    answered(py, Ok(answer))
}

/// An answer of the library as Python gets it.
pub(crate) fn answered<A: IntoAnswer>(
    py: Python<'_>,
    answer: loopsight::Result<A>,
) -> PyResult<Answer> {
    answer
        .and_then(IntoAnswer::into_answer)
        .map_err(|error| raised(py, &error))
}
