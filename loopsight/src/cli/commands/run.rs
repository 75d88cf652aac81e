//! `loopsight run`.

mod dashboard;
mod recorder;
mod summary;
mod timing;

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use dashboard::Dashboard;
use loopsight_core::TickError;
use loopsight_model::config::{Source, read_text};
use loopsight_model::loop_file::{Composed, LoopFile};
use loopsight_model::model::Model;
use loopsight_model::registry::{BuildError, DriverContext};
use loopsight_recordings::{LogWriter, RecordingError};
use loopsight_report::{Context, LoopRecord, figure_svg, run_figure, run_page, save};
use recorder::Recorder;
use summary::Summary;

use crate::cli::arguments::RunOptions;
use crate::cli::failure::{self, Failure};
use crate::cli::{load, output};

pub(crate) fn run(options: &RunOptions) -> Result<(), Failure> {
    let text = read_text(&options.file)?;
    let source = Source::parse(&options.file.display().to_string(), &text)?;
    let file = LoopFile::parse(&source)?;
    let (model, mut composed) = compose(&options.file, &source, &file)?;
    let log_path = options
        .output
        .clone()
        .or_else(|| file.log.as_ref().map(|l| beside(&options.file, l)));
    for path in log_path.iter().chain(&options.html).chain(&options.svg) {
        load::writable(path)?;
    }
    // The timer of a robot that runs the law itself is not the host's to measure.
    let real_time = (file.real_time || !file.driver.is_simulated()) && !file.driver.runs_law();
    let mut recorder = Recorder::new(&model, &composed, file.period_s, real_time);
    let mut log = match &log_path {
        None => None,
        Some(path) => Some(
            LogWriter::create(path, &recorder.headers(&model, &composed))
                .map_err(|e| failure::recording(path, &e))?,
        ),
    };
    let end = drive(&file, &mut composed, &mut recorder, log.as_mut());
    if let Some(log) = log {
        let path = log_path.as_deref().unwrap_or(Path::new(""));
        let path = log.finish().map_err(|e| failure::recording(path, &e))?;
        output::note(&format!("wrote {}", path.display()));
    }
    recorder.record.end = end.text.clone();
    promise(&file, &mut recorder.record);
    let mut summary = Summary::new(&recorder, log_path);
    summary.notes.extend(composed.notes.iter().cloned());
    summary.notes.extend(summary.reached());
    output::people(&summary.text(), options.json);
    if options.json {
        output::json(&summary)?;
    }
    let title = file.name.clone().unwrap_or_else(|| model.name.clone());
    let mut record = recorder.record;
    record.notes.clone_from(&summary.notes);
    if let Some(path) = &options.svg {
        save(path, &figure_svg(&run_figure(&title, &record)))?;
        output::note(&format!("wrote {}", path.display()));
    }
    if let Some(path) = &options.html {
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
    if record.every > 1 {
        // The design is sampled with the loop's period.
        return;
    }
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

/// The model of a loop file.
pub(crate) fn model_of(path: &Path, source: &Source, file: &LoopFile) -> Result<Model, Failure> {
    let model_path = beside(path, &file.model);
    if !model_path.exists() {
        let message = format!("there is no model file {}", model_path.display());
        return Err(source.error(&["model".into()], &message, None).into());
    }
    Ok(Model::load(&model_path)?.0)
}

/// Composes the loop of a loop file.
pub(crate) fn compose(
    path: &Path,
    source: &Source,
    file: &LoopFile,
) -> Result<(Model, Composed), Failure> {
    let ticks = file.duration_s.map_or(0.0, |d| d / file.period_s);
    if file.period_s > 0.0 && ticks > MOST_TICKS {
        let message = format!("that is {ticks:.1e} ticks, expected at most {MOST_TICKS:e}");
        return Err(source.error(&["duration_s".into()], &message, None).into());
    }
    let model = model_of(path, source, file)?;
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

/// Runs the loop to its end; the driver has been stopped when this returns.
fn drive(
    file: &LoopFile,
    composed: &mut Composed,
    recorder: &mut Recorder,
    mut log: Option<&mut LogWriter>,
) -> End {
    let stop = Arc::new(AtomicBool::new(false));
    let seen = Arc::clone(&stop);
    // A second handler (another run in the same process) is refused: the first one still stops us.
    let _ = ctrlc::set_handler(move || seen.store(true, Ordering::SeqCst));
    let ticks = file.duration_s.map_or(u64::MAX, |d| {
        (d / file.period_s + 1e-9).floor().min(1e15) as u64
    });
    let mut dashboard = Dashboard::new(file.duration_s, recorder.record.inputs.len());
    let mut end = End {
        text: format!(
            "the run lasted the {} s asked for",
            output::number(ticks as f64 * file.period_s)
        ),
        failed: false,
    };
    for index in 0..ticks {
        let time = index as f64 * file.period_s;
        if stop.load(Ordering::SeqCst) {
            end.text = format!("stopped by Ctrl-C at {time:.2} s");
            recorder.happened(time, end.text.clone());
            break;
        }
        let late = match composed.tick(time) {
            Ok(step) => {
                recorder.push(&step, file.supervisor.is_some());
                dashboard.take(&step, recorder);
                step.late
            }
            Err(error) => {
                end = End {
                    failed: !error.is_end(),
                    text: match &error {
                        TickError::Driver(e) => e.to_string(),
                        TickError::Control(e) => {
                            let said = composed.host.controller.remark();
                            said.map_or_else(|| e.to_string(), str::to_owned)
                        }
                        TickError::Supervisor(event) => recorder.words(event),
                    },
                };
                if end.failed {
                    recorder.happened(time, end.text.clone());
                }
                break;
            }
        };
        recorder.learn(composed, late);
        if let Some(remark) = composed.host.controller.remark() {
            recorder.happened(time, remark.to_owned());
        }
        if let Some(log) = log.as_mut()
            && let Err(error) = write(log, recorder)
        {
            end = End {
                text: format!("the log cannot be written: {error}"),
                failed: true,
            };
            break;
        }
    }
    let _ = dashboard.clear();
    if let Err(error) = composed.host.stop() {
        end = End {
            text: format!("the robot could not be stopped safely: {error}"),
            failed: true,
        };
    }
    // The reason why a run ended stands in its log, too.
    if let Some(log) = log {
        for (time, what) in recorder.news() {
            if let Err(error) = log.remark(time, &what) {
                output::note(&format!("the log lacks its last event: {error}"));
            }
        }
    }
    end
}

/// Writes the present tick, and what happened at it.
fn write(log: &mut LogWriter, recorder: &mut Recorder) -> Result<(), RecordingError> {
    log.write(recorder.row())?;
    for (time, what) in recorder.news() {
        log.remark(time, &what)?;
    }
    Ok(())
}
