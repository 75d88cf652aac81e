//! The terms that a residual force may be made of.

use std::f64::consts::TAU;

use loopsight_core::Role;

/// What a term may depend on, at a channel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Variable {
    /// A signal of the plant in a role.
    Role(Role),
    /// A signal of the plant by its own name, the same at every channel.
    Signal(&'static str),
    /// Time since the start of the run.
    Time,
}

/// A term without its coefficient.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Shape {
    One,
    Is(Variable),
    Magnitude(Variable),
    /// `x²`, `x³`.
    Power(Variable, i32),
    /// `x |x|`.
    SignedSquare(Variable),
    /// `x⁴ - s⁴`.
    Radiation(Variable, f64),
    /// `tanh(x/s)`.
    Direction(Variable, f64),
    /// `max(x, 0)` and `min(x, 0)`.
    Positive(Variable),
    Negative(Variable),
    /// Of a number of waves per revolution.
    Cosine(Variable, u32),
    Sine(Variable, u32),
    Product(Box<Shape>, Box<Shape>),
}

impl Variable {
    /// Name in an expression.
    pub(super) fn name(self) -> &'static str {
        match self {
            Variable::Role(role) => role.id(),
            Variable::Signal(id) => id,
            Variable::Time => "time",
        }
    }
}

impl Shape {
    pub(super) fn times(&self, other: &Shape) -> Shape {
        match (self, other) {
            (Shape::One, x) | (x, Shape::One) => x.clone(),
            (a, b) => Shape::Product(Box::new(a.clone()), Box::new(b.clone())),
        }
    }

    /// Its value, where `of` gives the variables'.
    pub(super) fn value(&self, of: &dyn Fn(Variable) -> f64) -> f64 {
        match self {
            Shape::One => 1.0,
            Shape::Is(x) => of(*x),
            Shape::Magnitude(x) => of(*x).abs(),
            Shape::Power(x, n) => of(*x).powi(*n),
            Shape::SignedSquare(x) => of(*x) * of(*x).abs(),
            Shape::Radiation(x, around) => of(*x).powi(4) - around.powi(4),
            Shape::Direction(x, scale) => (of(*x) / scale).tanh(),
            Shape::Positive(x) => of(*x).max(0.0),
            Shape::Negative(x) => of(*x).min(0.0),
            Shape::Cosine(x, n) => (f64::from(*n) * of(*x)).cos(),
            Shape::Sine(x, n) => (f64::from(*n) * of(*x)).sin(),
            Shape::Product(a, b) => a.value(of) * b.value(of),
        }
    }

    /// As it stands in an expression; `scale` names the number that it contains.
    pub(super) fn text(&self, scale: &mut dyn FnMut(Variable, f64) -> String) -> String {
        let wave = |function: &str, x: &Variable, n: u32| match n {
            1 => format!("{function}({})", x.name()),
            _ => format!("{function}({n} * {})", x.name()),
        };
        match self {
            Shape::One => "1".to_owned(),
            Shape::Is(x) => x.name().to_owned(),
            Shape::Magnitude(x) => format!("abs({})", x.name()),
            Shape::Power(x, n) => format!("{}^{n}", x.name()),
            Shape::SignedSquare(x) => format!("{0} * abs({0})", x.name()),
            Shape::Radiation(x, s) => format!("({}^4 - {}^4)", x.name(), scale(*x, *s)),
            Shape::Direction(x, s) => format!("tanh({} / {})", x.name(), scale(*x, *s)),
            Shape::Positive(x) => format!("max({}, 0)", x.name()),
            Shape::Negative(x) => format!("min({}, 0)", x.name()),
            Shape::Cosine(x, n) => wave("cos", x, *n),
            Shape::Sine(x, n) => wave("sin", x, *n),
            Shape::Product(a, b) => format!("{} * {}", a.text(scale), b.text(scale)),
        }
    }

    /// How many times each variable multiplies the unit.
    pub(super) fn powers(&self) -> Vec<(Variable, i32)> {
        match self {
            Shape::One | Shape::Direction(..) | Shape::Cosine(..) | Shape::Sine(..) => Vec::new(),
            Shape::Is(x) | Shape::Magnitude(x) | Shape::Positive(x) | Shape::Negative(x) => {
                vec![(*x, 1)]
            }
            Shape::Power(x, n) => vec![(*x, *n)],
            Shape::SignedSquare(x) => vec![(*x, 2)],
            Shape::Radiation(x, _) => vec![(*x, 4)],
            Shape::Product(a, b) => {
                let mut all = a.powers();
                all.extend(b.powers());
                all
            }
        }
    }

    /// What it depends on.
    pub(super) fn variables(&self) -> Vec<Variable> {
        match self {
            Shape::One => Vec::new(),
            Shape::Is(x)
            | Shape::Magnitude(x)
            | Shape::Power(x, _)
            | Shape::SignedSquare(x)
            | Shape::Radiation(x, _)
            | Shape::Direction(x, _)
            | Shape::Positive(x)
            | Shape::Negative(x)
            | Shape::Cosine(x, _)
            | Shape::Sine(x, _) => vec![*x],
            Shape::Product(a, b) => {
                let mut all = a.variables();
                all.extend(b.variables());
                all
            }
        }
    }
}

/// A quantity that a force at a place may depend on.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Quantity {
    pub(super) variable: Variable,
    pub(super) unit: String,
    /// An angle that makes turns: what depends on it repeats.
    pub(super) turns: bool,
    /// It has both signs, so each side may act in its own way.
    pub(super) both: bool,
    /// The least value of a temperature from absolute zero; none of a difference of temperatures.
    pub(super) coldest: Option<f64>,
    /// Root mean square in the recording.
    pub(super) rms: f64,
}

/// Waves per revolution that are tried.
const WAVES: u32 = 6;
/// Smoothing widths of a direction, as shares of the variable's root mean square.
const WIDTHS: [f64; 3] = [0.05, 0.2, 0.6];

/// Excursion to one side, over that to the other, up to which it is taken for noise about zero.
const LEAST_SIDE: f64 = 0.05;

/// Least of a temperature over its largest value from which it counts as measured from absolute zero: a furnace of 1500 K that
/// was begun at room temperature.
const COLDEST: f64 = 0.2;

/// Terms that are chosen together: a wave has a cosine and a sine.
pub(super) type Term = Vec<Shape>;

/// All possible terms of a force that depends on `quantities`, simple ones first.
pub(super) fn terms(quantities: &[Quantity]) -> Vec<Term> {
    let mut all: Vec<Term> = vec![vec![Shape::One]];
    let of = |role: Role| {
        let variable = Variable::Role(role);
        quantities.iter().find(|q| q.variable == variable)
    };
    let flow = of(Role::Flow);
    let positions: Vec<&Quantity> = (quantities.iter())
        .filter(|q| {
            let elsewhere = matches!(q.variable, Variable::Signal(_));
            elsewhere || q.variable == Variable::Role(Role::Position)
        })
        .collect();
    for q in quantities {
        let x = q.variable;
        let mut singles = vec![Shape::Is(x)];
        if q.both {
            singles.push(Shape::Magnitude(x));
        }
        // The sign of an angle that makes turns means nothing, and what has one sign only has no other side.
        if q.both && !q.turns {
            singles.extend(WIDTHS.map(|w| Shape::Direction(x, w * q.rms)));
            singles.extend([
                Shape::SignedSquare(x),
                Shape::Positive(x),
                Shape::Negative(x),
            ]);
            for half in [Shape::Positive(x), Shape::Negative(x)] {
                singles.push(half.times(&Shape::Is(x)));
            }
        }
        // What radiates does so with the fourth power of its temperature, and no law has another power of it.
        // Around it is what it cools down to: about the coldest that it was.
        match q.coldest {
            Some(around) => singles.push(Shape::Radiation(x, around)),
            None => singles.extend([Shape::Power(x, 2), Shape::Power(x, 3)]),
        }
        all.extend(singles.into_iter().map(|s| vec![s]));
    }
    let waves = |x: Variable, with: &Shape| -> Vec<Term> {
        (1..=WAVES)
            .map(|n| {
                [Shape::Cosine(x, n), Shape::Sine(x, n)]
                    .map(|wave| with.times(&wave))
                    .to_vec()
            })
            .collect()
    };
    let angles: Vec<Variable> = quantities
        .iter()
        .filter(|q| q.turns)
        .map(|q| q.variable)
        .collect();
    for angle in &angles {
        all.extend(waves(*angle, &Shape::One));
    }
    if let Some(flow) = flow {
        let x = flow.variable;
        let direction = (flow.both).then(|| Shape::Direction(x, WIDTHS[1] * flow.rms));
        for q in quantities.iter().filter(|q| q.variable != x) {
            let magnitude = (q.both).then_some(Shape::Magnitude(q.variable));
            for factor in std::iter::once(Shape::Is(q.variable)).chain(magnitude) {
                all.extend(direction.as_ref().map(|d| vec![d.times(&factor)]));
                all.push(vec![Shape::Is(x).times(&factor)]);
            }
        }
        for angle in &angles {
            let plain = [Shape::Is(x), Shape::Magnitude(x)];
            for factor in direction.iter().cloned().chain(plain) {
                all.extend(waves(*angle, &factor));
            }
        }
    }
    // What lies between two places.
    for (i, a) in positions.iter().enumerate() {
        for b in &positions[i + 1..] {
            all.push(vec![Shape::Is(a.variable).times(&Shape::Is(b.variable))]);
        }
    }
    if let Some(drive) = of(Role::Drive) {
        for angle in &angles {
            all.extend(waves(*angle, &Shape::Is(drive.variable)));
        }
        all.push(vec![
            Shape::Is(drive.variable).times(&Shape::Is(Variable::Time)),
        ]);
    }
    all
}

/// Whether a signal whose extremes are `low` and `high` comes to both sides of zero, and not by noise about it.
pub(super) fn both(low: f64, high: f64) -> bool {
    low < 0.0 && high > 0.0 && f64::min(-low, high) > LEAST_SIDE * f64::max(-low, high)
}

/// The least value of a signal that is a temperature and was never near zero.
pub(super) fn coldest(unit: &str, low: f64, high: f64) -> Option<f64> {
    (unit == "K" && low > COLDEST * high).then_some(low)
}

/// Whether a signal is an angle that made at least about a turn.
pub(super) fn turns(unit: &str, low: f64, high: f64) -> bool {
    unit == "rad" && high - low > 0.75 * TAU
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(quantity: Quantity) -> Vec<Shape> {
        terms(&[quantity]).into_iter().flatten().collect()
    }

    #[test]
    fn what_has_one_sign_has_no_terms_for_the_other() {
        let x = Variable::Role(Role::Position);
        let quantity = |low: f64, high: f64| Quantity {
            variable: x,
            unit: "K".to_owned(),
            turns: false,
            both: both(low, high),
            coldest: coldest("K", low, high),
            rms: high,
        };
        let temperature = of(quantity(290.0, 500.0));
        assert_eq!(
            temperature,
            [Shape::One, Shape::Is(x), Shape::Radiation(x, 290.0)]
        );
        // A difference of temperatures, with noise about zero, and one with both signs.
        let warmer = of(quantity(-0.1, 200.0));
        assert_eq!(warmer.len(), 4, "{warmer:?}");
        assert!(warmer.contains(&Shape::Power(x, 3)));
        assert!(of(quantity(-50.0, 200.0)).contains(&Shape::Positive(x)));
        let out = Shape::Radiation(x, 290.0).value(&|_| 300.0);
        assert!((out - (300f64.powi(4) - 290f64.powi(4))).abs() < 1.0);
    }
}
