//! What a loop did.

use loopsight_diagnosis::tracking::StepResponse;

use super::number::{hundredths, number, quantity, rounded};
use super::table::table;
use crate::record::{LoopRecord, Timing};

/// Events that a terminal shows; the page has more, the log all.
const MOST_EVENTS: usize = 20;

/// The figures of a run that sentences and tables are made of.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RunFigures<'a> {
    /// Ticks that were run.
    pub ticks: usize,
    /// Period of the loop, s.
    pub period_s: f64,
    /// Why it ended; may be empty.
    pub end: &'a str,
    /// Share of the ticks at which the controller wanted more than it could get.
    pub saturated: f64,
    /// Share of the ticks whose sample was older than the tick.
    pub stale: f64,
    /// Share of the ticks with the last good model instead of the learned one.
    pub fallen_back: f64,
    /// How well real time was kept; `None` where time was simulated.
    pub timing: Option<Timing>,
    /// The signals under control.
    pub tracking: Vec<Tracked<'a>>,
    /// The parameters that were learned.
    pub learned: Vec<Learned<'a>>,
    /// The regressions that they were learned from.
    pub regressions: Vec<RegressionFigures<'a>>,
    /// What happened when, s.
    pub events: Vec<(f64, &'a str)>,
    /// Sentences that belong to the run.
    pub notes: &'a [String],
}

/// How a signal followed its reference.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tracked<'a> {
    /// The signal.
    pub id: &'a str,
    /// Its unit.
    pub unit: &'a str,
    /// Root mean square of its error; `None` of nothing.
    pub rms_error: Option<f64>,
    /// Largest magnitude of its error.
    pub largest_error: f64,
}

/// A parameter at the end of a run.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Learned<'a> {
    /// Its name.
    pub name: &'a str,
    /// Its unit.
    pub unit: &'a str,
    /// Its value in the model file.
    pub start: f64,
    /// Its value at the end.
    pub value: f64,
    /// Interval that contains the true value with 95 % confidence if the noise is white; `None` where nothing
    /// was learned.
    pub interval95: Option<[f64; 2]>,
}

/// What a regression learned from.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RegressionFigures<'a> {
    /// Its output.
    pub id: &'a str,
    /// Unit of its output.
    pub unit: &'a str,
    /// Root mean square of the innovation; `None` of nothing.
    pub innovation_rms: Option<f64>,
    /// Root mean square of the excitation along its least excited direction; `None` of nothing.
    pub excitation_rms: Option<f64>,
    /// Share of the ticks from which something was learned.
    pub learned: f64,
    /// Shares of the ticks from which nothing was learned, by the reason's id.
    pub withheld: Vec<(&'a str, f64)>,
}

impl<'a> From<&'a LoopRecord> for RunFigures<'a> {
    /// The figures that the ticks of a record tell.
    fn from(record: &'a LoopRecord) -> Self {
        let share = |flags: &[bool]| {
            let set = flags.iter().take(record.time.len()).filter(|set| **set);
            set.count() as f64 / record.time.len().max(1) as f64
        };
        Self {
            ticks: record.ticks(),
            period_s: record.period_s,
            end: &record.end,
            saturated: share(&record.saturated),
            stale: share(&record.stale),
            fallen_back: share(&record.fallen),
            timing: record.timing,
            notes: &record.notes,
            ..Self::default()
        }
    }
}

/// What a run comes to, sentence by sentence.
pub fn summary(run: &RunFigures) -> Vec<String> {
    let mut said = vec![ended(run)];
    said.extend(course(run));
    said
}

/// How long it ran, and why it ended.
fn ended(run: &RunFigures) -> String {
    let ran = if run.ticks == 0 {
        "The loop did not complete a single tick.".to_owned()
    } else {
        format!(
            "The loop ran {} ticks of {}, {} in all.",
            run.ticks,
            quantity(&number(1e3 * run.period_s), "ms"),
            quantity(&number(run.ticks as f64 * run.period_s), "s")
        )
    };
    let end = run.end.trim().trim_end_matches('.');
    if end.is_empty() {
        ran
    } else {
        format!("{ran} It ended: {end}.")
    }
}

/// What went on meanwhile.
fn course(run: &RunFigures) -> Vec<String> {
    if run.ticks == 0 {
        return Vec::new();
    }
    let mut said = Vec::new();
    let mut share = |share: f64, what: &str| {
        if share > 0.0 {
            said.push(format!("{what} in {} of the ticks.", hundredths(share)));
        }
    };
    share(run.saturated, "An input was saturated");
    share(run.stale, "The sample was stale");
    share(
        run.fallen_back,
        "The controller had the last good model instead of the learned one",
    );
    if run.saturated <= 0.0 {
        said.insert(0, "No input was ever saturated.".to_owned());
    }
    said.extend(
        run.timing
            .as_ref()
            .map(|timing| kept_time(timing, run.ticks)),
    );
    said
}

/// How well real time was kept.
fn kept_time(timing: &Timing, ticks: usize) -> String {
    let ms = |seconds: f64| quantity(&rounded(1e3 * seconds, 3), "ms");
    format!(
        "Real time: jitter {} (rms), latest tick {} late, {} of {ticks} ticks more than a period late, longest \
         tick {}.",
        ms(timing.jitter_s),
        ms(timing.latest_s),
        timing.missed,
        ms(timing.longest_s)
    )
}

/// How the signal `id` followed the steps of its reference; `None` where it had none.
pub fn followed_steps(id: &str, steps: &[StepResponse]) -> Option<String> {
    if steps.is_empty() {
        return None;
    }
    let settled: Vec<f64> = steps.iter().filter_map(|s| s.settling_time_s).collect();
    let overshoot = steps.iter().map(|s| s.overshoot_percent).collect();
    Some(format!(
        "{id}: {} of {} steps settled within 2 %{}; overshoot {:.1} % (median)",
        settled.len(),
        steps.len(),
        median(settled).map_or_else(String::new, |m| format!(", after {m:.3} s (median)")),
        median(overshoot).unwrap_or(f64::NAN)
    ))
}

/// A run for a terminal.
pub fn text(run: &RunFigures) -> String {
    let mut text = ended(run);
    if !run.tracking.is_empty() {
        text.push_str(&format!("\n{}", tracking(&run.tracking)));
    }
    for sentence in course(run) {
        text.push_str(&format!("\n{sentence}"));
    }
    if !run.learned.is_empty() {
        text.push_str(&format!("\n\n{}", learned(&run.learned)));
    }
    if !run.regressions.is_empty() {
        text.push_str(&format!("\n\n{}", regressions(&run.regressions)));
    }
    if !run.events.is_empty() {
        text.push_str(&format!("\n\nevents\n{}", events(&run.events)));
    }
    if !run.notes.is_empty() {
        text.push('\n');
    }
    for note in run.notes {
        text.push_str(&format!("\n{note}"));
    }
    text
}

fn with_unit(value: Option<f64>, unit: &str) -> String {
    value.map_or_else(|| "-".to_owned(), |v| format!("{} {unit}", number(v)))
}

fn tracking(tracking: &[Tracked]) -> String {
    let rows: Vec<Vec<String>> = tracking
        .iter()
        .map(|t| {
            vec![
                t.id.to_owned(),
                with_unit(t.rms_error, t.unit),
                with_unit(t.rms_error.map(|_| t.largest_error), t.unit),
            ]
        })
        .collect();
    table(&["tracking", "rms error", "largest error"], &rows)
}

fn learned(learned: &[Learned]) -> String {
    let rows: Vec<Vec<String>> = learned
        .iter()
        .map(|p| {
            let interval = p.interval95.map_or_else(
                || "-".to_owned(),
                |[low, high]| format!("{} … {}", number(low), number(high)),
            );
            vec![
                p.name.to_owned(),
                number(p.start),
                number(p.value),
                interval,
                p.unit.to_owned(),
            ]
        })
        .collect();
    let head = ["learned", "start", "value", "95 % in white noise", "unit"];
    table(&head, &rows)
}

fn regressions(regressions: &[RegressionFigures]) -> String {
    let rows: Vec<Vec<String>> = regressions
        .iter()
        .map(|r| {
            vec![
                r.id.to_owned(),
                with_unit(r.innovation_rms, r.unit),
                with_unit(r.excitation_rms, r.unit),
                hundredths(r.learned),
            ]
        })
        .collect();
    let head = [
        "regression",
        "innovation, rms",
        "excitation, rms",
        "ticks learned from",
    ];
    let mut text = table(&head, &rows);
    for r in regressions.iter().filter(|r| !r.withheld.is_empty()) {
        let why: Vec<String> = r
            .withheld
            .iter()
            .map(|(id, share)| format!("{} {}", withheld(id), hundredths(*share)))
            .collect();
        let all = r.withheld.iter().map(|w| w.1).sum();
        text.push_str(&format!(
            "\n{} learned nothing from {} of the ticks: {}",
            r.id,
            hundredths(all),
            why.join(", ")
        ));
    }
    text
}

/// Why nothing was learned, by the reason's id.
fn withheld(id: &str) -> String {
    match id {
        "no_regressor" => "too few samples yet".to_owned(),
        "stale" => "stale sample".to_owned(),
        "saturated" => "saturated input".to_owned(),
        "held_command" => "safe command in place of the controller's".to_owned(),
        "not_finite" => "not a finite number".to_owned(),
        "dead_zone" => "innovation within the dead zone".to_owned(),
        "unexcited" => "no excitation".to_owned(),
        other => other.replace('_', " "),
    }
}

/// A line for each thing that happened; what happened again and again is told once.
fn events(events: &[(f64, &str)]) -> String {
    let mut told: Vec<(f64, &str, usize, f64)> = Vec::new();
    for (time, what) in events {
        match told.iter_mut().find(|(_, first, _, _)| first == what) {
            Some((_, _, times, last)) => {
                *times += 1;
                *last = *time;
            }
            None => told.push((*time, what, 1, *time)),
        }
    }
    let mut lines: Vec<String> = told
        .iter()
        .take(MOST_EVENTS)
        .map(|(first, what, times, last)| {
            let again = match times {
                1 => String::new(),
                _ => format!(" ({times} times, the last at {last:.3} s)"),
            };
            format!("  {first:>9.3} s  {what}{again}")
        })
        .collect();
    if let Some(more) = told.len().checked_sub(MOST_EVENTS).filter(|more| *more > 0) {
        lines.push(format!("  and {more} more, see the log"));
    }
    lines.join("\n")
}

fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures::loop_record;

    #[test]
    fn a_run_says_how_long_why_and_what_went_on() {
        let mut record = loop_record(1000);
        record.saturated = (0..1000).map(|k| k % 25 == 0).collect();
        record.stale = (0..1000).map(|k| k % 20 == 0).collect();
        record.fallen = (0..1000).map(|k| k >= 900).collect();
        record.timing = Some(Timing {
            jitter_s: 123e-6,
            latest_s: 0.0042,
            missed: 3,
            longest_s: 0.001,
        });
        assert_eq!(
            summary(&RunFigures::from(&record)),
            [
                "The loop ran 1000 ticks of 10 ms, 10 s in all. It ended: the reference ended.",
                "An input was saturated in 4.00 % of the ticks.",
                "The sample was stale in 5.00 % of the ticks.",
                "The controller had the last good model instead of the learned one in 10.00 % of the ticks.",
                "Real time: jitter 0.123 ms (rms), latest tick 4.20 ms late, 3 of 1000 ticks more than a period \
                 late, longest tick 1.00 ms.",
            ]
        );
        record.saturated.clear();
        assert_eq!(
            summary(&RunFigures::from(&record))[1],
            "No input was ever saturated."
        );
        assert_eq!(
            summary(&RunFigures::from(&LoopRecord::default())),
            ["The loop did not complete a single tick."]
        );
    }

    #[test]
    fn the_text_has_tables_reasons_and_events() {
        let events = (0..30).map(|k| (f64::from(k), if k < 10 { "again" } else { "x" }));
        let names: Vec<String> = (0..22).map(|k| format!("event {k}")).collect();
        let run = RunFigures {
            ticks: 100,
            period_s: 0.01,
            tracking: vec![Tracked {
                id: "speed",
                unit: "m/s",
                rms_error: Some(0.01),
                largest_error: 0.2,
            }],
            learned: vec![Learned {
                name: "K_A",
                unit: "1/s",
                start: -10.0,
                value: -12.5,
                interval95: Some([-13.0, -12.0]),
            }],
            regressions: vec![RegressionFigures {
                id: "speed",
                unit: "m/s^2",
                innovation_rms: Some(0.3),
                learned: 0.9,
                withheld: vec![("no_regressor", 0.04), ("unexcited", 0.06)],
                ..RegressionFigures::default()
            }],
            events: events
                .chain(names.iter().map(|name| (40.0, name.as_str())))
                .collect(),
            ..RunFigures::default()
        };
        let text = text(&run);
        let columns: Vec<&str> = text.split(' ').filter(|word| !word.is_empty()).collect();
        assert!(
            columns.join(" ").contains("K_A -10 -12.5 -13 … -12 1/s\n"),
            "{text}"
        );
        for line in [
            "  speed      0.01 m/s        0.2 m/s\n",
            "speed learned nothing from 10.00 % of the ticks: too few samples yet 4.00 %, no excitation 6.00 %\n",
            "      0.000 s  again (10 times, the last at 9.000 s)\n",
            "  and 4 more, see the log",
        ] {
            assert!(text.contains(line), "{line}\n{text}");
        }
    }

    #[test]
    fn steps_are_summed_up() {
        let step = |settling_time_s, overshoot_percent| StepResponse {
            at_s: 0.0,
            from: 0.0,
            to: 1.0,
            settling_time_s,
            overshoot_percent,
        };
        assert_eq!(followed_steps("speed", &[]), None);
        assert_eq!(
            followed_steps("speed", &[step(Some(0.5), 10.0), step(None, 12.0)]).unwrap(),
            "speed: 1 of 2 steps settled within 2 %, after 0.500 s (median); overshoot 12.0 % (median)"
        );
    }
}
