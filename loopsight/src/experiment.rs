//! The experiment that answers a question.

use loopsight_diagnosis::{ExperimentLimits, Question, QuestionError, effect_at, experiment};
use loopsight_model::model::Model as Composed;

use crate::answers::ExperimentAnswer;
use crate::error::Result;
use crate::session::Session;
use crate::watch::{Watch, watched};

/// Which experiment is planned.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct ExperimentOptions {
    /// What it is to answer: by default the values of all parameters that a fit estimates.
    pub ask: Ask,
    /// Largest magnitude of every input, in its SI unit: by default 9, or the limit of an
    /// `input_saturation` of the model where that is less.
    pub limit: Option<f64>,
    /// Sampling period of the robot's log, s: 0.01 by default.
    pub period_s: f64,
    /// Length of the experiment, s: by default as long as the question needs, 5 s to 600 s.
    pub duration_s: Option<f64>,
    /// Who gets the progress, and what stops the work.
    pub watch: Watch,
}

/// What an experiment is to answer. Effects are written as `EFFECT` or `EFFECT@CHANNEL+CHANNEL`.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Ask {
    /// The values of all parameters that a fit estimates.
    #[default]
    All,
    /// The value of one parameter, by its name in the model, to 1 %.
    Pin(String),
    /// Which of two effects it is.
    Separate(String, String),
    /// Whether an effect is there at all.
    IsThere(String),
}

impl Default for ExperimentOptions {
    fn default() -> Self {
        Self {
            ask: Ask::All,
            limit: None,
            period_s: 0.01,
            duration_s: None,
            watch: Watch::default(),
        }
    }
}

watched!(ExperimentOptions);

impl ExperimentOptions {
    /// What it is to answer.
    #[must_use]
    pub fn ask(mut self, ask: Ask) -> Self {
        self.ask = ask;
        self
    }

    /// Which of two effects it is.
    #[must_use]
    pub fn separate(self, first: &str, second: &str) -> Self {
        self.ask(Ask::Separate(first.to_owned(), second.to_owned()))
    }

    /// The value of a parameter, by its name in the model, to 1 %.
    #[must_use]
    pub fn pin(self, parameter: &str) -> Self {
        self.ask(Ask::Pin(parameter.to_owned()))
    }

    /// Largest magnitude of every input, in its SI unit.
    #[must_use]
    pub fn limit(mut self, limit: f64) -> Self {
        self.limit = Some(limit);
        self
    }

    /// Sampling period of the robot's log, s.
    #[must_use]
    pub fn period_s(mut self, period_s: f64) -> Self {
        self.period_s = period_s;
        self
    }

    /// Length of the experiment, s.
    #[must_use]
    pub fn duration_s(mut self, duration_s: f64) -> Self {
        self.duration_s = Some(duration_s);
        self
    }
}

/// Default for the largest magnitude of the inputs, in their SI unit.
const LIMIT: f64 = 9.0;

impl Session {
    /// Plans the experiment that separates two effects or pins a parameter: the answer has its inputs
    /// over time.
    ///
    /// # Errors
    ///
    /// There is no such effect, channel or parameter, values are missing, or the model is unstable at rest.
    pub fn experiment(&self, options: &ExperimentOptions) -> Result<ExperimentAnswer> {
        let model = &self.model.composed;
        let limits = ExperimentLimits {
            limit: options.limit.unwrap_or_else(|| default_limit(model)),
            period: options.period_s,
            duration: options.duration_s,
        };
        let question = question(&options.ask, model)?;
        let plan = experiment(model, &question, &limits, &options.watch.work())?;
        let inputs = model.plant.inputs;
        Ok(ExperimentAnswer::new(plan, &limits, inputs))
    }
}

fn question(ask: &Ask, model: &Composed) -> std::result::Result<Question, QuestionError> {
    Ok(match ask {
        Ask::All => Question::All,
        Ask::Pin(name) => Question::Pin(name.clone()),
        Ask::Separate(first, second) => {
            Question::Separate(effect_at(model, first)?, Some(effect_at(model, second)?))
        }
        Ask::IsThere(effect) => Question::Separate(effect_at(model, effect)?, None),
    })
}

/// What the model says its inputs can give, if that is less than the usual.
fn default_limit(model: &Composed) -> f64 {
    model
        .effects
        .iter()
        .filter(|e| e.meta.id == "input_saturation")
        .filter_map(|e| model.parameters.get(e.first_parameter)?.value)
        .fold(LIMIT, f64::min)
}
