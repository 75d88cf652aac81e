//! Numbers in sentences: a robot moves by metres, a mirror by microradians.

/// `value` with so many `decimals`, and with three significant digits where these would hardly show it.
pub(crate) fn figure(value: f64, decimals: usize) -> String {
    let size = value.abs();
    if is_shown(size, decimals) {
        format!("{value:.decimals$}")
    } else if size < 1e-4 {
        format!("{value:.2e}")
    } else {
        let more = 2 - size.log10().floor() as i32;
        format!("{value:.*}", more.max(0) as usize)
    }
}

/// Two values with their signs, as [`figure`] has the larger one.
pub(crate) fn pair(values: [f64; 2], decimals: usize) -> [String; 2] {
    let larger = values[0].abs().max(values[1].abs());
    values.map(|value| {
        let sign = if value.is_sign_negative() { "" } else { "+" };
        let shown = if is_shown(larger, decimals) {
            format!("{value:.decimals$}")
        } else {
            figure(value, decimals)
        };
        format!("{sign}{shown}")
    })
}

/// Whether so many `decimals` show two digits of a size.
fn is_shown(size: f64, decimals: usize) -> bool {
    size >= 10f64.powi(1 - decimals as i32) || size == 0.0 || !size.is_finite()
}

/// `value` to so many significant `digits`.
pub(crate) fn significant(value: f64, digits: i32) -> f64 {
    if value == 0.0 || !value.is_finite() {
        return value;
    }
    let digits = (digits - 1 - value.abs().log10().floor() as i32).clamp(-15, 15);
    let shift = 10f64.powi(digits.abs());
    if digits >= 0 {
        (value * shift).round() / shift
    } else {
        (value / shift).round() * shift
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_numbers_are_shown() {
        for (value, text) in [
            (0.0, "0.000"),
            (12.3456, "12.346"),
            (-0.0841, "-0.084"),
            (0.01, "0.010"),
            (-0.00123, "-0.00123"),
            (1.234e-7, "1.23e-7"),
            (f64::NAN, "NaN"),
        ] {
            assert_eq!(figure(value, 3), text);
        }
        assert_eq!(pair([-0.0102, 0.0079], 3), ["-0.010", "+0.008"]);
        assert_eq!(pair([-1.25e-6, 0.0], 3), ["-1.25e-6", "+0.000"]);
        assert_eq!(significant(0.000_999_999_999, 4), 0.001);
        assert_eq!(
            (figure(0.06, 2), figure(1.5, 2)),
            ("0.0600".into(), "1.50".into())
        );
    }
}
