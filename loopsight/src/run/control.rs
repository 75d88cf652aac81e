//! A loop file: what a loop is composed of.

use std::path::{Path, PathBuf};

use loopsight_model::config::{TomlSource, read_text};
use loopsight_model::loop_file::{Composed, LoopFile};
use loopsight_model::model::Model as ComposedModel;
use loopsight_model::registry::{BuildError, DriverContext};

use crate::about::About;
use crate::bounded;
use crate::columns;
use crate::error::Result;
use crate::files::Reads;
use crate::model::Model;
use crate::session::map;
use crate::words::number;

/// A control loop, as its file says it: driver, controller, estimator, references, limits, supervisor.
#[derive(Debug)]
pub struct Loop {
    pub(crate) parsed: LoopFile,
    /// Name and text of the file; other files that it names lie beside it.
    file: String,
    text: String,
}

/// Most ticks of one run: beyond it a number was mistyped.
const MOST_TICKS: f64 = 1e7;

impl Loop {
    /// Reads a loop file.
    ///
    /// # Errors
    ///
    /// The file cannot be read, or says something that cannot be: with line, column, and the nearest right
    /// thing.
    pub fn from_file(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        Self::from_toml(&path.display().to_string(), &read_text(path)?)
    }

    /// Makes a loop of a text; `name` stands for the file in messages, and files that it names lie beside
    /// it.
    ///
    /// # Errors
    ///
    /// As [`Loop::from_file`].
    pub fn from_toml(name: &str, text: &str) -> Result<Self> {
        let source = TomlSource::parse(name, text)?;
        Ok(Self {
            parsed: LoopFile::parse(&source)?,
            file: name.to_owned(),
            text: text.to_owned(),
        })
    }

    /// The model that the file names.
    ///
    /// # Errors
    ///
    /// As [`Model::from_file`].
    pub fn model(&self) -> Result<Model> {
        let path = self.beside(&self.parsed.model);
        if !path.exists() {
            let message = format!("there is no model file {}", path.display());
            let source = self.source()?;
            return Err(source.error(&["model".into()], &message, None).into());
        }
        Model::from_file(path)
    }

    /// The loop file, as it was named.
    pub(crate) fn file(&self) -> &Path {
        Path::new(&self.file)
    }

    /// Where the model file is that the file names.
    pub(crate) fn model_file(&self) -> PathBuf {
        self.beside(&self.parsed.model)
    }

    /// Period, s.
    pub fn period_s(&self) -> f64 {
        self.parsed.period_s
    }

    /// How long it runs, s; `None`: until it is stopped.
    pub fn duration_s(&self) -> Option<f64> {
        self.parsed.duration_s
    }

    /// The text with the places of its keys.
    pub(crate) fn source(&self) -> Result<TomlSource> {
        Ok(TomlSource::parse(&self.file, &self.text)?)
    }

    /// A path in a loop file is relative to that file.
    pub(crate) fn beside(&self, path: &str) -> PathBuf {
        let file = Path::new(&self.file);
        file.parent()
            .map_or_else(|| PathBuf::from(path), |folder| folder.join(path))
    }

    /// Composes the loop around `model`; `reads` gets the files that this reads.
    pub(crate) fn compose(&self, model: &ComposedModel, reads: &Reads) -> Result<Composed> {
        let (file, source) = (&self.parsed, self.source()?);
        let ticks = file.duration_s.map_or(0.0, |d| d / file.period_s);
        if file.period_s > 0.0 && ticks > MOST_TICKS {
            let message = format!("that is {ticks:.1e} ticks, expected at most {MOST_TICKS:e}");
            return Err(source.error(&["duration_s".into()], &message, None).into());
        }
        let simulated = file.driver.simulates_with().zip(file.duration_s);
        if let Some((step, duration)) = simulated.filter(|_| !file.real_time)
            && let Some(message) = bounded::robot(duration, step)
        {
            return Err(source.error(&["duration_s".into()], &message, None).into());
        }
        let load_model = |name: &str| {
            ComposedModel::load(&reads.note(self.beside(name)))
                .map(|(model, _)| model)
                .map_err(|e| BuildError::at("model", e.to_string()))
        };
        let load_runs = |name: &str, model: &ComposedModel| {
            let path = reads.note(self.beside(name));
            let wrong = |e: &loopsight_recordings::RecordingError| {
                BuildError::at("recording", e.to_string())
            };
            let log = loopsight_recordings::read(&path).map_err(|e| wrong(&e))?;
            Ok(map(model, &log).map_err(|e| wrong(&e))?.runs)
        };
        let context = DriverContext {
            model,
            period: file.period_s,
            load_model: &load_model,
            load_runs: &load_runs,
            read_column: &|name, column| columns::read(&reads.note(self.beside(name)), column),
        };
        Ok(file.compose(&source, model, &context)?)
    }

    /// What the loop is, in a sentence, once it was composed around `model`.
    pub(crate) fn described(&self, model: &Model) -> Result<String> {
        let (file, composed) = (
            &self.parsed,
            self.compose(&model.composed, &Reads::default())?,
        );
        let estimator = file
            .estimator
            .as_ref()
            .map_or_else(String::new, |e| format!(", estimator `{}`", e.meta().id));
        let controlled: Vec<&str> = composed.controlled.iter().map(|s| s.id).collect();
        Ok(format!(
            "a loop at {} Hz: driver `{}`, controller `{}`{estimator}, references for {}{}",
            number(1.0 / file.period_s),
            file.driver.meta().id,
            file.controller.meta().id,
            controlled.join(", "),
            composed
                .assumed
                .map_or_else(String::new, |why| format!("; {why}"))
        ))
    }

    /// What a run of it is about.
    pub(super) fn about(&self, model: &Model) -> About {
        About {
            model_name: model.name().to_owned(),
            model_file: Some(self.beside(&self.parsed.model).display().to_string()),
            title: self.parsed.name.clone(),
            ..About::default()
        }
    }
}
