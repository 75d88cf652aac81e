//! The question and its answer.

use serde::Serialize;

use crate::EffectAt;

/// What an experiment is to answer.
#[derive(Clone, Debug, PartialEq)]
pub enum Question {
    /// Which of two effects it is; `None`: whether it is there at all.
    Separate(EffectAt, Option<EffectAt>),
    /// The value of a parameter, by its name in the model.
    Pin(String),
    /// The values of all parameters that a fit estimates.
    All,
}

/// What the robot allows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExperimentLimits {
    /// Largest magnitude of every input, in its SI unit.
    pub limit: f64,
    /// Sampling period, s.
    pub period: f64,
    /// Length of the experiment, s; `None`: as long as it must be.
    pub duration: Option<f64>,
}

/// What an experiment promises.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Promise {
    /// It answers the question.
    Answers,
    /// It would have to be longer.
    TooShort,
    /// No inputs answer the question.
    CannotBeSeparated,
}

/// An experiment that was looked at.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Considered {
    /// What it is.
    pub experiment: String,
    /// As [`Plan::detectability`], for 20 s (or the duration asked for).
    pub detectability: f64,
}

/// An experiment, ready to be recorded.
#[derive(Clone, Debug, Serialize)]
pub struct Plan {
    /// What it is; empty when no inputs answer the question.
    pub experiment: String,
    /// How long it takes, s.
    pub duration_s: f64,
    /// How long it has to take, s; infinite when no length is enough.
    pub needed_s: f64,
    /// The effects it separates.
    pub separates: Vec<EffectAt>,
    /// The parameters it pins.
    pub pins: Vec<String>,
    /// Effects: their distance in standard deviations. Parameters: the value over the predicted standard error;
    /// a noticeable change takes the place of a smaller value.
    pub detectability: f64,
    /// What it promises.
    pub verdict: Promise,
    /// Why this one, in words.
    pub reason: String,
    /// What was looked at, best first.
    pub considered: Vec<Considered>,
    /// The inputs over time.
    #[serde(skip)]
    pub drive: Drive,
}

/// Inputs over time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Drive {
    /// Instants, s.
    pub time: Vec<f64>,
    /// Inputs from each instant to the next, row by row.
    pub inputs: Vec<f64>,
}
