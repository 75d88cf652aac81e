//! The page of a comparison: model against measurements.

use loopsight_diagnosis::{Comparison, RunTrace, SignalScore};
use loopsight_recordings::{Fault, Severity};

use crate::chart::{Chart, Role};
use crate::errors::{residual, rms, signal};
use crate::html::{escape, identifier, list, marked, sentence, table, text};
use crate::numbers::axis;
use crate::page::{Context, page, section};
use crate::scatter;
use crate::words::comparison::{run_name, summary};
use crate::words::{fault, hundredths, number, quantity, rounded, severity};

/// The page that compares a model with measurements: scores, faults of the log, every run over time, and
/// where the model fails.
pub fn comparison_page(context: &Context, comparison: &Comparison) -> String {
    page(context, &body(comparison))
}

/// Everything between header and footer.
pub(crate) fn body(comparison: &Comparison) -> String {
    let verdict = format!(
        "<p class=\"verdict\">{}</p>\n",
        text(&summary(comparison).join(" "))
    );
    let mut body = verdict + &faults(&comparison.faults) + &scores(&comparison.signals);
    body.push_str(&section("Over time", HOW_TO_LOOK, &runs(comparison)));
    body.push_str(&section(
        "Where it fails",
        "The residual is the measurement minus the free run. If the model lacks nothing, the residual depends on \
         nothing and its means lie on zero. Dots are samples, at most 3000 of them. The line is the mean of the \
         samples nearby, with their standard deviation.",
        &failures(comparison),
    ));
    body
}

/// How charts over time are used.
pub(crate) const HOW_TO_LOOK: &str = "Drag across a chart to zoom in. Double-click to see everything again. Tap an \
    entry of the legend to show or hide it.";

/// The faults of a log in a box.
pub(crate) fn faults(faults: &[Fault]) -> String {
    if faults.is_empty() {
        return String::new();
    }
    let items: String = faults
        .iter()
        .map(|one| {
            let grave = match one.severity() {
                Severity::Fatal => " class=\"fatal\"",
                Severity::Note | Severity::Warning => "",
            };
            format!(
                "<li{grave}><b>{}</b>: {}</li>",
                severity(one),
                marked(&fault(one))
            )
        })
        .collect();
    format!(
        "<div class=\"box\"><h2>Faults of the log</h2><p>Results that rest on these samples are \
         doubtful.</p><ul>{items}</ul></div>\n"
    )
}

fn scores(scores: &[SignalScore]) -> String {
    let rows: Vec<Vec<String>> = scores
        .iter()
        .map(|s| {
            vec![
                identifier(&s.id),
                text(&quantity(&rounded(s.rmse, 3), &s.unit)),
                text(&hundredths(s.nrmse)),
                text(&hundredths(s.fit_percent / 100.0)),
                text(&hundredths(s.one_step_nrmse)),
            ]
        })
        .collect();
    let header = ["signal", "rmse", "nrmse", "fit", "one-step nrmse"];
    let table = table(&header, &[false, true, true, true, true], &rows);
    format!(
        "{table}<details><summary>What these numbers mean</summary><dl class=\"terms\">\
         <dt>Free run</dt><dd>The model is simulated from the measured inputs alone, from an estimated initial \
         state. It never sees the measurement, so its errors add up and show.</dd>\
         <dt>One step</dt><dd>The model predicts each sample from the measured sample before it. That is easy: \
         errors that add up stay hidden.</dd>\
         <dt>rmse</dt><dd>Root mean square of measurement minus free run.</dd>\
         <dt>nrmse</dt><dd>The rmse divided by the standard deviation of the measurement. 0 % is perfect, 100 % \
         is no better than a constant.</dd>\
         <dt>fit</dt><dd>100 % minus nrmse.</dd></dl></details>\n"
    )
}

/// Every run, with buttons to choose one where there are several.
fn runs(comparison: &Comparison) -> String {
    let runs = &comparison.runs;
    if runs.is_empty() {
        return "<p>There is no run to show.</p>\n".into();
    }
    let mut out = String::new();
    if runs.len() > 1 {
        out.push_str(&run_table(comparison));
    }
    for (at, run) in runs.iter().enumerate() {
        let name = escape(&run_name(&run.name, at));
        let chart = over_time(run).html();
        if runs.len() > 1 {
            out.push_str(&format!(
                "<div class=\"run\" data-name=\"{name}\"><h3>Run {name}</h3>{chart}</div>\n"
            ));
        } else {
            out.push_str(&chart);
        }
    }
    out
}

fn run_table(comparison: &Comparison) -> String {
    let mut header = vec!["run".to_owned(), "duration".into(), "samples".into()];
    header.extend(
        comparison
            .signals
            .iter()
            .map(|s| axis(&format!("rmse of {}", s.id), &s.unit)),
    );
    let rows: Vec<Vec<String>> = comparison
        .runs
        .iter()
        .enumerate()
        .map(|(at, run)| {
            let duration = run.time.last().unwrap_or(&0.0) - run.time.first().unwrap_or(&0.0);
            let name = escape(&run_name(&run.name, at));
            let mut row = vec![
                format!("<button type=\"button\" data-run=\"{name}\">{name}</button>"),
                text(&quantity(&number(duration), "s")),
                run.time.len().to_string(),
            ];
            row.extend(comparison.signals.iter().map(|s| {
                let error = signal(run, &s.id).map_or(f64::NAN, |trace| rms(residual(trace)));
                text(&rounded(error, 2))
            }));
            row
        })
        .collect();
    let header: Vec<&str> = header.iter().map(String::as_str).collect();
    table(
        &header,
        &[&[false][..], &vec![true; header.len() - 1]].concat(),
        &rows,
    )
}

/// Measured, model and residual of every signal, then the inputs, over one time axis.
fn over_time(run: &RunTrace) -> Chart {
    let mut chart = Chart::over_time(&run.time);
    for signal in &run.signals {
        chart.panel_of(&signal.id, axis(&signal.id, &signal.unit), 200);
        chart.line("measured", Role::Measured, &signal.measured);
        if let Some(trace) = chart.line("one step", Role::OneStep, &signal.one_step) {
            trace.hidden = true;
        }
        chart.line("free run", Role::Model, &signal.free_run);
        let title = axis(&format!("residual of {}", signal.id), &signal.unit);
        chart.panel_of(&signal.id, title, 110);
        chart.line("residual", Role::Residual, &residual(signal));
    }
    // Inputs of one unit share a panel.
    let mut units: Vec<&str> = Vec::new();
    for (_, unit, _) in &run.inputs {
        if !units.contains(&unit.as_str()) {
            units.push(unit);
        }
    }
    for unit in units {
        chart.panel(axis("inputs", unit), 120);
        for (id, _, values) in run.inputs.iter().filter(|input| input.1 == unit) {
            if let Some(trace) = chart.line(id, Role::Series, values) {
                trace.step = true;
            }
        }
    }
    chart
}

/// Sentences and clouds of residuals, signal by signal.
fn failures(comparison: &Comparison) -> String {
    // Open where the reader can take it in at once.
    let open = if comparison.signals.len() <= 3 {
        " open"
    } else {
        ""
    };
    let mut out = String::new();
    for score in &comparison.signals {
        let mut said: Vec<String> = comparison
            .where_it_fails
            .iter()
            .filter(|s| s.signal == score.id)
            .map(|s| sentence(&s.statement))
            .collect();
        if said.is_empty() {
            said.push("The residual has no pattern that stands out.".to_owned());
        }
        let charts: String =
            scatter::charts(&comparison.runs, None, &score.id, &score.unit).concat();
        out.push_str(&format!(
            "<details class=\"signal\"{open}><summary><h3>{}</h3></summary>{}<div class=\"grid\">\
             {charts}</div></details>\n",
            identifier(&score.id),
            list(&said)
        ));
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures::{comparison, context, friction_runs, opened, without_library};
    use loopsight_recordings::FaultKind;

    #[test]
    fn the_page_says_and_shows() {
        let page = opened(&comparison_page(
            &context(),
            &comparison(friction_runs(2, 400)),
        ));
        for text in [
            "Free run: error 7.90\u{a0}% of the standard deviation",
            "inputs, V",
            "linear_velocity, m/s",
            "residual of angular_velocity, rad/s",
            "The mean residual of linear_velocity is −0.030\u{a0}m/s forwards and +0.031\u{a0}m/s backwards.",
            "The residual has no pattern that stands out.",
            "data-run=\"run-2\"",
            "free run",
            "\"hidden\":true",
        ] {
            assert!(page.contains(text), "{text}");
        }
        assert!(!page.contains("Faults of the log"));
        assert!(!page.contains("https://") && !page.contains("http://"));
    }

    #[test]
    fn faults_stand_in_a_box() {
        let mut comparison = comparison(friction_runs(1, 50));
        comparison.faults.push(Fault {
            kind: FaultKind::DeadSensor,
            run: String::new(),
            signal: "angular_velocity".into(),
            detail: "never moves <although> it should".into(),
        });
        let page = comparison_page(&context(), &comparison);
        assert!(page.contains(
            "<li class=\"fatal\"><b>fault</b>: dead sensor <code>angular_<wbr>velocity</code>"
        ));
        assert!(page.contains("never moves &lt;although&gt; it should"));
    }

    #[test]
    fn nasty_names_do_not_break_out() {
        let nasty = "</script><img src=x onerror=alert(1)>\"";
        let mut runs = friction_runs(2, 20);
        runs[0].name = nasty.into();
        for run in &mut runs {
            run.signals[0].id = nasty.into();
            run.signals[0].unit = nasty.into();
            run.inputs[0].0 = nasty.into();
        }
        let mut comparison = comparison(runs);
        comparison.signals[0].id = nasty.into();
        comparison.signals[0].unit = nasty.into();
        let page = without_library(&comparison_page(&context(), &comparison));
        assert!(!page.contains("<img"));
        assert_eq!(
            page.matches("<script").count(),
            page.matches("</script>").count()
        );
    }

    #[test]
    fn nothing_and_gaps_are_no_panic() {
        for runs in [vec![], friction_runs(1, 0), friction_runs(2, 1)] {
            assert!(comparison_page(&context(), &comparison(runs)).contains("</html>"));
        }
        let mut runs = friction_runs(1, 10);
        runs[0].signals[0].measured[3] = f64::NAN;
        runs[0].signals[1].free_run.truncate(4);
        runs[0].inputs[1].2.clear();
        assert!(opened(&comparison_page(&context(), &comparison(runs))).contains(",null,"));
    }

    #[test]
    fn a_page_is_the_same_every_time() {
        let comparison = comparison(friction_runs(2, 300));
        assert_eq!(
            comparison_page(&context(), &comparison),
            comparison_page(&context(), &comparison)
        );
    }

    #[test]
    fn long_logs_make_small_pages() {
        let comparison = comparison(friction_runs(5, 100_000));
        let page = comparison_page(&context(), &comparison);
        assert!(page.len() < 3_000_000, "{}", page.len());
        assert!(page.contains("Drawn with fewer points"));
    }
}
