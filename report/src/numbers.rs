//! Numbers and units, rounded for drawing.

use crate::words::exponent;

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounding_keeps_what_can_be_drawn() {
        let time: Vec<f64> = (0..3).map(|k| 12_345.0 + 0.01 * f64::from(k)).collect();
        assert_eq!(rounded_times(&time), [12_345.0, 12_345.01, 12_345.02]);
        assert_eq!(rounded_times(&[]), Vec::<f64>::new());
        assert_eq!(rounded_times(&[1.0, 1.0]), [1.0, 1.0]);
        assert_eq!(axis("K_B", "m/rad^2"), "K_B, m/rad²");
    }
}
