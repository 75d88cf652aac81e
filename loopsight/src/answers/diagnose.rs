//! What [`Session::diagnose`](crate::Session::diagnose) answers.

use std::sync::Arc;

use loopsight_diagnosis::{
    Comparison, Diagnosis, Explanation, Measurements, Untried, Work, compare,
};
use loopsight_model::model::Model as Composed;
use loopsight_model::run::Run;
use serde::Serialize;

use super::Answer;
use super::common::{
    Correction, EffectAt, Estimates, Failing, Level, LogFault, Recommendation, all, estimates,
};
use super::force::MissingForce;
use super::mirror::Verdict;
use super::series::{Series, SeriesOf, series};
use crate::about::About;
use crate::words;

/// Which physical effect a model lacks.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct DiagnoseAnswer {
    /// `loopsight/diagnose/1`.
    #[cfg_attr(feature = "schema", schemars(extend("const" = "loopsight/diagnose/1")))]
    pub schema: &'static str,
    /// The model as it is, all its parameters refitted.
    pub nominal: Level,
    /// What noise and resolution alone would leave.
    pub floor: Level,
    /// The conclusion.
    pub verdict: Verdict,
    /// The missing effect; `null` where none is.
    pub missing: Option<EffectAt>,
    /// Explanations, best first.
    pub candidates: Vec<Candidate>,
    /// Effects of the library that fit the plant and were not tried, because the log cannot show them.
    pub not_tried: Vec<NotTried>,
    /// Where the model as it is fails, the most telling first.
    pub where_it_fails: Vec<Failing>,
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
    /// Sample by sample, of the model as it is and of the best explanation; present where it was asked
    /// for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub series: Option<Vec<Series>>,
    #[serde(skip)]
    #[cfg_attr(feature = "schema", schemars(skip))]
    pub(crate) engine: Diagnosis,
    #[serde(skip)]
    #[cfg_attr(feature = "schema", schemars(skip))]
    about: About,
    #[serde(skip)]
    #[cfg_attr(feature = "schema", schemars(skip))]
    shown: Arc<[Run]>,
}

/// One way to explain what the model does not.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct Candidate {
    /// The effect and where.
    #[serde(flatten)]
    pub place: EffectAt,
    /// The effect that explains the error together with it, where neither does alone; errors and parameters are those
    /// with both.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub together_with: Option<EffectAt>,
    /// Free-run error with it, on the validation data.
    #[cfg_attr(feature = "schema", schemars(with = "Option<f64>"))]
    pub nrmse: f64,
    /// The effect's parameters, by their ids.
    pub parameters: Estimates,
    /// How many standard errors it is from doing nothing.
    #[cfg_attr(feature = "schema", schemars(with = "Option<f64>"))]
    pub significance: f64,
    /// Candidates that these data cannot tell from it.
    pub indistinguishable_from: Vec<EffectAt>,
    /// What to know about it.
    pub note: String,
}

/// An effect of the library that fits the plant and was not tried.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct NotTried {
    /// Id of the effect.
    pub effect: String,
    /// What the log does not show.
    pub why: String,
}

impl From<&Untried> for NotTried {
    fn from(untried: &Untried) -> Self {
        Self {
            effect: untried.effect.clone(),
            why: untried.why.clone(),
        }
    }
}

impl From<&Explanation> for Candidate {
    fn from(explanation: &Explanation) -> Self {
        Self {
            place: (&explanation.place).into(),
            together_with: explanation.together_with.as_ref().map(Into::into),
            nrmse: explanation.nrmse,
            parameters: estimates(&explanation.parameters),
            significance: explanation.significance,
            indistinguishable_from: all(&explanation.indistinguishable_from),
            note: explanation.note.clone(),
        }
    }
}

impl Answer for DiagnoseAnswer {
    const SCHEMA: &'static str = "loopsight/diagnose/1";
}

impl DiagnoseAnswer {
    pub(crate) fn new(
        engine: Diagnosis,
        about: About,
        shown: Arc<[Run]>,
        with_series: bool,
    ) -> Self {
        let mut this = Self {
            schema: Self::SCHEMA,
            nominal: Level {
                nrmse: engine.nominal.nrmse,
            },
            floor: Level {
                nrmse: engine.floor.nrmse,
            },
            verdict: engine.verdict.into(),
            missing: engine.missing.as_ref().map(Into::into),
            candidates: all(&engine.candidates),
            not_tried: all(&engine.not_tried),
            where_it_fails: all(&engine.where_it_fails),
            residual_force: engine.residual_force.as_ref().map(Into::into),
            faults: all(&engine.faults),
            advice: all(&engine.advice),
            observer: engine.observer.as_ref().map(Into::into),
            summary: words::diagnosis(&engine),
            series: None,
            engine,
            about,
            shown,
        };
        if with_series {
            this.series = Some(this.all_series());
        }
        this
    }

    /// The series of numbers, sample by sample, of the model as it is and of the best explanation: made when they
    /// are asked for, by two free runs.
    pub fn all_series(&self) -> Vec<Series> {
        two_series(self.before().as_ref(), self.after().as_ref())
    }

    /// The model as it is over what is shown.
    fn before(&self) -> Option<Comparison> {
        pictures(self.engine.model.as_ref(), &self.shown)
    }

    /// The best explanation over what is shown.
    fn after(&self) -> Option<Comparison> {
        let best = self.engine.candidates.first();
        pictures(best.map(|c| &c.model), &self.shown)
    }

    /// A page with pictures (HTML) that opens offline; `command` stands at its foot and may be empty.
    pub fn page(&self, command: &str) -> String {
        let (before, after) = (self.before(), self.after());
        let context = judged_context(&self.about, "what the model lacks", command);
        loopsight_report::diagnosis_page(&context, &self.engine, before.as_ref(), after.as_ref())
    }
}

/// `model` compared with `runs` for pictures; none where it cannot be simulated over them.
pub(super) fn pictures(model: Option<&Composed>, runs: &[Run]) -> Option<Comparison> {
    compare(model?, &Measurements::new(runs), &Work::quiet()).ok()
}

/// Series of a model before and after what it lacked was added.
pub(super) fn two_series(before: Option<&Comparison>, after: Option<&Comparison>) -> Vec<Series> {
    let of = |which, comparison: Option<&Comparison>| {
        comparison.map_or_else(Vec::new, |comparison| series(which, comparison))
    };
    let mut all = of(SeriesOf::Nominal, before);
    all.extend(of(SeriesOf::Best, after));
    all
}

/// The frame of a page of something that was judged.
pub(super) fn judged_context(
    about: &About,
    what: &str,
    command: &str,
) -> loopsight_report::Context {
    let mut context = about.context(format!("{}: {what}", about.model_name), command);
    context.notes.extend(about.test.as_ref().map(|test| {
        format!("Errors and pictures are those on {test}, which nothing was fitted to.")
    }));
    context
}
