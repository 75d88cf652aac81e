//! `[effect.expression]`: an effect that the model file itself defines.

use serde::{Deserialize, Serialize};

use super::at_channels::{
    AtChannels, HERE, HERE_NAMES, PARAMETERS, ROLES, SIGNALS, Site, read_roles, slot, state_slot,
};
use super::described::EFFECT_PART;
use super::keep::{self, Kept};
use super::parse::parse;
use super::placed;
use super::program::Program;
use super::states::{self, Motion, Reads, StateTable};
use super::table::{Ordered, ParameterTable, check_name, check_unit, check_used};
use super::tree::{Slot, Tree};
use crate::attach::unit_at;
use crate::config::{Mistake, PathSegment};
use crate::model::signals;
use crate::registry::{AnyPhysics, EffectPart, ReadyEffect, Values, effects};
use crate::{Dual, NarrowDual, TinyDual};
use loopsight_core::{
    Channel, EffectMeta, Parameter, Physics, PlaceKind, PlantMeta, Reading, Real, Role,
};

/// Shortest integration step that a file may ask for, s: with shorter ones a second takes minutes.
const SHORTEST_STEP: f64 = 1e-7;

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
    #[serde(default, skip_serializing_if = "Option::is_none")]
    max_step_s: Option<f64>,
    #[serde(default, skip_serializing_if = "Ordered::is_empty")]
    states: Ordered<StateTable>,
    #[serde(default, skip_serializing_if = "Ordered::is_empty")]
    parameters: Ordered<ParameterTable>,
}

/// An effect that a model file defines: its declaration and its law.
struct Law {
    meta: EffectMeta,
    force: Program,
    /// None where it has no states.
    motion: Option<Motion>,
    /// Signals it reads by their own name.
    signals: Vec<usize>,
}

macro_rules! physics {
    ($($scalar:ty),*) => {$(
        impl Physics<$scalar> for Law {
            fn contribution(
                &self,
                at: &Reading<'_, $scalar>,
                z: &[$scalar],
                p: &[$scalar],
            ) -> $scalar {
                let Some(motion) = &self.motion else {
                    let here = [at.nominal, at.side, <$scalar>::of(at.time)];
                    let value = |roles: &[$scalar]| {
                        self.force.value(&[p, roles, at.signals, &here])
                    };
                    // Most read one or two.
                    return if self.meta.reads.len() <= 2 {
                        value(&read_roles::<_, 2>(at, self.meta.reads))
                    } else {
                        value(&read_roles::<_, { Role::COUNT }>(at, self.meta.reads))
                    };
                };
                let mut reads = Reads::new(at, self.meta.reads, z);
                motion.confine(reads.states(), p);
                self.force.value(&reads.banks(p))
            }
            fn state_derivative(
                &self,
                at: &Reading<'_, $scalar>,
                z: &[$scalar],
                p: &[$scalar],
                dz: &mut [$scalar],
            ) {
                if let Some(motion) = &self.motion {
                    let mut reads = Reads::new(at, self.meta.reads, z);
                    motion.confine(reads.states(), p);
                    motion.rates(&reads, p, dz);
                }
            }
            fn initial_state(
                &self,
                at: &Reading<'_, $scalar>,
                p: &[$scalar],
                z: &mut [$scalar],
            ) {
                if let Some(motion) = &self.motion {
                    motion.starts(&Reads::new(at, self.meta.reads, &[]), p, z);
                }
            }
            fn confine(&self, z: &mut [$scalar], p: &[$scalar]) {
                if let Some(motion) = &self.motion {
                    motion.confine(z, p);
                }
            }
        }
    )*};
}
physics!(f32, f64, Dual, NarrowDual, TinyDual);

impl EffectTable {
    /// The effect of this table at some channels; made once for the same text.
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
            "{:p} {ids:?} {:?} {:?} {:?} {:?} {:?} {parameters:?}",
            plant, self.name, self.summary, self.force, self.max_step_s, self.states
        );
        LAWS.get(key, || self.understand(plant, at))
    }

    fn understand(
        &self,
        plant: &'static PlantMeta,
        at: &[&'static Channel],
    ) -> Result<Law, Mistake> {
        let taken = |id: &str| {
            let role = Role::ALL.iter().any(|r| r.id() == id);
            if HERE_NAMES.contains(&id) || role {
                return Some("what an effect can read");
            }
            let signal = signals(plant).any(|s| s.id == id);
            signal.then_some("a signal of the plant")
        };
        for id in self.parameters.ids() {
            check_name("parameters", id, taken(id))?;
        }
        let names = AtChannels {
            plant,
            at,
            parameters: &self.parameters,
            states: &self.states,
        };
        states::check(&self.states, &names, taken)?;
        let force: [PathSegment; 1] = ["force".into()];
        let tree = parse(&self.force, &names.at_site(Site::Rate)).map_err(|e| placed(&force, e))?;
        let moved = states::read(&names)?;
        let trees: Vec<&Tree> = [&tree].into_iter().chain(moved.trees()).collect();
        let missing = if self.states.is_empty() {
            "is not in the expression"
        } else {
            "is in no expression"
        };
        check_used(
            "parameters",
            self.parameters.ids(),
            &trees,
            |i| slot(PARAMETERS, usize::from(i)),
            missing,
        )?;
        let index_of = |s: Slot| {
            let first = usize::from(state_slot(0).index);
            let own = s.bank == HERE;
            usize::from(s.index).checked_sub(first).filter(|_| own)
        };
        states::check_used(&self.states, &tree, &moved.rates, index_of)?;
        let mut read = Vec::new();
        let mut roles = Vec::new();
        let mut timed = false;
        for tree in &trees {
            tree.for_each_name(&mut |slot| {
                let index = usize::from(slot.index);
                match slot.bank {
                    SIGNALS if !read.contains(&index) => read.push(index),
                    HERE => timed |= HERE_NAMES.get(index) == Some(&"time"),
                    ROLES => roles.extend(Role::ALL.get(index).filter(|r| !roles.contains(*r))),
                    _ => {}
                }
            });
        }
        // Only the roles that are read are looked up, so they are counted among themselves.
        let compact = |tree: &Tree| {
            tree.replace(&|s| {
                let of = |role: &Role| s == slot(ROLES, *role as usize);
                Some(Tree::Name(slot(ROLES, roles.iter().position(of)?)))
            })
        };
        let force = Program::new([&compact(&tree)]);
        let moved = moved.each(&compact);
        let motion = (!self.states.is_empty()).then(|| Motion::new(&moved));
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
            equation: keep::text(&format!(
                "{}w = {}",
                states::equation(&self.states),
                self.force.trim()
            )),
            reference: "the model file",
            example: EFFECT_PART.example,
            places: &PlaceKind::ALL,
            is_static: !timed && roles.is_empty() && read.is_empty() && self.states.is_empty(),
            reads: roles.leak(),
            parameters: parameters.leak(),
            states: self.states.len(),
            max_step_s: self.max_step_s.unwrap_or(f64::INFINITY),
            ..EffectMeta::PLAIN
        };
        Ok(Law {
            meta,
            force,
            motion,
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
            // What moves a state is not in proportion to a parameter, whatever the force is.
            let linear = self.states.is_empty() && found.linear.contains(&slot(PARAMETERS, index));
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
        let follows = |step: &f64| step.is_finite() && *step >= SHORTEST_STEP;
        if let Some(step) = self.max_step_s.filter(|step| !follows(step)) {
            let message =
                format!("`max_step_s` is {step}, expected a number of {SHORTEST_STEP:e} s or more");
            return Err(Mistake::value(["max_step_s".into()], message));
        }
        if let Some(name) = &self.name {
            let path: [PathSegment; 1] = ["name".into()];
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
        let values = table.parameters.values();
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
