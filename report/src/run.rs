//! The page of a loop at work.

use crate::chart::{Chart, Role};
use crate::errors::rms;
use crate::html::{escape, identifier, list, table};
use crate::numbers::{axis, percent, plain, quantity, show};
use crate::page::{Context, page, section};
use crate::record::{LoopRecord, Timing};

/// Lines for events; more would hide the traces.
const MOST_EVENTS: usize = 60;

/// The page of a closed loop: references, measurements and the response the design promises, the
/// inputs with saturation, what the estimator learned, and what happened.
pub fn run_page(context: &Context, record: &LoopRecord) -> String {
    let mut body = format!("<p class=\"verdict\">{}</p>\n", escape(&sentence(record)));
    body.push_str(&list(&record.notes));
    body.push_str(&scores(record));
    body.push_str(&section(
        "Over time",
        "Drag across a chart to zoom in, double-click to see all again; a tap on a legend entry \
         shows or hides it. Shaded: the controller wanted more than it could get.",
        &over_time(record).html(),
    ));
    body.push_str(&events(record));
    if !record.parameters.is_empty() || !record.innovations.is_empty() {
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
    let mut text = "Parameters".to_owned();
    if record.parameters.iter().any(|p| p.std.is_some()) {
        text.push_str(" with a band of ± 2 standard deviations");
    }
    if record.fallen.contains(&true) {
        text.push_str(" (shaded: the controller had the last good model instead)");
    }
    text.push_str("; below them the innovation: what each measurement told that was not expected");
    if !record.excitations.is_empty() {
        text.push_str(
            ", and the excitation of the direction that is excited least: near zero nothing can \
             be learned along it",
        );
    }
    text.push_str(". Wild first guesses may be out of sight: double-click to see all.");
    text
}

fn sentence(record: &LoopRecord) -> String {
    let n = record.time.len();
    if n == 0 {
        return with_end("The loop did not complete a single tick.".into(), record);
    }
    let ticks = record.ticks();
    let mut text = format!(
        "The loop ran for {} in {ticks} ticks of {}.",
        quantity(&plain(ticks as f64 * record.period_s), "s"),
        quantity(&plain(1000.0 * record.period_s), "ms"),
    );
    let share = |flags: &[bool]| {
        let set = flags.iter().take(n).filter(|s| **s).count();
        (set > 0).then(|| percent(set as f64 / n as f64))
    };
    text.push_str(&match share(&record.saturated) {
        None => " The inputs never saturated.".to_owned(),
        Some(share) => format!(" The inputs were saturated {share} of the time."),
    });
    if let Some(share) = share(&record.stale) {
        text.push_str(&format!(" {share} of the samples were stale."));
    }
    if let Some(share) = share(&record.fallen) {
        text.push_str(&format!(
            " The last good model took the place of the learned one {share} of the time."
        ));
    }
    if record.every > 1 {
        text.push_str(&format!(
            " It was long: one in {} ticks is kept here, all of them in the log.",
            record.every
        ));
    }
    if let Some(timing) = &record.timing {
        text.push_str(&kept_time(timing, record.period_s, ticks));
    }
    with_end(text, record)
}

/// How well real time was kept.
fn kept_time(timing: &Timing, period_s: f64, ticks: usize) -> String {
    let ms = |seconds: f64| quantity(&show(1000.0 * seconds, 3), "ms");
    let missed = match timing.missed {
        0 => "none began more than a period late".to_owned(),
        missed => format!("{missed} of {ticks} began more than a period late"),
    };
    format!(
        " Real time: the periods differed from {} by {} (rms), the latest tick began {} late, {missed}; \
         the longest took {}.",
        ms(period_s),
        ms(timing.jitter_s),
        ms(timing.latest_s),
        ms(timing.longest_s),
    )
}

fn with_end(text: String, record: &LoopRecord) -> String {
    let end = record.end.trim().trim_end_matches('.');
    if end.is_empty() {
        text
    } else {
        format!("{text} It ended: {end}.")
    }
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
                escape(&quantity(
                    &show(rms(difference(of, &c.measured)), 3),
                    &c.unit,
                ))
            };
            let largest = difference(&c.reference, &c.measured);
            let largest = largest.iter().filter(|e| e.is_finite());
            let largest = largest.fold(0.0_f64, |most, e| most.max(e.abs()));
            let mut row = vec![
                identifier(&c.id),
                error(&c.reference),
                escape(&quantity(&show(largest, 3), &c.unit)),
            ];
            if ideal {
                row.push(c.ideal.as_deref().map_or_else(|| "–".into(), error));
            }
            row
        })
        .collect();
    let header = [
        "signal",
        "from the reference (rms)",
        "largest",
        "from the ideal response (rms)",
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
        .map(|(at, (time, text))| {
            vec![
                (at + 1).to_string(),
                quantity(&format!("{time:.2}"), "s"),
                escape(text),
            ]
        })
        .collect();
    let more = match record.events.len().saturating_sub(MOST_EVENTS) {
        0 => String::new(),
        more => format!("<p>And {more} more.</p>\n"),
    };
    let table = table(&["", "time", "what happened"], &[true, true, false], &rows);
    section("Events", "Numbered lines in the charts.", &(table + &more))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures::{context, loop_record, opened, without_library};

    #[test]
    fn the_page_says_and_shows() {
        let record = loop_record(1000);
        let page = opened(&run_page(&context(), &record));
        for text in [
            "The loop ran for 10\u{a0}s in 1000 ticks of 10\u{a0}ms.",
            "The inputs were saturated",
            "It ended: the reference ended.",
            "Settling time asked for 0.45 s",
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
            "The loop ran for 40\u{a0}s in 4000 ticks of 10\u{a0}ms.",
            "% of the samples were stale",
            "took the place of the learned one 10",
            "one in 4 ticks is kept",
            "by 0.123\u{a0}ms (rms), the latest tick began 4.20\u{a0}ms late, 3 of 4000 began",
            "excitation of linear_velocity, m/s²",
            "shaded: the controller had the last good model",
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
