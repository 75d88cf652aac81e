//! `[effect.expression]`: an effect that the model file itself defines.

use serde::{Deserialize, Serialize};

use super::keep::{self, Kept};
use super::parse::parse;
use super::program::{FIRST_BANK, Program};
use super::table::{Ordered, ParameterTable, check_name, check_unit, check_used};
use super::tree::{Slot, Tree};
use super::{Names, placed};
use crate::attach::unit_at;
use crate::config::{Mistake, Step};
use crate::model::signals;
use crate::registry::{AnyPhysics, EffectPart, PartMeta, ReadyEffect, Setting, Values, effects};
use crate::{
    Channel, Dual, EffectMeta, Parameter, Physics, PlaceKind, PlantMeta, Reading, Real, Role,
};

/// What is known of effects as expressions before one is read.
pub(crate) const EFFECT_PART: PartMeta = PartMeta {
    id: "expression",
    role: "effect",
    summary: "an effect of your own, as an expression in the model file",
    equation: "w = force(flow, position, drive, …, nominal, side, time, signals; parameters)",
    reference: "docs/own-in-toml.md",
    example: "[[effect]]
[effect.expression]
at = [\"wheel.right\", \"wheel.left\"]
force = \"-c * tanh(flow / s)\"

[effect.expression.parameters]
c = { value = 0.9, unit = \"V\", range = [0.0, 12.0], doc = \"size of the friction\" }
s = { value = 0.1, unit = \"rad/s\", above = 0.0, held = true, doc = \"width of the smoothing\" }
",
    settings: &[
        Setting::new("at", "", "the channels it acts on; `on` is the same"),
        Setting::new("on", "", "the same as `at`"),
        Setting::new(
            "force",
            "",
            "what is added there, in the channel's unit; names: the channel's roles (flow, position, drive, …), nominal, side, time, signals of the plant, the parameters",
        ),
        Setting::new(
            "name",
            "",
            "name in reports and of its parameters; `expression` without it",
        ),
        Setting::new("summary", "", "one sentence for reports"),
        Setting::new(
            "parameters",
            "",
            "a table for each: value, unit, range (or above, below), held, scale, symbol, doc; or just a number",
        ),
    ],
};

/// `[effect.expression]`, as written.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct EffectTable {
    #[serde(default, skip_serializing_if = "Option::is_none")]
    name: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    summary: Option<String>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    at: Vec<String>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    on: Vec<String>,
    force: String,
    #[serde(default, skip_serializing_if = "Ordered::is_empty")]
    parameters: Ordered<ParameterTable>,
}

/// An effect that a model file defines: its declaration and its law.
struct Law {
    meta: EffectMeta,
    force: Program,
    /// Signals it reads by their own name.
    signals: Vec<usize>,
}

const PARAMETERS: u8 = FIRST_BANK;
const ROLES: u8 = FIRST_BANK + 1;
const SIGNALS: u8 = FIRST_BANK + 2;
const HERE: u8 = FIRST_BANK + 3;
/// What an effect sees beside signals, in this order.
const HERE_NAMES: [&str; 3] = ["nominal", "side", "time"];

macro_rules! physics {
    ($($scalar:ty),*) => {$(
        impl Physics<$scalar> for Law {
            fn contribution(
                &self,
                at: &Reading<'_, $scalar>,
                _z: &[$scalar],
                p: &[$scalar],
            ) -> $scalar {
                let here = [at.nominal, at.side, <$scalar>::of(at.time)];
                self.force.value(&[p, &at.roles, at.signals, &here])
            }
            fn state_derivative(
                &self,
                _at: &Reading<'_, $scalar>,
                _z: &[$scalar],
                _p: &[$scalar],
                _dz: &mut [$scalar],
            ) {
            }
            fn initial_state(
                &self,
                _at: &Reading<'_, $scalar>,
                _p: &[$scalar],
                _z: &mut [$scalar],
            ) {
            }
        }
    )*};
}
physics!(f32, f64, Dual);

/// The names at some channels of a plant.
struct AtChannels<'a> {
    plant: &'static PlantMeta,
    at: &'a [&'static Channel],
    parameters: &'a Ordered<ParameterTable>,
}

impl AtChannels<'_> {
    fn signal(&self, id: &str) -> Option<usize> {
        signals(self.plant).position(|s| s.id == id)
    }

    /// The role of this name; where the plant has no signal `speed` that is the flow.
    fn role(&self, name: &str) -> Option<Role> {
        let other = name == "speed" && self.signal(name).is_none();
        let id = if other { Role::Flow.id() } else { name };
        Role::ALL.into_iter().find(|r| r.id() == id)
    }

    /// A role wins over a signal of the same name, unless they are different things.
    fn reading(&self, role: Role, name: &str) -> Result<Slot, String> {
        let played: Vec<Option<&str>> = self.at.iter().map(|c| c.read(role)).collect();
        let signal = self.signal(name);
        let of_role = slot(ROLES, role as usize);
        match signal {
            Some(index) if played.iter().flatten().all(|p| *p == name) => Ok(slot(SIGNALS, index)),
            Some(_) => Err(format!(
                "`{name}` is a signal of the plant, and the {} at `{}` is another",
                role.name(),
                self.at.first().map_or("", |c| c.id)
            )),
            None => match self.at.iter().find(|c| c.read(role).is_none()) {
                Some(channel) => {
                    let offered: Vec<&str> = channel.reads.iter().map(|r| r.0.id()).collect();
                    Err(format!(
                        "the channel `{}` offers no {}, it offers {}",
                        channel.id,
                        role.name(),
                        offered.join(", ")
                    ))
                }
                None => Ok(of_role),
            },
        }
    }
}

impl Names for AtChannels<'_> {
    fn find(&self, name: &str) -> Option<Result<Tree, String>> {
        if let Some(index) = self.parameters.position(name) {
            return Some(Ok(Tree::Name(slot(PARAMETERS, index))));
        }
        if let Some(index) = HERE_NAMES.iter().position(|n| *n == name) {
            return Some(Ok(Tree::Name(slot(HERE, index))));
        }
        if let Some(role) = self.role(name) {
            return Some(self.reading(role, name).map(Tree::Name));
        }
        self.signal(name)
            .map(|index| Ok(Tree::Name(slot(SIGNALS, index))))
    }

    fn known(&self) -> Vec<String> {
        let everywhere = |r: &Role| self.at.iter().all(|c| c.read(*r).is_some());
        let roles = Role::ALL.into_iter().filter(everywhere).map(Role::id);
        let own = self.parameters.ids().map(str::to_owned);
        let read = roles.chain(HERE_NAMES).map(str::to_owned);
        let mut names: Vec<String> = own.chain(read).collect();
        for signal in signals(self.plant) {
            if !names.iter().any(|n| n == signal.id) {
                names.push(signal.id.to_owned());
            }
        }
        names
    }
}

fn slot(bank: u8, index: usize) -> Slot {
    Slot {
        bank,
        index: index as u16,
    }
}

impl EffectTable {
    /// What this table comes to at some channels; made once for the same text.
    fn law(
        &self,
        plant: &'static PlantMeta,
        at: &[&'static Channel],
    ) -> Result<&'static Law, Mistake> {
        static LAWS: Kept<Law> = Kept::new();
        let parameters: Vec<_> = self
            .parameters
            .iter()
            .map(|(id, p)| (id, p.without_value()))
            .collect();
        let ids: Vec<&str> = at.iter().map(|c| c.id).collect();
        let key = format!(
            "{:p} {ids:?} {:?} {:?} {:?} {parameters:?}",
            plant, self.name, self.summary, self.force
        );
        LAWS.get(key, || self.understand(plant, at))
    }

    fn understand(
        &self,
        plant: &'static PlantMeta,
        at: &[&'static Channel],
    ) -> Result<Law, Mistake> {
        for (id, _) in self.parameters.iter() {
            let signal = signals(plant).any(|s| s.id == id);
            let role = Role::ALL.iter().any(|r| r.id() == id);
            let taken = if HERE_NAMES.contains(&id) || role {
                Some("what an effect can read")
            } else {
                signal.then_some("a signal of the plant")
            };
            check_name("parameters", id, taken)?;
        }
        let names = AtChannels {
            plant,
            at,
            parameters: &self.parameters,
        };
        let force: [Step; 1] = ["force".into()];
        let tree = parse(&self.force, &names).map_err(|e| placed(&force, e))?;
        check_used(
            "parameters",
            self.parameters.ids(),
            &[&tree],
            |i| slot(PARAMETERS, usize::from(i)),
            "is not in the expression",
        )?;
        let mut read = Vec::new();
        let mut roles = Vec::new();
        tree.for_each_name(&mut |slot| {
            let index = usize::from(slot.index);
            match slot.bank {
                SIGNALS if !read.contains(&index) => read.push(index),
                ROLES => roles.extend(Role::ALL.get(index).filter(|r| !roles.contains(*r))),
                _ => {}
            }
        });
        let parameters = self.declare(plant, at, &tree)?;
        let meta = EffectMeta {
            id: keep::text(self.name.as_deref().unwrap_or(EFFECT_PART.id)),
            summary: keep::text(
                self.summary
                    .as_deref()
                    .unwrap_or("an effect that the model file defines"),
            ),
            symptom: "what the expression says is missing from the model",
            remedy: "command against what the expression says, where the drive allows it",
            equation: keep::text(&format!("w = {}", self.force.trim())),
            reference: "the model file",
            example: EFFECT_PART.example,
            places: &PlaceKind::ALL,
            reads: roles.leak(),
            parameters: parameters.leak(),
            ..EffectMeta::PLAIN
        };
        Ok(Law {
            meta,
            force: Program::new([&tree]),
            signals: read,
        })
    }

    fn declare(
        &self,
        plant: &'static PlantMeta,
        at: &[&'static Channel],
        tree: &Tree,
    ) -> Result<Vec<Parameter>, Mistake> {
        let held = |i: u16| {
            let parameter = self.parameters.0.get(usize::from(i));
            parameter.is_none_or(|(_, p)| p.is_held())
        };
        let found = tree.dependence(&|s| s.bank == PARAMETERS && !held(s.index));
        let declare = |(index, (id, table)): (usize, (&str, &ParameterTable))| {
            let linear = found.linear.contains(&slot(PARAMETERS, index));
            let parameter = table.declare(id, linear)?;
            // `channel` and `flow` may stand in a unit, as in those of the library.
            let unit = at.first().map_or_else(
                || parameter.unit.to_owned(),
                |c| unit_at(parameter.unit, c, plant).0,
            );
            let path = ["parameters".into(), id.into(), "unit".into()];
            check_unit(&path, &unit, parameter.unit)?;
            Ok(parameter)
        };
        self.parameters.iter().enumerate().map(declare).collect()
    }

    fn check(&self) -> Result<(), Mistake> {
        if !self.at.is_empty() && !self.on.is_empty() {
            let message = "the channels are given as `at` and as `on`, expected one of them";
            return Err(Mistake::key(["on".into()], message));
        }
        if let Some(name) = &self.name {
            let path: [Step; 1] = ["name".into()];
            if !super::lexer::is_name(name) {
                let message = format!("`{name}` is no name, expected letters, digits and `_`");
                return Err(Mistake::value(path, message));
            }
            if effects().iter().any(|e| e.id == name) {
                let message = format!("`{name}` is the name of an effect of the library");
                return Err(Mistake::value(path, message));
            }
        }
        Ok(())
    }
}

/// The effect as a file has it.
#[derive(Clone, Debug)]
struct Part {
    table: EffectTable,
    values: Values,
}

impl Serialize for Part {
    fn serialize<S: serde::Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        self.table.serialize(to)
    }
}

impl<'de> Deserialize<'de> for Part {
    fn deserialize<D: serde::Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        let table = EffectTable::deserialize(from)?;
        let given = table.parameters.iter().map(|(id, p)| p.given(id).0);
        let values = Values {
            set: 0,
            given: given.collect(),
        };
        Ok(Self { table, values })
    }
}

/// What an effect as an expression is before its expression is read.
const UNREAD: EffectMeta = EffectMeta {
    id: EFFECT_PART.id,
    summary: EFFECT_PART.summary,
    places: &PlaceKind::ALL,
    ..EffectMeta::PLAIN
};

/// The law of an effect whose expression is not read.
struct Nothing;

impl<S: Real> Physics<S> for Nothing {
    fn contribution(&self, _at: &Reading<'_, S>, _z: &[S], _p: &[S]) -> S {
        S::zero()
    }
    fn state_derivative(&self, _at: &Reading<'_, S>, _z: &[S], _p: &[S], _dz: &mut [S]) {}
    fn initial_state(&self, _at: &Reading<'_, S>, _p: &[S], _z: &mut [S]) {}
}

#[typetag::serde(name = "expression")]
impl EffectPart for Part {
    fn meta(&self) -> &'static EffectMeta {
        &UNREAD
    }
    fn at(&self) -> &[String] {
        if self.table.at.is_empty() {
            &self.table.on
        } else {
            &self.table.at
        }
    }
    fn values(&self) -> &Values {
        &self.values
    }
    fn physics(&self) -> &'static dyn AnyPhysics {
        &Nothing
    }
    fn at_key(&self) -> &'static str {
        if self.table.on.is_empty() { "at" } else { "on" }
    }
    fn ready(
        &self,
        plant: &'static PlantMeta,
        at: &[&'static Channel],
    ) -> Result<ReadyEffect, Mistake> {
        self.table.check()?;
        let law = self.table.law(plant, at)?;
        // Values are no part of what is kept.
        for (id, p) in self.table.parameters.iter() {
            p.declare(id, true)?;
        }
        let given = self.table.parameters.iter().map(|(id, p)| p.given(id));
        let (given, paths) = given.unzip();
        Ok(ReadyEffect {
            meta: &law.meta,
            physics: law,
            given,
            paths,
            signals: law.signals.clone(),
        })
    }
}
