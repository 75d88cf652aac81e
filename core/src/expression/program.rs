//! An expression made ready to be evaluated: a flat list of instructions.

use super::operation::{Binary, Unary};
use super::tree::{Slot, Tree};
use crate::{Dual, Real};

/// Bank of the program's own numbers.
const NUMBERS: u8 = 0;
/// Bank of intermediate results.
const SAVED: u8 = 1;
/// First of the banks a program is run with.
pub(crate) const FIRST_BANK: u8 = 2;
/// Number of banks a program is run with.
pub(crate) const N_BANKS: usize = 4;
/// Room for intermediate results; a tree of `n` leaves needs at most `log2 n` of them, since the
/// deeper side is evaluated first.
const ROOM: usize = 16;
/// Room that nearly every program is content with.
const SMALL_ROOM: usize = 4;
/// Most leaves of a tree, so that [`ROOM`] is enough.
pub(crate) const MOST_LEAVES: usize = 1 << 12;
/// Largest whole exponent that is written as a product.
const LARGEST_WHOLE: f64 = 16.0;

/// One instruction. There is one accumulator; the other operand, where there is one, is a slot.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Code {
    /// accumulator <- slot
    Load,
    /// saved\[index\] <- accumulator
    Save,
    /// result\[index\] <- accumulator
    Store,
    Add,
    Subtract,
    /// slot - accumulator
    SubtractFrom,
    Multiply,
    Divide,
    /// slot / accumulator
    DivideInto,
    Negate,
    Square,
    /// accumulator^index
    Whole,
    One(Unary),
    /// accumulator and slot
    Two(Binary),
    /// slot and accumulator
    Reversed(Binary),
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Instruction {
    code: Code,
    slot: Slot,
}

/// Numbers for one scalar.
pub(crate) trait Numbers<S> {
    /// The numbers of a program as this scalar.
    fn numbers(&self) -> &[S];
}

/// One or several expressions, ready to be evaluated over any scalar a host uses, without an
/// allocation.
///
/// The slices a program is run with hold the values of the names; [`Slot`]s point into them. A
/// slot beyond its slice counts as zero.
#[derive(Clone, Debug, Default)]
pub(crate) struct Program {
    code: Vec<Instruction>,
    doubles: Vec<f64>,
    singles: Vec<f32>,
    duals: Vec<Dual>,
    saved: usize,
}

macro_rules! numbers {
    ($($scalar:ty: $field:ident),*) => {$(
        impl Numbers<$scalar> for Program {
            #[inline(always)]
            fn numbers(&self) -> &[$scalar] {
                &self.$field
            }
        }
    )*};
}
numbers!(f64: doubles, f32: singles, Dual: duals);

impl Program {
    /// A program whose `i`-th result is the `i`-th of `trees`.
    pub(crate) fn new<'t>(trees: impl IntoIterator<Item = &'t Tree>) -> Self {
        let mut program = Self::default();
        for (index, tree) in trees.into_iter().enumerate() {
            program.emit(tree, 0);
            program.push(Code::Store, slot(0, index));
        }
        program.singles = program.doubles.iter().map(|x| *x as f32).collect();
        program.duals = program.doubles.iter().map(|x| Dual::of(*x)).collect();
        program
    }

    fn push(&mut self, code: Code, slot: Slot) {
        self.code.push(Instruction { code, slot });
    }

    /// Where a leaf is found.
    fn leaf(&mut self, tree: &Tree) -> Option<Slot> {
        match tree {
            Tree::Name(slot) => Some(*slot),
            Tree::Number(x) => {
                let known = |y: &f64| y.to_bits() == x.to_bits();
                let index = self.doubles.iter().position(known).unwrap_or_else(|| {
                    self.doubles.push(*x);
                    self.doubles.len() - 1
                });
                Some(slot(NUMBERS, index))
            }
            _ => None,
        }
    }

    /// Code that leaves the value of `tree` in the accumulator; `saved` results are in use.
    fn emit(&mut self, tree: &Tree, saved: usize) {
        if let Some(slot) = self.leaf(tree) {
            self.push(Code::Load, slot);
            return;
        }
        let nothing = slot(NUMBERS, 0);
        match tree {
            Tree::Number(_) | Tree::Name(_) => {}
            Tree::One(operation, x) => {
                self.emit(x, saved);
                let code = match operation {
                    Unary::Negate => Code::Negate,
                    Unary::Square => Code::Square,
                    other => Code::One(*other),
                };
                self.push(code, nothing);
            }
            Tree::Two(Binary::Power, x, exponent) if whole(exponent).is_some() => {
                self.emit(x, saved);
                self.push(Code::Whole, slot(NUMBERS, whole(exponent).unwrap_or(0)));
            }
            Tree::Two(operation, a, b) => {
                if let Some(b) = self.leaf(b) {
                    self.emit(a, saved);
                    self.push(forward(*operation), b);
                } else if let Some(a) = self.leaf(a) {
                    self.emit(b, saved);
                    self.push(reversed(*operation), a);
                } else {
                    let deeper_first = depth(a) >= depth(b);
                    let (first, second) = if deeper_first { (a, b) } else { (b, a) };
                    self.emit(first, saved);
                    let kept = slot(SAVED, saved);
                    self.push(Code::Save, kept);
                    self.saved = self.saved.max(saved + 1);
                    self.emit(second, saved + 1);
                    let code = if deeper_first {
                        reversed(*operation)
                    } else {
                        forward(*operation)
                    };
                    self.push(code, kept);
                }
            }
        }
    }

    /// Evaluates the expressions into `results`.
    #[inline]
    pub(crate) fn run<S: Real>(&self, banks: &[&[S]; N_BANKS], results: &mut [S])
    where
        Self: Numbers<S>,
    {
        if self.saved <= SMALL_ROOM {
            self.run_in(&mut [S::zero(); SMALL_ROOM], banks, results);
        } else {
            self.run_in(&mut [S::zero(); ROOM], banks, results);
        }
    }

    /// Evaluates the first expression.
    #[inline]
    pub(crate) fn value<S: Real>(&self, banks: &[&[S]; N_BANKS]) -> S
    where
        Self: Numbers<S>,
    {
        let mut result = [S::zero()];
        self.run(banks, &mut result);
        result[0]
    }

    #[inline(always)]
    fn run_in<S: Real, const N: usize>(
        &self,
        saved: &mut [S; N],
        banks: &[&[S]; N_BANKS],
        results: &mut [S],
    ) where
        Self: Numbers<S>,
    {
        let numbers: &[S] = self.numbers();
        let banks: [&[S]; 5] = [numbers, banks[0], banks[1], banks[2], banks[3]];
        let mut a = S::zero();
        for Instruction { code, slot } in &self.code {
            let index = usize::from(slot.index);
            // The operand of those that have one.
            macro_rules! b {
                () => {
                    if slot.bank == SAVED {
                        saved.get(index).copied().unwrap_or(S::zero())
                    } else {
                        let bank = banks[usize::from(slot.bank.saturating_sub(1)) % 5];
                        bank.get(index).copied().unwrap_or(S::zero())
                    }
                };
            }
            match code {
                Code::Load => a = b!(),
                Code::Save => {
                    if let Some(to) = saved.get_mut(index) {
                        *to = a;
                    }
                }
                Code::Store => {
                    if let Some(to) = results.get_mut(index) {
                        *to = a;
                    }
                }
                Code::Add => a += b!(),
                Code::Subtract => a -= b!(),
                Code::SubtractFrom => a = b!() - a,
                Code::Multiply => a *= b!(),
                Code::Divide => a /= b!(),
                Code::DivideInto => a = b!() / a,
                Code::Negate => a = -a,
                Code::Square => a = a * a,
                Code::Whole => a = whole_power(a, index),
                Code::One(operation) => a = operation.apply(a),
                Code::Two(operation) => a = operation.apply(a, b!()),
                Code::Reversed(operation) => a = operation.apply(b!(), a),
            }
        }
    }
}

fn slot(bank: u8, index: usize) -> Slot {
    Slot {
        bank,
        index: u16::try_from(index).unwrap_or(u16::MAX),
    }
}

fn forward(operation: Binary) -> Code {
    match operation {
        Binary::Add => Code::Add,
        Binary::Subtract => Code::Subtract,
        Binary::Multiply => Code::Multiply,
        Binary::Divide => Code::Divide,
        other => Code::Two(other),
    }
}

fn reversed(operation: Binary) -> Code {
    match operation {
        Binary::Add => Code::Add,
        Binary::Subtract => Code::SubtractFrom,
        Binary::Multiply => Code::Multiply,
        Binary::Divide => Code::DivideInto,
        other => Code::Reversed(other),
    }
}

/// Intermediate results that evaluating a tree needs.
fn depth(tree: &Tree) -> usize {
    match tree {
        Tree::Number(_) | Tree::Name(_) => 0,
        Tree::One(_, x) => depth(x).max(1),
        Tree::Two(_, a, b) => match (depth(a), depth(b)) {
            (a, b) if a == b => a + 1,
            (a, b) => a.max(b),
        },
    }
}

/// An exponent that is small and whole.
fn whole(tree: &Tree) -> Option<usize> {
    match tree {
        Tree::Number(x) if *x >= 3.0 && *x <= LARGEST_WHOLE && x.fract() == 0.0 => {
            Some(*x as usize)
        }
        _ => None,
    }
}

fn whole_power<S: Real>(x: S, exponent: usize) -> S {
    let mut product = x;
    for _ in 1..exponent {
        product *= x;
    }
    product
}
