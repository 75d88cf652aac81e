//! The page of a fit: parameters with their intervals, then the fitted model against measurements.

use std::collections::BTreeMap;

use loopsight_diagnosis::{Comparison, Estimate, Fit, Method, Verdict};

use crate::chart::{Abscissae, Chart, Role, Trace};
use crate::comparison;
use crate::html::{escape, identifier, list, table};
use crate::intervals::{self, Interval};
use crate::numbers::{axis, percent, plain, powers, rounded_times, significant, with_error};
use crate::page::{Context, page, section};
use crate::thin::{MOST_POINTS, kept};

/// The page of a fit: how far the error fell, the parameters and how well they are known, and the
/// fitted model held against the measurements as in [`comparison_page`](crate::comparison_page).
pub fn fit_page(context: &Context, fit: &Fit) -> String {
    Found {
        comparison: &fit.comparison,
        parameters: &fit.parameters,
        derived: &fit.derived,
        method: fit.method,
        nrmse_before: fit.nrmse_before,
        nrmse_fit: fit.nrmse_fit,
        iterations: fit.iterations,
        flat: &fit.flat,
        history: &fit.history,
    }
    .page(context)
}

/// A [`Fit`] without its model.
struct Found<'a> {
    comparison: &'a Comparison,
    parameters: &'a BTreeMap<String, Estimate>,
    derived: &'a BTreeMap<String, Estimate>,
    method: Method,
    nrmse_before: Option<f64>,
    nrmse_fit: f64,
    iterations: u64,
    flat: &'a [String],
    history: &'a [(String, Vec<(f64, f64)>)],
}

impl Found<'_> {
    fn page(&self, context: &Context) -> String {
        let mut body = format!("<p class=\"verdict\">{}</p>\n", escape(&self.sentence()));
        body.push_str(&section("Parameters", "", &self.parameters()));
        if self.history.iter().any(|(_, points)| !points.is_empty()) {
            body.push_str(&section(
                "How the estimate converged",
                "Each parameter over the time of the log. A line that is still moving at the end \
                 has not converged; one that jumps saw something the model does not explain. Wild first guesses \
                 may be out of sight: double-click to see all.",
                &self.history(),
            ));
        }
        let title = "<h2>The fitted model against measurements</h2>\n";
        page(
            context,
            &(body + title + &comparison::body(self.comparison)),
        )
    }

    fn sentence(&self) -> String {
        let how = match self.method {
            Method::Rls => format!("Recursive least squares over {} samples", self.iterations),
            Method::OutputError => {
                format!(
                    "Least squares on the error of the free run, {} iterations",
                    self.iterations
                )
            }
        };
        let from = match self.nrmse_before {
            Some(before) => format!("from {} to", percent(before)),
            None => "to".into(),
        };
        let mut text = format!(
            "{how}: the error fell {from} {} of the measured variation.",
            percent(self.nrmse_fit)
        );
        if self
            .nrmse_before
            .is_some_and(|before| before < self.nrmse_fit)
        {
            text = text.replace("the error fell", "the error rose");
        }
        let on_test = self.comparison.nrmse;
        if on_test.is_finite() && (on_test - self.nrmse_fit).abs() > 1e-9 * self.nrmse_fit {
            text.push_str(&format!(
                " On the test recording, which the fit has not seen, it is {}.",
                percent(on_test)
            ));
        }
        text
    }

    fn parameters(&self) -> String {
        let (free, held): (Vec<_>, Vec<_>) = self
            .parameters
            .iter()
            .partition(|(_, e)| e.verdict != Verdict::Held);
        let intervals: Vec<Interval> = free
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
        let mut out = estimates(&free);
        let flat: Vec<String> = self
            .flat
            .iter()
            .map(|f| format!("Not determined by these data: {f}"))
            .collect();
        out.push_str(&list(&flat));
        let bars = intervals::chart(&intervals);
        if !bars.is_empty() {
            out.push_str(&format!(
                "<h3>95 % intervals, relative to the value</h3><p class=\"what\">The shorter the \
                 bar, the better the data pin the parameter; an arrow means the bar goes on.</p>\
                 {bars}"
            ));
        }
        let without: Vec<String> = free
            .iter()
            .filter(|(name, _)| intervals.iter().all(|i| i.name != name.as_str()))
            .map(|(name, e)| {
                format!(
                    "{name}: no relative interval to draw; {}.",
                    e.verdict.text()
                )
            })
            .collect();
        out.push_str(&list(&without));
        if !held.is_empty() {
            let rows: Vec<Vec<String>> = held
                .iter()
                .map(|(name, e)| vec![identifier(name), plain(e.value), escape(&powers(&e.unit))])
                .collect();
            let table = table(
                &["parameter", "value", "unit"],
                &[false, true, false],
                &rows,
            );
            out.push_str(&format!("<h3>Held at the file's value</h3>{table}"));
        }
        if !self.derived.is_empty() {
            let table = estimates(&self.derived.iter().collect::<Vec<_>>());
            out.push_str(&format!(
                "<h3>What follows from them</h3><p class=\"what\"><code>loopsight explain</code> of the \
                 plant says how.</p>{table}"
            ));
        }
        out
    }

    fn history(&self) -> String {
        let mut chart = Chart::over("time, s".into());
        for (name, points) in self.history {
            let values: Vec<f64> = points.iter().map(|p| p.1).collect();
            let time = rounded_times(&continued(points));
            let unit = self.parameters.get(name).map_or("", |e| e.unit.as_str());
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
                None => "–".into(),
            };
            let class = if e.verdict == Verdict::Good {
                "good"
            } else {
                "doubtful"
            };
            vec![
                identifier(name),
                value,
                escape(&powers(&e.unit)),
                error,
                interval,
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
        "std. error",
        "95 % interval",
        "what the data say",
    ];
    table(&header, &[false, true, false, true, true, false], &rows)
}

#[cfg(test)]
pub(crate) mod tests {
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
            ("K_A", estimate(-15.146, 0.31, "1/s", Verdict::Good)),
            ("K_B", estimate(0.005, 0.02, "m", Verdict::NotPinned)),
            ("K_C", estimate(0.136, 0.0028, "m/(s²·V)", Verdict::Good)),
            ("K_D", estimate(-9.573, 0.12, "1/s", Verdict::Good)),
            ("K_E", estimate(0.0, 0.0, "1/m", Verdict::Dead)),
            (
                "coulomb_friction.level",
                estimate(0.45, 0.02, "m/s²", Verdict::AtBound),
            ),
            ("wheel_radius", estimate(0.05, 0.0, "m", Verdict::Held)),
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
        let history = match history {
            true => vec![
                ("K_A".to_owned(), convergence(-15.1)),
                ("K_C".into(), convergence(0.136)),
            ],
            false => vec![],
        };
        Found {
            comparison: &comparison(friction_runs(1, n)),
            parameters: &parameters(),
            derived: &[(
                "kV".to_owned(),
                Estimate {
                    value: 1.2,
                    unit: "V s/rad".into(),
                    std_error: Some(0.01),
                    interval95: Some([1.18, 1.22]),
                    verdict: Verdict::Good,
                },
            )]
            .into(),
            method: if history.is_empty() {
                Method::OutputError
            } else {
                Method::Rls
            },
            nrmse_before: Some(0.21),
            nrmse_fit: 0.052,
            iterations: 12,
            flat: &["K_E + 0.3·K_B".to_owned()],
            history: &history,
        }
        .page(&context())
    }

    #[test]
    fn parameters_are_listed_with_what_is_known_of_them() {
        let page = opened(&page(300, false));
        for text in [
            "the error fell from 21\u{a0}% to 5.2\u{a0}% of the measured variation",
            "which the fit has not seen, it is 7.9\u{a0}%",
            "K_<wbr>A",
            "−15.46 … −14.84",
            "interval wider than the value",
            "K_E: no relative interval to draw; no influence on what is measured here.",
            "What follows from them",
            "Held at the file&#39;s value"
                .replace("&#39;", "'")
                .as_str(),
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
