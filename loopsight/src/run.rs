//! A control loop at work.

mod control;
mod drive;
mod recorder;
mod timing;
mod view;

use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use loopsight_recordings::LogWriter;

use crate::answers::RunAnswer;
use crate::error::{Error, Result};
use crate::files::{self, Reads};
use crate::session::Session;
use crate::watch::{Watch, watched};

pub use control::Loop;
pub(crate) use recorder::{Recorder, Sums};
pub use view::{ControlledNow, InputNow, ParameterNow, RunView};

/// How a loop is run.
#[derive(Clone, Default)]
#[non_exhaustive]
pub struct RunOptions {
    /// Where the log goes: by default where the loop file says, if it says so.
    pub log: LogTo,
    /// Whether the answer has the series of numbers, tick by tick; by default it has not.
    pub series: bool,
    /// Stops the loop, which releases the robot before it ends; a loop reports no progress.
    pub watch: Watch,
    /// Who cancels, for the sentence that says so: by default `its caller`.
    pub stopped_by: Option<String>,
    /// Files that will be written of the answer: an error if the loop reads one of them, before it runs.
    pub pages: Vec<PathBuf>,
    on_tick: Option<Arc<OnTick>>,
}

/// What is called at each tick.
type OnTick = dyn Fn(&RunView<'_>) + Send + Sync;

/// Where the log of a loop goes.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum LogTo {
    /// Where the loop file says, if it says so.
    #[default]
    AsWritten,
    /// To this file: MCAP where its name ends in `.mcap`, else CSV.
    File(PathBuf),
    /// Nowhere.
    Nowhere,
}

watched!(RunOptions);

impl fmt::Debug for RunOptions {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("RunOptions")
            .field("log", &self.log)
            .field("series", &self.series)
            .field("watch", &self.watch)
            .field("stopped_by", &self.stopped_by)
            .field("pages", &self.pages)
            .finish_non_exhaustive()
    }
}

impl RunOptions {
    /// Where the log goes.
    #[must_use]
    pub fn log(mut self, log: LogTo) -> Self {
        self.log = log;
        self
    }

    /// Whether the answer has the series of numbers, tick by tick.
    #[must_use]
    pub fn series(mut self, series: bool) -> Self {
        self.series = series;
        self
    }

    /// Who cancels, for the sentence that says so.
    #[must_use]
    pub fn stopped_by(mut self, who: &str) -> Self {
        self.stopped_by = Some(who.to_owned());
        self
    }

    /// Files that will be written of the answer: an error if the loop reads one of them, before it runs.
    #[must_use]
    pub fn pages<P: Into<PathBuf>>(mut self, pages: impl IntoIterator<Item = P>) -> Self {
        self.pages.extend(pages.into_iter().map(Into::into));
        self
    }

    /// Calls `look` at each tick, after the command was written. A loop in real time waits for it.
    #[must_use]
    pub fn on_tick(mut self, look: impl Fn(&RunView<'_>) + Send + Sync + 'static) -> Self {
        self.on_tick = Some(Arc::new(look));
        self
    }
}

impl Session {
    /// Runs the control loop `control`; the model of the session is that of its controller. The robot, simulated or
    /// not, is released when this returns.
    ///
    /// ```
    /// use loopsight::{LogTo, Loop, RunOptions, Session};
    ///
    /// # let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../examples/twil");
    /// let control = Loop::from_file(format!("{folder}/loop.toml"))?;
    /// let session = Session::of_model(control.model()?);
    /// let answer = session.run(&control, &RunOptions::default().log(LogTo::Nowhere))?;
    /// assert!(!answer.failed && answer.ticks > 1000);
    /// # Ok::<(), loopsight::Error>(())
    /// ```
    ///
    /// # Errors
    ///
    /// The loop cannot be composed, or its log cannot be written. What goes wrong while it runs is an
    /// answer: see [`RunAnswer::failed`].
    pub fn run(&self, control: &Loop, options: &RunOptions) -> Result<RunAnswer> {
        let model = &self.model.composed;
        let file = &control.parsed;
        let reads = Reads::default();
        reads.note(control.file().to_owned());
        reads.note(control.model_file());
        let mut composed = control.compose(model, &reads)?;
        let log_path = match &options.log {
            LogTo::AsWritten => file.log.as_ref().map(|log| control.beside(log)),
            LogTo::File(path) => Some(path.clone()),
            LogTo::Nowhere => None,
        };
        if let Some(path) = &log_path {
            files::check(path)?;
        }
        let outputs = log_path.iter().chain(&options.pages);
        reads.apart(outputs.clone().map(PathBuf::as_path))?;
        files::distinct(outputs.map(PathBuf::as_path))?;
        // The timer of a robot that runs the law itself is not the host's to measure.
        let real_time = (file.real_time || !file.driver.is_simulated()) && !file.driver.runs_law();
        let mut recorder = Recorder::new(model, &composed, file.period_s, real_time);
        let wrong = |path: &Path, error: &loopsight_recordings::RecordingError| {
            Error::in_log(error, &path.display().to_string(), None)
        };
        let mut log = match &log_path {
            None => None,
            Some(path) => Some(
                LogWriter::create(path, &recorder.headers(model, &composed))
                    .map_err(|e| wrong(path, &e))?,
            ),
        };
        let mut end = drive::drive(control, &mut composed, &mut recorder, log.as_mut(), options);
        let mut written = None;
        if let Some(log) = log {
            match log.finish() {
                Ok(path) => written = Some(path),
                // The run was: its summary is worth more than the error alone.
                Err(error) => {
                    let text = format!("the log cannot be finished: {error}");
                    if end.failed {
                        recorder.record.notes.push(text);
                    } else {
                        end = drive::End { text, failed: true };
                    }
                }
            }
        }
        recorder.record.end.clone_from(&end.text);
        promise(control, &mut recorder);
        Ok(RunAnswer::new(
            recorder,
            end.failed,
            &composed.notes,
            control.about(&self.model),
            (log_path, written),
            options.series,
        ))
    }
}

/// Puts what the design promises beside what was measured.
fn promise(control: &Loop, recorder: &mut Recorder) {
    let record = &mut recorder.record;
    if record.every > 1 {
        // The design is sampled with the loop's period.
        return;
    }
    let references: Vec<Vec<f64>> = record
        .controlled
        .iter()
        .map(|trace| trace.reference.clone())
        .collect();
    let file = &control.parsed;
    if let Some(ideal) = file.controller.ideal(&references, file.period_s) {
        for (trace, ideal) in record.controlled.iter_mut().zip(ideal) {
            trace.ideal = Some(ideal);
        }
    }
}
