//! What expressions are made of: operators and functions.

use loopsight_core::Real;

/// An operation on one number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Unary {
    Negate,
    Square,
    Abs,
    Sign,
    Sqrt,
    Exp,
    Ln,
    Sin,
    Cos,
    Tan,
    Asin,
    Acos,
    Atan,
    Sinh,
    Cosh,
    Tanh,
}

/// An operation on two numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Binary {
    Add,
    Subtract,
    Multiply,
    Divide,
    Power,
    Min,
    Max,
    Atan2,
}

/// A function by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Function {
    One(Unary),
    Two(Binary),
}

/// The functions an expression may call.
pub(crate) const FUNCTIONS: [(&str, Function); 17] = [
    ("abs", Function::One(Unary::Abs)),
    ("sign", Function::One(Unary::Sign)),
    ("sqrt", Function::One(Unary::Sqrt)),
    ("exp", Function::One(Unary::Exp)),
    ("ln", Function::One(Unary::Ln)),
    ("sin", Function::One(Unary::Sin)),
    ("cos", Function::One(Unary::Cos)),
    ("tan", Function::One(Unary::Tan)),
    ("asin", Function::One(Unary::Asin)),
    ("acos", Function::One(Unary::Acos)),
    ("atan", Function::One(Unary::Atan)),
    ("sinh", Function::One(Unary::Sinh)),
    ("cosh", Function::One(Unary::Cosh)),
    ("tanh", Function::One(Unary::Tanh)),
    ("min", Function::Two(Binary::Min)),
    ("max", Function::Two(Binary::Max)),
    ("atan2", Function::Two(Binary::Atan2)),
];

/// The constants an expression may name.
pub(crate) const CONSTANTS: [(&str, f64); 2] =
    [("pi", core::f64::consts::PI), ("π", core::f64::consts::PI)];

/// The function of this name.
pub(crate) fn function(name: &str) -> Option<Function> {
    FUNCTIONS.iter().find(|(n, _)| *n == name).map(|(_, f)| *f)
}

/// The constant of this name.
pub(crate) fn constant(name: &str) -> Option<f64> {
    CONSTANTS.iter().find(|(n, _)| *n == name).map(|(_, c)| *c)
}

impl Unary {
    /// The operation itself.
    #[inline(always)]
    pub(crate) fn apply<S: Real>(self, x: S) -> S {
        let (zero, one) = (S::zero(), S::one());
        match self {
            Unary::Negate => -x,
            Unary::Square => x * x,
            Unary::Abs => x.abs(),
            Unary::Sign if x > zero => one,
            Unary::Sign if x < zero => -one,
            // Zero, or what is no number.
            Unary::Sign => x * zero,
            Unary::Sqrt => x.sqrt(),
            Unary::Exp => x.exp(),
            Unary::Ln => x.ln(),
            Unary::Sin => x.sin(),
            Unary::Cos => x.cos(),
            Unary::Tan => x.sin() / x.cos(),
            Unary::Asin => x.atan2((one - x * x).sqrt()),
            Unary::Acos => (one - x * x).sqrt().atan2(x),
            Unary::Atan => x.atan2(one),
            Unary::Sinh => S::of(0.5) * (x.exp() - (-x).exp()),
            Unary::Cosh => S::of(0.5) * (x.exp() + (-x).exp()),
            Unary::Tanh => x.tanh(),
        }
    }
}

impl Binary {
    /// The operation itself.
    #[inline(always)]
    pub(crate) fn apply<S: Real>(self, a: S, b: S) -> S {
        match self {
            Binary::Add => a + b,
            Binary::Subtract => a - b,
            Binary::Multiply => a * b,
            Binary::Divide => a / b,
            Binary::Power => a.powf(b),
            Binary::Min => a.min(b),
            Binary::Max => a.max(b),
            Binary::Atan2 => a.atan2(b),
        }
    }
}
