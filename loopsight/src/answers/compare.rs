//! What [`Session::compare`](crate::Session::compare) answers.

use loopsight_diagnosis::Comparison;
use serde::Serialize;

use super::Answer;
use super::common::ModelErrors;
use super::series::{Series, SeriesOf, series};
use crate::about::About;
use crate::words;

/// How well a model agrees with a log.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct CompareAnswer {
    /// `loopsight/compare/1`.
    #[cfg_attr(feature = "schema", schemars(extend("const" = "loopsight/compare/1")))]
    pub schema: &'static str,
    /// The errors.
    #[serde(flatten)]
    pub errors: ModelErrors,
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
    pub(crate) engine: Comparison,
}

impl Answer for CompareAnswer {
    const SCHEMA: &'static str = "loopsight/compare/1";
}

impl CompareAnswer {
    pub(crate) fn new(engine: Comparison, about: About, with_series: bool) -> Self {
        let mut this = Self {
            schema: Self::SCHEMA,
            errors: ModelErrors::from(&engine),
            summary: words::comparison(&engine),
            series: None,
            about,
            engine,
        };
        if with_series {
            this.series = Some(this.all_series());
        }
        this
    }

    /// The series of numbers, sample by sample.
    pub fn all_series(&self) -> Vec<Series> {
        series(SeriesOf::Model, &self.engine)
    }

    /// Sentences that belong beside the numbers.
    pub fn notes(&self) -> &[String] {
        &self.about.notes
    }

    /// A page with pictures (HTML) that opens offline; `command` stands at its foot and may be empty.
    pub fn page(&self, command: &str) -> String {
        let title = format!("{} compared with {}", self.about.model_name, self.about.log);
        loopsight_report::comparison_page(&self.about.context(title, command), &self.engine)
    }
}
