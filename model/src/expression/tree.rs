//! The syntax tree of an expression.

use std::collections::BTreeSet;

use super::operation::{Binary, Unary};

/// Where the value of a name is found: which slice, which element.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Slot {
    /// Index of the slice among those a program is run with.
    pub(crate) bank: u8,
    /// Index in that slice.
    pub(crate) index: u16,
}

/// An expression: numbers, names, operations.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Tree {
    Number(f64),
    Name(Slot),
    One(Unary, Box<Tree>),
    Two(Binary, Box<Tree>, Box<Tree>),
}

/// How an expression depends on some of its names.
#[derive(Clone, Debug, Default)]
pub(crate) struct Dependence {
    /// It is a sum of terms with one of these to the first power.
    pub(crate) linear: BTreeSet<Slot>,
    /// These enter in another way.
    pub(crate) nonlinear: BTreeSet<Slot>,
}

impl Tree {
    /// The operation on this; done at once where the number is known.
    pub(crate) fn one(operation: Unary, x: Tree) -> Tree {
        match x {
            Tree::Number(x) => Tree::Number(operation.apply(x)),
            x => Tree::One(operation, Box::new(x)),
        }
    }

    /// The operation on these; done at once where both numbers are known.
    pub(crate) fn two(operation: Binary, a: Tree, b: Tree) -> Tree {
        match (operation, a, b) {
            (_, Tree::Number(a), Tree::Number(b)) => Tree::Number(operation.apply(a, b)),
            (Binary::Power, a, Tree::Number(2.0)) => Tree::one(Unary::Square, a),
            (Binary::Power, a, Tree::Number(1.0)) => a,
            (_, a, b) => Tree::Two(operation, Box::new(a), Box::new(b)),
        }
    }

    /// Number of operations, numbers and names.
    pub(crate) fn size(&self) -> usize {
        match self {
            Tree::Number(_) | Tree::Name(_) => 1,
            Tree::One(_, x) => 1 + x.size(),
            Tree::Two(_, a, b) => 1 + a.size() + b.size(),
        }
    }

    /// Calls `each` with every name.
    pub(crate) fn for_each_name(&self, each: &mut dyn FnMut(Slot)) {
        match self {
            Tree::Number(_) => {}
            Tree::Name(slot) => each(*slot),
            Tree::One(_, x) => x.for_each_name(each),
            Tree::Two(_, a, b) => {
                a.for_each_name(each);
                b.for_each_name(each);
            }
        }
    }

    /// The expression with some names replaced by expressions.
    pub(crate) fn replace(&self, with: &dyn Fn(Slot) -> Option<Tree>) -> Tree {
        match self {
            Tree::Number(x) => Tree::Number(*x),
            Tree::Name(slot) => with(*slot).unwrap_or(Tree::Name(*slot)),
            Tree::One(operation, x) => Tree::one(*operation, x.replace(with)),
            Tree::Two(operation, a, b) => Tree::two(*operation, a.replace(with), b.replace(with)),
        }
    }

    /// A number in it that is not finite, like `1/0`.
    pub(crate) fn has_bad_number(&self) -> bool {
        match self {
            Tree::Number(x) => !x.is_finite(),
            Tree::Name(_) => false,
            Tree::One(_, x) => x.has_bad_number(),
            Tree::Two(_, a, b) => a.has_bad_number() || b.has_bad_number(),
        }
    }

    /// How the expression depends on the names `of`. A factor that depends on others in a
    /// non-linear way takes nothing from linearity: `c tanh(v/s)` is linear in `c`.
    pub(crate) fn dependence(&self, of: &dyn Fn(Slot) -> bool) -> Dependence {
        let mut found = self.depends(of);
        let both = &found.linear & &found.nonlinear;
        found.linear = &found.linear - &both;
        found
    }

    fn depends(&self, of: &dyn Fn(Slot) -> bool) -> Dependence {
        match self {
            Tree::Number(_) => Dependence::default(),
            Tree::Name(slot) => Dependence {
                linear: of(*slot).then_some(*slot).into_iter().collect(),
                nonlinear: BTreeSet::new(),
            },
            Tree::One(Unary::Negate, x) => x.depends(of),
            Tree::One(_, x) => x.depends(of).bent(),
            Tree::Two(operation, a, b) => {
                let (a, b) = (a.depends(of), b.depends(of));
                let (a, b) = match operation {
                    Binary::Add | Binary::Subtract => (a, b),
                    Binary::Multiply if a.linear.is_empty() || b.linear.is_empty() => (a, b),
                    Binary::Divide => (a, b.bent()),
                    _ => (a.bent(), b.bent()),
                };
                Dependence {
                    linear: &a.linear | &b.linear,
                    nonlinear: &a.nonlinear | &b.nonlinear,
                }
            }
        }
    }
}

impl Dependence {
    fn bent(self) -> Self {
        Self {
            nonlinear: &self.linear | &self.nonlinear,
            linear: BTreeSet::new(),
        }
    }
}

/// The number zero.
impl Default for Tree {
    fn default() -> Self {
        Tree::Number(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn name(index: u16) -> Tree {
        Tree::Name(Slot { bank: 2, index })
    }

    fn linear_in(tree: &Tree) -> Vec<u16> {
        let found = tree.dependence(&|_| true);
        found.linear.iter().map(|s| s.index).collect()
    }

    #[test]
    fn linear_is_what_regressions_take_for_linear() {
        let smooth = Tree::one(Unary::Tanh, Tree::two(Binary::Divide, name(7), name(1)));
        assert_eq!(
            linear_in(&Tree::two(Binary::Multiply, name(0), smooth)),
            [0]
        );
        assert!(linear_in(&Tree::two(Binary::Multiply, name(0), name(1))).is_empty());
        assert!(linear_in(&Tree::two(Binary::Power, name(0), Tree::Number(2.0))).is_empty());
        let both = Tree::two(Binary::Add, name(0), Tree::one(Unary::Exp, name(0)));
        assert!(linear_in(&both).is_empty());
        let sum = Tree::two(Binary::Subtract, name(0), name(1));
        assert_eq!(linear_in(&Tree::one(Unary::Negate, sum)), [0, 1]);
    }
}
