//! The supervisor and the limits that a loop has although its file does not ask for them.

use super::LoopFile;
use crate::config::{ConfigError, TomlSource};
use crate::model::Model;
use crate::supervisor::{Supervision, SupervisorSettings};

/// The supervisor of a loop.
#[derive(Clone, Debug, PartialEq)]
pub struct LoopSupervision {
    /// How.
    pub settings: SupervisorSettings,
    /// It decides whether what is learned is used.
    pub learning: bool,
    /// In words, where the file does not ask for it.
    pub assumed: Option<&'static str>,
}

const OF_LEARNING: &str = "the file has no [supervisor], and the loop uses what it learns: one with the defaults is \
                           assumed; `supervisor = false` in the file has none";
const OF_ANY: &str = "the file has no [supervisor]: one is assumed that stops the loop where nothing is measured any \
                      more, and where a signal goes the wrong way; `supervisor = false` in the file has none";

impl LoopFile {
    /// The supervisor of the loop, also where the file has none. Then a loop that uses what it learns has a supervisor
    /// with the defaults; any other is stopped where nothing is measured any more or a signal goes the wrong way. A
    /// log that is played back needs none.
    pub fn supervision(&self) -> Option<LoopSupervision> {
        let taught = self
            .learning
            .as_ref()
            .is_some_and(|l| l.certainty_equivalence);
        match &self.supervisor {
            Some(Supervision::Nobody) => None,
            Some(Supervision::By(settings)) => Some(LoopSupervision {
                settings: settings.clone(),
                learning: true,
                assumed: None,
            }),
            None if !self.driver.is_driven() => None,
            None if taught => Some(LoopSupervision {
                settings: SupervisorSettings::of_learning(self.period_s),
                learning: true,
                assumed: Some(OF_LEARNING),
            }),
            None => {
                let mut settings = SupervisorSettings::of_any(self.period_s);
                // A robot that keeps the time itself also knows when it has heard nothing for too long.
                if self.driver.runs_law() {
                    settings.stale_s = f64::INFINITY;
                }
                Some(LoopSupervision {
                    settings,
                    learning: false,
                    assumed: Some(OF_ANY),
                })
            }
        }
    }

    /// A loop drives a robot only if something limits its inputs.
    pub(super) fn limited(
        &self,
        source: &TomlSource,
        model: &Model,
    ) -> Result<(), Box<ConfigError>> {
        let held = |id: &str| {
            let limits = self.limits.get(id);
            limits.is_some_and(|l| l.magnitude.is_some_and(f64::is_finite))
        };
        let free = model.plant.inputs.iter().find(|input| !held(input.id));
        let Some(input) =
            free.filter(|_| !self.controller.is_limited() && !self.driver.is_limited())
        else {
            return Ok(());
        };
        let (id, driver) = (input.id, self.driver.meta().id);
        let message = format!(
            "nothing limits `{id}`, and the driver `{driver}` drives a robot: expected a limit that is declared"
        );
        let help = format!(
            "add `{id} = {{ magnitude = … }}` ({}) to [limits], or give the controller its `limit`",
            input.unit
        );
        Err(source.error(&["driver".into(), driver.into()], &message, Some(help)))
    }
}
