//! The equations of a plant that a model file defines.

use super::lexer::{Word, words};
use super::operation::Binary;
use super::parse::parse;
use super::plant::{MOST, PlantTable, SignalTable};
use super::program::{FIRST_BANK, MOST_LEAVES, Numbers, Program};
use super::table::{Ordered, check_used};
use super::tree::{Slot, Tree};
use super::{ExpressionError, Names, placed};
use crate::config::{Mistake, PathSegment};
use crate::{Dual, NarrowDual, TinyDual};
use loopsight_core::{Dynamics, Real, Steps, steps_alone};

const PARAMETERS: u8 = FIRST_BANK;
const STATES: u8 = FIRST_BANK + 1;
const INPUTS: u8 = FIRST_BANK + 2;
const EFFORTS: u8 = FIRST_BANK + 3;
/// Stands for the expression of an output until that is put in its place.
const OUTPUTS: u8 = FIRST_BANK + 4;

fn slot(bank: u8, index: usize) -> Slot {
    Slot {
        bank,
        index: index as u16,
    }
}

/// The names in the equations of a plant.
struct InPlant<'a> {
    plant: &'a PlantTable,
    /// Efforts act on rates only.
    rate: bool,
}

impl InPlant<'_> {
    fn efforts(&self) -> impl Iterator<Item = &str> {
        let declared = self.plant.channels.iter();
        declared.filter(|(_, c)| c.is_effort()).map(|(id, _)| id)
    }
}

impl Names for InPlant<'_> {
    fn find(&self, name: &str) -> Option<Result<Tree, String>> {
        let plant = self.plant;
        let found = [
            (PARAMETERS, plant.parameters.position(name)),
            (STATES, plant.states.position(name)),
            (INPUTS, plant.inputs.position(name)),
            (OUTPUTS, plant.outputs.position(name)),
        ];
        for (bank, index) in found {
            if let Some(index) = index {
                return Some(Ok(Tree::Name(slot(bank, index))));
            }
        }
        let effort = self.efforts().position(|id| id == name)?;
        if self.rate {
            Some(Ok(Tree::Name(slot(EFFORTS, effort))))
        } else {
            Some(Err(format!(
                "the effort `{name}` acts on rates, an output cannot read it"
            )))
        }
    }

    fn known(&self) -> Vec<String> {
        let plant = self.plant;
        let signals = plant.signals().map(|s| s.0);
        let mut names: Vec<&str> = plant.parameters.ids().chain(signals).collect();
        if self.rate {
            names.extend(self.efforts());
        }
        names.into_iter().map(str::to_owned).collect()
    }
}

/// The expressions of a plant, as they were understood.
pub(super) struct Equations {
    /// Rates as written: they may name outputs.
    written: Vec<Tree>,
    /// Rates without outputs.
    rates: Vec<Tree>,
    outputs: Vec<Tree>,
}

impl Equations {
    /// Reads them all.
    pub(super) fn read(plant: &PlantTable) -> Result<Self, Mistake> {
        let read = |group: &Ordered<SignalTable>, table: &str, rate: bool| {
            let key = if rate { "rate" } else { "value" };
            let mut trees = Vec::new();
            for (id, signal) in group.iter() {
                let text = if rate { &signal.rate } else { &signal.value };
                let names = InPlant { plant, rate };
                let tree = parse(text.as_deref().unwrap_or(""), &names);
                trees.push(tree.map_err(|e| {
                    let path: [PathSegment; 3] = [table.into(), id.into(), key.into()];
                    placed(&path, e)
                })?);
            }
            Ok(trees)
        };
        let written = read(&plant.states, "states", true)?;
        let raw = read(&plant.outputs, "outputs", false)?;
        let mut outputs: Vec<Option<Tree>> = vec![None; raw.len()];
        for index in 0..raw.len() {
            put_in(plant, &raw, &mut outputs, index, &mut Vec::new())?;
        }
        let outputs: Vec<Tree> = outputs.into_iter().flatten().collect();
        let mut rates = Vec::new();
        for (tree, id) in written.iter().zip(plant.states.ids()) {
            let path: [PathSegment; 3] = ["states".into(), id.into(), "rate".into()];
            rates.push(without_outputs(tree, &outputs, &path)?);
        }
        let equations = Self {
            written,
            rates,
            outputs,
        };
        equations.check_used(plant)?;
        Ok(equations)
    }

    fn check_used(&self, plant: &PlantTable) -> Result<(), Mistake> {
        let all: Vec<&Tree> = self.rates.iter().chain(&self.outputs).collect();
        check_used(
            "parameters",
            plant.parameters.ids(),
            &all,
            |i| slot(PARAMETERS, usize::from(i)),
            "is in no expression",
        )?;
        let names = InPlant { plant, rate: true };
        check_used(
            "channels",
            names.efforts(),
            &all,
            |i| slot(EFFORTS, usize::from(i)),
            "is in no rate: an effort acts where its name stands",
        )
    }

    /// `(rate, integral)` of states whose rate is just another signal, and of signals that say so.
    pub(super) fn integrals<'p>(
        &self,
        plant: &'p PlantTable,
    ) -> Result<Vec<(&'p str, &'p str)>, Mistake> {
        let mut found = Vec::new();
        for (tree, (id, signal)) in self.written.iter().zip(plant.states.iter()) {
            let Tree::Name(slot) = tree else { continue };
            let group = match slot.bank {
                STATES => &plant.states,
                INPUTS => &plant.inputs,
                OUTPUTS => &plant.outputs,
                _ => continue,
            };
            if let Some(rate) = group.ids().nth(usize::from(slot.index))
                && signal.integral_of.is_none()
            {
                found.push((rate, id));
            }
        }
        for (table, group) in [("states", &plant.states), ("outputs", &plant.outputs)] {
            for (id, signal) in group.iter() {
                let Some(rate) = &signal.integral_of else {
                    continue;
                };
                let Some((rate, _)) = plant.signals().find(|s| s.0 == rate) else {
                    let all: Vec<&str> = plant.signals().map(|s| s.0).collect();
                    let message = format!(
                        "there is no signal `{rate}`, expected one of {}",
                        all.join(", ")
                    );
                    let path: [PathSegment; 3] = [table.into(), id.into(), "integral_of".into()];
                    return Err(Mistake::value(path, message));
                };
                found.push((rate, id));
            }
        }
        Ok(found)
    }

    /// Whether a parameter enters all rates linearly.
    pub(super) fn is_linear(&self, plant: &PlantTable, index: usize) -> bool {
        let free = |slot: Slot| {
            let parameter = plant.parameters.0.get(usize::from(slot.index));
            slot.bank == PARAMETERS && parameter.is_some_and(|(_, p)| !p.is_held())
        };
        let own = slot(PARAMETERS, index);
        self.rates
            .iter()
            .all(|tree| !tree.dependence(&free).nonlinear.contains(&own))
    }

    /// Whether the rate of a state is affine in the inputs.
    pub(super) fn is_affine(&self, state: usize) -> bool {
        let inputs = |slot: Slot| slot.bank == INPUTS;
        let rate = self.rates.get(state);
        rate.is_some_and(|tree| tree.dependence(&inputs).nonlinear.is_empty())
    }

    /// The equations ready to be evaluated; efforts of no name of their own are added to the rates
    /// of the states `pushed`, in this order.
    pub(super) fn law(self, pushed: &[usize]) -> Law {
        let mut rates = self.rates;
        for (effort, state) in pushed.iter().enumerate() {
            if let Some(tree) = rates.get_mut(*state) {
                let w = Tree::Name(slot(EFFORTS, effort));
                *tree = Tree::two(Binary::Add, std::mem::take(tree), w);
            }
        }
        Law {
            rates: Program::new(&rates),
            outputs: self
                .outputs
                .iter()
                .map(|tree| Program::new([tree]))
                .collect(),
        }
    }
}

/// Puts other outputs in their places in the `index`-th, which `path` led to.
fn put_in(
    plant: &PlantTable,
    raw: &[Tree],
    done: &mut [Option<Tree>],
    index: usize,
    path: &mut Vec<usize>,
) -> Result<(), Mistake> {
    if done.get(index).is_none_or(Option::is_some) {
        return Ok(());
    }
    let id = |i: usize| plant.outputs.ids().nth(i).unwrap_or("");
    path.push(index);
    let mut needed = Vec::new();
    raw[index].for_each_name(&mut |slot| {
        if slot.bank == OUTPUTS {
            needed.push(usize::from(slot.index));
        }
    });
    let place: [PathSegment; 3] = ["outputs".into(), id(index).into(), "value".into()];
    for other in needed {
        if let Some(first) = path.iter().position(|p| *p == other) {
            let round = path[first..].iter().chain([&other]).map(|i| id(*i));
            let round: Vec<&str> = round.collect();
            let message = format!("an output depends on itself: {}", round.join(" needs "));
            let text = plant.outputs.0[index].1.value.as_deref().unwrap_or("");
            let place_in_text = place_of(text, id(other));
            return Err(placed(&place, ExpressionError::at(place_in_text, message)));
        }
        put_in(plant, raw, done, other, path)?;
    }
    path.pop();
    let known: Vec<Tree> = done.iter().map(|t| t.clone().unwrap_or_default()).collect();
    done[index] = Some(without_outputs(&raw[index], &known, &place)?);
    Ok(())
}

/// An expression with the outputs it names put in their places.
fn without_outputs(tree: &Tree, outputs: &[Tree], path: &[PathSegment]) -> Result<Tree, Mistake> {
    let mut size = tree.size();
    tree.for_each_name(&mut |slot| {
        if slot.bank == OUTPUTS {
            size += outputs.get(usize::from(slot.index)).map_or(0, Tree::size);
        }
    });
    if size > MOST_LEAVES {
        let message = "with the outputs it names the expression is too long";
        return Err(Mistake::value(path.iter().cloned(), message));
    }
    Ok(tree.replace(&|slot| {
        let output = outputs.get(usize::from(slot.index));
        (slot.bank == OUTPUTS).then(|| output.cloned()).flatten()
    }))
}

/// Where a name stands in an expression.
fn place_of(text: &str, name: &str) -> std::ops::Range<usize> {
    let found = words(text).unwrap_or_default();
    let place = found
        .into_iter()
        .find(|(word, _)| *word == Word::Name(name));
    place.map_or(0..text.len(), |(_, place)| place)
}

/// The equations of a plant, ready to be evaluated.
pub(super) struct Law {
    rates: Program,
    outputs: Vec<Program>,
}

macro_rules! dynamics {
    ($($scalar:ty),*) => {$(
        impl Dynamics<$scalar> for Law {
            fn derivative(
                &self,
                x: &[$scalar],
                u: &[$scalar],
                w: &[$scalar],
                p: &[$scalar],
                dx: &mut [$scalar],
            ) {
                self.rates.run(&[p, x, u, w], dx);
            }

            fn steps(
                &self,
                x: &mut [$scalar],
                span: Steps<$scalar>,
                u: &[$scalar],
                w: &[$scalar],
                p: &[$scalar],
            ) -> f64 {
                match x.len() {
                    0..=2 => self.steps_in::<$scalar, 2>(x, span, u, w, p),
                    3..=4 => self.steps_in::<$scalar, 4>(x, span, u, w, p),
                    5..=6 => self.steps_in::<$scalar, 6>(x, span, u, w, p),
                    7..=8 => self.steps_in::<$scalar, 8>(x, span, u, w, p),
                    9..=16 => self.steps_in::<$scalar, 16>(x, span, u, w, p),
                    _ => self.steps_in::<$scalar, MOST>(x, span, u, w, p),
                }
            }

            fn output(
                &self,
                index: usize,
                x: &[$scalar],
                u: &[$scalar],
                p: &[$scalar],
            ) -> $scalar {
                match self.outputs.get(index) {
                    Some(output) => output.value(&[p, x, u, &[]]),
                    None => <$scalar>::of(0.0),
                }
            }

            fn lower(&self, _set: usize, from: &[$scalar], p: &mut [$scalar]) {
                for (to, from) in p.iter_mut().zip(from) {
                    *to = *from;
                }
            }
        }
    )*};
}
dynamics!(f32, f64, Dual, NarrowDual, TinyDual);

impl Law {
    /// Steps in room for `N` states.
    fn steps_in<S: Real, const N: usize>(
        &self,
        x: &mut [S],
        span: Steps<S>,
        u: &[S],
        w: &[S],
        p: &[S],
    ) -> f64
    where
        Program: Numbers<S>,
    {
        let n = x.len().min(N);
        let mut padded = [S::zero(); N];
        padded[..n].copy_from_slice(&x[..n]);
        let bend = steps_alone(&mut padded, span, |x: &[S; N]| {
            let mut dx = [S::zero(); N];
            self.rates.run(&[p, &x[..n], u, w], &mut dx);
            dx
        });
        x[..n].copy_from_slice(&padded[..n]);
        bend
    }
}
