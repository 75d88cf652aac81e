//! What an expression means: precedence, mistakes, derivatives.

use exmex::{Differentiate, Express, FlatEx};
use proptest::prelude::*;

use super::parse::parse;
use super::program::{FIRST_BANK, Program};
use super::tree::{Slot, Tree};
use super::{ExpressionError, Names};
use crate::{Dual, derivative, variable};
use loopsight_core::Real;

/// `x`, `y` and `z` are the elements of the first bank, `shaft.right` its fourth.
struct Letters;

const LETTERS: [&str; 4] = ["x", "y", "z", "shaft.right"];

impl Names for Letters {
    fn find(&self, name: &str) -> Option<Result<Tree, String>> {
        let index = LETTERS.iter().position(|l| *l == name)? as u16;
        let bank = FIRST_BANK;
        Some(Ok(Tree::Name(Slot { bank, index })))
    }
    fn known(&self) -> Vec<String> {
        LETTERS.map(str::to_owned).to_vec()
    }
}

fn value(text: &str, letters: [f64; 4]) -> f64 {
    let tree = parse(text, &Letters).unwrap_or_else(|e| panic!("{text}: {e}"));
    Program::new([&tree]).value(&[&letters, &[], &[], &[]])
}

#[test]
fn operators_bind_as_in_mathematics() {
    let (x, y, z, right) = (3.0f64, 0.5f64, -2.0f64, 7.0f64);
    for (text, expected) in [
        ("-x^2", -9.0),
        ("(-x)^2", 9.0),
        ("2^-x", 0.125),
        ("2 ^ - x * y", 0.0625),
        ("x - y - z", 4.5),
        ("x / y / z", -3.0),
        ("x / y * z", -12.0),
        ("x / -y * z", 12.0),
        ("x * -y^2", -0.75),
        ("x - -y", 3.5),
        ("-x * y + z", -3.5),
        ("+x", 3.0),
        ("-(x + y)", -3.5),
        ("-sin(x)^2", -(x.sin() * x.sin())),
        ("1 - 2*x^2", -17.0),
        ("x^3 + x^0.5", 27.0 + x.sqrt()),
        ("x^-1", 1.0 / 3.0),
        ("max(x, min(y, z)) - min(max(x, y), x*2)", 0.0),
        ("min(x, y)^2", 0.25),
        ("2 * max(x, y)", 6.0),
        ("atan2(y, z)", y.atan2(z)),
        ("abs(z) * sign(z)", -2.0),
        ("shaft.right / 2", right / 2.0),
        ("pi - π", 0.0),
        ("1e-3 * x + .5", 0.503),
        ("((((x))))", 3.0),
        (
            "tan(y) + asin(y) + acos(y) + atan(y)",
            y.tan() + y.asin() + y.acos() + y.atan(),
        ),
        (
            "sinh(y) - cosh(y) + tanh(y)",
            y.sinh() - y.cosh() + y.tanh(),
        ),
        ("ln(exp(z)) + sqrt(x)", z + x.sqrt()),
        ("sin x", f64::NAN),
    ] {
        if expected.is_nan() {
            assert!(parse(text, &Letters).is_err(), "{text}");
            continue;
        }
        let found = value(text, [x, y, z, right]);
        assert!(
            (found - expected).abs() < 1e-14 * expected.abs().max(1.0),
            "{text}: {found}"
        );
    }
}

fn mistake(text: &str) -> ExpressionError {
    match parse(text, &Letters) {
        Ok(tree) => panic!("{text}: {tree:?}"),
        Err(error) => error,
    }
}

#[test]
fn mistakes_are_pointed_at() {
    let known = "x, y, z, shaft.right, pi, π";
    let functions = "abs, sign, sqrt, exp, ln, sin, cos, tan, asin, acos, atan, sinh, cosh, tanh, \
                     min, max, atan2";
    for (text, at, message, help) in [
        (
            "2 * w",
            "w",
            format!("unknown name `w`, expected one of {known}"),
            None,
        ),
        (
            "x + shaft.rigt",
            "shaft.rigt",
            format!("unknown name `shaft.rigt`, expected one of {known}"),
            Some("did you mean `shaft.right`?"),
        ),
        (
            "tahn(x)",
            "tahn",
            format!("unknown function `tahn`, expected one of {functions}"),
            Some("did you mean `tanh`?"),
        ),
        (
            "x (y + 1)",
            "x",
            "`x` is no function".to_owned(),
            Some("a product is written `x * (…)`"),
        ),
        (
            "2 x",
            "x",
            "an operator is missing before `x`".to_owned(),
            None,
        ),
        (
            "x + ",
            "+",
            "the expression ends where a number or a name is expected".to_owned(),
            None,
        ),
        (
            "x * / y",
            "/",
            "a number or a name is missing before `/`".to_owned(),
            None,
        ),
        (
            "(x + y",
            "(",
            "the parenthesis that begins here is never closed".to_owned(),
            None,
        ),
        (
            "x + y)",
            ")",
            "this parenthesis was never opened".to_owned(),
            None,
        ),
        (
            "max(x)",
            ")",
            "`max` takes two arguments, found one".to_owned(),
            None,
        ),
        (
            "max(x, y, z)",
            ", z)",
            "`max` takes two arguments".to_owned(),
            None,
        ),
        (
            "sin(x, y)",
            ",",
            "`sin` takes one argument".to_owned(),
            None,
        ),
        (
            "sin + 1",
            "sin",
            "the function `sin` needs its argument in parentheses".to_owned(),
            None,
        ),
        (
            "()",
            ")",
            "a number or a name is missing before `)`".to_owned(),
            None,
        ),
        (
            "x^y^z",
            "^z",
            "a power of a power".to_owned(),
            Some("say with parentheses which is meant: `(a^b)^c` or `a^(b^c)`"),
        ),
        (
            "x**2",
            "**",
            "`**` is no operator".to_owned(),
            Some("a power is written `x^2`"),
        ),
        (
            "x % 2",
            "%",
            "`%` has no meaning in an expression".to_owned(),
            None,
        ),
        (
            "1.2.3 + x",
            ".3",
            "an operator is missing before `.3`".to_owned(),
            None,
        ),
        ("", "", "there is no expression".to_owned(), None),
        (
            "x - --y",
            "-y",
            "a second sign".to_owned(),
            Some("one of them is enough, or parentheses around the inner one"),
        ),
        (
            "x + 1/0",
            "x + 1/0",
            "a part of this without names is not a finite number".to_owned(),
            None,
        ),
    ] {
        let found = mistake(text);
        assert_eq!(found.message, message, "{text}");
        assert_eq!(found.help.as_deref(), help, "{text}");
        let place = &text[found.place.clone()];
        assert!(
            at.starts_with(place),
            "{text}: at `{place}`, expected `{at}`"
        );
        if !at.is_empty() {
            assert_eq!(found.place.start, text.rfind(at).unwrap_or(0), "{text}");
        }
    }
    assert!(mistake(&"(".repeat(100)).message.contains("40 parentheses"));
    assert!(mistake(&"x+".repeat(2000)).message.contains("1000 words"));
}

/// Texts that exmex and this module read alike.
fn text() -> impl Strategy<Value = String> {
    let leaf = prop_oneof![
        Just("x".to_owned()),
        Just("y".to_owned()),
        Just("z".to_owned()),
        (1u32..90).prop_map(|n| format!("{:.1}", f64::from(n) / 10.0)),
    ];
    leaf.prop_recursive(5, 40, 2, |inner| {
        prop_oneof![
            (inner.clone(), inner.clone()).prop_map(|(a, b)| format!("({a} + {b})")),
            (inner.clone(), inner.clone()).prop_map(|(a, b)| format!("({a} - {b})")),
            (inner.clone(), inner.clone()).prop_map(|(a, b)| format!("{a} * {b}")),
            (inner.clone(), inner.clone()).prop_map(|(a, b)| format!("({a} / (1.5 + ({b})^2))")),
            inner.clone().prop_map(|a| format!("({a})^3")),
            inner.clone().prop_map(|a| format!("(1.0 + ({a})^2)^0.5")),
            inner.clone().prop_map(|a| format!("sqrt(2.0 + sin({a}))")),
            inner.clone().prop_map(|a| format!("ln(1.0 + ({a})^2)")),
            inner.clone().prop_map(|a| format!("exp(sin({a}))")),
            inner.clone().prop_map(|a| format!("tanh({a})")),
            inner.clone().prop_map(|a| format!("cos({a})")),
            inner.clone().prop_map(|a| format!("atan({a})")),
            inner.prop_map(|a| format!("(-({a}))")),
        ]
    })
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, cases: 400, rng_seed: proptest::test_runner::RngSeed::Fixed(4), ..ProptestConfig::default() })]

    /// Value and derivatives by dual numbers are exmex's value and its symbolic derivatives, and
    /// those are the differences.
    #[test]
    fn derivatives_are_those_of_exmex(
        text in text(),
        at in proptest::array::uniform3(-1.5..1.5f64),
    ) {
        let tree = parse(&text, &Letters).unwrap_or_else(|e| panic!("{text}: {e}"));
        let program = Program::new([&tree]);
        let exact = program.value(&[&[0, 1, 2].map(|i| variable(at[i], i)), &[], &[], &[]]);
        let plain: f64 = program.value(&[&at, &[], &[], &[]]);
        // A dual number divides by multiplying with the inverse.
        prop_assert!((plain - exact.value()).abs() < 1e-12 * (1.0 + plain.abs()));

        let oracle = FlatEx::<f64>::parse(&text).unwrap_or_else(|e| panic!("{text}: {e}"));
        let places: Vec<usize> = oracle
            .var_names()
            .iter()
            .filter_map(|n| LETTERS.iter().position(|l| l == n))
            .collect();
        let values: Vec<f64> = places.iter().map(|i| at[*i]).collect();
        let size = 1.0 + plain.abs();
        let found = oracle.eval(&values).unwrap_or(f64::NAN);
        prop_assert!((found - plain).abs() < 1e-9 * size, "{}: {} and {}", text, plain, found);
        for (k, letter) in places.iter().enumerate() {
            let slope = derivative(&exact, *letter);
            let partial = oracle.clone().partial(k).and_then(|d| d.eval(&values));
            if let Ok(partial) = partial && partial.is_finite() {
                let band = 1e-9 * (1.0 + slope.abs().max(partial.abs()));
                prop_assert!((slope - partial).abs() < band, "{}: {} and {}", text, slope, partial);
            }
            let h = 1e-6;
            let moved = |by: f64| {
                let mut at = at;
                at[*letter] += by;
                program.value::<f64>(&[&at, &[], &[], &[]])
            };
            let numeric = (moved(h) - moved(-h)) / (2.0 * h);
            let curve = (moved(h) - 2.0 * plain + moved(-h)).abs() / h;
            let band = 1e-5 * (1.0 + slope.abs()) + 1e-9 * size / h + curve;
            prop_assert!((slope - numeric).abs() < band, "{}: {} and {}", text, slope, numeric);
        }
    }

    /// Whatever is written, there is an answer.
    #[test]
    fn no_text_breaks_it(text in "[xyz0-9 .+*/^(),{}e~a-h\\-π]{0,40}") {
        if let Ok(tree) = parse(&text, &Letters) {
            let _ = Program::new([&tree]).value::<Dual>(&[&[Dual::of(0.0); 4], &[], &[], &[]]);
        }
    }
}

#[test]
fn single_precision_and_missing_values_do_no_harm() {
    let tree = parse("x / y + 0.1", &Letters).unwrap_or_else(|e| panic!("{e}"));
    let program = Program::new([&tree]);
    assert_eq!(program.value(&[&[1.0f32, 4.0], &[], &[], &[]]), 0.35);
    assert!(program.value::<f64>(&[&[1.0], &[], &[], &[]]).is_infinite());
    assert!(program.value::<f64>(&[&[], &[], &[], &[]]).is_nan());
}

#[test]
fn deep_trees_find_room() {
    // A full binary tree of products of sums: as much room as any tree of its size needs.
    fn full(depth: usize) -> String {
        if depth == 0 {
            return "sin(x)".to_owned();
        }
        let inner = full(depth - 1);
        let operator = if depth.is_multiple_of(2) { '+' } else { '*' };
        format!("({inner} {operator} {inner})")
    }
    let text = full(6);
    let x = 0.9f64;
    let mut expected = Real::sin(x);
    for depth in 1..=6 {
        expected = if depth % 2 == 0 {
            expected + expected
        } else {
            expected * expected
        };
    }
    let found = value(&text, [x, 0.0, 0.0, 0.0]);
    assert!((found - expected).abs() < 1e-12 * expected);
}
