//! What [`Session::run`](crate::Session::run) answers.

use std::collections::BTreeMap;
use std::path::PathBuf;

use loopsight_diagnosis::tracking::step_responses;
use loopsight_recordings::output::Written;
use loopsight_report::{InnovationTrace, LoopRecord};
use serde::Serialize;

use super::Answer;
use super::run_parts::{
    Happened, LearnedParameter, Learning, LoopTiming, ReferenceStep, RunSeries, Spread, Tracking,
};
use crate::about::About;
use crate::error::Error;
use crate::run::{Recorder, Sums};
use crate::words;

/// What a loop did.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct RunAnswer {
    /// `loopsight/run/1`.
    #[cfg_attr(feature = "schema", schemars(extend("const" = "loopsight/run/1")))]
    pub schema: &'static str,
    /// Ticks that were run.
    pub ticks: usize,
    /// How long it ran, s.
    pub duration_s: f64,
    /// Why it ended.
    pub end: String,
    /// It ended because something went wrong.
    pub failed: bool,
    /// Share of the ticks at which an input was saturated.
    pub saturated_share: f64,
    /// Share of the ticks whose sample was older than the tick.
    pub stale_share: f64,
    /// Share of the ticks with the last good model instead of the learned one.
    pub fallen_back_share: f64,
    /// How the controlled signals followed their references.
    pub tracking: Vec<Tracking>,
    /// Value of each parameter at the end, by name.
    #[cfg_attr(feature = "schema", schemars(with = "BTreeMap<String, Option<f64>>"))]
    pub parameters: BTreeMap<String, f64>,
    /// The parameters with their start and their intervals, in the order of the model.
    pub estimates: Vec<LearnedParameter>,
    /// What each regression did not expect.
    pub innovation: Vec<Spread>,
    /// How much the least excited direction of each regression was excited.
    pub excitation: Vec<Spread>,
    /// How often each regression was taught something.
    pub learning: Vec<Learning>,
    /// What happened when.
    pub events: Vec<Happened>,
    /// How well real time was kept; `null` where time was simulated.
    pub timing: Option<LoopTiming>,
    /// Sentences worth reading.
    pub notes: Vec<String>,
    /// The log; `null` where none was written.
    pub log: Option<PathBuf>,
    /// What it comes to, in a sentence.
    pub summary: String,
    /// Tick by tick; present where it was asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub series: Option<RunSeries>,
    #[serde(skip)]
    #[cfg_attr(feature = "schema", schemars(skip))]
    record: LoopRecord,
    #[serde(skip)]
    #[cfg_attr(feature = "schema", schemars(skip))]
    about: About,
    #[serde(skip)]
    #[cfg_attr(feature = "schema", schemars(skip))]
    written: Option<Written>,
}

/// Standard normal quantile of a 95 % interval.
const WITHIN_95: f64 = 1.959_963_985;

impl Answer for RunAnswer {
    const SCHEMA: &'static str = "loopsight/run/1";
}

impl RunAnswer {
    pub(crate) fn new(
        recorder: Recorder,
        failed: bool,
        notes: &[String],
        about: About,
        (log, written): (Option<PathBuf>, Option<Written>),
        with_series: bool,
    ) -> Self {
        let record = &recorder.record;
        let ticks = record.ticks();
        let share = |n: usize| n as f64 / ticks.max(1) as f64;
        let tracking: Vec<Tracking> = record
            .controlled
            .iter()
            .zip(&recorder.errors)
            .map(|(trace, sums)| Tracking {
                id: trace.id.clone(),
                unit: trace.unit.clone(),
                rms_error: sums.rms(),
                largest_error: sums.largest,
                steps: step_responses(&record.time, &trace.reference, &trace.measured)
                    .iter()
                    .map(ReferenceStep::from)
                    .collect(),
            })
            .collect();
        let mut notes = notes.to_vec();
        notes.extend(tracking.iter().filter_map(words::reached));
        notes.extend(record.notes.iter().cloned());
        let learning = record.innovations.iter().zip(&recorder.withheld);
        let events = record.events.iter().map(|(time, what)| Happened {
            time_s: *time,
            what: what.clone(),
        });
        let mut this = Self {
            schema: Self::SCHEMA,
            ticks,
            duration_s: ticks as f64 * record.period_s,
            end: record.end.clone(),
            failed,
            saturated_share: share(recorder.saturated),
            stale_share: share(recorder.stale),
            fallen_back_share: share(recorder.fallen),
            tracking,
            parameters: record
                .parameters
                .iter()
                .zip(&recorder.estimates)
                .map(|(p, value)| (p.name.clone(), *value))
                .collect(),
            estimates: estimates(&recorder),
            innovation: spreads(&record.innovations, &recorder.innovations),
            excitation: spreads(&record.excitations, &recorder.excitations),
            learning: learning
                .map(|(trace, why)| Learning {
                    id: trace.id.clone(),
                    taught_share: share(ticks - why.values().sum::<usize>()),
                    withheld_share: why.iter().map(|(why, n)| (*why, share(*n))).collect(),
                })
                .collect(),
            events: events.collect(),
            timing: record.timing.map(|t| LoopTiming {
                jitter_s: t.jitter_s,
                latest_s: t.latest_s,
                missed: t.missed,
                longest_s: t.longest_s,
            }),
            log,
            summary: String::new(),
            series: with_series.then(|| RunSeries::new(record)),
            record: LoopRecord {
                notes: notes.clone(),
                ..recorder.record
            },
            notes,
            about,
            written,
        };
        this.summary = words::run(&this);
        this
    }

    /// The error that ended the loop, where one did.
    pub fn failure(&self) -> Option<Error> {
        self.failed.then(|| Error::work(self.end.clone()))
    }

    /// The log that was written, and whether it replaced one.
    pub fn log_written(&self) -> Option<&Written> {
        self.written.as_ref()
    }

    fn title(&self) -> String {
        let about = &self.about;
        about.title.as_ref().unwrap_or(&about.model_name).clone()
    }

    /// A page with pictures (HTML) that opens offline; `command` stands at its foot and may be empty.
    pub fn page(&self, command: &str) -> String {
        let mut context = self.about.context(self.title(), command);
        context.log_file = self
            .log
            .as_ref()
            .map_or_else(String::new, |log| log.display().to_string());
        loopsight_report::run_page(&context, &self.record)
    }

    /// A picture (SVG) for a text.
    pub fn svg(&self) -> String {
        let figure = loopsight_report::run_figure(&self.title(), &self.record);
        loopsight_report::figure_svg(&figure)
    }
}

fn spreads(traces: &[InnovationTrace], sums: &[Sums]) -> Vec<Spread> {
    let pairs = traces.iter().zip(sums);
    let of = pairs.map(|(trace, sums)| Spread {
        id: trace.id.clone(),
        unit: trace.unit.clone(),
        rms: sums.rms(),
        last: sums.last,
    });
    of.collect()
}

fn estimates(recorder: &Recorder) -> Vec<LearnedParameter> {
    let names = recorder.record.parameters.iter();
    let numbers = recorder.starts.iter().zip(&recorder.estimates);
    names
        .zip(numbers.zip(&recorder.deviations))
        .map(|(p, ((start, value), deviation))| {
            let std_error = Some(*deviation).filter(|s| s.is_finite());
            LearnedParameter {
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
