//! Numbers for people, in plain letters: `-15.146`, `1.2e-7`, `14.9 %`.

/// From here on an error says that a model runs away, and no more.
pub const ASTRAY: f64 = 100.0;

/// Six significant digits, without needless zeros.
///
/// ```
/// use loopsight_report::words::number;
/// assert_eq!(number(0.05), "0.05");
/// assert_eq!(number(-15.146_524_7), "-15.1465");
/// assert_eq!(number(1.5e-7), "1.5000e-7");
/// ```
pub fn number(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return format!("{value}");
    }
    if !(-4..7).contains(&exponent(value)) {
        return format!("{value:.4e}");
    }
    let decimals = (5 - exponent(value)).max(0) as usize;
    let text = format!("{value:.decimals$}");
    if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        text
    }
}

/// `digits` significant digits, zeros at the end kept: `0.0131`, `-15.146`, `1.2e-7`; `-` for what is no
/// number.
pub fn rounded(value: f64, digits: usize) -> String {
    if value.is_nan() {
        return "-".into();
    }
    if value.is_infinite() {
        return if value > 0.0 { "∞" } else { "-∞" }.into();
    }
    let rounded = significant(value, digits);
    let exponent = exponent(rounded);
    if (-4..6).contains(&exponent) {
        let decimals = (digits as i32 - 1 - exponent).max(0) as usize;
        format!("{rounded:.decimals$}")
    } else {
        format!("{rounded:.*e}", digits.saturating_sub(1))
    }
}

/// A share of something in per cent, with as many digits as mean something: `73 %`, `0.4 %`.
pub fn percent(share: f64) -> String {
    let percent = 100.0 * share;
    if !percent.is_finite() {
        "-".into()
    } else if percent.abs() >= 9.95 || percent == 0.0 {
        format!("{percent:.0} %")
    } else if percent.abs() < 0.095 {
        format!("{} %", rounded(percent, 1))
    } else {
        format!("{percent:.1} %")
    }
}

/// An error relative to the standard deviation (nrmse) in per cent, for a sentence: three significant
/// digits.
///
/// ```
/// use loopsight_report::words::error;
/// assert_eq!(error(0.1489), "14.9 %");
/// assert_eq!(error(0.0172), "1.72 %");
/// assert_eq!(error(1e6), "> 10000 %");
/// ```
pub fn error(nrmse: f64) -> String {
    let percent = 100.0 * nrmse;
    if nrmse > ASTRAY {
        format!("> {:.0} %", 100.0 * ASTRAY)
    } else if percent.is_nan() {
        "-".into()
    } else if percent.abs() >= 99.95 {
        format!("{percent:.0} %")
    } else if percent.abs() >= 9.995 {
        format!("{percent:.1} %")
    } else if percent.abs() >= 0.095 || percent == 0.0 {
        format!("{percent:.2} %")
    } else {
        format!("{} %", rounded(percent, 1))
    }
}

/// An error or a share in per cent, for a column of a table: two decimals.
pub fn hundredths(share: f64) -> String {
    if share.is_nan() {
        "-".to_owned()
    } else if share > ASTRAY {
        format!("> {:.0} %", 100.0 * ASTRAY)
    } else {
        format!("{:.2} %", 100.0 * share)
    }
}

/// A value and its standard error, both to the second significant digit of the error.
pub fn with_error(value: f64, std_error: f64) -> (String, String) {
    if !(std_error.is_finite() && std_error > 0.0 && value.is_finite()) {
        return (rounded(value, 5), rounded(std_error, 2));
    }
    let digits = (exponent(value) - exponent(significant(std_error, 2)) + 2).clamp(2, 8);
    (rounded(value, digits as usize), rounded(std_error, 2))
}

/// A number with its unit; one without dimension stands alone.
pub fn quantity(number: &str, unit: &str) -> String {
    if unit.is_empty() || unit == "1" {
        number.into()
    } else {
        format!("{number} {unit}")
    }
}

/// `value` rounded to `digits` significant digits; what is not finite stays as it is.
pub(crate) fn significant(value: f64, digits: usize) -> f64 {
    if value == 0.0 || !value.is_finite() {
        return value;
    }
    format!("{value:.*e}", digits.saturating_sub(1))
        .parse()
        .unwrap_or(value)
}

/// The power of ten of the leading digit; 0 for 0.
pub(crate) fn exponent(value: f64) -> i32 {
    if value == 0.0 || !value.is_finite() {
        0
    } else {
        value.abs().log10().floor() as i32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_read_well() {
        for (value, text) in [
            (0.0, "0"),
            (9.0, "9"),
            (0.400_09, "0.40009"),
            (1.234_567_89e6, "1234568"),
            (1.2e8, "1.2000e8"),
            (f64::NAN, "NaN"),
        ] {
            assert_eq!(number(value), text);
        }
        assert_eq!(rounded(-15.14593, 5), "-15.146");
        assert_eq!(rounded(0.01307, 2), "0.013");
        assert_eq!(rounded(0.0, 3), "0.00");
        assert_eq!(rounded(1.234e-7, 2), "1.2e-7");
        assert_eq!(rounded(9.999e11, 3), "1.00e12");
        assert_eq!(rounded(f64::NAN, 3), "-");
        assert_eq!(rounded(f64::NEG_INFINITY, 3), "-∞");
        assert_eq!(quantity("0.1", "1"), "0.1");
        assert_eq!(quantity("0.1", "m/s"), "0.1 m/s");
    }

    #[test]
    fn percentages_have_the_digits_that_mean_something() {
        for (share, rough, fine, column) in [
            (0.7312, "73 %", "73.1 %", "73.12 %"),
            (0.0042, "0.4 %", "0.42 %", "0.42 %"),
            (0.000_068, "0.007 %", "0.007 %", "0.01 %"),
            (2.5223, "252 %", "252 %", "252.23 %"),
            (0.0, "0 %", "0.00 %", "0.00 %"),
            (f64::NAN, "-", "-", "-"),
            (f64::INFINITY, "-", "> 10000 %", "> 10000 %"),
        ] {
            assert_eq!(percent(share), rough);
            assert_eq!(error(share), fine);
            assert_eq!(hundredths(share), column);
        }
    }

    #[test]
    fn a_value_is_as_precise_as_its_error() {
        assert_eq!(
            with_error(-15.146_37, 0.0213),
            ("-15.146".into(), "0.021".into())
        );
        assert_eq!(with_error(0.136, 12.0), ("0.14".into(), "12".into()));
        assert_eq!(with_error(2.5, f64::NAN), ("2.5000".into(), "-".into()));
    }
}
