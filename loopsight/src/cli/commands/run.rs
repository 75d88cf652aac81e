//! `loopsight run`.

use std::sync::{Arc, Mutex};

use super::dashboard::Dashboard;
use crate::answers::{Happened, LearnedParameter, RunAnswer};
use crate::cli::arguments::RunArguments;
use crate::cli::{files, interrupt, output};
use crate::error::Result;
use crate::words::{number, percent};
use crate::{LogTo, Loop, RunOptions, Session};

/// Events that are told at the end; the page has more, the log all.
const MOST_TOLD: usize = 20;

pub(crate) fn run(arguments: &RunArguments) -> Result<()> {
    let control = Loop::from_file(&arguments.file)?;
    let session = Session::of_model(control.model()?);
    for path in arguments.html.iter().chain(&arguments.svg) {
        files::writable(path)?;
    }
    let dashboard = Arc::new(Mutex::new(Dashboard::new()));
    let shown = Arc::clone(&dashboard);
    let log = arguments.output.clone();
    let options = RunOptions::default()
        .log(log.map_or(LogTo::AsWritten, LogTo::File))
        .series(arguments.series)
        .stopped_by("Ctrl-C")
        .cancel(&interrupt::token())
        .on_tick(move |view| {
            if let Ok(mut dashboard) = shown.lock() {
                dashboard.take(view);
            }
        });
    let answer = session.run(&control, &options);
    if let Ok(mut dashboard) = dashboard.lock() {
        let _ = dashboard.clear();
    }
    let answer = answer?;
    if let Some(path) = answer.log_written() {
        files::wrote(path);
    }
    output::answer(&answer, &text(&answer), arguments.json)?;
    if let Some(path) = &arguments.svg {
        files::save(path, &answer.svg())?;
    }
    if let Some(path) = &arguments.html {
        files::save(path, &answer.page(&output::command_line()))?;
    }
    answer.failure().map_or(Ok(()), Err)
}

fn text(run: &RunAnswer) -> String {
    let with_unit = |value: Option<f64>, unit: &str| match value {
        Some(value) => format!("{} {unit}", number(value)),
        None => "-".to_owned(),
    };
    let rows = run.tracking.iter().map(|t| {
        vec![
            t.id.clone(),
            with_unit(t.rms_error, &t.unit),
            with_unit(t.rms_error.map(|_| t.largest_error), &t.unit),
        ]
    });
    let mut text = format!(
        "{} ticks in {} s: {}\n{}\nsaturated in {} of the ticks",
        run.ticks,
        number(run.duration_s),
        run.end,
        output::table(
            &["tracking", "rms error", "largest error"],
            &rows.collect::<Vec<_>>()
        ),
        percent(run.saturated_share)
    );
    if run.stale_share > 0.0 {
        let share = percent(run.stale_share);
        text.push_str(&format!("\nstale samples in {share} of the ticks"));
    }
    if run.fallen_back_share > 0.0 {
        let share = percent(run.fallen_back_share);
        text.push_str(&format!("\nthe last good model in {share} of the ticks"));
    }
    if let Some(t) = &run.timing {
        text.push_str(&format!(
            "\nreal time: jitter {:.3} ms (rms), latest {:.3} ms, {} of {} ticks more than a period late, \
             longest tick {:.3} ms",
            1e3 * t.jitter_s,
            1e3 * t.latest_s,
            t.missed,
            run.ticks,
            1e3 * t.longest_s
        ));
    }
    if !run.estimates.is_empty() {
        text.push_str(&format!("\n\n{}", estimates_text(&run.estimates)));
    }
    if !run.innovation.is_empty() {
        let rows = run.innovation.iter().enumerate().map(|(i, s)| {
            let excited = run.excitation.get(i);
            let learned = run.learning.get(i);
            vec![
                s.id.clone(),
                with_unit(s.rms, &s.unit),
                excited.map_or_else(|| "-".to_owned(), |e| with_unit(e.rms, &e.unit)),
                learned.map_or_else(|| "-".to_owned(), |l| percent(l.taught_share)),
            ]
        });
        let head = [
            "regression",
            "innovation, rms",
            "excitation, rms",
            "taught by",
        ];
        text.push_str(&format!(
            "\n\n{}",
            output::table(&head, &rows.collect::<Vec<_>>())
        ));
        for l in run.learning.iter().filter(|l| !l.withheld_share.is_empty()) {
            let why = l.withheld_share.iter();
            let why =
                why.map(|(why, share)| format!("{} {}", why.replace('_', " "), percent(*share)));
            let why: Vec<String> = why.collect();
            text.push_str(&format!("\n{} was not taught: {}", l.id, why.join(", ")));
        }
    }
    if !run.events.is_empty() {
        text.push_str(&format!("\n\nevents\n{}", events_text(&run.events)));
    }
    if !run.notes.is_empty() {
        text.push('\n');
    }
    for note in &run.notes {
        text.push_str(&format!("\n{note}"));
    }
    text
}

/// A line for each thing that happened; what happened again and again is told once.
fn events_text(events: &[Happened]) -> String {
    let mut told: Vec<(&Happened, usize, f64)> = Vec::new();
    for event in events {
        match told
            .iter_mut()
            .find(|(first, _, _)| first.what == event.what)
        {
            Some((_, times, last)) => {
                *times += 1;
                *last = event.time_s;
            }
            None => told.push((event, 1, event.time_s)),
        }
    }
    let mut lines: Vec<String> = told
        .iter()
        .take(MOST_TOLD)
        .map(|(event, times, last)| {
            let again = match times {
                1 => String::new(),
                _ => format!(" ({times} times, the last at {last:.3} s)"),
            };
            format!("  {:>9.3} s  {}{again}", event.time_s, event.what)
        })
        .collect();
    if let Some(more) = told.len().checked_sub(MOST_TOLD).filter(|more| *more > 0) {
        lines.push(format!("  and {more} more, see the log"));
    }
    lines.join("\n")
}

fn estimates_text(estimates: &[LearnedParameter]) -> String {
    let rows: Vec<Vec<String>> = estimates
        .iter()
        .map(|p| {
            vec![
                p.name.clone(),
                number(p.start),
                number(p.value),
                p.interval95.map_or_else(
                    || "-".to_owned(),
                    |[low, high]| format!("{} … {}", number(low), number(high)),
                ),
                p.unit.clone(),
            ]
        })
        .collect();
    let head = [
        "identified",
        "start",
        "value",
        "95 % in white noise",
        "unit",
    ];
    output::table(&head, &rows)
}
