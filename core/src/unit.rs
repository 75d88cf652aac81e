//! Units of measurement: what a text such as `m/s`, `V s/m` or `rad_per_s2` means in SI.
//!
//! A [`Unit`] is a factor and a [`Dimension`]: *SI value = factor × value*. The radian keeps an
//! exponent of its own, so that `rad/s` and `1/s` differ: a column in hertz is not taken for an
//! angular velocity. Turns (`rev`, `rot`, `deg`, and those of `rpm`, `rps`, `dps`) are angles. A `count` is a plain number, since
//! the angle of one count depends on the encoder.
//!
//! ## Grammar
//!
//! * symbols `m g s A V N Nm J W Hz Ohm Ω H F C Pa K rad`, each with the prefixes
//!   `p n u µ m c k M G`; and without prefix `min h deg ° rev rot rotation(s) rpm rps dps mps kph kmh mph count(s)
//!   percent % in ft 1`; names as WPILib SysId spells them (`Meters`, `Feet`, `Inches`,
//!   `Radians`, `Degrees`, `Rotations`), in any case;
//! * products by a space, `*`, `·`, `.` or `_`; `/` divides by the *one* factor that follows
//!   (`V/m s` is V·s/m; write `V/(m s)` for the other);
//! * powers `^2`, `^-1`, `²`, `⁻¹`, or digits right behind the symbol: `s2`, `s-1`; up to 9;
//! * column spelling: `m_per_s`, `V_s_per_m`; *everything* behind `per` divides.
//!
//! ```
//! use loopsight_core::unit::{conversion, parse, split_name};
//!
//! let (name, unit) = split_name("motor_speed_rpm");
//! assert_eq!((name, unit), ("motor_speed", Some("rpm")));
//! let factor = conversion(&parse("rpm").unwrap(), &parse("rad/s").unwrap()).unwrap();
//! assert!((60.0 * factor - 2.0 * std::f64::consts::PI).abs() < 1e-12);
//! assert!(conversion(&parse("Hz").unwrap(), &parse("rad/s").unwrap()).is_none());
//! ```

use core::fmt;

mod parser;
mod symbols;

use parser::Parser;

/// Exponents of the SI base units, with the radian as one of them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Dimension {
    /// Length.
    pub metre: i8,
    /// Mass.
    pub kilogram: i8,
    /// Time.
    pub second: i8,
    /// Current.
    pub ampere: i8,
    /// Temperature.
    pub kelvin: i8,
    /// Plane angle.
    pub radian: i8,
}

impl Dimension {
    /// True for plain numbers.
    pub fn is_one(&self) -> bool {
        *self == Self::default()
    }

    const fn new(exponents: [i8; 6]) -> Self {
        let [metre, kilogram, second, ampere, kelvin, radian] = exponents;
        Self {
            metre,
            kilogram,
            second,
            ampere,
            kelvin,
            radian,
        }
    }

    fn exponents(&self) -> [i8; 6] {
        [
            self.metre,
            self.kilogram,
            self.second,
            self.ampere,
            self.kelvin,
            self.radian,
        ]
    }
}

impl fmt::Display for Dimension {
    /// In base units, e.g. `m s^-1`; `1` for plain numbers.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut separator = "";
        for (symbol, exponent) in ["m", "kg", "s", "A", "K", "rad"]
            .iter()
            .zip(self.exponents())
        {
            match exponent {
                0 => continue,
                1 => write!(f, "{separator}{symbol}")?,
                _ => write!(f, "{separator}{symbol}^{exponent}")?,
            }
            separator = " ";
        }
        if separator.is_empty() {
            f.write_str("1")
        } else {
            Ok(())
        }
    }
}

/// A unit: SI value = `factor` × value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unit {
    /// What one of this unit is in SI.
    pub factor: f64,
    /// What it measures.
    pub dimension: Dimension,
}

impl Unit {
    /// The plain number.
    pub const ONE: Self = Self {
        factor: 1.0,
        dimension: Dimension::new([0; 6]),
    };

    /// `self · other^power`; nothing when it leaves the range of exponents or numbers.
    pub fn times(self, other: Self, power: i8) -> Option<Self> {
        let mut factor = 1.0;
        for _ in 0..power.unsigned_abs() {
            factor *= other.factor;
        }
        let factor = if power < 0 {
            self.factor / factor
        } else {
            self.factor * factor
        };
        let mut exponents = self.dimension.exponents();
        for (mine, theirs) in exponents.iter_mut().zip(other.dimension.exponents()) {
            *mine = mine.checked_add(theirs.checked_mul(power)?)?;
        }
        factor.is_normal().then_some(Self {
            factor,
            dimension: Dimension::new(exponents),
        })
    }
}

/// What is wrong with a text that should be a unit, and where.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct UnitError {
    /// Byte at which the offending piece begins.
    pub position: usize,
    /// Its length in bytes; 0 at the end of the text.
    pub length: usize,
    /// What is wrong with it.
    pub problem: Problem,
}

/// Kinds of mistakes in a unit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Problem {
    /// There is no unit at all.
    Empty,
    /// No unit has this symbol.
    UnknownSymbol,
    /// A unit must stand here, before or behind an operator.
    MissingUnit,
    /// A parenthesis has no partner, or they nest too deep.
    Parenthesis,
    /// A power must be a whole number from -9 to 9, not 0.
    Power,
    /// The exponents or the factor leave the range of numbers.
    TooLarge,
}

impl UnitError {
    /// The offending piece of `text`, the text that was parsed.
    pub fn piece<'t>(&self, text: &'t str) -> &'t str {
        text.get(self.position..self.position.saturating_add(self.length))
            .unwrap_or("")
    }
}

impl fmt::Display for UnitError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let what = match self.problem {
            Problem::Empty => "there is no unit",
            Problem::UnknownSymbol => "no unit has this symbol",
            Problem::MissingUnit => "a unit is missing",
            Problem::Parenthesis => "a parenthesis has no partner",
            Problem::Power => "a power must be a whole number from -9 to 9, not 0",
            Problem::TooLarge => "the powers are too large",
        };
        write!(f, "character {}: {what}", self.position + 1)
    }
}

impl core::error::Error for UnitError {}

/// Reads a unit; the grammar is in the [module's documentation](self).
///
/// ```
/// use loopsight_core::unit::parse;
/// let unit = parse("km/h").unwrap();
/// assert!((unit.factor - 1.0 / 3.6).abs() < 1e-15);
/// assert_eq!(unit.dimension.to_string(), "m s^-1");
/// assert_eq!(parse("rad_per_s2"), parse("rad/s²"));
/// assert_eq!(parse("V s/furlong").unwrap_err().piece("V s/furlong"), "furlong");
/// ```
///
/// # Errors
///
/// [`UnitError`] names the place and the problem.
pub fn parse(text: &str) -> Result<Unit, UnitError> {
    if text.trim().is_empty() {
        return Err(UnitError {
            position: 0,
            length: text.len(),
            problem: Problem::Empty,
        });
    }
    let mut parser = Parser::new(text);
    let unit = parser.product(0)?;
    match parser.peek() {
        None => Ok(unit),
        Some(_) => Err(parser.here(Problem::Parenthesis)),
    }
}

/// Splits a column's name from the unit at its end: the *longest* ending behind an underscore
/// that [`parse`]s and has a letter in it.
///
/// ```
/// use loopsight_core::unit::split_name;
/// assert_eq!(split_name("linear_velocity_m_per_s"), ("linear_velocity", Some("m_per_s")));
/// assert_eq!(split_name("t_s"), ("t", Some("s")));
/// assert_eq!(split_name("speed"), ("speed", None));
/// assert_eq!(split_name("wheel_1"), ("wheel_1", None));
/// ```
///
/// The rule cannot know what was meant: `x_h` is x in hours and `K_A` is K in amperes. `in` is an
/// inch at the very end or before `per` only (`force_in_N` is `force_in` in newtons), and `l` and `L` are litres before `per` or
/// `min` only (`wheel_l` is the left one). Whoever
/// looks for a known name should try the whole column first, and then the name, an underscore
/// and a unit.
pub fn split_name(column: &str) -> (&str, Option<&str>) {
    for (at, _) in column.match_indices('_') {
        let (name, unit) = (&column[..at], &column[at + 1..]);
        if !name.is_empty() && is_ending(unit) {
            return (name, Some(unit));
        }
    }
    (column, None)
}

fn is_ending(text: &str) -> bool {
    let mut tokens = text.split('_').peekable();
    while let Some(token) = tokens.next() {
        let next = tokens.peek();
        let is_word = match token {
            "in" => next.is_some_and(|next| *next != "per"),
            "l" | "L" => next.is_none_or(|next| !["per", "min"].contains(next)),
            _ => false,
        };
        if is_word {
            return false;
        }
    }
    text.chars().any(|c| c.is_alphabetic() || c == '%') && parse(text).is_ok()
}

/// Factor that turns a value in `from` into one in `to`; none when they measure different things.
pub fn conversion(from: &Unit, to: &Unit) -> Option<f64> {
    (from.dimension == to.dimension).then(|| from.factor / to.factor)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;
    use std::string::ToString;

    use proptest::prelude::*;

    use super::*;

    fn is(text: &str, factor: f64, base: &str) {
        let unit = parse(text).unwrap_or_else(|e| panic!("{text}: {e}"));
        assert!(
            (unit.factor - factor).abs() <= 1e-12 * factor,
            "{text}: {}",
            unit.factor
        );
        assert_eq!(unit.dimension.to_string(), base, "{text}");
    }

    #[test]
    fn symbols_prefixes_and_names() {
        is("m", 1.0, "m");
        is("mm", 1e-3, "m");
        is("min", 60.0, "s");
        is("kg", 1.0, "kg");
        is("µs", 1e-6, "s");
        is("mV", 1e-3, "m^2 kg s^-3 A^-1");
        is("mNm", 1e-3, "m^2 kg s^-2");
        is("kΩ", 1e3, "m^2 kg s^-3 A^-2");
        is("mrad", 1e-3, "rad");
        is("deg", PI / 180.0, "rad");
        is("rpm", PI / 30.0, "s^-1 rad");
        is("mbar", 100.0, "m^-1 kg s^-2");
        is("psi", 6_894.757_293_168_361, "m^-1 kg s^-2");
        is("L/min", 1e-3 / 60.0, "m^3 s^-1");
        is("lpm", 1e-3 / 60.0, "m^3 s^-1");
        is("kWh", 3.6e6, "m^2 kg s^-2");
        is("mAh", 3.6, "s A");
        is("dps", PI / 180.0, "s^-1 rad");
        is("rps", 2.0 * PI, "s^-1 rad");
        is("kph", 1.0 / 3.6, "m s^-1");
        is("mps", 1.0, "m s^-1");
        is("mph", 0.44704, "m s^-1");
        is("counts", 1.0, "1");
        is("%", 0.01, "1");
        is("1", 1.0, "1");
        is("Feet", 0.3048, "m");
        is("Inches", 0.0254, "m");
        is("Rotations", 2.0 * PI, "rad");
        assert_eq!(parse("kg").unwrap().factor, 1.0);
    }

    #[test]
    fn products_quotients_and_powers() {
        for text in [
            "V s/m",
            "V*s/m",
            "V·s/m",
            "V.s.m-1",
            "V_s_per_m",
            "V s m^-1",
            "V/m s",
        ] {
            is(text, 1.0, "m kg s^-2 A^-1");
        }
        for text in [
            "rad/s^2",
            "rad/s²",
            "rad/s2",
            "rad_per_s2",
            "rad s⁻²",
            "rad/(s s)",
        ] {
            is(text, 1.0, "s^-2 rad");
        }
        is("N/(m/s)", 1.0, "kg s^-1");
        is("1/s", 1.0, "s^-1");
        is("1_per_s", 1.0, "s^-1");
        is("per_s", 1.0, "s^-1");
        is("N_per_m_s", 1.0, "kg s^-3");
        is("km/h", 1.0 / 3.6, "m s^-1");
    }

    #[test]
    fn errors_name_the_piece() {
        for (text, piece, problem) in [
            ("", "", Problem::Empty),
            ("m/", "", Problem::MissingUnit),
            ("/s", "/", Problem::MissingUnit),
            ("m//s", "/", Problem::MissingUnit),
            ("m/bogus", "bogus", Problem::UnknownSymbol),
            ("12", "12", Problem::UnknownSymbol),
            ("m^0", "^0", Problem::Power),
            ("m^", "^", Problem::Power),
            ("m^12", "^12", Problem::Power),
            ("(m s", "(m s", Problem::Parenthesis),
            ("m)", ")", Problem::Parenthesis),
            ("m$", "$", Problem::UnknownSymbol),
        ] {
            let error = parse(text).unwrap_err();
            assert_eq!(
                (error.piece(text), error.problem),
                (piece, problem),
                "{text}"
            );
        }
        let deep = "(".repeat(100_000);
        assert_eq!(parse(&deep).unwrap_err().problem, Problem::Parenthesis);
        let large = "m^9 ".repeat(20);
        assert_eq!(parse(&large).unwrap_err().problem, Problem::TooLarge);
    }

    #[test]
    fn columns_split_at_their_unit() {
        for (column, name, unit) in [
            (
                "linear_velocity_m_per_s",
                "linear_velocity",
                Some("m_per_s"),
            ),
            (
                "angular_acceleration_rad_per_s2",
                "angular_acceleration",
                Some("rad_per_s2"),
            ),
            ("voltage_right_V", "voltage_right", Some("V")),
            ("wheel_counts_per_s", "wheel", Some("counts_per_s")),
            ("duty_percent", "duty", Some("percent")),
            ("gain_V_s_per_m", "gain", Some("V_s_per_m")),
            ("t_s", "t", Some("s")),
            ("x_h", "x", Some("h")),
            ("K_A", "K", Some("A")),
            ("force_in_N", "force_in", Some("N")),
            ("length_in", "length", Some("in")),
            ("oil_mbar", "oil", Some("mbar")),
            ("flow_L_min", "flow", Some("L_min")),
            ("wheel_l", "wheel_l", None),
            ("way_l_m", "way_l", Some("m")),
            ("speed", "speed", None),
            ("wheel_1", "wheel_1", None),
            ("u1", "u1", None),
            ("_s", "_s", None),
            ("speed_", "speed_", None),
            ("", "", None),
        ] {
            assert_eq!(split_name(column), (name, unit), "{column}");
        }
    }

    #[test]
    fn conversion_wants_one_dimension() {
        let factor = |a, b| conversion(&parse(a).unwrap(), &parse(b).unwrap());
        assert_eq!(factor("mm", "m"), Some(1e-3));
        assert_eq!(factor("m/s", "rad/s"), None);
        assert_eq!(factor("Hz", "rad/s"), None);
        assert_eq!(factor("count", "rad"), None);
        assert_eq!(factor("V", "kg m^2 s^-3 A^-1"), Some(1.0));
    }

    proptest! {
        #[test]
        fn never_panics(text in any::<String>(), near in "[mskgVANrd_/*^.()²1-9 per-]{0,40}") {
            for text in [&text, &near] {
                if let Err(error) = parse(text) {
                    let _ = (error.piece(text), error.to_string());
                }
                let (name, unit) = split_name(text);
                prop_assert_eq!(
                    unit.map_or(name.len(), |unit| name.len() + 1 + unit.len()),
                    text.len()
                );
            }
        }
    }
}
