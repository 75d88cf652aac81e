//! Horizontal bars of errors, with lines to compare them with.

use crate::html::text;
use crate::words::error;

/// Something to compare bars with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Line {
    pub(crate) name: &'static str,
    /// Class in the style sheet.
    pub(crate) class: &'static str,
    pub(crate) value: f64,
}

/// The scale that several bars share: zero at the left.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Scale {
    end: f64,
    lines: Vec<Line>,
}

impl Scale {
    /// A scale that shows every line, and `values` up to half as much again as `usual`.
    pub(crate) fn new(values: impl IntoIterator<Item = f64>, usual: f64, lines: &[Line]) -> Self {
        let lines: Vec<Line> = lines
            .iter()
            .copied()
            .filter(|l| l.value.is_finite())
            .collect();
        let most =
            |of: &mut dyn Iterator<Item = f64>| of.filter(|v| v.is_finite()).fold(0.0, f64::max);
        let greatest = most(&mut values.into_iter());
        let end = most(&mut lines.iter().map(|l| l.value)).max(if usual > 0.0 {
            greatest.min(1.5 * usual)
        } else {
            greatest
        });
        Self {
            end: if end > 0.0 { 1.04 * end } else { 1.0 },
            lines,
        }
    }

    /// The drawing of one bar, or of a group of them below each other; class and value each.
    pub(crate) fn bar(&self, bars: &[(&str, f64)]) -> String {
        let place = |value: f64| (100.0 * value / self.end).clamp(0.0, 100.0);
        let height = 10.0 / bars.len().max(1) as f64;
        let mut out = String::from(
            "<svg viewBox=\"0 0 100 10\" preserveAspectRatio=\"none\" aria-hidden=\"true\">",
        );
        for (at, (class, value)) in bars.iter().enumerate() {
            if !value.is_finite() {
                continue;
            }
            let top = at as f64 * height + 0.22 * height;
            out.push_str(&format!(
                "<rect class=\"{class}\" x=\"0\" y=\"{top:.2}\" width=\"{:.2}\" height=\"{:.2}\"/>",
                place(*value).max(0.3),
                0.56 * height
            ));
        }
        for line in &self.lines {
            out.push_str(&format!(
                "<path class=\"{}\" d=\"M{:.2} 0V10\"/>",
                line.class,
                place(line.value)
            ));
        }
        out + "</svg>"
    }

    /// What the lines and, by class and name, the bars mean.
    pub(crate) fn legend(&self, bars: &[(&str, &str)]) -> String {
        let mut out = String::from("<p class=\"key\">");
        for (class, name) in bars {
            out.push_str(&format!(
                "<span><svg width=\"16\" height=\"10\" viewBox=\"0 0 16 10\" aria-hidden=\"true\">\
                 <rect class=\"{class}\" x=\"0\" y=\"1\" width=\"16\" height=\"8\"/></svg> {name}</span> "
            ));
        }
        for line in &self.lines {
            out.push_str(&format!(
                "<span><svg width=\"16\" height=\"10\" viewBox=\"0 0 16 10\" aria-hidden=\"true\">\
                 <path class=\"{}\" d=\"M8 0V10\"/></svg> {}: {}</span> ",
                line.class,
                line.name,
                text(&error(line.value))
            ));
        }
        out + "</p>\n"
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FLOOR: Line = Line {
        name: "noise alone",
        class: "floor",
        value: 0.02,
    };

    #[test]
    fn bars_are_as_long_as_their_values() {
        let scale = Scale::new([0.1, 0.2], 0.2, &[FLOOR]);
        assert!(scale.bar(&[("error", 0.104)]).contains("width=\"50.00\""));
        assert!(scale.bar(&[]).contains("class=\"floor\" d=\"M9.62 0V10\""));
        assert!(scale.legend(&[]).contains("noise alone: 2.00\u{a0}%"));
    }

    #[test]
    fn one_huge_value_does_not_dwarf_the_others() {
        let scale = Scale::new([0.1, 70.0], 0.1, &[]);
        assert!(scale.bar(&[("error", 0.078)]).contains("width=\"50.00\""));
        assert!(scale.bar(&[("error", 70.0)]).contains("width=\"100.00\""));
    }

    #[test]
    fn nothing_finite_is_no_bar() {
        let none = Line {
            value: f64::NAN,
            ..FLOOR
        };
        let scale = Scale::new([f64::NAN], f64::NAN, &[none]);
        let html = scale.bar(&[("error", f64::NAN)]) + &scale.legend(&[]);
        assert!(!html.contains("NaN") && !html.contains("<rect") && !html.contains("<path"));
    }
}
