//! A loop, composed from TOML.

mod watch;

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::affine::{Affine, Treatment};
use crate::config::{ConfigError, PathSegment, TomlSource};
use crate::excitation::{self, Excitation, Sequence};
use crate::identification::{Identification, IdentificationError, LearningSettings};
use crate::limits::{self, LimitSettings};
use crate::model::Model;
use crate::registry::{
    BuildError, ControllerPart, DriverContext, DriverPart, EstimatorPart, HalfError, HostDriver,
    HostDriverError,
};
use crate::regression::Scheme;
use crate::supervisor::Supervision;
use loopsight_core::supervisor::Supervisor;
use loopsight_core::{
    AffineModel, Clock, Controller, Loop, Signal, SimulatedClock, SystemClock, TickError,
};

pub use watch::LoopSupervision;

/// A loop file, as written.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LoopFile {
    /// Name, for titles.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// The model file, relative to the loop file.
    pub model: String,
    /// Time between two ticks, s.
    pub period_s: f64,
    /// Length of the run, s; without it the loop runs until the driver ends or Ctrl-C.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub duration_s: Option<f64>,
    /// Keep pace with the clock on the wall also with a simulated driver.
    #[serde(default)]
    pub real_time: bool,
    /// What stands between the loop and the robot.
    pub driver: Box<dyn DriverPart>,
    /// The control law.
    pub controller: Box<dyn ControllerPart>,
    /// What learns while the loop runs, if anything.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub estimator: Option<Box<dyn EstimatorPart>>,
    /// Regression that the estimator is fed with.
    #[serde(default)]
    pub regression: Scheme,
    /// What is done with the estimator.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub learning: Option<LearningSettings>,
    /// References of the controlled signals; 0 where none is given.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub reference: BTreeMap<String, Excitation>,
    /// Limits of inputs and of the controlled signals' references, by signal.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub limits: LimitSettings,
    /// The supervisor: a table, or `false`; see [`LoopFile::supervision`] for a file that says nothing.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub supervisor: Option<Supervision>,
    /// Where the log is written, relative to the loop file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub log: Option<String>,
}

/// A loop composed at run time.
pub type HostLoop = Loop<
    f64,
    HostDriver,
    Box<dyn Controller<f64>>,
    Affine,
    Option<Identification>,
    Box<dyn Clock>,
    Vec<f64>,
    Option<Supervisor<f64, Vec<f64>>>,
>;

/// A composed loop with what its references and titles need.
pub struct Composed {
    /// The loop, ready to tick.
    pub host: HostLoop,
    /// The controlled signals, in the order of the references.
    pub controlled: Vec<&'static Signal>,
    /// One reference per controlled signal.
    pub references: Vec<Sequence>,
    /// The references as they are now, and as the controller gets them.
    now: Vec<f64>,
    target: Vec<f64>,
    /// What the controller says of its design.
    pub notes: Vec<String>,
    /// A supervisor decides whether what is learned is used.
    pub judges_learning: bool,
    /// The supervisor that watches although the file asks for none, in words.
    pub assumed: Option<&'static str>,
}

impl Composed {
    /// One tick at `time`, s: with the references that hold then, and for the controller those that
    /// hold when its command arrives, where the model knows how late that is.
    ///
    /// # Errors
    ///
    /// [`TickError`] where driver or controller fail, or where the supervisor stops the loop.
    pub fn tick(
        &mut self,
        time: f64,
    ) -> Result<loopsight_core::TickRecord<'_, f64>, TickError<HostDriverError>> {
        let ahead = self.host.model.ahead();
        for (i, sequence) in self.references.iter().enumerate() {
            self.now[i] = sequence.sample(time);
            self.target[i] = sequence.sample(time + ahead);
        }
        self.host.tick_towards(&self.now, &self.target)
    }
}

impl LoopFile {
    /// Reads a loop file.
    ///
    /// # Errors
    ///
    /// [`ConfigError`] where the document is not a loop file.
    pub fn parse(source: &TomlSource) -> Result<Self, Box<ConfigError>> {
        source.read()
    }

    /// Composes the loop; errors are placed in `source`.
    ///
    /// # Errors
    ///
    /// [`ConfigError`] where a part cannot be built, or a number is wrong.
    pub fn compose(
        &self,
        source: &TomlSource,
        model: &Model,
        context: &DriverContext<'_>,
    ) -> Result<Composed, Box<ConfigError>> {
        let number = |key: &str, value: f64| {
            if value > 0.0 && value.is_finite() {
                Ok(())
            } else {
                let message = format!("`{key}` is {value} s, expected a number above 0 s");
                Err(source.error(&[key.into()], &message, None))
            }
        };
        number("period_s", self.period_s)?;
        if let Some(duration) = self.duration_s {
            number("duration_s", duration)?;
        }
        let missing = model.missing_values();
        if !missing.is_empty() {
            let message = format!(
                "the model gives no value for {}: a loop needs a model with all its values",
                missing.join(", ")
            );
            return Err(source.error(&["model".into()], &message, None));
        }
        let Some(affine) = model.affine() else {
            let message = format!(
                "the plant `{}` is not control-affine with as many inputs as controlled states, \
                 so no velocity controller can act on it",
                model.plant.id
            );
            return Err(source.error(&["model".into()], &message, None));
        };
        let affine = affine.predicting(self.period_s);
        let mut notes = self.controller.notes();
        if self.controller.inverts_model() {
            notes.extend(affine.treatments().iter().map(Treatment::say));
        }
        notes.extend(affine.predictor_note());
        let controlled: Vec<&'static Signal> = model
            .plant
            .controlled
            .iter()
            .map(|i| &model.plant.states[*i])
            .collect();
        for (i, signal) in controlled.iter().enumerate() {
            if model
                .measured
                .get(i)
                .is_none_or(|m| m.signal.id != signal.id)
            {
                let message = format!(
                    "the model does not measure `{}`, which the controller acts on",
                    signal.id
                );
                let help = format!("add [log.measured.{}] to the model file", signal.id);
                return Err(source.error(&["model".into()], &message, Some(help)));
            }
        }
        let signals: Vec<Signal> = controlled.iter().map(|s| **s).collect();
        let references = excitation::build_with(&self.reference, &signals, context.read_column)
            .map_err(|e| placed(source, &["reference".into()], e))?;
        let halves = self.driver.build_with(self.controller.as_ref(), context);
        let (driver, controller) = halves.map_err(|error| {
            let (table, id, error) = match error {
                HalfError::Driver(error) => ("driver", self.driver.meta().id, error),
                HalfError::Controller(error) => ("controller", self.controller.meta().id, error),
            };
            placed(source, &[table.into(), id.into()], error)
        })?;
        let identification = match &self.estimator {
            None if self.learning.is_some() => {
                let message = "`learning` says what is done with an estimator, and there is none";
                let help = "add one, e.g. [estimator.rls]".to_owned();
                return Err(source.error(&["learning".into()], message, Some(help)));
            }
            None => None,
            Some(part) => {
                let settings = self.learning.clone().unwrap_or_default();
                let path: [PathSegment; 2] = ["estimator".into(), part.meta().id.into()];
                Some(
                    Identification::new(
                        model,
                        self.regression,
                        part.as_ref(),
                        &settings,
                        self.period_s,
                    )
                    .map_err(|error| match error {
                        IdentificationError::Build(error) => placed(source, &path, error),
                        IdentificationError::Learning(error) => {
                            placed(source, &["learning".into()], error)
                        }
                        IdentificationError::Regression(error) => {
                            source.error(&path, &error.to_string(), None)
                        }
                    })?,
                )
            }
        };
        if let Some(identification) = &identification {
            notes.extend(identification.notes(model));
        }
        let (input_limits, reference_limits) =
            limits::build(&self.limits, model.plant.inputs, &signals)
                .map_err(|e| placed(source, &["limits".into()], e))?;
        if self.driver.runs_law() && input_limits.is_some() {
            let message = "the robot runs its law itself, and nothing here can hold its inputs";
            let help = "give the law its `limit` instead".to_owned();
            return Err(source.error(&["limits".into()], message, Some(help)));
        }
        if !self.driver.is_simulated() {
            self.limited(source, model)?;
        }
        let watch = self.supervision();
        let judges_learning = watch.as_ref().is_some_and(|w| w.learning);
        let rows = identification.as_ref().filter(|_| judges_learning);
        let rows = rows.map_or(0, Identification::len);
        let supervisor = match &watch {
            None => None,
            Some(watch) => Some(
                watch
                    .settings
                    .build(model, rows)
                    .map_err(|e| placed(source, &["supervisor".into()], e))?,
            ),
        };
        let assumed = watch.and_then(|w| w.assumed);
        notes.extend(assumed.filter(|_| judges_learning).map(str::to_owned));
        // A simulation is as fast as it can be; a robot's own timer is waited for where it is read.
        let hurries = self.driver.is_simulated() && !self.real_time;
        let clock: Box<dyn Clock> = if hurries || self.driver.runs_law() {
            Box::new(SimulatedClock::default())
        } else {
            Box::new(SystemClock::default())
        };
        let nu = model.plant.inputs.len();
        let mut host = Loop::new(
            driver,
            controller,
            affine,
            identification,
            clock,
            self.period_s,
            vec![0.0; model.measured.len()],
            vec![0.0; nu],
            vec![0.0; nu],
            vec![0.0; controlled.len()],
        )
        .supervised(supervisor);
        host.input_limits = input_limits;
        host.target_limits = reference_limits.clone();
        host.reference_limits = reference_limits;
        Ok(Composed {
            host,
            now: vec![0.0; controlled.len()],
            target: vec![0.0; controlled.len()],
            controlled,
            references,
            notes,
            judges_learning,
            assumed,
        })
    }
}

/// Places a part's error in the file: its key is a path within the part's table.
pub fn placed(source: &TomlSource, table: &[PathSegment], error: BuildError) -> Box<ConfigError> {
    let mut path = table.to_vec();
    path.extend(key_path(&error.key));
    source.error(&path, &error.message, error.help)
}

/// `voltage_left.sum[1].prbs` as steps.
fn key_path(key: &str) -> Vec<PathSegment> {
    let mut path = Vec::new();
    for piece in key.split('.').filter(|p| !p.is_empty()) {
        let mut rest = piece;
        if let Some((name, _)) = piece.split_once('[') {
            path.push(name.into());
            rest = &piece[name.len()..];
            for index in rest
                .split(['[', ']'])
                .filter_map(|i| i.parse::<usize>().ok())
            {
                path.push(index.into());
            }
        } else {
            path.push(rest.into());
        }
    }
    path
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_of_errors_become_paths() {
        assert_eq!(
            key_path("voltage_left.sum[1].prbs"),
            vec![
                PathSegment::from("voltage_left"),
                PathSegment::from("sum"),
                PathSegment::from(1),
                PathSegment::from("prbs")
            ]
        );
        assert_eq!(key_path(""), vec![]);
    }
}
