//! A model before and after a change, both compared with the same measurements.

use loopsight_diagnosis::{Comparison, RunTrace};

use crate::chart::{Chart, Role};
use crate::errors::{residual, rms, signal};
use crate::html::{escape, text};
use crate::numbers::axis;
use crate::scatter;
use crate::words::comparison::run_name;
use crate::words::{error, number, quantity};

/// Signals that are drawn over time.
const MOST_SIGNALS: usize = 4;
/// Signals whose dependences are open to see at once.
const OPEN: usize = 2;
/// Longer runs show at first the stretch of this length with the largest error, s.
const STRETCH: f64 = 6.0;

/// Names of the two models in the charts.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Names<'a> {
    pub(crate) before: &'a str,
    pub(crate) after: &'a str,
}

/// The worst run of `before` over time, with what `after` does there.
pub(crate) fn over_time(before: &Comparison, after: Option<&Comparison>, names: Names) -> String {
    let ids = by_error(before);
    let Some((at, run)) = worst_run(before, ids.first().copied()) else {
        return "<p>There is no run to show.</p>\n".into();
    };
    let other = after.and_then(|c| c.runs.get(at));
    let mut chart = Chart::over_time(&run.time);
    for id in ids.iter().take(MOST_SIGNALS) {
        let Some(trace) = signal(run, id) else {
            continue;
        };
        let with = other.and_then(|run| signal(run, id));
        chart.panel_of(id, axis(id, &trace.unit), 190);
        chart.line("measured", Role::Measured, &trace.measured);
        chart.line(names.before, Role::Model, &trace.free_run);
        if let Some(with) = with {
            chart.line(names.after, Role::After, &with.free_run);
        }
        chart.panel_of(
            &format!("residual of {id}"),
            axis(&format!("residual of {id}"), &trace.unit),
            110,
        );
        chart.line(names.before, Role::Model, &residual(trace));
        if let Some(with) = with {
            chart.line(names.after, Role::After, &residual(with));
        }
    }
    chart.x_range = ids.first().and_then(|id| stretch(run, id));
    let mut said = Vec::new();
    if before.runs.len() > 1 {
        said.push(format!(
            "The run with the largest error of {}: {}.",
            before.runs.len(),
            run_name(&run.name, at)
        ));
    }
    if ids.len() > MOST_SIGNALS {
        said.push(format!(
            "The {MOST_SIGNALS} signals with the largest errors of {}.",
            ids.len()
        ));
    }
    if chart.x_range.is_some() {
        said.push(format!(
            "Shown at first: the {} with the largest error.",
            quantity(&number(STRETCH), "s")
        ));
    }
    format!(
        "<p class=\"what\">{}</p>\n{}",
        text(&said.join(" ")),
        chart.html()
    )
}

/// Ids of the scored signals, those with the greatest relative error first.
fn by_error(comparison: &Comparison) -> Vec<&str> {
    let mut scores: Vec<_> = comparison.signals.iter().collect();
    let error = |nrmse: f64| if nrmse.is_finite() { nrmse } else { -1.0 };
    scores.sort_by(|a, b| error(b.nrmse).total_cmp(&error(a.nrmse)));
    scores.into_iter().map(|s| s.id.as_str()).collect()
}

/// The run in which the error of the signal `id` is largest.
fn worst_run<'a>(comparison: &'a Comparison, id: Option<&str>) -> Option<(usize, &'a RunTrace)> {
    let error = |run: &RunTrace| {
        let error = id
            .and_then(|id| signal(run, id))
            .map_or(f64::NAN, |s| rms(residual(s)));
        if error.is_finite() { error } else { -1.0 }
    };
    comparison
        .runs
        .iter()
        .enumerate()
        .max_by(|a, b| error(a.1).total_cmp(&error(b.1)).then(b.0.cmp(&a.0)))
}

/// The stretch of a long run in which the error of the signal `id` is largest.
fn stretch(run: &RunTrace, id: &str) -> Option<[f64; 2]> {
    let (first, last) = (*run.time.first()?, *run.time.last()?);
    let duration = last - first;
    if duration.is_nan() || duration <= 1.3 * STRETCH {
        return None;
    }
    let errors = residual(signal(run, id)?);
    let square = |k: usize| match errors.get(k) {
        Some(e) if e.is_finite() => e * e,
        _ => 0.0,
    };
    let (mut from, mut sum) = (0, 0.0);
    let (mut most, mut best) = (-1.0, first);
    for (k, time) in run.time.iter().enumerate() {
        sum += square(k);
        while from < k && time - run.time[from] > STRETCH {
            sum -= square(from);
            from += 1;
        }
        if sum > most {
            (most, best) = (sum, run.time[from]);
        }
    }
    let start = best.min(last - STRETCH);
    Some([start, start + STRETCH].map(|t| (100.0 * t).round() / 100.0))
}

/// Error of every signal before and after, then the residual against each quantity.
pub(crate) fn dependences(before: &Comparison, after: Option<&Comparison>, names: Names) -> String {
    let mut out = String::new();
    for (at, id) in by_error(before).into_iter().enumerate() {
        let Some(score) = before.signals.iter().find(|s| s.id == id) else {
            continue;
        };
        let with = after.and_then(|c| c.signals.iter().find(|s| s.id == id));
        let fell = match with {
            Some(with) => format!(
                "error {} ({}), {} ({})",
                error(score.nrmse),
                names.before,
                error(with.nrmse),
                names.after
            ),
            None => format!("error {}", error(score.nrmse)),
        };
        let runs = after.map(|c| (names.after, c.runs.as_slice()));
        let charts = scatter::charts(&before.runs, runs, id, &score.unit).concat();
        let open = if at < OPEN { " open" } else { "" };
        out.push_str(&format!(
            "<details class=\"signal\"{open}><summary><h3>{}</h3> <span class=\"soft\">{}</span>\
             </summary><div class=\"grid\">{charts}</div></details>\n",
            escape(id),
            text(&fell)
        ));
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures::{comparison, friction_runs, opened};

    const NAMES: Names = Names {
        before: "before",
        after: "after",
    };

    #[test]
    fn a_long_run_opens_where_its_error_is_largest() {
        let mut runs = friction_runs(1, 3000);
        assert_eq!(stretch(&friction_runs(1, 700)[0], "linear_velocity"), None);
        for value in &mut runs[0].signals[0].free_run[1500..1600] {
            *value += 3.0;
        }
        let [from, to] = stretch(&runs[0], "linear_velocity").unwrap();
        assert!(from <= 15.0 && to >= 16.0 && (to - from - STRETCH).abs() < 1e-9);
        let html = over_time(&comparison(runs), None, NAMES);
        assert!(html.contains("Shown at first: the 6\u{a0}s with the largest error."));
    }

    #[test]
    fn the_worst_run_is_shown_for_both() {
        let mut runs = friction_runs(3, 100);
        for value in &mut runs[1].signals[0].free_run {
            *value += 3.0;
        }
        let (before, after) = (comparison(runs), comparison(friction_runs(3, 100)));
        let html = opened(&over_time(&before, Some(&after), NAMES));
        assert!(
            html.contains("The run with the largest error of 3: run-2."),
            "{html}"
        );
        assert_eq!(html.matches("\"role\":\"after\"").count(), 4);
        let html = opened(&dependences(&before, Some(&after), NAMES));
        assert!(html.contains("\"role\":\"mean_after\""));
    }

    #[test]
    fn nothing_and_gaps_are_no_panic() {
        for runs in [vec![], friction_runs(1, 0), friction_runs(2, 1)] {
            let some = comparison(runs);
            let none = comparison(vec![]);
            let _ = over_time(&some, Some(&none), NAMES) + &dependences(&some, Some(&none), NAMES);
            let _ = over_time(&none, Some(&some), NAMES) + &dependences(&none, None, NAMES);
        }
        let mut runs = friction_runs(1, 1000);
        runs[0].signals[0].measured.fill(f64::NAN);
        assert!(opened(&over_time(&comparison(runs), None, NAMES)).contains(",null,"));
    }
}
