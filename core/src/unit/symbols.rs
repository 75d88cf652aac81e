//! The words that are units.

use core::f64::consts::TAU;

use super::{Dimension, Unit};

const fn unit(factor: f64, exponents: [i8; 6]) -> Unit {
    Unit {
        factor,
        dimension: Dimension::new(exponents),
    }
}

/// A pound, falling freely, on a square inch: 0.453 592 37 kg at 9.806 65 m/s² on 0.0254² m².
const PSI: f64 = 0.453_592_37 * 9.806_65 / (0.0254 * 0.0254);

/// Symbols that take prefixes; exponents of m, kg, s, A, K, rad.
const PREFIXABLE: [(&str, Unit); 20] = [
    ("m", unit(1.0, [1, 0, 0, 0, 0, 0])),
    ("g", unit(1e-3, [0, 1, 0, 0, 0, 0])),
    ("s", unit(1.0, [0, 0, 1, 0, 0, 0])),
    ("A", unit(1.0, [0, 0, 0, 1, 0, 0])),
    ("V", unit(1.0, [2, 1, -3, -1, 0, 0])),
    ("N", unit(1.0, [1, 1, -2, 0, 0, 0])),
    ("Nm", unit(1.0, [2, 1, -2, 0, 0, 0])),
    ("J", unit(1.0, [2, 1, -2, 0, 0, 0])),
    ("W", unit(1.0, [2, 1, -3, 0, 0, 0])),
    ("Hz", unit(1.0, [0, 0, -1, 0, 0, 0])),
    ("Ohm", unit(1.0, [2, 1, -3, -2, 0, 0])),
    ("H", unit(1.0, [2, 1, -2, -2, 0, 0])),
    ("F", unit(1.0, [-2, -1, 4, 2, 0, 0])),
    ("C", unit(1.0, [0, 0, 1, 1, 0, 0])),
    ("Pa", unit(1.0, [-1, 1, -2, 0, 0, 0])),
    ("bar", unit(1e5, [-1, 1, -2, 0, 0, 0])),
    ("Wh", unit(3600.0, [2, 1, -2, 0, 0, 0])),
    ("Ah", unit(3600.0, [0, 0, 1, 1, 0, 0])),
    ("K", unit(1.0, [0, 0, 0, 0, 1, 0])),
    ("rad", unit(1.0, [0, 0, 0, 0, 0, 1])),
];

const PREFIXES: [(char, f64); 10] = [
    ('p', 1e-12),
    ('n', 1e-9),
    ('u', 1e-6),
    ('µ', 1e-6),
    ('μ', 1e-6),
    ('m', 1e-3),
    ('c', 1e-2),
    ('k', 1e3),
    ('M', 1e6),
    ('G', 1e9),
];

/// The unit a word means.
pub(super) fn lookup(word: &str) -> Option<Unit> {
    symbol(word).or_else(|| spelled_out(word)).or_else(|| {
        PREFIXES.iter().find_map(|(prefix, factor)| {
            let base = prefixable(word.strip_prefix(*prefix)?)?;
            // 1e-3 · 1e3 is exactly 1: the kilogram is the base unit.
            Some(Unit {
                factor: base.factor * factor,
                ..base
            })
        })
    })
}

fn prefixable(word: &str) -> Option<Unit> {
    let word = if matches!(word, "\u{3a9}" | "\u{2126}") {
        "Ohm"
    } else {
        word
    };
    PREFIXABLE
        .iter()
        .find(|(symbol, _)| *symbol == word)
        .map(|(_, unit)| *unit)
}

fn symbol(word: &str) -> Option<Unit> {
    const ANGLE: [i8; 6] = [0, 0, 0, 0, 0, 1];
    prefixable(word).or_else(|| {
        Some(match word {
            "min" => unit(60.0, [0, 0, 1, 0, 0, 0]),
            "h" => unit(3600.0, [0, 0, 1, 0, 0, 0]),
            "deg" | "°" => unit(TAU / 360.0, ANGLE),
            "rev" | "rot" | "rotation" | "rotations" => unit(TAU, ANGLE),
            "rpm" => unit(TAU / 60.0, [0, 0, -1, 0, 0, 1]),
            "rps" => unit(TAU, [0, 0, -1, 0, 0, 1]),
            "dps" => unit(TAU / 360.0, [0, 0, -1, 0, 0, 1]),
            "mps" => unit(1.0, [1, 0, -1, 0, 0, 0]),
            "kph" | "kmh" => unit(1.0 / 3.6, [1, 0, -1, 0, 0, 0]),
            "mph" => unit(0.44704, [1, 0, -1, 0, 0, 0]),
            "count" | "counts" => Unit::ONE,
            "percent" | "%" => unit(0.01, [0; 6]),
            "L" | "l" => unit(1e-3, [3, 0, 0, 0, 0, 0]),
            "mL" | "ml" => unit(1e-6, [3, 0, 0, 0, 0, 0]),
            "lpm" | "LPM" => unit(1e-3 / 60.0, [3, 0, -1, 0, 0, 0]),
            "psi" => unit(PSI, [-1, 1, -2, 0, 0, 0]),
            "in" => unit(0.0254, [1, 0, 0, 0, 0, 0]),
            "ft" => unit(0.3048, [1, 0, 0, 0, 0, 0]),
            _ => return None,
        })
    })
}

fn spelled_out(word: &str) -> Option<Unit> {
    const NAMES: [(&str, &str); 21] = [
        ("meter", "m"),
        ("meters", "m"),
        ("metre", "m"),
        ("metres", "m"),
        ("feet", "ft"),
        ("foot", "ft"),
        ("inch", "in"),
        ("inches", "in"),
        ("radian", "rad"),
        ("radians", "rad"),
        ("degree", "deg"),
        ("degrees", "deg"),
        ("rotation", "rot"),
        ("rotations", "rot"),
        ("revolution", "rev"),
        ("revolutions", "rev"),
        ("seconds", "s"),
        ("volts", "V"),
        ("amperes", "A"),
        ("amps", "A"),
        ("newtons", "N"),
    ];
    let (_, name) = NAMES
        .iter()
        .find(|(name, _)| name.eq_ignore_ascii_case(word))?;
    symbol(name)
}
