//! An expression made ready to be evaluated: a flat list of instructions.

use super::operation::{Binary, Unary};
use super::tree::{Slot, Tree};
use crate::{Dual, NarrowDual, TinyDual};
use loopsight_core::Real;

/// Bank of the program's own numbers.
const NUMBERS: u8 = 0;
/// First of the banks a program is run with.
pub(crate) const FIRST_BANK: u8 = 1;
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

/// One instruction. There is one accumulator; operands are slots, or a saved result.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Code {
    /// accumulator <- a
    Load,
    /// result\[b\] <- a
    Copy,
    /// saved\[a\] <- accumulator
    Save,
    /// result\[a\] <- accumulator
    Store,
    Add,
    Subtract,
    /// a - accumulator
    SubtractFrom,
    Multiply,
    Divide,
    /// a / accumulator
    DivideInto,
    /// accumulator <- a b
    Product,
    /// accumulator + a b
    AddProduct,
    /// accumulator - a b
    SubtractProduct,
    /// a b - accumulator
    SubtractFromProduct,
    /// accumulator <- a + b
    Sum,
    /// accumulator + (a + b)
    AddSum,
    /// accumulator - (a + b)
    SubtractSum,
    /// accumulator + saved\[a\]
    AddSaved,
    /// accumulator - saved\[a\]
    SubtractSaved,
    /// saved\[a\] - accumulator
    SubtractFromSaved,
    /// accumulator saved\[a\]
    MultiplySaved,
    /// accumulator and saved\[a\]
    Saved(Binary),
    /// saved\[a\] and accumulator
    SavedFirst(Binary),
    Negate,
    Square,
    /// accumulator^index
    Whole,
    One(Unary),
    /// accumulator and a
    Two(Binary),
    /// a and accumulator
    Reversed(Binary),
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Instruction {
    code: Code,
    a: Slot,
    b: Slot,
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
    narrow: Vec<NarrowDual>,
    tiny: Vec<TinyDual>,
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
numbers!(f64: doubles, f32: singles, Dual: duals, NarrowDual: narrow, TinyDual: tiny);

impl Program {
    /// A program whose `i`-th result is the `i`-th of `trees`.
    pub(crate) fn new<'t>(trees: impl IntoIterator<Item = &'t Tree>) -> Self {
        let mut program = Self::default();
        for (index, tree) in trees.into_iter().enumerate() {
            let to = slot(NUMBERS, index);
            if let Some(from) = program.leaf(tree) {
                program.push_two(Code::Copy, from, to);
            } else {
                program.emit(tree, 0);
                program.push(Code::Store, to);
            }
        }
        program.singles = program.doubles.iter().map(|x| *x as f32).collect();
        let doubles = program.doubles.iter();
        program.duals = doubles.clone().map(|x| Dual::of(*x)).collect();
        program.narrow = doubles.clone().map(|x| NarrowDual::of(*x)).collect();
        program.tiny = doubles.map(|x| TinyDual::of(*x)).collect();
        program
    }

    fn push(&mut self, code: Code, a: Slot) {
        self.push_two(code, a, a);
    }

    fn push_two(&mut self, code: Code, a: Slot, b: Slot) {
        self.code.push(Instruction { code, a, b });
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

    /// The operands of a product or a sum of leaves.
    fn pair(&mut self, of: Binary, tree: &Tree) -> Option<(Slot, Slot)> {
        match tree {
            Tree::Two(operation, a, b) if *operation == of => Some((self.leaf(a)?, self.leaf(b)?)),
            _ => None,
        }
    }

    /// Code for a sum or a difference of which one side is a product or a sum of leaves, which
    /// needs no place to be kept. The order of a sum is free.
    fn emit_with_pair(&mut self, add: bool, a: &Tree, b: &Tree, saved: usize) -> bool {
        let (rest, code, pair) = if let Some(pair) = self.pair(Binary::Multiply, b) {
            let code = if add {
                Code::AddProduct
            } else {
                Code::SubtractProduct
            };
            (a, code, pair)
        } else if let Some(pair) = self.pair(Binary::Add, b) {
            let code = if add { Code::AddSum } else { Code::SubtractSum };
            (a, code, pair)
        } else if let Some(pair) = self.pair(Binary::Multiply, a) {
            let code = if add {
                Code::AddProduct
            } else {
                Code::SubtractFromProduct
            };
            (b, code, pair)
        } else if let (true, Some(pair)) = (add, self.pair(Binary::Add, a)) {
            (b, Code::AddSum, pair)
        } else {
            return false;
        };
        self.emit(rest, saved);
        self.push_two(code, pair.0, pair.1);
        true
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
                let sum = matches!(operation, Binary::Add | Binary::Subtract);
                let add = *operation == Binary::Add;
                if let Some((a, b)) = self.pair(Binary::Multiply, tree) {
                    self.push_two(Code::Product, a, b);
                } else if let Some((a, b)) = self.pair(Binary::Add, tree) {
                    self.push_two(Code::Sum, a, b);
                } else if let Some(b) = self.leaf(b) {
                    self.emit(a, saved);
                    self.push(forward(*operation), b);
                } else if let Some(a) = self.leaf(a) {
                    self.emit(b, saved);
                    self.push(reversed(*operation), a);
                } else if !(sum && self.emit_with_pair(add, a, b, saved)) {
                    let deeper_first = depth(a) >= depth(b);
                    let (first, second) = if deeper_first { (a, b) } else { (b, a) };
                    self.emit(first, saved);
                    let kept = slot(NUMBERS, saved);
                    self.push(Code::Save, kept);
                    self.saved = self.saved.max(saved + 1);
                    self.emit(second, saved + 1);
                    self.push(with_saved(*operation, deeper_first), kept);
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
        let zero = S::zero();
        let mut x = zero;
        for Instruction { code, a, b } in &self.code {
            macro_rules! at {
                ($slot:expr) => {
                    *match $slot.bank {
                        NUMBERS => numbers,
                        // A power of two: found without a check.
                        bank => banks[usize::from(bank.wrapping_sub(FIRST_BANK)) % N_BANKS],
                    }
                    .get(usize::from($slot.index))
                    .unwrap_or(&zero)
                };
            }
            let index = usize::from(a.index);
            macro_rules! saved {
                () => {
                    *saved.get(index).unwrap_or(&zero)
                };
            }
            match code {
                Code::Load => x = at!(a),
                Code::Copy => {
                    if let Some(to) = results.get_mut(usize::from(b.index)) {
                        *to = at!(a);
                    }
                }
                Code::Save => {
                    if let Some(to) = saved.get_mut(index) {
                        *to = x;
                    }
                }
                Code::Store => {
                    if let Some(to) = results.get_mut(index) {
                        *to = x;
                    }
                }
                Code::Add => x += at!(a),
                Code::Subtract => x -= at!(a),
                Code::SubtractFrom => x = at!(a) - x,
                Code::Multiply => x *= at!(a),
                Code::Divide => x /= at!(a),
                Code::DivideInto => x = at!(a) / x,
                Code::Product => x = at!(a) * at!(b),
                Code::AddProduct => x += at!(a) * at!(b),
                Code::SubtractProduct => x -= at!(a) * at!(b),
                Code::SubtractFromProduct => x = at!(a) * at!(b) - x,
                Code::Sum => x = at!(a) + at!(b),
                Code::AddSum => x += at!(a) + at!(b),
                Code::SubtractSum => x -= at!(a) + at!(b),
                Code::AddSaved => x += saved!(),
                Code::SubtractSaved => x -= saved!(),
                Code::SubtractFromSaved => x = saved!() - x,
                Code::MultiplySaved => x *= saved!(),
                Code::Saved(operation) => x = operation.apply(x, saved!()),
                Code::SavedFirst(operation) => x = operation.apply(saved!(), x),
                Code::Negate => x = -x,
                Code::Square => x = x * x,
                Code::Whole => x = whole_power(x, index),
                Code::One(operation) => x = operation.apply(x),
                Code::Two(operation) => x = operation.apply(x, at!(a)),
                Code::Reversed(operation) => x = operation.apply(at!(a), x),
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

/// The operation on the accumulator and a saved result, which may come `first`.
fn with_saved(operation: Binary, first: bool) -> Code {
    match (operation, first) {
        (Binary::Add, _) => Code::AddSaved,
        (Binary::Multiply, _) => Code::MultiplySaved,
        (Binary::Subtract, false) => Code::SubtractSaved,
        (Binary::Subtract, true) => Code::SubtractFromSaved,
        (other, false) => Code::Saved(other),
        (other, true) => Code::SavedFirst(other),
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
