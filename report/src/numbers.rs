//! Numbers, rounded for drawing and written for reading.

/// `value` rounded to `digits` significant digits; what is not finite stays as it is.
pub(crate) fn significant(value: f64, digits: usize) -> f64 {
    if value == 0.0 || !value.is_finite() {
        return value;
    }
    format!("{value:.*e}", digits.saturating_sub(1))
        .parse()
        .unwrap_or(value)
}

/// `value` with `digits` significant digits, in a form for people: `0.0131`, `−15.146`, `1.2·10⁻⁷`.
pub(crate) fn show(value: f64, digits: usize) -> String {
    if value.is_nan() {
        return "–".into();
    }
    if value.is_infinite() {
        return if value > 0.0 { "∞" } else { "−∞" }.into();
    }
    let rounded = significant(value, digits);
    let exponent = exponent(rounded);
    let text = if (-4..6).contains(&exponent) {
        let decimals = (digits as i32 - 1 - exponent).max(0) as usize;
        format!("{rounded:.decimals$}")
    } else {
        let mantissa = rounded / 10f64.powi(exponent);
        let decimals = digits.saturating_sub(1);
        format!("{mantissa:.decimals$}·10{}", superscript(exponent))
    };
    text.replace('-', "−")
}

/// From here on an error says that a model runs away, and no more.
pub const ASTRAY: f64 = 100.0;

/// A share as percent, with as many digits as mean something: `73 %`, `0.4 %`.
pub(crate) fn percent(share: f64) -> String {
    let percent = 100.0 * share;
    if !percent.is_finite() {
        "–".into()
    } else if share > ASTRAY {
        format!(">\u{a0}{:.0}\u{a0}%", 100.0 * ASTRAY)
    } else if percent.abs() >= 9.95 || percent == 0.0 {
        format!("{percent:.0}\u{a0}%").replace('-', "−")
    } else if percent.abs() < 0.095 {
        format!("{}\u{a0}%", show(percent, 1))
    } else {
        format!("{percent:.1}\u{a0}%").replace('-', "−")
    }
}

/// `percent` with one decimal.
pub(crate) fn tenths(percent: f64) -> String {
    if percent.is_finite() {
        format!("{percent:.1}\u{a0}%").replace('-', "−")
    } else {
        "–".into()
    }
}

/// A number that somebody wrote: `0.05`, not `0.050000`.
pub(crate) fn plain(value: f64) -> String {
    let rounded = significant(value, 6);
    if rounded.is_finite() && (rounded == 0.0 || (-4..9).contains(&exponent(rounded))) {
        rounded.to_string().replace('-', "−")
    } else {
        show(value, 6)
    }
}

/// A value and its standard error, both to the second significant digit of the error.
pub(crate) fn with_error(value: f64, std_error: f64) -> (String, String) {
    if !(std_error.is_finite() && std_error > 0.0 && value.is_finite()) {
        return (show(value, 5), show(std_error, 2));
    }
    let digits = (exponent(value) - exponent(significant(std_error, 2)) + 2).clamp(2, 8);
    (show(value, digits as usize), show(std_error, 2))
}

/// A quantity with its unit; a number without dimension stands alone.
pub(crate) fn quantity(number: &str, unit: &str) -> String {
    if unit.is_empty() || unit == "1" {
        number.into()
    } else {
        format!("{number}\u{a0}{}", powers(unit))
    }
}

/// A unit with its powers raised: `m/rad²` for `m/rad^2`.
pub(crate) fn powers(unit: &str) -> String {
    unit.replace("^2", "²").replace("^3", "³")
}

/// `name, unit` for an axis.
pub(crate) fn axis(name: &str, unit: &str) -> String {
    if unit.is_empty() || unit == "1" {
        name.into()
    } else {
        format!("{name}, {}", powers(unit))
    }
}

/// Time stamps rounded to a hundredth of their typical distance.
pub(crate) fn rounded_times(time: &[f64]) -> Vec<f64> {
    let span = match (time.first(), time.last()) {
        (Some(first), Some(last)) if time.len() > 1 => (last - first) / (time.len() - 1) as f64,
        _ => 0.0,
    };
    if !(span.is_finite() && span > 0.0) {
        return time.to_vec();
    }
    let decimals = (2 - exponent(span)).clamp(0, 12) as usize;
    time.iter()
        .map(|t| format!("{t:.decimals$}").parse().unwrap_or(*t))
        .collect()
}

/// The power of ten of the leading digit; 0 for 0.
fn exponent(value: f64) -> i32 {
    if value == 0.0 || !value.is_finite() {
        0
    } else {
        value.abs().log10().floor() as i32
    }
}

fn superscript(exponent: i32) -> String {
    const DIGITS: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
    exponent
        .to_string()
        .chars()
        .map(|c| match c.to_digit(10) {
            Some(digit) => DIGITS[digit as usize],
            None => '⁻',
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_read_well() {
        assert_eq!(show(-15.14593, 5), "−15.146");
        assert_eq!(show(0.01307, 2), "0.013");
        assert_eq!(show(0.0, 3), "0.00");
        assert_eq!(show(1.234e-7, 2), "1.2·10⁻⁷");
        assert_eq!(show(9.999e11, 3), "1.00·10¹²");
        assert_eq!(show(f64::NAN, 3), "–");
        assert_eq!(show(f64::NEG_INFINITY, 3), "−∞");
        assert_eq!(percent(0.7312), "73\u{a0}%");
        assert_eq!(percent(0.0042), "0.4\u{a0}%");
        assert_eq!(percent(0.000_068), "0.007\u{a0}%");
        assert_eq!(percent(f64::NAN), "–");
        assert_eq!(axis("K_B", "m/rad^2"), "K_B, m/rad²");
        assert_eq!(tenths(-3.25), "−3.2\u{a0}%");
        assert_eq!(plain(0.05), "0.05");
        assert_eq!(plain(-1e-9), "−1.00000·10⁻⁹");
    }

    #[test]
    fn a_value_is_as_precise_as_its_error() {
        assert_eq!(
            with_error(-15.146_37, 0.0213),
            ("−15.146".into(), "0.021".into())
        );
        assert_eq!(with_error(0.136, 12.0), ("0.14".into(), "12".into()));
        assert_eq!(with_error(2.5, f64::NAN), ("2.5000".into(), "–".into()));
    }

    #[test]
    fn rounding_keeps_what_can_be_drawn() {
        assert_eq!(significant(0.012_345_678, 5), 0.012_346);
        assert!(significant(f64::NAN, 5).is_nan());
        let time: Vec<f64> = (0..3).map(|k| 12_345.0 + 0.01 * f64::from(k)).collect();
        assert_eq!(rounded_times(&time), [12_345.0, 12_345.01, 12_345.02]);
        assert_eq!(rounded_times(&[]), Vec::<f64>::new());
        assert_eq!(rounded_times(&[1.0, 1.0]), [1.0, 1.0]);
    }
}
