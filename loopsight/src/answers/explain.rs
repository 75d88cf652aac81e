//! What [`explain`](crate::explain()) answers.

use serde::Serialize;

use super::Answer;

/// What a part is.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct ExplainAnswer {
    /// `loopsight/explain/1`.
    #[cfg_attr(feature = "schema", schemars(extend("const" = "loopsight/explain/1")))]
    pub schema: &'static str,
    /// The parts of this id: one, or the two that a model file itself can define.
    pub parts: Vec<Explained>,
}

/// One part, explained. What a part of its role does not have is absent.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct Explained {
    /// `plant`, `effect`, `estimator`, `controller` or `driver`; `table`: a table of model files.
    pub role: &'static str,
    /// Identifier in TOML.
    pub id: &'static str,
    /// One sentence.
    pub summary: &'static str,
    /// The equations, or what it does, one to a line.
    pub equation: String,
    /// What a plant takes for granted.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub assumptions: Option<&'static str>,
    /// How an effect shows in a log.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub symptom: Option<&'static str>,
    /// What can be done about an effect.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub remedy: Option<&'static str>,
    /// States of a plant.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub states: Vec<ExplainedSignal>,
    /// Inputs of a plant.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub inputs: Vec<ExplainedSignal>,
    /// Further signals of a plant.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub outputs: Vec<ExplainedSignal>,
    /// Parameters of a plant or an effect.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub parameters: Vec<ExplainedParameter>,
    /// Other sets of parameters of a plant.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub parameterizations: Vec<ExplainedSet>,
    /// What follows from the parameters of a plant.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub derived: Vec<ExplainedDerived>,
    /// Channels of a plant, where effects attach.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub channels: Vec<ExplainedChannel>,
    /// Plants that an effect attaches to.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub attaches_to: Vec<ExplainedHome>,
    /// Settings of an estimator, a controller or a driver, keys of a table.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub settings: Vec<ExplainedSignal>,
    /// Where the equations come from.
    pub reference: &'static str,
    /// A TOML table that makes it.
    pub example: &'static str,
}

/// A signal, or a setting.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct ExplainedSignal {
    /// Identifier in TOML, JSON and logs.
    pub id: &'static str,
    /// Symbol in the equations; absent for a setting.
    #[serde(skip_serializing_if = "str::is_empty")]
    pub symbol: &'static str,
    /// SI unit; empty where it has none to have.
    pub unit: &'static str,
    /// One sentence.
    pub doc: &'static str,
}

/// A parameter.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct ExplainedParameter {
    /// Key in TOML and JSON.
    pub id: &'static str,
    /// Symbol in the equations.
    pub symbol: &'static str,
    /// SI unit.
    pub unit: &'static str,
    /// One sentence.
    pub doc: &'static str,
    /// Value when the file gives none; `null`: there is no such value.
    pub default: Option<f64>,
    /// A fit estimates it unless told otherwise.
    pub estimated: bool,
    /// Its admissible range, in words.
    pub range: String,
}

/// Another set of parameters of a plant.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct ExplainedSet {
    /// Its table: `[plant.<plant>.<id>]`.
    pub id: &'static str,
    /// One sentence.
    pub summary: &'static str,
    /// The parameters.
    pub parameters: Vec<ExplainedParameter>,
}

/// What follows from the parameters of a plant.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct ExplainedDerived {
    /// Its name.
    pub id: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// How it follows.
    pub equation: &'static str,
    /// One sentence.
    pub doc: &'static str,
}

/// A channel of a plant.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct ExplainedChannel {
    /// Its name.
    pub id: &'static str,
    /// What it is a place in: `effort`, `input`, …
    pub place: &'static str,
    /// Unit of what acts there.
    pub unit: &'static str,
    /// How it enters the equations.
    pub equation: &'static str,
    /// Ids of the effects that fit there.
    pub effects: Vec<&'static str>,
}

/// A plant that an effect attaches to.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct ExplainedHome {
    /// Id of the plant.
    pub plant: &'static str,
    /// Ids of its channels.
    pub channels: Vec<&'static str>,
}

impl Answer for ExplainAnswer {
    const SCHEMA: &'static str = "loopsight/explain/1";
}

impl ExplainAnswer {
    pub(crate) fn new(parts: Vec<Explained>) -> Self {
        Self {
            schema: Self::SCHEMA,
            parts,
        }
    }
}

impl Explained {
    /// A part with nothing but what every part has: id, summary, equation, reference, example.
    pub(crate) fn new(role: &'static str, texts: [&'static str; 5]) -> Self {
        let [id, summary, equation, reference, example] = texts;
        Self {
            role,
            id,
            summary,
            equation: equation.replace(";  ", "\n"),
            assumptions: None,
            symptom: None,
            remedy: None,
            states: Vec::new(),
            inputs: Vec::new(),
            outputs: Vec::new(),
            parameters: Vec::new(),
            parameterizations: Vec::new(),
            derived: Vec::new(),
            channels: Vec::new(),
            attaches_to: Vec::new(),
            settings: Vec::new(),
            reference,
            example,
        }
    }
}
