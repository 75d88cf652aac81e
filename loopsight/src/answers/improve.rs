//! What [`Session::improve`](crate::Session::improve) answers.

use std::sync::Arc;

use loopsight_diagnosis::{Comparison, Improvement};
use loopsight_model::run::Run;
use serde::Serialize;

use super::common::{
    Correction, EffectAt, Estimates, Failing, LogFault, PerRun, Recommendation, SignalError, all,
    estimates, per_run,
};
use super::diagnose::{judged_context, pictures, two_series};
use super::feedforward::Feedforward;
use super::force::MissingForce;
use super::mirror::Verdict;
use super::series::Series;
use super::{Answer, ModelErrors};
use crate::about::About;
use crate::model::Model;
use crate::words;

/// A model with everything added that the log shows to be missing.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct ImproveAnswer {
    /// `loopsight/improve/1`.
    #[cfg_attr(feature = "schema", schemars(extend("const" = "loopsight/improve/1")))]
    pub schema: &'static str,
    /// The model as it was, then each addition.
    pub steps: Vec<ImproveStep>,
    /// What the last diagnosis concludes.
    pub verdict: Verdict,
    /// The parameters of the best model by name; empty where nothing was fitted.
    pub parameters: Estimates,
    /// The parameters that differ from run to run (`[fit] per_run`), by name; absent where none does. Under `parameters`
    /// is the mean over the runs.
    #[serde(skip_serializing_if = "PerRun::is_empty")]
    pub per_run: PerRun,
    /// What follows from the plant's parameters, by name; absent where nothing does.
    #[serde(skip_serializing_if = "Estimates::is_empty")]
    pub derived: Estimates,
    /// What SysId would make of it, in V and the log's own units; absent for a log that is none of SysId's.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub feedforward: Option<Feedforward>,
    /// Combinations of parameters that the data do not determine, in words.
    pub flat: Vec<String>,
    /// Errors of the best model on a log that neither the fits nor the choice among effects saw; absent where no such log was
    /// given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reported: Option<Reported>,
    /// Errors of the best model by signal, on the test log where there is one.
    pub signals: Vec<SignalError>,
    /// Where the best model still fails, the most telling first.
    pub where_it_fails: Vec<Failing>,
    /// What is still open at the end: the added effects that the data could not tell from others.
    pub still_open: Vec<OpenChoice>,
    /// The missing force, where no effect of the library explains it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub residual_force: Option<MissingForce>,
    /// Faults of the log, the worst first.
    pub faults: Vec<LogFault>,
    /// Experiments that would tell more.
    pub advice: Vec<Recommendation>,
    /// How free runs are corrected by the measurements; absent where they are simulated from the inputs
    /// alone.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub observer: Option<Correction>,
    /// What it comes to, in a few sentences.
    pub summary: String,
    /// Sample by sample, of the model as it was and of the best one; present where it was asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub series: Option<Vec<Series>>,
    #[serde(skip)]
    #[cfg_attr(feature = "schema", schemars(skip))]
    pub(crate) engine: Arc<Improvement>,
    #[serde(skip)]
    #[cfg_attr(feature = "schema", schemars(skip))]
    model: Option<Model>,
    #[serde(skip)]
    #[cfg_attr(feature = "schema", schemars(skip))]
    about: About,
    #[serde(skip)]
    #[cfg_attr(feature = "schema", schemars(skip))]
    shown: Arc<[Run]>,
}

/// One step of an improvement.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct ImproveStep {
    /// What was added, under the name that it has in the best model; `null` for the model as it was.
    pub added: Option<EffectAt>,
    /// Free-run error on the fitting data.
    #[cfg_attr(feature = "schema", schemars(with = "Option<f64>"))]
    pub nrmse_fit: f64,
    /// Free-run error on the validation data.
    #[cfg_attr(feature = "schema", schemars(with = "Option<f64>"))]
    pub nrmse_test: f64,
    /// What the data cannot tell from it, with all that was added later in the model.
    pub indistinguishable_from: Vec<EffectAt>,
}

/// Errors on a log that nothing was fitted to and nothing was chosen on.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct Reported {
    /// Its name.
    pub log: String,
    /// The errors there.
    #[serde(flatten)]
    pub errors: ModelErrors,
}

impl Reported {
    pub(crate) fn new(log: &str, comparison: &Comparison) -> Self {
        Self {
            log: log.to_owned(),
            errors: comparison.into(),
        }
    }

    /// In words.
    pub fn sentence(&self) -> String {
        format!(
            "On {}, which neither the fits nor the choice among effects saw, the free-run error of the improved model is {}.",
            self.log,
            words::error(self.errors.nrmse)
        )
    }
}

/// An effect of the best model that could be another one as well.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct OpenChoice {
    /// The effect and where.
    #[serde(flatten)]
    pub place: EffectAt,
    /// What the data cannot tell from it.
    pub indistinguishable_from: Vec<EffectAt>,
}

impl Answer for ImproveAnswer {
    const SCHEMA: &'static str = "loopsight/improve/1";
}

impl ImproveAnswer {
    pub(crate) fn new(
        engine: Improvement,
        model: Option<Model>,
        reported: Option<Reported>,
        about: About,
        shown: Arc<[Run]>,
        with_series: bool,
    ) -> Self {
        let steps: Vec<ImproveStep> = engine
            .steps
            .iter()
            .map(|step| ImproveStep {
                added: step.added.as_ref().map(Into::into),
                nrmse_fit: step.nrmse_fit,
                nrmse_test: step.nrmse_test,
                indistinguishable_from: all(&step.still_open),
            })
            .collect();
        let still_open = steps
            .iter()
            .filter(|step| !step.indistinguishable_from.is_empty())
            .filter_map(|step| {
                Some(OpenChoice {
                    place: step.added.clone()?,
                    indistinguishable_from: step.indistinguishable_from.clone(),
                })
            });
        let still_open = still_open.collect();
        let (best, last) = (engine.best.as_ref(), engine.diagnoses.last());
        let errors = best.map(|best| ModelErrors::from(&best.comparison));
        let (signals, where_it_fails) =
            errors.map_or_else(Default::default, |e| (e.signals, e.where_it_fails));
        let mut this = Self {
            schema: Self::SCHEMA,
            steps,
            verdict: engine.verdict.into(),
            parameters: best.map_or_else(Estimates::new, |best| estimates(&best.parameters)),
            per_run: best.map_or_else(PerRun::new, |best| per_run(&best.per_run)),
            derived: best.map_or_else(Estimates::new, |best| estimates(&best.derived)),
            feedforward: (best.zip(about.sysid.as_ref()))
                .and_then(|(best, (units, size))| Feedforward::of(best, units, *size, &shown)),
            flat: best.map_or_else(Vec::new, |best| best.flat.clone()),
            reported,
            signals,
            where_it_fails,
            still_open,
            residual_force: last.and_then(|d| d.residual_force.as_ref()).map(Into::into),
            faults: last.map_or_else(Vec::new, |d| all(&d.faults)),
            advice: all(&engine.advice()),
            observer: last.and_then(|d| d.observer.as_ref()).map(Into::into),
            summary: words::improvement(&engine),
            series: None,
            engine: Arc::new(engine),
            model,
            about,
            shown,
        };
        if let Some(reported) = &this.reported {
            this.summary.push(' ');
            this.summary.push_str(&reported.sentence());
        }
        if let Some(feedforward) = &this.feedforward {
            for sentence in feedforward.sentences() {
                this.summary.push(' ');
                this.summary.push_str(&sentence);
            }
        }
        if with_series {
            this.series = Some(this.all_series());
        }
        this
    }

    /// The series of numbers, sample by sample, of the first model and of the best one: made when they are asked
    /// for, by two free runs.
    pub fn all_series(&self) -> Vec<Series> {
        two_series(self.before().as_ref(), self.after().as_ref())
    }

    /// The best model: the text it was made from with its comments, the effects added and the values
    /// fitted. None where nothing was fitted.
    pub fn model(&self) -> Option<&Model> {
        self.model.as_ref()
    }

    /// What the fit of the best model came to, in a sentence. None where nothing was fitted.
    pub fn fitted(&self) -> Option<String> {
        self.engine.best.as_ref().map(words::fit)
    }

    fn before(&self) -> Option<Comparison> {
        let first = self.engine.diagnoses.first();
        pictures(first.and_then(|d| d.model.as_ref()), &self.shown)
    }

    fn after(&self) -> Option<Comparison> {
        pictures(self.engine.best.as_ref().map(|b| &b.model), &self.shown)
    }

    /// A page with pictures (HTML) that opens offline; `command` stands at its foot and may be empty.
    pub fn page(&self, command: &str) -> String {
        let (before, after) = (self.before(), self.after());
        let mut context = judged_context(&self.about, "what was missing", command);
        context
            .notes
            .extend(self.reported.as_ref().map(Reported::sentence));
        loopsight_report::improvement_page(&context, &self.engine, before.as_ref(), after.as_ref())
    }
}
