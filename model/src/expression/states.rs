//! The states of an effect that a model file defines.

use serde::de::Visitor;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::fmt;

use super::at_channels::{AtChannels, HERE_NAMES, Site, read_roles};
use super::parse::parse;
use super::placed;
use super::program::{N_BANKS, Numbers, Program};
use super::table::{Ordered, check_name, check_unit};
use super::tree::Tree;
use crate::attach::unit_at;
use crate::config::{Mistake, PathSegment};
use loopsight_core::{Reading, Real, Role};

/// Most states of an effect at one channel.
pub(super) const MOST: usize = 8;
/// The table of the states.
const STATES: &str = "states";

/// A state of an effect, as written.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct StateTable {
    unit: String,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    rate: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    start: Option<Formula>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    limits: Option<[Formula; 2]>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    doc: Option<String>,
}

/// A number, or an expression.
#[derive(Clone, Debug, PartialEq)]
enum Formula {
    Number(f64),
    Text(String),
}

impl Serialize for Formula {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Formula::Number(value) => serializer.serialize_f64(*value),
            Formula::Text(text) => serializer.serialize_str(text),
        }
    }
}

impl<'de> Deserialize<'de> for Formula {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Either;
        impl Visitor<'_> for Either {
            type Value = Formula;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a number or an expression")
            }
            fn visit_f64<E>(self, value: f64) -> Result<Formula, E> {
                Ok(Formula::Number(value))
            }
            fn visit_i64<E>(self, value: i64) -> Result<Formula, E> {
                Ok(Formula::Number(value as f64))
            }
            fn visit_str<E>(self, text: &str) -> Result<Formula, E> {
                Ok(Formula::Text(text.to_owned()))
            }
        }
        deserializer.deserialize_any(Either)
    }
}

/// The trees of the states of an effect, in the order of the file.
pub(super) struct Read {
    pub(super) rates: Vec<Tree>,
    pub(super) starts: Vec<Tree>,
    /// The least and the greatest value of each, one behind the other.
    pub(super) limits: Vec<Tree>,
}

impl Read {
    /// All of them.
    pub(super) fn trees(&self) -> impl Iterator<Item = &Tree> {
        self.rates.iter().chain(&self.starts).chain(&self.limits)
    }

    /// Each of them as `with` makes it.
    pub(super) fn each(&self, with: &dyn Fn(&Tree) -> Tree) -> Self {
        let of = |trees: &[Tree]| trees.iter().map(with).collect();
        Self {
            rates: of(&self.rates),
            starts: of(&self.starts),
            limits: of(&self.limits),
        }
    }
}

/// Checks the names, units and numbers of the states.
pub(super) fn check<'t>(
    states: &Ordered<StateTable>,
    names: &AtChannels<'_>,
    taken: impl Fn(&str) -> Option<&'t str>,
) -> Result<(), Mistake> {
    if states.len() > MOST {
        let message = format!("{} states, expected at most {MOST}", states.len());
        return Err(Mistake::key([STATES.into()], message));
    }
    for (id, state) in states.iter() {
        let own = names.parameters.position(id).map(|_| "a parameter");
        check_name(STATES, id, taken(id).or(own))?;
        let unit = names.at.first().map_or_else(
            || state.unit.clone(),
            |c| unit_at(&state.unit, c, names.plant).0,
        );
        check_unit(
            &[STATES.into(), id.into(), "unit".into()],
            &unit,
            &state.unit,
        )?;
        state.check(id)?;
    }
    Ok(())
}

impl StateTable {
    /// The numbers that stand where an expression might.
    fn check(&self, id: &str) -> Result<(), Mistake> {
        let path = |key: &str| -> [PathSegment; 3] { [STATES.into(), id.into(), key.into()] };
        if self.rate.is_none() {
            let message = format!("`{id}` is a state and needs a `rate`: an expression");
            return Err(Mistake::key([STATES.into(), id.into()], message));
        }
        let number = |formula: Option<&Formula>| match formula {
            Some(Formula::Number(value)) => Some(*value),
            _ => None,
        };
        let start = number(self.start.as_ref().or(Some(&Formula::Number(0.0))));
        if let Some(start) = start.filter(|s| !s.is_finite()) {
            let message = format!("`start` is {start}, expected a finite number or an expression");
            return Err(Mistake::value(path("start"), message));
        }
        let Some([least, greatest]) = &self.limits else {
            return Ok(());
        };
        let least = number(Some(least)).unwrap_or(f64::NEG_INFINITY);
        let greatest = number(Some(greatest)).unwrap_or(f64::INFINITY);
        if least.is_nan() || greatest.is_nan() || least >= greatest {
            let message = format!("the limits are from {least} to {greatest}");
            let error = Mistake::value(path("limits"), message);
            return Err(error.help("the least value comes first: `limits = [0.0, 1.0]`"));
        }
        match start {
            Some(start) if start < least || start > greatest => {
                let given = self.start.is_some();
                let message = format!(
                    "`{id}` starts at {start}{}, expected a number from {least} to {greatest}: its limits",
                    if given { "" } else { " without a `start`" }
                );
                Err(Mistake::value(
                    path(if given { "start" } else { "limits" }),
                    message,
                ))
            }
            _ => Ok(()),
        }
    }
}

/// Reads the expressions of the states.
pub(super) fn read(names: &AtChannels<'_>) -> Result<Read, Mistake> {
    let mut read = Read {
        rates: Vec::new(),
        starts: Vec::new(),
        limits: Vec::new(),
    };
    let formula = |formula: &Formula, site, path: &[PathSegment]| match formula {
        Formula::Number(value) => Ok(Tree::Number(*value)),
        Formula::Text(text) => parse(text, &names.at_site(site)).map_err(|e| placed(path, e)),
    };
    for (id, state) in names.states.iter() {
        let path = |key: &str| -> Vec<PathSegment> { vec![STATES.into(), id.into(), key.into()] };
        let rate = Formula::Text(state.rate.clone().unwrap_or_default());
        read.rates.push(formula(&rate, Site::Rate, &path("rate"))?);
        let start = state.start.as_ref().unwrap_or(&Formula::Number(0.0));
        read.starts
            .push(formula(start, Site::Start, &path("start"))?);
        let free = [f64::NEG_INFINITY, f64::INFINITY].map(Formula::Number);
        let limits = state.limits.as_ref().unwrap_or(&free);
        for (side, limit) in limits.iter().enumerate() {
            let mut path = path("limits");
            path.push(side.into());
            read.limits.push(formula(limit, Site::Limit, &path)?);
        }
    }
    Ok(read)
}

/// A state that moves nothing is a mistake: it is neither in the force nor in the rate of one that is.
pub(super) fn check_used(
    states: &Ordered<StateTable>,
    force: &Tree,
    rates: &[Tree],
    index_of: impl Fn(super::tree::Slot) -> Option<usize>,
) -> Result<(), Mistake> {
    let mut used = vec![false; rates.len()];
    let mut open = vec![force];
    while let Some(tree) = open.pop() {
        tree.for_each_name(&mut |slot| {
            if let Some(index) = index_of(slot)
                && let Some(known) = used.get_mut(index)
                && !std::mem::replace(known, true)
                && let Some(rate) = rates.get(index)
            {
                open.push(rate);
            }
        });
    }
    match states.ids().zip(used).find(|(_, used)| !used) {
        Some((id, _)) => {
            let message =
                format!("`{id}` is neither in the force nor in the rate of a state that is");
            Err(Mistake::key([STATES.into(), id.into()], message))
        }
        None => Ok(()),
    }
}

/// The states as they are said in an equation: `z' = …`.
pub(super) fn equation(states: &Ordered<StateTable>) -> String {
    let line = |(id, state): (&str, &StateTable)| {
        let rate = state.rate.as_deref().unwrap_or("").trim();
        let limits = match &state.limits {
            Some([least, greatest]) => format!(" within {} … {}", least.text(), greatest.text()),
            None => String::new(),
        };
        format!("{id}' = {rate}{limits};  ")
    };
    states.iter().map(line).collect()
}

impl Formula {
    fn text(&self) -> String {
        match self {
            Formula::Number(value) => value.to_string(),
            Formula::Text(text) => text.trim().to_owned(),
        }
    }
}

/// What an expression reads at a channel.
pub(super) struct Reads<'a, S> {
    roles: [S; Role::COUNT],
    signals: &'a [S],
    here: [S; HERE_NAMES.len() + MOST],
    /// How much of `here` there is.
    n: usize,
}

impl<'a, S: Real> Reads<'a, S> {
    pub(super) fn new(at: &Reading<'a, S>, roles: &[Role], z: &[S]) -> Self {
        let mut here = [S::zero(); HERE_NAMES.len() + MOST];
        here[..HERE_NAMES.len()].copy_from_slice(&[at.nominal, at.side, S::of(at.time)]);
        let n = z.len().min(MOST);
        here[HERE_NAMES.len()..][..n].copy_from_slice(&z[..n]);
        Self {
            roles: read_roles(at, roles),
            signals: at.signals,
            here,
            n: HERE_NAMES.len() + n,
        }
    }

    /// The states.
    pub(super) fn states(&mut self) -> &mut [S] {
        &mut self.here[HERE_NAMES.len()..self.n]
    }

    pub(super) fn banks<'s>(&'s self, p: &'s [S]) -> [&'s [S]; N_BANKS] {
        [p, &self.roles, self.signals, &self.here[..self.n]]
    }
}

/// How the states of an effect move, ready to be evaluated.
pub(super) struct Motion {
    rates: Program,
    starts: Program,
    /// None where no state has limits.
    limits: Option<Program>,
}

impl Motion {
    pub(super) fn new(read: &Read) -> Self {
        let free = |tree: &Tree| matches!(tree, Tree::Number(x) if x.is_infinite());
        let limited = !read.limits.iter().all(free);
        Self {
            rates: Program::new(&read.rates),
            starts: Program::new(&read.starts),
            limits: limited.then(|| Program::new(&read.limits)),
        }
    }

    /// What exceeds the limits is lost: a state comes to them and stays there until its rate turns back.
    pub(super) fn confine<S: Real>(&self, z: &mut [S], p: &[S])
    where
        Program: Numbers<S>,
    {
        let Some(limits) = &self.limits else { return };
        let mut bounds = [S::zero(); 2 * MOST];
        limits.run(&[p, &[], &[], &[]], &mut bounds);
        for (z, bound) in z.iter_mut().zip(bounds.chunks_exact(2)) {
            *z = z.clamp(bound[0], bound[1]);
        }
    }

    /// The rates at the reading `at`, which has the states within their limits.
    pub(super) fn rates<S: Real>(&self, at: &Reads<'_, S>, p: &[S], dz: &mut [S])
    where
        Program: Numbers<S>,
    {
        self.rates.run(&at.banks(p), dz);
    }

    /// The states at the start of a run.
    pub(super) fn starts<S: Real>(&self, at: &Reads<'_, S>, p: &[S], z: &mut [S])
    where
        Program: Numbers<S>,
    {
        self.starts.run(&at.banks(p), z);
        self.confine(z, p);
    }
}
