//! What [`Session::fit`](crate::Session::fit) answers.

use loopsight_diagnosis::Fit;
use serde::Serialize;

use super::Answer;
use super::common::{Estimates, ModelErrors, PerRun, estimates, per_run};
use super::series::{Series, SeriesOf, series};
use crate::about::About;
use crate::error::{Error, Result};
use crate::fit::Method;
use crate::model::Model;
use crate::words;

/// The parameters of a model, found from a log.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct FitAnswer {
    /// `loopsight/fit/1`.
    #[cfg_attr(feature = "schema", schemars(extend("const" = "loopsight/fit/1")))]
    pub schema: &'static str,
    /// The errors of the fitted model, on the test log where there is one.
    #[serde(flatten)]
    pub errors: ModelErrors,
    /// The parameters by name.
    pub parameters: Estimates,
    /// The parameters that differ from run to run (`[fit] per_run`), by name; absent where none does. Under `parameters`
    /// is the mean over the runs.
    #[serde(skip_serializing_if = "PerRun::is_empty")]
    pub per_run: PerRun,
    /// What follows from the plant's parameters, by name; absent where nothing does.
    #[serde(skip_serializing_if = "Estimates::is_empty")]
    pub derived: Estimates,
    /// The method that found them.
    pub method: Method,
    /// Free-run error before the fit; `null` where the file gave no values.
    pub nrmse_before: Option<f64>,
    /// Free-run error on the log it was fitted to.
    #[cfg_attr(feature = "schema", schemars(with = "Option<f64>"))]
    pub nrmse_fit: f64,
    /// Iterations (output error) or samples (recursive least squares).
    pub iterations: u64,
    /// Whether the fit to the free run converged, and from which start; absent for recursive least squares.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub convergence: Option<Convergence>,
    /// Combinations of parameters that the data do not determine, in words.
    pub flat: Vec<String>,
    /// The fit was cancelled: these are the best values found until then, without errors.
    pub cancelled: bool,
    /// What it comes to, in a few sentences.
    pub summary: String,
    /// Sample by sample; present where it was asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub series: Option<Vec<Series>>,
    #[serde(skip)]
    #[cfg_attr(feature = "schema", schemars(skip))]
    pub(crate) about: About,
    #[serde(skip)]
    #[cfg_attr(feature = "schema", schemars(skip))]
    pub(crate) engine: Fit,
    #[serde(skip)]
    #[cfg_attr(feature = "schema", schemars(skip))]
    model: Model,
}

/// Whether a fit converged.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct Convergence {
    /// The error falls no further, and the model leaves less than a constant would.
    pub converged: bool,
    /// Why not; absent where it did.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
    /// The starts that were tried, the most promising first.
    pub starts: Vec<Start>,
}

/// A start of a fit.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct Start {
    /// What it was made of.
    pub from: String,
    /// Free-run error at its end, relative to the standard deviation.
    #[cfg_attr(feature = "schema", schemars(with = "Option<f64>"))]
    pub nrmse: f64,
}

impl From<loopsight_diagnosis::Convergence> for Convergence {
    fn from(of: loopsight_diagnosis::Convergence) -> Self {
        let starts = of.starts.into_iter();
        Self {
            converged: of.converged,
            reason: of.reason,
            starts: starts
                .map(|tried| Start {
                    from: tried.from,
                    nrmse: tried.nrmse,
                })
                .collect(),
        }
    }
}

impl Answer for FitAnswer {
    const SCHEMA: &'static str = "loopsight/fit/1";
}

impl FitAnswer {
    pub(crate) fn new(engine: Fit, model: Model, about: About, with_series: bool) -> Self {
        let mut this = Self {
            schema: Self::SCHEMA,
            errors: ModelErrors::from(&engine.comparison),
            parameters: estimates(&engine.parameters),
            per_run: per_run(&engine.per_run),
            derived: estimates(&engine.derived),
            method: engine.method.into(),
            nrmse_before: engine.nrmse_before,
            nrmse_fit: engine.nrmse_fit,
            iterations: engine.iterations,
            convergence: engine.convergence.clone().map(Convergence::from),
            flat: engine.flat.clone(),
            cancelled: engine.cancelled,
            summary: words::fit(&engine),
            series: None,
            about,
            engine,
            model,
        };
        if with_series {
            this.series = Some(this.all_series());
        }
        this
    }

    /// The series of numbers, sample by sample, of the fitted model.
    pub fn all_series(&self) -> Vec<Series> {
        series(SeriesOf::Fitted, &self.engine.comparison)
    }

    /// An error if the fit did not converge, with the reason and what was tried.
    ///
    /// # Errors
    ///
    /// The model leaves as much as a constant would from every start, or the error was still falling at the
    /// last iteration.
    pub fn arrived(&self) -> Result<()> {
        match words::not_converged(&self.engine) {
            Some(why) => Err(Error::work(why)),
            None => Ok(()),
        }
    }

    /// The fitted model: the text it was made from with its comments, the values replaced. Digits far
    /// below a value's standard error are left out.
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// What the errors come to, in a sentence.
    pub fn judged(&self) -> String {
        words::comparison(&self.engine.comparison)
    }

    /// A page with pictures (HTML) that opens offline; `command` stands at its foot and may be empty.
    pub fn page(&self, command: &str) -> String {
        let about = &self.about;
        let mut context = about.context(
            format!("{} fitted to {}", about.model_name, about.log),
            command,
        );
        if let Some(test) = &about.test {
            context.notes.push(format!(
                "Errors and pictures are those on {test}, which the model was not fitted to."
            ));
            context.log_file.clone_from(test);
        }
        loopsight_report::fit_page(&context, &self.engine)
    }
}
