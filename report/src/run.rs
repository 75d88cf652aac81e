//! The page of a loop at work.

use crate::chart::{Chart, Role};
use crate::comparison::HOW_TO_LOOK;
use crate::errors::rms;
use crate::html::{identifier, list, table, text};
use crate::numbers::axis;
use crate::page::{Context, page, section};
use crate::record::LoopRecord;
use crate::words::run::{RunFigures, summary};
use crate::words::{quantity, rounded};

/// Lines for events; more would hide the traces.
const MOST_EVENTS: usize = 60;

/// The page of a control loop: references, measurements and the response that the design promises, the inputs
/// with saturation, what the estimator learned, and what happened.
pub fn run_page(context: &Context, record: &LoopRecord) -> String {
    let mut said = summary(&RunFigures::from(record));
    if record.every > 1 {
        said.push(format!(
            "The run is long: one in {} ticks is shown here, the log has them all.",
            record.every
        ));
    }
    let mut body = format!("<p class=\"verdict\">{}</p>\n", text(&said.join(" ")));
    body.push_str(&list(&record.notes));
    body.push_str(&scores(record));
    if !record.time.is_empty() {
        body.push_str(&section(
            "Over time",
            &format!("{HOW_TO_LOOK} Shaded: an input was saturated."),
            &over_time(record).html(),
        ));
    }
    body.push_str(&events(record));
    let learns = !record.parameters.is_empty() || !record.innovations.is_empty();
    if learns && !record.time.is_empty() {
        body.push_str(&section(
            "What the estimator learned",
            &learned(record),
            &estimator(record).html(),
        ));
    }
    page(context, &body)
}

/// What stands above the estimator's charts.
fn learned(record: &LoopRecord) -> String {
    let mut said = vec!["The parameters that were learned".to_owned()];
    if record.parameters.iter().any(|p| p.std.is_some()) {
        said[0].push_str(", with a band of ± 2 standard deviations");
    }
    said[0].push('.');
    if record.fallen.contains(&true) {
        said.push(
            "Shaded: the controller had the last good model instead of the learned one.".into(),
        );
    }
    if !record.innovations.is_empty() {
        said.push(
            "Below them the innovation: the measurement minus what the estimator expected.".into(),
        );
    }
    if !record.excitations.is_empty() {
        said.push(
            "Then the excitation of the direction that is excited least. Near zero nothing can be learned along it."
                .into(),
        );
    }
    said.push("Wild first guesses may be out of sight: double-click to see everything.".into());
    said.join(" ")
}

fn difference(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a - b).collect()
}

/// How far each signal was from its reference and from the promised response.
fn scores(record: &LoopRecord) -> String {
    if record.controlled.is_empty() {
        return String::new();
    }
    let ideal = record.controlled.iter().any(|c| c.ideal.is_some());
    let rows: Vec<Vec<String>> = record
        .controlled
        .iter()
        .map(|c| {
            let error = |of: &[f64]| {
                text(&quantity(
                    &rounded(rms(difference(of, &c.measured)), 3),
                    &c.unit,
                ))
            };
            let largest = difference(&c.reference, &c.measured);
            let largest = largest.iter().filter(|e| e.is_finite());
            let largest = largest.fold(0.0_f64, |most, e| most.max(e.abs()));
            let mut row = vec![
                identifier(&c.id),
                error(&c.reference),
                text(&quantity(&rounded(largest, 3), &c.unit)),
            ];
            if ideal {
                row.push(c.ideal.as_deref().map_or_else(|| "–".into(), error));
            }
            row
        })
        .collect();
    let header = [
        "signal",
        "rms error",
        "largest error",
        "rms difference from the ideal response",
    ];
    table(
        &header[..if ideal { 4 } else { 3 }],
        &[false, true, true, true],
        &rows,
    )
}

fn over_time(record: &LoopRecord) -> Chart {
    let mut chart = Chart::over_time(&record.time);
    for c in &record.controlled {
        chart.panel_of(&c.id, axis(&c.id, &c.unit), 200);
        chart.line("measured", Role::Measured, &c.measured);
        if let Some(ideal) = &c.ideal {
            chart.line("ideal response", Role::Model, ideal);
        }
        if let Some(trace) = chart.line("reference", Role::Reference, &c.reference) {
            trace.step = true;
        }
        let title = axis(&format!("tracking error of {}", c.id), &c.unit);
        chart.panel_of(&c.id, title, 110);
        chart.line(
            "tracking error",
            Role::Residual,
            &difference(&c.reference, &c.measured),
        );
    }
    for input in &record.inputs {
        chart.panel_of(&input.id, axis(&input.id, &input.unit), 120);
        let applied = if input.applied.is_empty() {
            &input.commanded
        } else {
            &input.applied
        };
        for (name, role, values) in [
            ("commanded", Role::Commanded, &input.commanded),
            ("applied", Role::Series, applied),
        ] {
            if let Some(trace) = chart.line(name, role, values) {
                trace.step = true;
            }
        }
        chart.shade(&record.saturated);
    }
    chart.events = record
        .events
        .iter()
        .take(MOST_EVENTS)
        .map(|e| e.0)
        .collect();
    chart
}

fn estimator(record: &LoopRecord) -> Chart {
    let mut chart = Chart::over_time(&record.time);
    for p in &record.parameters {
        chart.panel_of(&p.name, axis(&p.name, &p.unit), 110);
        let two_sigma: Option<Vec<f64>> = p
            .std
            .as_ref()
            .map(|std| std.iter().map(|s| 2.0 * s).collect());
        chart.band("estimate", Role::Model, &p.values, two_sigma.as_deref());
        chart.shade(&record.fallen);
        chart.settle();
    }
    for i in &record.innovations {
        let title = axis(&format!("innovation of {}", i.id), &i.unit);
        chart.panel_of(&i.id, title, 110);
        chart.line("innovation", Role::Residual, &i.values);
        chart.settle();
    }
    for e in &record.excitations {
        let title = axis(&format!("excitation of {}", e.id), &e.unit);
        chart.panel_of(&e.id, title, 110);
        chart.line("excitation", Role::Series, &e.values);
    }
    chart.events = record
        .events
        .iter()
        .take(MOST_EVENTS)
        .map(|e| e.0)
        .collect();
    chart
}

/// The numbered lines of the charts, in words.
fn events(record: &LoopRecord) -> String {
    if record.events.is_empty() {
        return String::new();
    }
    let rows: Vec<Vec<String>> = record
        .events
        .iter()
        .take(MOST_EVENTS)
        .enumerate()
        .map(|(at, (time, what))| {
            vec![
                (at + 1).to_string(),
                text(&quantity(&format!("{time:.2}"), "s")),
                text(what),
            ]
        })
        .collect();
    let more = match record.events.len().saturating_sub(MOST_EVENTS) {
        0 => String::new(),
        more => format!("<p>And {more} more.</p>\n"),
    };
    let table = table(&["", "time", "what happened"], &[true, true, false], &rows);
    section(
        "Events",
        "The numbers are those of the lines in the charts.",
        &(table + &more),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures::{context, loop_record, opened, without_library};
    use crate::record::Timing;

    #[test]
    fn the_page_says_and_shows() {
        let record = loop_record(1000);
        let page = opened(&run_page(&context(), &record));
        for text in [
            "The loop ran 1000 ticks of 10\u{a0}ms, 10\u{a0}s in all.",
            "An input was saturated in",
            "It ended: the reference ended.",
            "Settling time asked for 0.45\u{a0}s",
            "tracking error of linear_velocity, m/s",
            "\"shaded\":[[",
            "\"spread\":[",
            "innovation of linear_velocity, m/s²",
            "estimator reset: covariance lost",
            "\"events\":[3.2,7.7]",
        ] {
            assert!(page.contains(text), "{text}");
        }
    }

    #[test]
    fn what_was_watched_over_is_said() {
        let mut record = loop_record(1000);
        record.stale = (0..1000).map(|k| k % 20 == 0).collect();
        record.fallen = (0..1000).map(|k| k >= 900).collect();
        record.excitations = record.innovations.clone();
        record.ticks = 4000;
        record.every = 4;
        record.timing = Some(Timing {
            jitter_s: 123e-6,
            latest_s: 0.0042,
            missed: 3,
            longest_s: 0.001,
        });
        let page = opened(&run_page(&context(), &record));
        for text in [
            "The loop ran 4000 ticks of 10\u{a0}ms, 40\u{a0}s in all.",
            "The sample was stale in 5.00\u{a0}% of the ticks.",
            "one in 4 ticks is shown here",
            "jitter 0.123\u{a0}ms (rms), latest tick 4.20\u{a0}ms late",
            "excitation of linear_velocity, m/s²",
            "Shaded: the controller had the last good model",
        ] {
            assert!(page.contains(text), "{text}");
        }
    }

    #[test]
    fn an_empty_record_is_a_page() {
        let page = run_page(&context(), &LoopRecord::default());
        assert!(page.contains("did not complete a single tick") && page.contains("</html>"));
    }

    #[test]
    fn series_of_any_length_are_no_panic() {
        let mut record = loop_record(100);
        record.saturated.truncate(3);
        record.controlled[0].measured.truncate(7);
        record.controlled[1].ideal = None;
        record.inputs[0].applied.clear();
        record.parameters[0].std = Some(vec![1.0]);
        record.events = (0..100)
            .map(|k| (f64::from(k), "</script>".into()))
            .collect();
        let page = run_page(&context(), &record);
        assert!(page.contains("And 40 more."));
        let page = without_library(&page);
        assert_eq!(
            page.matches("<script").count(),
            page.matches("</script>").count()
        );
    }
}
