//! `[plant.expression]`: a plant that the model file itself defines.

use serde::{Deserialize, Serialize};

use super::channels::{ChannelTable, declared, implied};
use super::described::PLANT_PART;
use super::equations::{Equations, Law};
use super::keep::{self, Kept};
use super::table::{Ordered, ParameterTable, check_name, check_unit};
use crate::config::{Mistake, PathSegment, nearest};
use crate::registry::{AnyDynamics, PlantPart, ReadyPlant, Values};
use loopsight_core::{Channel, Dynamics, Parameter, Place, PlantMeta, Real, Signal, Steps};

/// `[plant.expression]`, as written.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct PlantTable {
    #[serde(default, skip_serializing_if = "Option::is_none")]
    summary: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    assumptions: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    reference: Option<String>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    controlled: Vec<String>,
    pub(crate) states: Ordered<SignalTable>,
    pub(crate) inputs: Ordered<SignalTable>,
    #[serde(default, skip_serializing_if = "Ordered::is_empty")]
    pub(crate) outputs: Ordered<SignalTable>,
    #[serde(default, skip_serializing_if = "Ordered::is_empty")]
    pub(crate) channels: Ordered<ChannelTable>,
    #[serde(default, skip_serializing_if = "Ordered::is_empty")]
    pub(crate) parameters: Ordered<ParameterTable>,
}

/// A state, an input or an output.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct SignalTable {
    pub(crate) unit: String,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) rate: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) value: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) integral_of: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    symbol: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    size: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    doc: Option<String>,
}

/// Most states, inputs, outputs or parameters.
pub(crate) const MOST: usize = 32;

impl PlantTable {
    /// States, inputs and outputs with their units, in this order.
    pub(crate) fn signals(&self) -> impl Iterator<Item = (&str, &str)> + Clone {
        let groups = [&self.states, &self.inputs, &self.outputs];
        groups
            .into_iter()
            .flat_map(|g| g.iter().map(|(id, s)| (id, s.unit.as_str())))
    }

    pub(crate) fn unit_of(&self, id: &str) -> &str {
        self.signals().find(|s| s.0 == id).map_or("1", |s| s.1)
    }

    fn groups(&self) -> [(&'static str, &Ordered<SignalTable>); 3] {
        [
            ("states", &self.states),
            ("inputs", &self.inputs),
            ("outputs", &self.outputs),
        ]
    }

    /// Every name can be one and stands for one thing.
    fn check_names(&self) -> Result<(), Mistake> {
        let mut taken: Vec<(&str, &str)> = ["nominal", "side", "time"]
            .map(|n| (n, "what an effect can read"))
            .to_vec();
        let groups = self.groups();
        let ids = groups
            .iter()
            .flat_map(|(table, g)| g.ids().map(|id| (*table, id)));
        let parameters = self.parameters.ids().map(|id| ("parameters", id));
        for (table, id) in ids.chain(parameters) {
            let before = taken.iter().find(|(name, _)| *name == id);
            check_name(table, id, before.map(|(_, what)| *what))?;
            taken.push((id, one_of(table)));
        }
        for (id, channel) in self.channels.iter() {
            let before = taken
                .iter()
                .find(|(name, _)| channel.is_effort() && *name == id);
            let is_name = id.split('.').all(super::lexer::is_name);
            if !is_name || before.is_some() {
                check_name("channels", id, before.map(|(_, what)| *what))?;
            }
        }
        for (table, group) in groups {
            if group.len() > MOST {
                let message = format!("{} {table}, expected at most {MOST}", group.len());
                return Err(Mistake::key([table.into()], message));
            }
        }
        for table in ["states", "inputs"] {
            let empty = groups
                .iter()
                .any(|(name, g)| *name == table && g.is_empty());
            if empty {
                let message = format!("a plant needs {}", one_of(table));
                return Err(Mistake::key([table.into()], message));
            }
        }
        Ok(())
    }

    /// The keys of every signal are those of its kind.
    fn check_signals(&self) -> Result<(), Mistake> {
        for (table, group) in self.groups() {
            for (id, signal) in group.iter() {
                let path =
                    |key: &str| -> [PathSegment; 3] { [table.into(), id.into(), key.into()] };
                check_unit(&path("unit"), &signal.unit, &signal.unit)?;
                let keys = [
                    ("rate", signal.rate.is_some(), table == "states"),
                    ("value", signal.value.is_some(), table == "outputs"),
                ];
                for (key, given, wanted) in keys {
                    if given && !wanted {
                        let message = format!("`{id}` is {}, which has no `{key}`", one_of(table));
                        return Err(Mistake::key(path(key), message));
                    }
                    if wanted && !given {
                        let what = one_of(table);
                        let message =
                            format!("`{id}` is {what} and needs a `{key}`: an expression");
                        return Err(Mistake::key([table.into(), id.into()], message));
                    }
                }
                let size = signal.size.unwrap_or(1.0);
                if !(size > 0.0 && size.is_finite()) {
                    let message = format!("`size` is {size}, expected a number above 0");
                    return Err(Mistake::value(path("size"), message));
                }
            }
        }
        Ok(())
    }

    fn understand(&self) -> Result<Plant, Mistake> {
        self.check_names()?;
        self.check_signals()?;
        let equations = Equations::read(self)?;
        let integrals = equations.integrals(self)?;
        let mut channels: Vec<Channel> = Vec::new();
        let mut efforts = 0;
        for (id, table) in self.channels.iter() {
            channels.push(declared(self, id, table, efforts)?);
            efforts += usize::from(table.is_effort());
        }
        let more = implied(self, &integrals, &channels);
        // Without an effort of the file's own there is one on every rate that stands for itself.
        let pushed: Vec<usize> = more
            .iter()
            .filter(|c| matches!(c.place, Place::Effort(_)))
            .filter_map(|c| self.states.position(c.id.strip_prefix("effort.")?))
            .collect();
        channels.extend(more);
        let controlled = self.controlled(&equations, &integrals)?;
        let mut parameters: Vec<Parameter> = Vec::new();
        for (index, (id, table)) in self.parameters.iter().enumerate() {
            let parameter = table.declare(id, equations.is_linear(self, index))?;
            let path = ["parameters".into(), id.into(), "unit".into()];
            check_unit(&path, parameter.unit, parameter.unit)?;
            parameters.push(parameter);
        }
        let law = equations.law(&pushed);
        let text =
            |given: &Option<String>, otherwise| keep::text(given.as_deref().unwrap_or(otherwise));
        let integrals: Vec<(&'static str, &'static str)> = integrals
            .into_iter()
            .map(|(rate, integral)| (keep::text(rate), keep::text(integral)))
            .collect();
        let meta = PlantMeta {
            id: PLANT_PART.id,
            summary: text(&self.summary, "a plant that the model file defines"),
            equation: keep::text(&self.equation()),
            reference: text(&self.reference, "the model file"),
            assumptions: text(&self.assumptions, "none were written down"),
            example: PLANT_PART.example,
            states: signals(&self.states).leak(),
            inputs: signals(&self.inputs).leak(),
            outputs: signals(&self.outputs).leak(),
            integrals: integrals.leak(),
            channels: channels.leak(),
            parameters: parameters.leak(),
            parameterizations: &[],
            controlled: controlled.leak(),
        };
        Ok(Plant { meta, law })
    }

    /// The states a controller acts on: as many as inputs, each affine in them. Where the file is
    /// silent, those that are more than an integral, if they are such states.
    fn controlled(
        &self,
        equations: &Equations,
        integrals: &[(&str, &str)],
    ) -> Result<Vec<usize>, Mistake> {
        let mut found = Vec::new();
        if self.controlled.is_empty() {
            let ids = self.states.ids().enumerate();
            found.extend(
                ids.filter(|(_, id)| integrals.iter().all(|(_, integral)| integral != id))
                    .map(|(state, _)| state),
            );
            let fit = found.len() == self.inputs.len();
            if !(fit && found.iter().all(|state| equations.is_affine(*state))) {
                found.clear();
            }
        }
        for (i, id) in self.controlled.iter().enumerate() {
            let path: [PathSegment; 2] = ["controlled".into(), i.into()];
            let Some(state) = self.states.position(id) else {
                let all: Vec<&str> = self.states.ids().collect();
                let message = format!(
                    "there is no state `{id}`, expected one of {}",
                    all.join(", ")
                );
                let mistake = Mistake::value(path, message);
                return Err(match nearest(id, all) {
                    Some(near) => mistake.help(format!("did you mean `{near}`?")),
                    None => mistake,
                });
            };
            if !equations.is_affine(state) {
                let message = format!(
                    "the rate of `{id}` is not affine in the inputs, so no velocity controller can act on it"
                );
                return Err(Mistake::value(path, message));
            }
            found.push(state);
        }
        if !found.is_empty() && found.len() != self.inputs.len() {
            let message = format!(
                "{} controlled states, expected as many as inputs: {}",
                found.len(),
                self.inputs.len()
            );
            return Err(Mistake::key(["controlled".into()], message));
        }
        Ok(found)
    }

    fn equation(&self) -> String {
        let line = |mark: &str, id: &str, text: &Option<String>| {
            format!("{id}{mark} = {}", text.as_deref().unwrap_or("").trim())
        };
        let states = self.states.iter().map(|(id, s)| line("'", id, &s.rate));
        let outputs = self.outputs.iter().map(|(id, s)| line("", id, &s.value));
        let all: Vec<String> = states.chain(outputs).collect();
        all.join(";  ")
    }
}

/// What a name in one of the tables is.
fn one_of(table: &str) -> &'static str {
    match table {
        "states" => "a state",
        "inputs" => "an input",
        "outputs" => "an output",
        _ => "a parameter",
    }
}

fn signals(group: &Ordered<SignalTable>) -> Vec<Signal> {
    group
        .iter()
        .map(|(id, s)| {
            let symbol = keep::text(s.symbol.as_deref().unwrap_or(id));
            let doc = keep::text(s.doc.as_deref().unwrap_or("a signal of the model file"));
            Signal::new(keep::text(id), symbol, keep::text(&s.unit), doc)
                .sized(s.size.unwrap_or(1.0))
        })
        .collect()
}

/// A plant that a model file defines: its declaration and its equations.
struct Plant {
    meta: PlantMeta,
    law: Law,
}

/// The plant as a file has it.
#[derive(Clone, Debug)]
struct Part {
    table: PlantTable,
    values: Values,
}

impl Serialize for Part {
    fn serialize<S: serde::Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        self.table.serialize(to)
    }
}

impl<'de> Deserialize<'de> for Part {
    fn deserialize<D: serde::Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        let table = PlantTable::deserialize(from)?;
        let values = table.parameters.values();
        Ok(Self { table, values })
    }
}

/// What a plant as expressions is before they are read.
const UNREAD: PlantMeta = PlantMeta {
    id: PLANT_PART.id,
    summary: PLANT_PART.summary,
    equation: "",
    reference: "",
    assumptions: "",
    example: PLANT_PART.example,
    states: &[],
    inputs: &[],
    outputs: &[],
    integrals: &[],
    channels: &[],
    parameters: &[],
    parameterizations: &[],
    controlled: &[],
};

/// The equations of a plant whose expressions are not read.
struct Nothing;

impl<S: Real> Dynamics<S> for Nothing {
    fn derivative(&self, _x: &[S], _u: &[S], _w: &[S], _p: &[S], _dx: &mut [S]) {}
    fn steps(&self, _x: &mut [S], _span: Steps<S>, _u: &[S], _w: &[S], _p: &[S]) -> f64 {
        1.0
    }
    fn output(&self, _index: usize, _x: &[S], _u: &[S], _p: &[S]) -> S {
        S::zero()
    }
    fn lower(&self, _set: usize, _from: &[S], _p: &mut [S]) {}
}

#[typetag::serde(name = "expression")]
impl PlantPart for Part {
    fn meta(&self) -> &'static PlantMeta {
        &UNREAD
    }
    fn values(&self) -> &Values {
        &self.values
    }
    fn dynamics(&self) -> &'static dyn AnyDynamics {
        &Nothing
    }
    fn ready(&self) -> Result<ReadyPlant, Mistake> {
        static PLANTS: Kept<Plant> = Kept::new();
        // Values are no part of what is kept.
        let parameters = self.table.parameters.iter();
        let declared: Vec<_> = parameters
            .clone()
            .map(|(id, p)| (id, p.without_value()))
            .collect();
        let rest = PlantTable {
            parameters: Ordered::default(),
            ..self.table.clone()
        };
        let plant = PLANTS.get(format!("{rest:?} {declared:?}"), || self.table.understand())?;
        for (id, p) in parameters.clone() {
            p.declare(id, true)?;
        }
        Ok(ReadyPlant {
            meta: &plant.meta,
            dynamics: &plant.law,
            values: self.values.clone(),
            paths: parameters.map(|(id, p)| p.given(id).1).collect(),
        })
    }
}
