//! The page of a fit: parameters with their intervals, then the fitted model compared with the measurements.

use loopsight_diagnosis::{Estimate, Fit, ParameterVerdict};

use crate::chart::{Abscissae, Chart, Role, Trace};
use crate::comparison;
use crate::html::{escape, identifier, list, table, text};
use crate::intervals::{self, Interval};
use crate::numbers::{axis, powers, rounded_times};
use crate::page::{Context, page, section};
use crate::thin::{MOST_POINTS, kept};
use crate::words::fit::{how_it_went, in_each_run, not_determined};
use crate::words::{number, significant, with_error};

/// The page of a fit: how far the error fell, the parameters and how well they are known, and the fitted model
/// compared with the measurements as in [`comparison_page`](crate::comparison_page).
pub fn fit_page(context: &Context, fit: &Fit) -> String {
    let mut body = format!(
        "<p class=\"verdict\">{}</p>\n",
        text(&how_it_went(fit).join(" "))
    );
    body.push_str(&section("Parameters", "", &parameters(fit)));
    if fit.history.iter().any(|(_, points)| !points.is_empty()) {
        body.push_str(&section(
            "How the estimate converged",
            "Each parameter over the time of the log. A line that still moves at the end has not converged. A line \
             that jumps saw something that the model does not explain. Wild first guesses may be out of sight: \
             double-click to see everything.",
            &history(fit),
        ));
    }
    let title = "<h2>The fitted model compared with the measurements</h2>\n";
    page(
        context,
        &(body + title + &comparison::body(&fit.comparison)),
    )
}

/// The parameters: a table, their intervals, those that were not fitted, and what follows from them.
fn parameters(fit: &Fit) -> String {
    let (fitted, frozen): (Vec<_>, Vec<_>) = fit
        .parameters
        .iter()
        .partition(|(_, e)| e.verdict != ParameterVerdict::Frozen);
    let intervals: Vec<Interval> = fitted
        .iter()
        .filter_map(|(name, e)| {
            Some(Interval {
                name,
                unit: &e.unit,
                value: e.value,
                std_error: e.std_error.unwrap_or(f64::NAN),
                bounds: e.interval95?,
            })
        })
        .filter(intervals::can_be_drawn)
        .collect();
    let mut out = estimates(&fitted);
    let flat: Vec<String> = fit.flat.iter().map(|f| not_determined(f)).collect();
    out.push_str(&list(&flat));
    let bars = intervals::chart(&intervals);
    if !bars.is_empty() {
        out.push_str(&format!(
            "<h3>95 % intervals, relative to the value</h3><p class=\"what\">The shorter the bar, the better the \
             data pin the parameter. A bar with an arrow is longer than can be drawn.</p>{bars}"
        ));
    }
    let without: Vec<String> = fitted
        .iter()
        .filter(|(name, _)| intervals.iter().all(|i| i.name != name.as_str()))
        .map(|(name, e)| format!("{name} has no relative interval: {}.", e.verdict.text()))
        .collect();
    out.push_str(&list(&without));
    if !frozen.is_empty() {
        let rows: Vec<Vec<String>> = frozen
            .iter()
            .map(|(name, e)| {
                vec![
                    identifier(name),
                    text(&number(e.value)),
                    escape(&powers(&e.unit)),
                ]
            })
            .collect();
        let table = table(
            &["parameter", "value", "unit"],
            &[false, true, false],
            &rows,
        );
        out.push_str(&format!(
            "<h3>Not fitted: the values of the file</h3>{table}"
        ));
    }
    if !fit.per_run.is_empty() {
        let table = estimates(&in_each_run(fit).iter().collect::<Vec<_>>());
        out.push_str(&format!(
            "<h3>What differs from run to run</h3><p class=\"what\">The table above has the mean over the runs.</p>{table}"
        ));
    }
    if !fit.derived.is_empty() {
        let table = estimates(&fit.derived.iter().collect::<Vec<_>>());
        out.push_str(&format!(
            "<h3>What follows from them</h3><p class=\"what\"><code>loopsight explain</code> with the name of the \
             plant shows how.</p>{table}"
        ));
    }
    out
}

/// How a recursive estimate went on over the log.
fn history(fit: &Fit) -> String {
    let mut chart = Chart::over("time, s".into());
    for (name, points) in &fit.history {
        let values: Vec<f64> = points.iter().map(|p| p.1).collect();
        let time = rounded_times(&continued(points));
        let unit = fit.parameters.get(name).map_or("", |e| e.unit.as_str());
        chart.panel_of(name, axis(name, unit), 110);
        let kept = kept(&values, MOST_POINTS);
        chart.push(Trace {
            name: "estimate".into(),
            role: Role::Model,
            x: Abscissae::Own(kept.iter().map(|k| time[*k]).collect()),
            y: kept.iter().map(|k| significant(values[*k], 5)).collect(),
            spread: None,
            step: false,
            hidden: false,
        });
        chart.settle();
    }
    chart.html()
}

/// Time stamps that go on where those of the next run start anew.
fn continued(points: &[(f64, f64)]) -> Vec<f64> {
    let (mut offset, mut last) = (0.0, f64::NEG_INFINITY);
    points
        .iter()
        .map(|(time, _)| {
            if *time < last {
                offset += last - time;
            }
            last = *time;
            time + offset
        })
        .collect()
}

/// Estimated parameters in a table.
pub(crate) fn estimates(parameters: &[(&String, &Estimate)]) -> String {
    let rows: Vec<Vec<String>> = parameters
        .iter()
        .map(|(name, e)| {
            let (value, error) = with_error(e.value, e.std_error.unwrap_or(f64::NAN));
            let bound = |b: f64| with_error(b, e.std_error.unwrap_or(f64::NAN)).0;
            let interval = match e.interval95 {
                Some([low, high]) => format!("{} … {}", bound(low), bound(high)),
                None => "-".into(),
            };
            let class = if e.verdict == ParameterVerdict::Good {
                "good"
            } else {
                "doubtful"
            };
            vec![
                identifier(name),
                text(&value),
                escape(&powers(&e.unit)),
                text(&error),
                text(&interval),
                format!(
                    "<span class=\"{class}\">{}</span>",
                    escape(e.verdict.text())
                ),
            ]
        })
        .collect();
    let header = [
        "parameter",
        "value",
        "unit",
        "std error",
        "95 % interval",
        "what the data say",
    ];
    table(&header, &[false, true, false, true, true, false], &rows)
}

#[cfg(test)]
pub(crate) mod tests {
    use std::collections::BTreeMap;

    use loopsight_diagnosis::Method;

    use super::*;
    use crate::fixtures::{comparison, context, friction_runs, opened};

    pub(crate) fn parameters() -> BTreeMap<String, Estimate> {
        let estimate = |value: f64, half: f64, unit: &str, verdict| Estimate {
            value,
            unit: unit.into(),
            std_error: (half > 0.0).then_some(half / 1.96),
            interval95: (half > 0.0).then_some([value - half, value + half]),
            verdict,
        };
        [
            (
                "K_A",
                estimate(-15.146, 0.31, "1/s", ParameterVerdict::Good),
            ),
            (
                "K_B",
                estimate(0.005, 0.02, "m", ParameterVerdict::NotPinned),
            ),
            (
                "K_C",
                estimate(0.136, 0.0028, "m/(s²·V)", ParameterVerdict::Good),
            ),
            ("K_D", estimate(-9.573, 0.12, "1/s", ParameterVerdict::Good)),
            ("K_E", estimate(0.0, 0.0, "1/m", ParameterVerdict::Dead)),
            (
                "coulomb_friction.level",
                estimate(0.45, 0.02, "m/s²", ParameterVerdict::AtBound),
            ),
            (
                "wheel_radius",
                estimate(0.05, 0.0, "m", ParameterVerdict::Frozen),
            ),
        ]
        .into_iter()
        .map(|(name, e)| (name.to_owned(), e))
        .collect()
    }

    pub(crate) fn page(n: usize, history: bool) -> String {
        let convergence = |end: f64| {
            (0..n)
                .map(|k| 0.01 * k as f64)
                .map(|t| (t, end * (1.0 - (-t).exp())))
                .collect()
        };
        let derived = Estimate {
            value: 1.2,
            unit: "V s/rad".into(),
            std_error: Some(0.01),
            interval95: Some([1.18, 1.22]),
            verdict: ParameterVerdict::Good,
        };
        let mut fit = Fit {
            comparison: comparison(friction_runs(1, n)),
            derived: [("kV".to_owned(), derived)].into(),
            nrmse_before: Some(0.21),
            nrmse_fit: 0.052,
            iterations: 12,
            convergence: None,
            flat: vec!["K_E + 0.3·K_B".to_owned()],
            ..crate::findings::fit()
        };
        if history {
            fit.method = Method::Rls;
            fit.history = vec![
                ("K_A".to_owned(), convergence(-15.1)),
                ("K_C".into(), convergence(0.136)),
            ];
        }
        fit_page(&context(), &fit)
    }

    #[test]
    fn parameters_are_listed_with_what_is_known_of_them() {
        let page = opened(&page(300, false));
        for text in [
            "the free-run error on the log fell from 21.0\u{a0}% to 5.20\u{a0}%.",
            "which the fit did not see, it is 7.90\u{a0}%",
            "K_<wbr>A",
            "−15.46 … −14.84",
            "interval wider than the value",
            "K_E has no relative interval: no influence on what is measured here.",
            "What follows from them",
            "Not fitted: the values of the file",
            "Not determined by these data: K_E + 0.3·K_B",
        ] {
            assert!(page.contains(text), "{text}");
        }
        assert!(!page.contains("How the estimate converged"));
    }

    #[test]
    fn runs_follow_each_other() {
        let points = [(0.0, 1.0), (1.0, 1.0), (0.5, 1.0), (1.5, 1.0)];
        assert_eq!(continued(&points), [0.0, 1.0, 1.0, 2.0]);
        assert!(continued(&[]).is_empty());
    }

    #[test]
    fn the_history_of_a_recursive_fit_is_drawn() {
        let page = opened(&page(300, true));
        assert!(page.contains("How the estimate converged") && page.contains("K_C, m/(s²·V)"));
        assert!(page.contains("Recursive least squares over 12 samples"));
    }
}
