//! What [`Session::send`](crate::Session::send) answers.

use loopsight_model::model::{Attached, Model as Composed};
use loopsight_onboard::{Acknowledged, Attachment};
use serde::Serialize;

use super::Answer;
use crate::words;

/// What a robot was told, and how it took it.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct SendAnswer {
    /// `loopsight/send/1`.
    #[cfg_attr(feature = "schema", schemars(extend("const" = "loopsight/send/1")))]
    pub schema: &'static str,
    /// The line to the robot.
    pub line: String,
    /// Id of its plant.
    pub plant: String,
    /// Its period, s.
    pub period_s: f64,
    /// It drives on with what it was told.
    pub runs: bool,
    /// It was driving, and came to rest.
    pub interrupted: bool,
    /// Parameters of the plant.
    pub parameters: Vec<SentParameter>,
    /// Effects.
    pub effects: Vec<SentEffect>,
    /// It learns.
    pub learns: bool,
    /// What it comes to, in a sentence.
    pub summary: String,
}

/// A number that was sent, with the digits that a robot has.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct SentParameter {
    /// Its name.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// Its value.
    pub value: f32,
}

/// An effect that was sent.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct SentEffect {
    /// Id of the effect.
    pub id: String,
    /// Ids of the channels.
    pub at: Vec<&'static str>,
    /// Its parameters.
    pub parameters: Vec<SentParameter>,
}

fn named<'p>(
    declared: impl Iterator<Item = (&'p str, &'p str)>,
    values: &[f32],
) -> Vec<SentParameter> {
    let of = |((name, unit), value): ((&str, &str), &f32)| SentParameter {
        name: name.to_owned(),
        unit: unit.to_owned(),
        value: *value,
    };
    declared.zip(values).map(of).collect()
}

impl Answer for SendAnswer {
    const SCHEMA: &'static str = "loopsight/send/1";
}

impl SendAnswer {
    pub(crate) fn new(told: &Acknowledged, model: &Composed) -> Self {
        let configuration = &told.configuration;
        let effects = configuration.effects.iter().zip(&model.effects);
        let effect = |(sent, own): (&Attachment, &Attached)| {
            // Units are those of the channels that it acts on.
            let parameters = &model.parameters[own.first_parameter..];
            let declared = own.meta.parameters.iter().zip(parameters);
            SentEffect {
                id: own.meta.id.to_owned(),
                at: own.at.iter().map(|channel| channel.id).collect(),
                parameters: named(declared.map(|(d, p)| (d.id, p.unit.as_str())), &sent.values),
            }
        };
        let declared = model.plant.parameters.iter().map(|p| (p.id, p.unit));
        let mut this = Self {
            schema: Self::SCHEMA,
            line: told.line.clone(),
            plant: told.plant.clone(),
            period_s: told.period_s,
            runs: told.runs,
            interrupted: told.interrupted,
            parameters: named(declared, &configuration.parameters),
            effects: effects.map(effect).collect(),
            learns: configuration.learning.is_some(),
            summary: String::new(),
        };
        this.summary = words::sent(&this);
        this
    }
}
