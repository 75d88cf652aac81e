//! A force that no effect of the library explains: what it looks like, and an expression to start from.

use loopsight_diagnosis::{ForceBin, ForceCurve, ForceDependence, ForceExpression, ResidualForce};

use crate::chart::{Abscissae, Chart, Role, Trace};
use crate::html::{escape, marked, sentence, text};
use crate::numbers::axis;
use crate::page::section;
use crate::words::{fitted, percent, significant};

/// Quantities that are drawn.
const DRAWN: usize = 4;
/// Smaller shares of the variance are not drawn.
const TELLING: f64 = 0.05;
/// Digits of a drawn value.
const DIGITS: usize = 4;

/// What to do with an expression.
fn then(expression: &ForceExpression) -> String {
    match fitted(expression) {
        Some(fitted) => format!(
            "{} To go on from it, paste this at the end of the model file and edit it:",
            sentence(&fitted)
        ),
        None => "Paste this at the end of the model file and fit it. Then edit it to describe what the force is:".to_owned(),
    }
}

/// The section of a page; empty where there is nothing to show.
pub(crate) fn residual_force(force: Option<&ResidualForce>) -> String {
    let Some(force) = force else {
        return String::new();
    };
    let mut body = format!("<p>{}</p>\n", marked(&sentence(&force.statement)));
    let charts: String = force
        .depends_on
        .iter()
        .filter(|d| !d.curves.is_empty())
        .enumerate()
        .take_while(|(at, d)| *at == 0 || d.share_of_variance > TELLING)
        .take(DRAWN)
        .map(|(_, d)| {
            format!(
                "<div><h3>{} <span class=\"soft\">{} of the variance</span></h3>{}</div>",
                escape(&d.quantity),
                text(&percent(d.share_of_variance)),
                chart(force, d).html()
            )
        })
        .collect();
    body.push_str(&format!("<div class=\"grid forces\">{charts}</div>\n"));
    body.push_str(&match &force.expression {
        Some(expression) => format!(
            "<p>The expression <code>{}</code> accounts for {} of the variance. {}</p>\n\
             <pre><code>{}</code></pre>\n",
            escape(&expression.force),
            text(&percent(expression.share_of_variance)),
            text(&then(expression)),
            escape(expression.toml.trim_end())
        ),
        None => "<p>No expression in these quantities stands out from the noise. What is missing depends on \
                 something that is not measured, or on the past.</p>\n"
            .to_owned(),
    });
    section(
        "The force that is missing",
        "This force would have to act on the model, besides all that is in it, to make it do what was \
         measured. Points are the mean force over each quantity with its standard error, forwards and \
         backwards. Lines are the expression below, over the same samples.",
        &body,
    )
}

fn chart(force: &ResidualForce, of: &ForceDependence) -> Chart {
    let turn = if of.period.is_some() {
        format!("{} within a turn", of.quantity)
    } else {
        of.quantity.clone()
    };
    let mut chart = Chart::over(axis(&turn, &of.unit));
    chart.panel(axis("force", &force.unit), 220);
    for (at, curve) in of.curves.iter().enumerate() {
        let second = at > 0;
        let column = |value: &dyn Fn(&ForceBin) -> f64| -> Vec<f64> {
            curve
                .bins
                .iter()
                .map(|bin| significant(value(bin), DIGITS))
                .collect()
        };
        let x = Abscissae::Own(column(&|b| b.center));
        chart.push(Trace {
            name: name(curve, "mean force"),
            role: if second { Role::DotsAfter } else { Role::Dots },
            x: x.clone(),
            y: column(&|b| b.mean),
            spread: Some(column(&|b| b.std_error)),
            step: false,
            hidden: false,
        });
        if curve.bins.iter().any(|b| b.expression.is_some()) {
            chart.push(Trace {
                name: name(curve, "expression"),
                role: if second { Role::After } else { Role::Model },
                x,
                y: column(&|b| b.expression.unwrap_or(f64::NAN)),
                spread: None,
                step: false,
                hidden: false,
            });
        }
    }
    chart
}

fn name(curve: &ForceCurve, what: &str) -> String {
    match curve.direction {
        "all" => what.to_owned(),
        direction => format!("{what}, {direction}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures::opened;

    fn force() -> ResidualForce {
        let curve = |direction, sign: f64| ForceCurve {
            direction,
            bins: (0..8)
                .map(|k| ForceBin {
                    center: 0.8 * f64::from(k),
                    mean: sign * (1.6 * f64::from(k)).cos(),
                    std_error: 0.05,
                    count: 100,
                    expression: Some(sign * (1.6 * f64::from(k)).cos()),
                })
                .collect(),
        };
        ResidualForce {
            at: vec!["shaft".into()],
            unit: "V".into(),
            statement: "the residual force at shaft depends on position: 62 % of its variance"
                .into(),
            depends_on: vec![ForceDependence {
                quantity: "position".into(),
                unit: "rad".into(),
                period: Some(std::f64::consts::TAU),
                share_of_variance: 0.62,
                curves: vec![curve("forwards", 1.0), curve("backwards", -1.0)],
            }],
            expression: Some(ForceExpression {
                force: "0.25 * flow * cos(2 * position)".into(),
                share_of_variance: 0.98,
                toml: "[[effect]]\n[effect.expression]\nat = [\"shaft\"]\n".into(),
                beside: Vec::new(),
                left: None,
            }),
        }
    }

    #[test]
    fn the_force_is_shown_with_its_expression() {
        assert_eq!(residual_force(None), "");
        let html = opened(&residual_force(Some(&force())));
        for text in [
            "The residual force at shaft depends on position: 62\u{a0}% of its variance.",
            "position within a turn, rad",
            "force, V",
            "mean force, backwards",
            "expression, forwards",
            "<code>0.25 * flow * cos(2 * position)</code>",
            "[effect.expression]\nat = [&quot;shaft&quot;]",
        ] {
            assert!(html.contains(text), "{text}: {html}");
        }
    }

    #[test]
    fn nothing_and_nasty_names_are_no_panic() {
        let mut nasty = force();
        nasty.expression = None;
        nasty.depends_on[0].quantity = "</script><img src=x>".into();
        nasty.depends_on[0].curves[0].bins.clear();
        nasty.depends_on[0].curves[1].bins[0].mean = f64::NAN;
        let html = residual_force(Some(&nasty));
        assert!(!html.contains("<img") && html.contains("stands out from the noise"));
        nasty.depends_on.clear();
        assert!(residual_force(Some(&nasty)).contains("</section>"));
    }
}
