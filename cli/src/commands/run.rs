//! `loopsight run`.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use loopsight_core::config::{Source, read_text};
use loopsight_core::loop_file::{Composed, LoopFile};
use loopsight_core::model::Model;
use loopsight_core::registry::{BuildError, DriverContext};
use loopsight_core::supervisor::{Event, described};
use loopsight_core::{Signal, TickError};
use loopsight_diagnosis::tracking::{StepResponse, step_responses};
use loopsight_recordings::{LogWriter, header};
use loopsight_report::{
    Context, ControlledTrace, InnovationTrace, InputTrace, LoopRecord, ParameterTrace, run_page,
    save,
};
use serde::Serialize;

use crate::arguments::RunOptions;
use crate::commands::simulate::rounded;
use crate::failure::{self, Failure};
use crate::{load, output, progress};

/// What `--json` says of a run.
#[derive(Serialize)]
struct Summary {
    ticks: usize,
    duration_s: f64,
    end: String,
    saturated_share: f64,
    tracking: Vec<Tracking>,
    parameters: std::collections::BTreeMap<String, f64>,
    notes: Vec<String>,
    log: Option<PathBuf>,
}

#[derive(Serialize)]
struct Tracking {
    id: String,
    unit: String,
    rms_error: f64,
    largest_error: f64,
    steps: Vec<StepResponse>,
}

pub(crate) fn run(options: &RunOptions) -> Result<(), Failure> {
    let text = read_text(&options.file)?;
    let source = Source::parse(&options.file.display().to_string(), &text)?;
    let file = LoopFile::parse(&source)?;
    let (model, mut composed) = compose(&options.file, &source, &file)?;
    let log_path = options
        .output
        .clone()
        .or_else(|| file.log.as_ref().map(|l| beside(&options.file, l)));
    for path in log_path.iter().chain(&options.html) {
        load::writable(path)?;
    }
    let mut recorder = Recorder::new(&model, &composed, file.period_s, file.duration_s);
    let mut log = match &log_path {
        None => None,
        Some(path) => Some(
            LogWriter::create(path, &log_headers(&model, &composed))
                .map_err(|e| failure::recording(path, &e))?,
        ),
    };
    let end = drive(&file, &mut composed, &mut recorder, log.as_mut())?;
    if let Some(log) = log {
        let path = log_path.as_deref().unwrap_or(Path::new(""));
        let path = log.finish().map_err(|e| failure::recording(path, &e))?;
        output::note(&format!("wrote {}", path.display()));
    }
    let mut record = recorder.record;
    record.end = end.text.clone();
    promise(&file, &mut record);
    let tracking = tracking(&record);
    record.notes.extend(composed.notes.iter().cloned());
    record.notes.extend(reached(&tracking));
    let summary = Summary {
        ticks: record.time.len(),
        duration_s: record.time.len() as f64 * file.period_s,
        end: end.text.clone(),
        saturated_share: share(&record.saturated),
        parameters: record
            .parameters
            .iter()
            .filter_map(|p| Some((p.name.clone(), *p.values.last()?)))
            .collect(),
        tracking,
        notes: record.notes.clone(),
        log: log_path,
    };
    output::people(&summary_text(&summary, &record), options.json);
    if options.json {
        output::json(&summary)?;
    }
    if let Some(path) = &options.html {
        let title = file.name.clone().unwrap_or_else(|| model.name.clone());
        let context = Context {
            title,
            model_name: model.name.clone(),
            model_file: Some(beside(&options.file, &file.model).display().to_string()),
            log_file: summary
                .log
                .as_ref()
                .map_or_else(String::new, |l| l.display().to_string()),
            notes: Vec::new(),
            command: output::command_line(),
        };
        save(path, &run_page(&context, &record))?;
        output::note(&format!("wrote {}", path.display()));
    }
    if end.failed {
        Err(Failure::work(end.text))
    } else {
        Ok(())
    }
}

/// Puts what the design promises beside what was measured.
fn promise(file: &LoopFile, record: &mut LoopRecord) {
    let references: Vec<Vec<f64>> = record
        .controlled
        .iter()
        .map(|trace| trace.reference.clone())
        .collect();
    if let Some(ideal) = file.controller.ideal(&references, file.period_s) {
        for (trace, ideal) in record.controlled.iter_mut().zip(ideal) {
            trace.ideal = Some(ideal);
        }
    }
}

/// Most ticks of one run: beyond it a number was mistyped.
const MOST_TICKS: f64 = 1e7;

/// A path in a loop file is relative to that file.
fn beside(file: &Path, path: &str) -> PathBuf {
    file.parent()
        .map_or_else(|| PathBuf::from(path), |folder| folder.join(path))
}

/// Composes the loop of a loop file.
pub(crate) fn compose(
    path: &Path,
    source: &Source,
    file: &LoopFile,
) -> Result<(Model, Composed), Failure> {
    // Each tick is kept for the page and the summary, so this bounds memory, too.
    let ticks = file.duration_s.map_or(0.0, |d| d / file.period_s);
    if file.period_s > 0.0 && ticks > MOST_TICKS {
        let message = format!("that is {ticks:.1e} ticks, expected at most {MOST_TICKS:e}");
        return Err(source.error(&["duration_s".into()], &message, None).into());
    }
    let model_path = beside(path, &file.model);
    if !model_path.exists() {
        let message = format!("there is no model file {}", model_path.display());
        return Err(source.error(&["model".into()], &message, None).into());
    }
    let (model, _) = Model::load(&model_path)?;
    let load_model = |name: &str| {
        Model::load(&beside(path, name))
            .map(|(model, _)| model)
            .map_err(|e| BuildError::at("model", e.to_string()))
    };
    let load_runs = |name: &str, model: &Model| {
        let path = beside(path, name);
        let wrong =
            |e: &loopsight_recordings::RecordingError| BuildError::at("recording", e.to_string());
        let log = loopsight_recordings::read(&path).map_err(|e| wrong(&e))?;
        Ok(load::map(model, &log).map_err(|e| wrong(&e))?.runs)
    };
    let context = DriverContext {
        model: &model,
        period: file.period_s,
        load_model: &load_model,
        load_runs: &load_runs,
        read_column: &|name, column| load::column(&beside(path, name), column),
    };
    let composed = file.compose(source, &model, &context)?;
    Ok((model, composed))
}

/// How a run ended.
struct End {
    text: String,
    failed: bool,
}

fn drive(
    file: &LoopFile,
    composed: &mut Composed,
    recorder: &mut Recorder,
    mut log: Option<&mut LogWriter>,
) -> Result<End, Failure> {
    let stop = Arc::new(AtomicBool::new(false));
    let seen = Arc::clone(&stop);
    // A second handler (another run in the same process) is refused: the first one still stops us.
    let _ = ctrlc::set_handler(move || seen.store(true, Ordering::SeqCst));
    let ticks = file.duration_s.map_or(u64::MAX, |d| {
        (d / file.period_s + 1e-9).floor().min(1e15) as u64
    });
    let bar = progress::bar("running", if ticks == u64::MAX { 0 } else { ticks });
    let mut end = End {
        text: format!(
            "the run lasted the {} s asked for",
            output::number(ticks as f64 * file.period_s)
        ),
        failed: false,
    };
    for index in 0..ticks {
        if stop.load(Ordering::SeqCst) {
            end.text = format!("stopped by Ctrl-C at {:.2} s", index as f64 * file.period_s);
            break;
        }
        let time = index as f64 * file.period_s;
        match composed.tick(time) {
            Ok(step) => {
                recorder.push(time, &step);
                if let Some(log) = log.as_mut() {
                    log.write(recorder.row())
                        .map_err(|e| Failure::work(e.to_string()))?;
                }
            }
            Err(error) => {
                end = End {
                    failed: !error.is_end(),
                    text: match &error {
                        TickError::Driver(e) => e.to_string(),
                        TickError::Control(e) => e.to_string(),
                        TickError::Supervisor(event) => {
                            let text = recorder.words(event);
                            recorder.happened(time, text.clone());
                            text
                        }
                    },
                };
                break;
            }
        }
        recorder.learn(composed);
        if index.is_multiple_of(64) {
            bar.set_position(index);
        }
    }
    bar.finish_and_clear();
    if let Err(error) = composed.host.stop() {
        end = End {
            text: format!("the robot could not be stopped safely: {error}"),
            failed: true,
        };
    }
    Ok(end)
}

fn log_headers(model: &Model, composed: &Composed) -> Vec<String> {
    let mut headers = vec!["time_s".to_owned()];
    headers.extend(model.plant.inputs.iter().map(header));
    headers.extend(model.measured.iter().map(|m| header(m.signal)));
    headers.extend(
        composed
            .controlled
            .iter()
            .map(|s| format!("reference_{}", header(s))),
    );
    headers.push("saturated_1".to_owned());
    headers
}

/// Collects what a loop does.
struct Recorder {
    record: LoopRecord,
    row: Vec<f64>,
    names: Vec<Vec<usize>>,
    signals: Vec<Signal>,
}

/// Most events that are kept of a run.
const MOST_EVENTS: usize = 1000;

impl Recorder {
    fn new(model: &Model, composed: &Composed, period: f64, duration: Option<f64>) -> Self {
        let ticks = duration.map_or(0, |d| (d / period).min(1e7) as usize);
        let room = || Vec::with_capacity(ticks);
        let controlled = composed
            .controlled
            .iter()
            .map(|s| ControlledTrace {
                id: s.id.to_owned(),
                unit: s.unit.to_owned(),
                reference: room(),
                measured: room(),
                ideal: None,
            })
            .collect();
        let inputs = model
            .plant
            .inputs
            .iter()
            .map(|s| InputTrace {
                id: s.id.to_owned(),
                unit: s.unit.to_owned(),
                commanded: room(),
                applied: room(),
            })
            .collect();
        let mut names = Vec::new();
        let mut parameters = Vec::new();
        let mut innovations = Vec::new();
        if let Some(identification) = &composed.host.observer {
            for row in 0..identification.len() {
                names.push(identification.parameters(row).to_vec());
                for j in identification.parameters(row) {
                    parameters.push(ParameterTrace {
                        name: model.parameters[*j].name.clone(),
                        unit: model.parameters[*j].unit.clone(),
                        values: room(),
                        std: None,
                    });
                }
                let signal = composed.controlled.get(row);
                innovations.push(InnovationTrace {
                    id: signal.map_or_else(String::new, |s| s.id.to_owned()),
                    unit: signal.map_or_else(String::new, |s| match s.unit.strip_suffix("/s") {
                        Some(of) => format!("{of}/s^2"),
                        None => format!("{}/s", s.unit),
                    }),
                    values: room(),
                });
            }
        }
        Self {
            record: LoopRecord {
                period_s: period,
                time: room(),
                controlled,
                inputs,
                parameters,
                innovations,
                ..LoopRecord::default()
            },
            row: Vec::new(),
            signals: model.measured.iter().map(|m| *m.signal).collect(),
            names,
        }
    }

    /// What a supervisor did, in words.
    fn words(&self, event: &Event<f64>) -> String {
        let signals = self.signals.iter().map(|s| (s.id, s.unit));
        described(event, &signals.collect::<Vec<_>>())
    }

    fn happened(&mut self, time: f64, text: String) {
        if self.record.events.len() < MOST_EVENTS {
            self.record.events.push((time, text));
        }
    }

    fn push(&mut self, time: f64, step: &loopsight_core::Step<'_, f64>) {
        if let Some(event) = &step.event {
            self.happened(time, self.words(event));
        }
        let reference = step.reference;
        let record = &mut self.record;
        record.time.push(time);
        for (i, trace) in record.controlled.iter_mut().enumerate() {
            trace.reference.push(reference[i]);
            trace.measured.push(step.measured[i]);
        }
        for (i, trace) in record.inputs.iter_mut().enumerate() {
            trace.commanded.push(step.command[i]);
            trace.applied.push(step.applied[i]);
        }
        let was = record.saturated.last().copied().unwrap_or(false);
        record.saturated.push(step.outcome.saturated);
        if step.outcome.saturated && !was {
            self.happened(time, "an actuator saturates".to_owned());
        }
        if step.outcome.held {
            self.happened(time, "the last safe command is held".to_owned());
        }
        self.row.clear();
        self.row.push((time * 1e9).round() / 1e9);
        for values in [step.applied, step.measured, reference] {
            self.row.extend(values.iter().map(|v| rounded(*v)));
        }
        self.row.push(f64::from(u8::from(step.outcome.saturated)));
    }

    /// The present row of the log.
    fn row(&self) -> &[f64] {
        &self.row
    }

    fn learn(&mut self, composed: &Composed) {
        let Some(identification) = &composed.host.observer else {
            return;
        };
        let mut next = 0;
        for row in 0..self.names.len() {
            let estimator = identification.estimator(row);
            for theta in estimator.theta() {
                self.record.parameters[next].values.push(*theta);
                next += 1;
            }
            let innovation = identification.lesson(row).innovation;
            self.record.innovations[row].values.push(innovation);
        }
    }
}

fn share(flags: &[bool]) -> f64 {
    flags.iter().filter(|f| **f).count() as f64 / flags.len().max(1) as f64
}

fn tracking(record: &LoopRecord) -> Vec<Tracking> {
    record
        .controlled
        .iter()
        .map(|trace| {
            let errors = || {
                trace
                    .reference
                    .iter()
                    .zip(&trace.measured)
                    .map(|(r, m)| r - m)
            };
            Tracking {
                id: trace.id.clone(),
                unit: trace.unit.clone(),
                rms_error: (errors().map(|e| e * e).sum::<f64>()
                    / trace.reference.len().max(1) as f64)
                    .sqrt(),
                largest_error: errors().fold(0.0, |a, e| a.max(e.abs())),
                steps: step_responses(&record.time, &trace.reference, &trace.measured),
            }
        })
        .collect()
}

/// What the step responses reached, in words.
fn reached(tracking: &[Tracking]) -> Vec<String> {
    tracking
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
                median(settled).map_or_else(String::new, |m| format!(", after {m:.3} s (median)")),
                median(overshoot).unwrap_or(f64::NAN)
            ))
        })
        .collect()
}

fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}

fn summary_text(summary: &Summary, record: &LoopRecord) -> String {
    let rows: Vec<Vec<String>> = summary
        .tracking
        .iter()
        .map(|t| {
            vec![
                t.id.clone(),
                format!("{} {}", output::number(t.rms_error), t.unit),
                format!("{} {}", output::number(t.largest_error), t.unit),
            ]
        })
        .collect();
    let mut text = format!(
        "{} ticks in {} s: {}\n{}\nsaturated in {} of the ticks",
        summary.ticks,
        output::number(summary.duration_s),
        summary.end,
        output::table(&["tracking", "rms error", "largest error"], &rows),
        output::percent(summary.saturated_share)
    );
    if !record.parameters.is_empty() {
        let rows: Vec<Vec<String>> = record
            .parameters
            .iter()
            .map(|p| {
                vec![
                    p.name.clone(),
                    p.values
                        .last()
                        .map_or_else(|| "-".to_owned(), |v| output::number(*v)),
                    p.unit.clone(),
                ]
            })
            .collect();
        text.push_str(&format!(
            "\n\n{}",
            output::table(&["identified", "value", "unit"], &rows)
        ));
    }
    for note in &summary.notes {
        text.push_str(&format!("\n{note}"));
    }
    text
}
