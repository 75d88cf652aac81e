//! What a run came to: as JSON, and in words.

use std::collections::BTreeMap;
use std::path::PathBuf;

use loopsight_diagnosis::tracking::{StepResponse, step_responses};
use serde::Serialize;

use super::recorder::{Recorder, Sums};
use crate::cli::output;

/// Events that are told at the end; the page has more, the log all.
const MOST_TOLD: usize = 20;

/// What `--json` says of a run.
#[derive(Serialize)]
pub(super) struct Summary {
    ticks: usize,
    duration_s: f64,
    end: String,
    saturated_share: f64,
    stale_share: f64,
    fallen_back_share: f64,
    tracking: Vec<Tracking>,
    /// Value of each parameter at the end, by name.
    parameters: BTreeMap<String, f64>,
    estimates: Vec<Estimate>,
    innovation: Vec<Spread>,
    excitation: Vec<Spread>,
    learning: Vec<Learning>,
    events: Vec<Happened>,
    timing: Option<Kept>,
    pub(super) notes: Vec<String>,
    pub(super) log: Option<PathBuf>,
}

#[derive(Serialize)]
struct Tracking {
    id: String,
    unit: String,
    rms_error: Option<f64>,
    largest_error: f64,
    steps: Vec<StepResponse>,
}

/// A parameter at the end of a run.
#[derive(Serialize)]
struct Estimate {
    name: String,
    unit: String,
    start: f64,
    value: f64,
    std_error: Option<f64>,
    interval95: Option<[f64; 2]>,
}

/// How large something of a regression was.
#[derive(Serialize)]
struct Spread {
    id: String,
    unit: String,
    rms: Option<f64>,
    last: f64,
}

/// How often a regression was taught something, and why not at the other ticks.
#[derive(Serialize)]
struct Learning {
    id: String,
    taught_share: f64,
    withheld_share: BTreeMap<&'static str, f64>,
}

#[derive(Serialize)]
struct Happened {
    time_s: f64,
    what: String,
}

#[derive(Serialize)]
struct Kept {
    jitter_s: f64,
    latest_s: f64,
    missed: usize,
    longest_s: f64,
}

/// Standard normal quantile of a 95 % interval.
const WITHIN_95: f64 = 1.959_963_985;

impl Summary {
    pub(super) fn new(recorder: &Recorder, log: Option<PathBuf>) -> Self {
        let record = &recorder.record;
        let ticks = record.ticks();
        let share = |n: usize| n as f64 / ticks.max(1) as f64;
        let tracking = record.controlled.iter().zip(&recorder.errors);
        let spreads = |traces: &[loopsight_report::InnovationTrace], sums: &[Sums]| {
            let pairs = traces.iter().zip(sums);
            let of = pairs.map(|(trace, sums)| Spread {
                id: trace.id.clone(),
                unit: trace.unit.clone(),
                rms: sums.rms(),
                last: sums.last,
            });
            of.collect::<Vec<_>>()
        };
        Self {
            ticks,
            duration_s: ticks as f64 * record.period_s,
            end: record.end.clone(),
            saturated_share: share(recorder.saturated),
            stale_share: share(recorder.stale),
            fallen_back_share: share(recorder.fallen),
            tracking: tracking
                .map(|(trace, sums)| Tracking {
                    id: trace.id.clone(),
                    unit: trace.unit.clone(),
                    rms_error: sums.rms(),
                    largest_error: sums.largest,
                    steps: step_responses(&record.time, &trace.reference, &trace.measured),
                })
                .collect(),
            parameters: record
                .parameters
                .iter()
                .zip(&recorder.estimates)
                .map(|(p, value)| (p.name.clone(), *value))
                .collect(),
            estimates: estimates(recorder),
            innovation: spreads(&record.innovations, &recorder.innovations),
            excitation: spreads(&record.excitations, &recorder.excitations),
            learning: record
                .innovations
                .iter()
                .zip(&recorder.withheld)
                .map(|(trace, why)| Learning {
                    id: trace.id.clone(),
                    taught_share: share(ticks - why.values().sum::<usize>()),
                    withheld_share: why.iter().map(|(why, n)| (*why, share(*n))).collect(),
                })
                .collect(),
            events: record
                .events
                .iter()
                .map(|(time, what)| Happened {
                    time_s: *time,
                    what: what.clone(),
                })
                .collect(),
            timing: record.timing.map(|t| Kept {
                jitter_s: t.jitter_s,
                latest_s: t.latest_s,
                missed: t.missed,
                longest_s: t.longest_s,
            }),
            notes: Vec::new(),
            log,
        }
    }

    /// What the step responses reached, in words.
    pub(super) fn reached(&self) -> Vec<String> {
        self.tracking
            .iter()
            .filter_map(|t| {
                let settled: Vec<f64> = t.steps.iter().filter_map(|s| s.settling_time_s).collect();
                if t.steps.is_empty() {
                    return None;
                }
                let overshoot: Vec<f64> = t.steps.iter().map(|s| s.overshoot_percent).collect();
                Some(format!(
                    "{}: {} of {} steps came to stay within 2 %{}; overshoot {:.1} % (median)",
                    t.id,
                    settled.len(),
                    t.steps.len(),
                    median(settled)
                        .map_or_else(String::new, |m| format!(", after {m:.3} s (median)")),
                    median(overshoot).unwrap_or(f64::NAN)
                ))
            })
            .collect()
    }

    /// For people.
    pub(super) fn text(&self) -> String {
        let with_unit = |value: Option<f64>, unit: &str| match value {
            Some(value) => format!("{} {unit}", output::number(value)),
            None => "-".to_owned(),
        };
        let rows = self.tracking.iter().map(|t| {
            vec![
                t.id.clone(),
                with_unit(t.rms_error, &t.unit),
                with_unit(t.rms_error.map(|_| t.largest_error), &t.unit),
            ]
        });
        let mut text = format!(
            "{} ticks in {} s: {}\n{}\nsaturated in {} of the ticks",
            self.ticks,
            output::number(self.duration_s),
            self.end,
            output::table(
                &["tracking", "rms error", "largest error"],
                &rows.collect::<Vec<_>>()
            ),
            output::percent(self.saturated_share)
        );
        if self.stale_share > 0.0 {
            let share = output::percent(self.stale_share);
            text.push_str(&format!("\nstale samples in {share} of the ticks"));
        }
        if self.fallen_back_share > 0.0 {
            let share = output::percent(self.fallen_back_share);
            text.push_str(&format!("\nthe last good model in {share} of the ticks"));
        }
        if let Some(t) = &self.timing {
            text.push_str(&format!(
                "\nreal time: jitter {:.3} ms (rms), latest {:.3} ms, {} of {} ticks more than a period late, \
                 longest tick {:.3} ms",
                1e3 * t.jitter_s,
                1e3 * t.latest_s,
                t.missed,
                self.ticks,
                1e3 * t.longest_s
            ));
        }
        if !self.estimates.is_empty() {
            text.push_str(&format!("\n\n{}", self.estimates_text()));
        }
        if !self.innovation.is_empty() {
            let rows = self.innovation.iter().enumerate().map(|(i, s)| {
                let excited = self.excitation.get(i);
                let learned = self.learning.get(i);
                vec![
                    s.id.clone(),
                    with_unit(s.rms, &s.unit),
                    excited.map_or_else(|| "-".to_owned(), |e| with_unit(e.rms, &e.unit)),
                    learned.map_or_else(|| "-".to_owned(), |l| output::percent(l.taught_share)),
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
            for l in self
                .learning
                .iter()
                .filter(|l| !l.withheld_share.is_empty())
            {
                let why = l.withheld_share.iter();
                let why = why.map(|(why, share)| {
                    format!("{} {}", why.replace('_', " "), output::percent(*share))
                });
                let why: Vec<String> = why.collect();
                text.push_str(&format!("\n{} was not taught: {}", l.id, why.join(", ")));
            }
        }
        if !self.events.is_empty() {
            text.push_str(&format!("\n\nevents\n{}", self.events_text()));
        }
        if !self.notes.is_empty() {
            text.push('\n');
        }
        for note in &self.notes {
            text.push_str(&format!("\n{note}"));
        }
        text
    }

    /// A line for each thing that happened; what happened again and again is told once.
    fn events_text(&self) -> String {
        let mut told: Vec<(&Happened, usize, f64)> = Vec::new();
        for event in &self.events {
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

    fn estimates_text(&self) -> String {
        let rows: Vec<Vec<String>> = self
            .estimates
            .iter()
            .map(|p| {
                vec![
                    p.name.clone(),
                    output::number(p.start),
                    output::number(p.value),
                    p.interval95.map_or_else(
                        || "-".to_owned(),
                        |[low, high]| format!("{} … {}", output::number(low), output::number(high)),
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
}

fn estimates(recorder: &Recorder) -> Vec<Estimate> {
    let names = recorder.record.parameters.iter();
    let numbers = recorder.starts.iter().zip(&recorder.estimates);
    names
        .zip(numbers.zip(&recorder.deviations))
        .map(|(p, ((start, value), deviation))| {
            let std_error = Some(*deviation).filter(|s| s.is_finite());
            Estimate {
                name: p.name.clone(),
                unit: p.unit.clone(),
                start: *start,
                value: *value,
                std_error,
                interval95: std_error.map(|s| [value - WITHIN_95 * s, value + WITHIN_95 * s]),
            }
        })
        .collect()
}

fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}
