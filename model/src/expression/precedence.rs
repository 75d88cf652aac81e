//! Which operator binds more tightly: exmex, computing with trees.

use exmex::{BinOp, Express, FlatEx, MakeOperators, Operator};

use super::operation::{Binary, Unary};
use super::tree::Tree;

/// The operators of an expression, for exmex.
#[derive(Clone, Debug)]
struct Operators;

macro_rules! binary {
    ($text:literal, $prio:literal, $operation:expr) => {
        Operator::make_bin(
            $text,
            BinOp {
                apply: $operation,
                prio: $prio,
                is_commutative: false,
            },
        )
    };
}

macro_rules! calls {
    ($($text:literal: $operation:ident),*) => {
        vec![$(Operator::make_unary($text, |x| Tree::one(Unary::$operation, x))),*]
    };
}

impl MakeOperators<Tree> for Operators {
    fn make<'a>() -> Vec<Operator<'a, Tree>> {
        let mut all = calls![
            "abs": Abs, "sign": Sign, "sqrt": Sqrt, "exp": Exp, "ln": Ln, "sin": Sin, "cos": Cos,
            "tan": Tan, "asin": Asin, "acos": Acos, "atan": Atan, "sinh": Sinh, "cosh": Cosh,
            "tanh": Tanh
        ];
        all.extend([
            binary!("+", 1, |a, b| Tree::two(Binary::Add, a, b)),
            binary!("-", 1, |a, b| Tree::two(Binary::Subtract, a, b)),
            binary!("*", 2, |a, b| Tree::two(Binary::Multiply, a, b)),
            binary!("/", 2, |a, b| Tree::two(Binary::Divide, a, b)),
            binary!("~", 3, |_, b| Tree::one(Unary::Negate, b)),
            binary!("^", 4, |a, b| Tree::two(Binary::Power, a, b)),
            binary!("^-", 4, |a, b| {
                Tree::two(Binary::Power, a, Tree::one(Unary::Negate, b))
            }),
            binary!("min", 5, |a, b| Tree::two(Binary::Min, a, b)),
            binary!("max", 5, |a, b| Tree::two(Binary::Max, a, b)),
            binary!("atan2", 5, |a, b| Tree::two(Binary::Atan2, a, b)),
        ]);
        all
    }
}

/// What exmex makes of an expression whose operands are numbered.
pub(super) fn evaluate(written: &str, operands: &[Tree]) -> Result<Tree, String> {
    let expression = FlatEx::<Tree, Operators>::parse(written).map_err(|e| e.msg().to_owned())?;
    let values: Option<Vec<Tree>> = expression
        .var_names()
        .iter()
        .map(|name| operands.get(name.parse::<usize>().ok()?).cloned())
        .collect();
    let values = values.ok_or("an operand is missing")?;
    expression.eval(&values).map_err(|e| e.msg().to_owned())
}
