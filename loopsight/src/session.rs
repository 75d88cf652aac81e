//! A model and the logs of one machine.

use std::path::Path;
use std::sync::Arc;

use loopsight_core::Signal;
use loopsight_diagnosis::Measurements;
use loopsight_model::log_map::LogMap;
use loopsight_model::model::Model as Composed;
use loopsight_model::run::{Run, shortest_period};
use loopsight_recordings::{Fault, Recording, RecordingError, Severity, Source};

use crate::about::About;
use crate::answers::LogFault;
use crate::bounded;
use crate::error::{Error, Result};
use crate::inspect::suggest;
use crate::log::Log;
use crate::model::Model;
use crate::stamps;

/// A model and the logs of one machine, and what can be done with them: [`compare`](Self::compare),
/// [`fit`](Self::fit), [`diagnose`](Self::diagnose), [`improve`](Self::improve), [`add`](Self::add),
/// [`experiment`](Self::experiment), [`simulate`](Self::simulate) and [`run`](Self::run).
///
/// A session does not change: each of these returns an answer, some of them with a model in it, and a
/// new session can be made of that.
///
/// ```
/// use loopsight::{CompareOptions, Log, Model, Session};
///
/// # let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../examples/twil");
/// let model = Model::from_file(format!("{folder}/model.toml"))?;
/// let log = Log::read(format!("{folder}/prbs.csv"))?;
/// let answer = Session::new(model, log)?.compare(&CompareOptions::default())?;
/// assert!(answer.errors.fit_percent > 98.0);
/// # Ok::<(), loopsight::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct Session {
    pub(crate) model: Model,
    /// The model came out of the log, without values.
    pub(crate) described: bool,
    data: Option<Data>,
}

/// Logs, matched with the signals of the model.
#[derive(Clone, Debug)]
pub(crate) struct Data {
    /// The model, with what the log measures.
    pub(crate) model: Composed,
    pub(crate) log: String,
    pub(crate) runs: Arc<[Run]>,
    pub(crate) test: Option<(String, Arc<[Run]>)>,
    pub(crate) report: Option<(String, Arc<[Run]>)>,
    pub(crate) faults: Vec<Fault>,
    /// The unit of a SysId log, and what it is for the model (m or rad).
    sysid: Option<(String, f64)>,
}

impl Data {
    /// As the engine wants them.
    pub(crate) fn measurements(&self) -> Measurements<'_> {
        let test = self.test.as_ref().map(|(_, runs)| &**runs);
        Measurements::new(&self.runs)
            .tested_on(test)
            .with_faults(&self.faults)
    }

    /// The runs to be shown: those of the test log, or else those of the log.
    pub(crate) fn shown(&self) -> Arc<[Run]> {
        let shown = self.test.as_ref().map_or(&self.runs, |(_, runs)| runs);
        Arc::clone(shown)
    }

    /// A fit to a log with a fatal fault would mean nothing: refuses, with the reasons.
    pub(crate) fn refuse_fatal(&self) -> Result<()> {
        let fatal: Vec<String> = self
            .faults
            .iter()
            .filter(|f| f.severity() == Severity::Fatal)
            .map(|f| format!("  {f}"))
            .collect();
        if fatal.is_empty() {
            return Ok(());
        }
        Err(Error::request(format!(
            "{}: a fit to this log would mean nothing:\n{}",
            self.log,
            fatal.join("\n")
        )))
    }
}

impl Session {
    /// A model and a log. Columns are matched with signals by name and unit, or as the model's `[log]` says. Values
    /// become SI. The log is cut into runs and checked for faults.
    ///
    /// # Errors
    ///
    /// A column that the model needs is missing, has another unit, or no usable value.
    pub fn new(model: Model, log: Log) -> Result<Self> {
        let mut session = Self::of_model(model);
        let mut measuring = session.model.composed.clone();
        let (runs, faults) = matched(&mut measuring, &log)?;
        let sysid = match &log.source {
            Source::SysId(sysid) => Some((sysid.units.clone(), sysid.unit_of_model())),
            _ => None,
        };
        session.data = Some(Data {
            sysid,
            model: measuring,
            runs: runs.into(),
            test: None,
            report: None,
            faults,
            log: log.name,
        });
        Ok(session)
    }

    /// A log that describes itself (SysId JSON): its model comes with it.
    ///
    /// # Errors
    ///
    /// The log does not describe itself, or as [`Session::new`].
    pub fn of_log(log: Log) -> Result<Self> {
        let Some(model) = log.model() else {
            let file = &log.name;
            return Err(Error::request(format!(
                "{file} does not describe itself: a model file is needed before it, as in `loopsight compare model.toml {file}`"
            )));
        };
        let mut session = Self::new(model?, log)?;
        session.described = true;
        Ok(session)
    }

    /// A model alone: enough to [`add`](Self::add), [`simulate`](Self::simulate),
    /// [`run`](Self::run) and plan an [`experiment`](Self::experiment).
    pub fn of_model(model: Model) -> Self {
        Self {
            model,
            described: false,
            data: None,
        }
    }

    /// Another log of the same machine to fit to.
    ///
    /// # Errors
    ///
    /// It does not measure what the first log measures, or as [`Session::new`].
    pub fn also(mut self, log: Log) -> Result<Self> {
        let more = self.further(&log)?;
        let name = Path::new(&log.name).file_stem();
        let name = name.unwrap_or_default().to_string_lossy();
        let more = more.into_iter().map(|run| {
            let name = if run.name().is_empty() {
                name.to_string()
            } else {
                format!("{name} {}", run.name())
            };
            run.named(name)
        });
        if let Some(data) = &mut self.data {
            data.runs = data.runs.iter().cloned().chain(more).collect();
        }
        Ok(self)
    }

    /// A log of the same machine for validation: nothing is fitted to it.
    ///
    /// # Errors
    ///
    /// As [`Session::also`].
    pub fn test(mut self, log: Log) -> Result<Self> {
        let runs = self.further(&log)?;
        if let Some(data) = &mut self.data {
            data.test = Some((log.name, runs.into()));
        }
        Ok(self)
    }

    /// A log of the same machine that neither a fit nor a choice sees: [`improve`](Self::improve) says the error of the
    /// model that came of it there.
    ///
    /// # Errors
    ///
    /// As [`Session::also`].
    pub fn report(mut self, log: Log) -> Result<Self> {
        let runs = self.further(&log)?;
        if let Some(data) = &mut self.data {
            data.report = Some((log.name, runs.into()));
        }
        Ok(self)
    }

    /// The model.
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// What is wrong with the logs, the worst first; a fit is refused where one of it is
    /// [fatal](crate::answers::Severity::Fatal).
    pub fn faults(&self) -> Vec<LogFault> {
        let faults = self.data.iter().flat_map(|data| &data.faults);
        faults.map(LogFault::from).collect()
    }

    /// The logs.
    pub(crate) fn data(&self) -> Result<&Data> {
        self.data.as_ref().ok_or_else(|| {
            Error::request("there is no log: `Session::new` makes a session of a model and a log")
        })
    }

    /// What an answer about the logs is about.
    pub(crate) fn about(&self, data: &Data) -> About {
        About {
            model_name: self.model.name().to_owned(),
            model_file: (!self.described).then(|| self.model.file.clone()),
            log: data.log.clone(),
            test: data.test.as_ref().map(|(name, _)| name.clone()),
            sysid: data.sysid.clone(),
            ..About::default()
        }
    }

    /// The runs of another log, which must measure what the first one measures; its faults join those of
    /// the first.
    fn further(&mut self, log: &Log) -> Result<Vec<Run>> {
        let Some(data) = &mut self.data else {
            return Err(Error::request(format!(
                "{}: there is no first log to add it to",
                log.name
            )));
        };
        let mut model = data.model.clone();
        let (runs, faults) = matched(&mut model, log)?;
        if model.measured != data.model.measured {
            return Err(Error::request(format!(
                "{} does not measure the same signals as {}",
                log.name, data.log
            )));
        }
        data.faults.extend(faults);
        Ok(runs)
    }
}

/// The runs of a log for `model`; signals that the model does not list are found by name, and what is
/// measured is written into the model.
fn matched(model: &mut Composed, log: &Log) -> Result<(Vec<Run>, Vec<Fault>)> {
    let recording = map(model, &log.source).map_err(|error| unmapped(model, log, &error))?;
    for (i, signal) in recording.measured.iter().enumerate() {
        let mut samples = recording
            .runs
            .iter()
            .flat_map(|run| (0..run.len()).map(move |k| run.sample(k)[i]));
        if !samples.any(f64::is_finite) {
            return Err(Error::request(format!(
                "{}: `{}` has no sample: every value of its column is missing or impossible",
                log.name, signal.id
            )));
        }
    }
    let measured: Vec<_> = recording
        .measured
        .iter()
        .map(|m| (m.id.clone(), m.sensor.clone()))
        .collect();
    model.measure(&measured).map_err(|(_, message, help)| {
        Error::request(match help {
            Some(help) => format!("{message} ({help})"),
            None => message,
        })
    })?;
    model.follow(shortest_period(&recording.runs));
    stamps::check(model, log, &recording)?;
    bounded::log(&log.name, model, &recording.runs)?;
    Ok((recording.runs, recording.faults))
}

/// A log that cannot be mapped, with the `[log]` to paste where only columns are missing.
fn unmapped(model: &Composed, log: &Log, error: &RecordingError) -> Error {
    let wrong = log.wrong(error);
    let missing = matches!(
        error,
        RecordingError::MissingColumn { .. } | RecordingError::NothingMeasured { .. }
    );
    match missing
        .then(|| suggest::table(model, &log.source))
        .flatten()
    {
        Some(table) => {
            let place = match model.log == LogMap::default() {
                true => "in the model file",
                false => "in the model file, in place of its [log]",
            };
            wrong.with_help(format!("this {place} reads the log:\n\n{table}"))
        }
        None => wrong,
    }
}

/// Maps a log on the signals of a model.
pub(crate) fn map(
    model: &Composed,
    log: &Source,
) -> std::result::Result<Recording, RecordingError> {
    let measurable: Vec<Signal> = model
        .plant
        .states
        .iter()
        .chain(model.plant.outputs)
        .copied()
        .collect();
    loopsight_recordings::map(log, model.plant.inputs, &measurable, &model.log)
}
