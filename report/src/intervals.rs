//! Confidence intervals of parameters, drawn to a common relative scale.

use crate::html::{identifier, text};
use crate::words::{percent, quantity, with_error};

/// One parameter with an interval.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Interval<'a> {
    pub(crate) name: &'a str,
    pub(crate) unit: &'a str,
    pub(crate) value: f64,
    pub(crate) std_error: f64,
    pub(crate) bounds: [f64; 2],
}

impl Interval<'_> {
    /// Ends relative to the value; `None` where that means nothing.
    fn relative(&self) -> Option<[f64; 2]> {
        let ends = self.bounds.map(|b| (b - self.value) / self.value.abs());
        (ends.iter().all(|e| e.is_finite()) && ends[0] <= ends[1]).then_some(ends)
    }

    /// Numbers for a tooltip.
    fn numbers(&self) -> String {
        let show = |v: f64| quantity(&with_error(v, self.std_error).0, self.unit);
        let [low, high] = self.bounds;
        format!(
            "{} = {}, 95 % interval {} to {}",
            self.name,
            show(self.value),
            show(low),
            show(high)
        )
    }
}

/// True where an interval can be drawn relative to its value.
pub(crate) fn can_be_drawn(interval: &Interval) -> bool {
    interval.relative().is_some()
}

/// A bar for each interval. Those much wider than the others end at the rim, with an arrow.
pub(crate) fn chart(intervals: &[Interval]) -> String {
    let half_widths: Vec<f64> = intervals
        .iter()
        .filter_map(Interval::relative)
        .map(|[a, b]| b.max(-a))
        .collect();
    if half_widths.is_empty() {
        return String::new();
    }
    let scale = scale(&half_widths);
    let mut out = String::from("<div class=\"intervals\">\n");
    for interval in intervals {
        let Some(ends) = interval.relative() else {
            continue;
        };
        // The scale spans 5 to 95 of 100 units; beyond it, bars end at the rim.
        let place = |end: f64| (50.0 + 45.0 * end / scale).clamp(2.0, 98.0);
        let [from, to] = ends.map(place);
        let arrow = |beyond: bool, points: &str| match beyond {
            true => format!("<path class=\"arrow\" d=\"{points}\"/>"),
            false => String::new(),
        };
        out.push_str(&format!(
            "<div class=\"interval\" title=\"{}\"><span class=\"name\">{}</span>\
             <svg viewBox=\"0 0 100 10\" preserveAspectRatio=\"none\" role=\"img\" \
             aria-label=\"{}\"><path class=\"zero\" d=\"M50 0V10\"/>\
             <path class=\"bar\" d=\"M{from:.2} 5H{to:.2}\"/>{}{}\
             <path class=\"value\" d=\"M50 1.5V8.5\"/></svg>\
             <span class=\"width\">±\u{a0}{}</span></div>\n",
            text(&interval.numbers()),
            identifier(interval.name),
            text(&interval.numbers()),
            arrow(ends[0] < -1.001 * scale, "M0 5L3 2V8Z"),
            arrow(ends[1] > 1.001 * scale, "M100 5L97 2V8Z"),
            text(&percent((ends[1] - ends[0]) / 2.0)),
        ));
    }
    let end = text(&percent(scale));
    out.push_str(&format!(
        "<div class=\"interval scale\"><span class=\"name\"></span><span class=\"ends\">\
         <span>−{end}</span><span>value</span><span>+{end}</span></span>\
         <span class=\"width\"></span></div>\n</div>\n"
    ));
    out
}

/// A round number that most half-widths fit in.
fn scale(half_widths: &[f64]) -> f64 {
    let mut sorted = half_widths.to_vec();
    sorted.sort_by(f64::total_cmp);
    let typical = sorted[sorted.len() / 2];
    let widest = sorted
        .iter()
        .rev()
        .copied()
        .find(|w| *w <= 5.0 * typical)
        .unwrap_or(typical);
    let power = 10f64.powf(widest.max(1e-6).log10().floor());
    [1.0, 2.0, 5.0, 10.0]
        .map(|m| m * power)
        .into_iter()
        .find(|s| *s >= widest * (1.0 - 1e-9))
        .unwrap_or(widest)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn interval(value: f64, half: f64) -> Interval<'static> {
        Interval {
            name: "K_A<",
            unit: "1/s",
            value,
            std_error: half / 2.0,
            bounds: [value - half, value + half],
        }
    }

    #[test]
    fn the_scale_is_round_and_ignores_the_hopeless() {
        assert_eq!(scale(&[0.003, 0.012, 0.018]), 0.02);
        assert_eq!(scale(&[0.01, 0.02, 8.0]), 0.02);
        assert_eq!(scale(&[0.0]), 1e-6);
    }

    #[test]
    fn a_bar_is_where_its_interval_is() {
        let html = chart(&[
            interval(-15.146, 0.15146),
            interval(1.0, 0.01),
            interval(1.0, 9.0),
        ]);
        assert!(html.contains("d=\"M5.00 5H95.00\""), "{html}");
        assert!(html.contains("class=\"arrow\" d=\"M0 5") && html.contains("±\u{a0}1.0\u{a0}%"));
        assert!(
            html.contains("K_A&lt; = −15.146\u{a0}1/s, 95\u{a0}% interval −15.297"),
            "{html}"
        );
    }

    #[test]
    fn what_cannot_be_drawn_is_left_out() {
        assert!(!can_be_drawn(&interval(0.0, 1.0)));
        assert!(!can_be_drawn(&interval(1.0, f64::INFINITY)));
        assert_eq!(chart(&[interval(0.0, 1.0)]), "");
        assert_eq!(chart(&[]), "");
    }
}
