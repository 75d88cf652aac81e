//! `[controller.aboard]`: the host's end of the line.

mod configured;
#[cfg(unix)]
mod line;
mod remote;

use loopsight_controllers::FeedbackLinearizingPiSettings;
use loopsight_core::identification::LearningSettings;
use loopsight_core::model::Model;
use loopsight_core::registry::{BuildError, ControllerPart, PartMeta, Setting};
use loopsight_core::{Controller, declare_part};
use loopsight_estimators::RlsSettings;
use loopsight_link::Safety;
use serde::{Deserialize, Serialize};

#[cfg(unix)]
pub use line::Line;

/// A law that runs aboard a robot: the loop on the host hands over what was measured and wanted, and
/// the robot answers with the command.
///
/// Model, effects, learning and law of this table are sent to the robot once, before its first step. Which
/// robot stands behind the line is the loop's driver: with `simulated` the plant is on the host, and the
/// firmware drives it like the real one.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Aboard {
    /// Path of the unix socket at which the line is found.
    pub socket: String,
    /// How long the robot may take to answer, s.
    #[serde(default = "timeout")]
    pub timeout_s: f64,
    /// The law, as in `[controller.feedback_linearizing_pi]`.
    pub law: FeedbackLinearizingPiSettings,
    /// The estimators, as in `[estimator.rls]`; without it nothing is learned aboard.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rls: Option<RlsSettings>,
    /// What is done with them, as in `[learning]`.
    #[serde(default)]
    pub learning: LearningSettings,
    /// When the robot comes to rest by itself.
    #[serde(default)]
    pub safety: SafetySettings,
}

fn timeout() -> f64 {
    2.0
}

/// `[controller.aboard.safety]`: when a robot comes to rest by itself.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SafetySettings {
    /// Time without a step, s.
    pub watchdog_s: f64,
    /// Time for which an input beyond `encoder_input` may turn nothing, s.
    pub encoder_s: f64,
    /// Input from which on every motor turns, in the unit of the inputs.
    pub encoder_input: f64,
}

impl Default for SafetySettings {
    /// A tenth of a second without a step; half a second of a third of 12 V without a count.
    fn default() -> Self {
        Self {
            watchdog_s: 0.1,
            encoder_s: 0.5,
            encoder_input: 4.0,
        }
    }
}

impl SafetySettings {
    /// In periods of the robot.
    fn in_periods(&self, period: f64) -> Result<Safety, BuildError> {
        let ticks = |key: &str, time: f64| {
            let ticks = (time / period).ceil();
            if ticks >= 1.0 && ticks <= f64::from(u16::MAX) {
                Ok(ticks as u16)
            } else {
                let most = f64::from(u16::MAX) * period;
                let message = format!("`{key}` is {time} s, expected above 0 s and up to {most} s");
                Err(BuildError::at(&format!("safety.{key}"), message))
            }
        };
        if !(self.encoder_input > 0.0 && self.encoder_input.is_finite()) {
            let found = self.encoder_input;
            let message = format!("`encoder_input` is {found}, expected a number above 0");
            return Err(BuildError::at("safety.encoder_input", message));
        }
        Ok(Safety {
            watchdog_ticks: ticks("watchdog_s", self.watchdog_s)?,
            // A host that hands a measurement over has just taken it.
            stale_us: (period * 0.5e6) as u32,
            stale_ticks: 1,
            // Nor does it know the supply.
            least_supply: 0.0,
            encoder_ticks: ticks("encoder_s", self.encoder_s)?,
            encoder_input: self.encoder_input as f32,
        })
    }
}

const META: PartMeta = PartMeta {
    id: "aboard",
    role: "controller",
    summary: "the law and the learning run aboard a robot, at the other end of a line; the host hands over \
              what was measured and wanted",
    equation: "robot: V = G⁻¹ (ν - f) with friction compensated, guarded recursive least squares; host: \
               step out, command in",
    reference: "Alves, Lages, Henriques (2018), IFAC PapersOnLine 51-15, 437-442, equations (38)-(52)",
    example: "[controller.aboard]\nsocket = \"/tmp/twil.line\"\nlaw = { settling_time_s = 0.45, limit = 12.0 }\n",
    settings: &[
        Setting::new(
            "socket",
            "",
            "path of the unix socket at which the line is found",
        ),
        Setting::new(
            "timeout_s",
            "s",
            "how long the robot may take to answer; default 2 s",
        ),
        Setting::new(
            "law",
            "",
            "table: the law, as in `[controller.feedback_linearizing_pi]`, from gains",
        ),
        Setting::new(
            "rls",
            "",
            "table: the estimators, as in `[estimator.rls]`, with constant forgetting; default: nothing is \
             learned aboard",
        ),
        Setting::new(
            "learning",
            "",
            "table: what is done with them, as in `[learning]`",
        ),
        Setting::new(
            "safety",
            "",
            "table: when the robot comes to rest by itself: `watchdog_s` without a step (default 0.1 s), \
             `encoder_s` of an input beyond `encoder_input` that turns nothing (default 0.5 s, 4)",
        ),
    ],
};

#[typetag::serde(name = "aboard")]
impl ControllerPart for Aboard {
    fn meta(&self) -> &'static PartMeta {
        &META
    }

    fn build(&self, model: &Model, period: f64) -> Result<Box<dyn Controller<f64>>, BuildError> {
        if !(self.timeout_s > 0.0 && self.timeout_s < 1e6) {
            let found = self.timeout_s;
            let message = format!("`timeout_s` is {found} s, expected a number above 0 s");
            return Err(BuildError::at("timeout_s", message));
        }
        let configuration = self.configuration(model, period)?;
        #[cfg(unix)]
        return Ok(Box::new(remote::Remote::new(
            Line::at(&self.socket, self.timeout_s),
            configuration,
            period,
        )));
        #[cfg(not(unix))]
        {
            let _ = configuration;
            Err(BuildError::at("socket", "this system has no unix sockets"))
        }
    }

    fn notes(&self) -> Vec<String> {
        vec![format!(
            "the law{} aboard the robot at {}, in single precision",
            if self.rls.is_some() {
                " and the learning run"
            } else {
                " runs"
            },
            self.socket
        )]
    }

    fn ideal(&self, references: &[Vec<f64>], period: f64) -> Option<Vec<Vec<f64>>> {
        self.law.ideal(references, period)
    }
}

declare_part!(&META);
