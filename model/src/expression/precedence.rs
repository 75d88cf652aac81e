//! Which operator binds more tightly: two stacks, as E. W. Dijkstra's shunting yard has them
//! (Algol-60 translation, Mathematisch Centrum MR 34/61, 1961).
//!
//! Sums bind loosest, then products, then a sign, then a power: `-x^2` is `-(x^2)`. Operators of one
//! strength go from left to right. The words come checked: an operand where one belongs, an
//! operator where one belongs.

use super::operation::{Binary, Function, Unary};
use super::tree::Tree;

/// An operator that waits for its last operand.
#[derive(Clone, Copy)]
enum Waiting {
    /// A minus in front of its operand.
    Sign,
    Operator(Binary),
    /// An open parenthesis, and the function it belongs to.
    Open(Option<Function>),
}

impl Waiting {
    /// How tightly it binds; nothing passes an open parenthesis.
    fn strength(self) -> u8 {
        match self {
            Waiting::Open(_) => 0,
            Waiting::Operator(Binary::Add | Binary::Subtract) => 1,
            Waiting::Operator(Binary::Multiply | Binary::Divide) => 2,
            Waiting::Sign => 3,
            Waiting::Operator(_) => 4,
        }
    }
}

/// An expression that is read from left to right.
#[derive(Default)]
pub(super) struct Stacks {
    operands: Vec<Tree>,
    waiting: Vec<Waiting>,
}

impl Stacks {
    /// A number or a name.
    pub(super) fn operand(&mut self, tree: Tree) {
        self.operands.push(tree);
    }

    /// A minus in front of an operand.
    pub(super) fn sign(&mut self) {
        self.waiting.push(Waiting::Sign);
    }

    /// An operator between two operands.
    pub(super) fn operator(&mut self, operator: Binary) {
        let waiting = Waiting::Operator(operator);
        self.settle(waiting.strength());
        self.waiting.push(waiting);
    }

    /// An opening parenthesis, of a function or of none.
    pub(super) fn open(&mut self, function: Option<Function>) {
        self.waiting.push(Waiting::Open(function));
    }

    /// The comma between the arguments of a function: the first one is complete.
    pub(super) fn comma(&mut self) {
        self.settle(1);
    }

    /// A closing parenthesis.
    pub(super) fn close(&mut self) {
        self.settle(1);
        if let Some(Waiting::Open(function)) = self.waiting.pop() {
            match function {
                None => {}
                Some(Function::One(operation)) => self.one(operation),
                Some(Function::Two(operation)) => self.two(operation),
            }
        }
    }

    /// The expression, when all of it was read.
    pub(super) fn finish(mut self) -> Option<Tree> {
        self.settle(1);
        self.operands.pop()
    }

    /// Completes what waits and binds at least as tightly.
    fn settle(&mut self, strength: u8) {
        while let Some(last) = self.waiting.pop_if(|last| last.strength() >= strength) {
            match last {
                Waiting::Sign => self.one(Unary::Negate),
                Waiting::Operator(operation) => self.two(operation),
                Waiting::Open(_) => {}
            }
        }
    }

    fn one(&mut self, operation: Unary) {
        if let Some(x) = self.operands.pop() {
            self.operands.push(Tree::one(operation, x));
        }
    }

    fn two(&mut self, operation: Binary) {
        if let (Some(b), Some(a)) = (self.operands.pop(), self.operands.pop()) {
            self.operands.push(Tree::two(operation, a, b));
        }
    }
}
