//! `[controller.aboard]`: the host's end of the line.

mod changeable;
mod configured;
mod conversation;
#[cfg(unix)]
mod door;
mod line;
mod open;
mod remote;
mod send;
mod serial;
mod told;

use loopsight_controllers::FeedbackLinearizingPiSettings;
use loopsight_core::Controller;
use loopsight_estimators::RlsSettings;
use loopsight_link::Safety;
use loopsight_model::declare_part;
use loopsight_model::identification::LearningSettings;
use loopsight_model::model::Model;
use loopsight_model::registry::{BuildError, ControllerPart, PartMeta, Setting};
use serde::{Deserialize, Serialize};

pub use changeable::Changeable;
use conversation::Conversation;
pub use line::{Line, LineError};
pub use send::{Acknowledged, SendError, send};
pub use serial::Serial;
use told::Told;

/// A law that runs aboard a robot, told to it once before its first step: model, effects, learning and law of
/// this table.
///
/// With `[driver.serial]` the robot measures and drives by itself, and the line stands in that table. With any
/// other driver the host hands over what was measured and wanted, step by step, and the robot at `line` answers
/// with the command: with `simulated` the plant is on the host, and the firmware drives it like the real one.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Aboard {
    /// Serial port or unix socket at which the robot is found.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub line: Option<String>,
    /// Baud rate of a serial port, 1/s.
    #[serde(default = "baud")]
    pub baud: u32,
    /// How long the robot may take to answer, s.
    #[serde(default = "timeout")]
    pub timeout_s: f64,
    /// Unix socket at which a run of this loop takes another model for the robot: `loopsight send`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub door: Option<String>,
    /// What may be changed there while the robot drives; by default nothing.
    #[serde(default)]
    pub changeable: Changeable,
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

fn baud() -> u32 {
    115_200
}

/// Checks the time that an answer may take.
fn waits(timeout_s: f64) -> Result<(), BuildError> {
    if timeout_s > 0.0 && timeout_s < 1e6 {
        return Ok(());
    }
    let message = format!("`timeout_s` is {timeout_s} s, expected a number above 0 s");
    Err(BuildError::at("timeout_s", message))
}

/// Checks a baud rate.
fn rate(baud: u32) -> Result<(), BuildError> {
    if baud > 0 {
        return Ok(());
    }
    let error = BuildError::at("baud", "`baud` is 0, expected a number above 0");
    Err(error.help("the rate the robot's firmware has, often 115200"))
}

/// `[controller.aboard.safety]`: when a robot comes to rest by itself.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SafetySettings {
    /// Time without a step, s.
    pub watchdog_s: f64,
    /// Time without a fresh measurement, s.
    pub stale_s: f64,
    /// Time for which an input beyond `encoder_input` may turn nothing, s.
    pub encoder_s: f64,
    /// Input from which on every motor turns, in the unit of the inputs.
    pub encoder_input: f64,
    /// Least supply, V, of a robot that measures it: with `[driver.serial]`.
    pub least_supply_v: f64,
}

impl Default for SafetySettings {
    /// A tenth of a second without a step, a fifth without a fresh measurement; half a second of a third of 12 V without a count.
    fn default() -> Self {
        Self {
            watchdog_s: 0.1,
            stale_s: 0.2,
            encoder_s: 0.5,
            encoder_input: 4.0,
            least_supply_v: 0.0,
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
        if !(self.least_supply_v >= 0.0 && self.least_supply_v.is_finite()) {
            let found = self.least_supply_v;
            let message =
                format!("`least_supply_v` is {found}, expected a number from 0 V upwards");
            return Err(BuildError::at("safety.least_supply_v", message));
        }
        Ok(Safety {
            watchdog_ticks: ticks("watchdog_s", self.watchdog_s)?,
            // A measurement is of this period, or older.
            stale_us: (period * 0.5e6) as u32,
            stale_ticks: ticks("stale_s", self.stale_s)?,
            least_supply: self.least_supply_v as f32,
            encoder_ticks: ticks("encoder_s", self.encoder_s)?,
            encoder_input: self.encoder_input as f32,
        })
    }
}

const META: PartMeta = PartMeta {
    id: "aboard",
    role: "controller",
    summary: "the law and the learning run aboard a robot, at the other end of a line; the host hands over \
              what is wanted and, where the robot has no sensors of its own, what was measured",
    equation: "robot: V = G⁻¹ (ν - f) with friction compensated, guarded recursive least squares; host: \
               step out, command in",
    reference: "Alves, Lages, Henriques (2018), IFAC PapersOnLine 51-15, 437-442, equations (38)-(52)",
    example: "[controller.aboard]\nline = \"/tmp/twil.line\"\nlaw = { settling_time_s = 0.45, limit = 12.0 }\n",
    settings: &[
        Setting::new(
            "line",
            "",
            "serial port or unix socket at which the robot is found; not with `[driver.serial]`, which has it",
        ),
        Setting::new("baud", "1/s", "baud rate of a serial port; default: 115200"),
        Setting::new(
            "timeout_s",
            "s",
            "how long the robot may take to answer; default 2 s",
        ),
        Setting::new(
            "door",
            "",
            "unix socket at which a run takes another model for the robot while it drives, from `loopsight send`; \
             default: none",
        ),
        Setting::new(
            "changeable",
            "",
            "table: what may be changed there: `parameters` of the plant by `[low, high]`, `effects` that may come, \
             go and change, and whether `gains` may; default: nothing",
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
             `stale_s` without a fresh measurement (default 0.2 s), `encoder_s` of an input beyond `encoder_input` that turns nothing (default 0.5 s, 4); with \
             `[driver.serial]` a supply below `least_supply_v` (default 0 V)",
        ),
    ],
};

#[typetag::serde(name = "aboard")]
impl ControllerPart for Aboard {
    fn meta(&self) -> &'static PartMeta {
        &META
    }

    fn is_limited(&self) -> bool {
        self.law.limit.is_some()
    }

    fn build(&self, model: &Model, period: f64) -> Result<Box<dyn Controller<f64>>, BuildError> {
        let Some(line) = &self.line else {
            let error = BuildError::at("", "at which line is the robot?");
            return Err(error.help(
                "say `line = \"/dev/ttyACM0\"`, or take `[driver.serial]` for a robot with sensors of its own",
            ));
        };
        waits(self.timeout_s)?;
        rate(self.baud)?;
        if self.safety.least_supply_v > 0.0 {
            let message = "no supply is measured where the host measures for the robot";
            return Err(BuildError::at("safety.least_supply_v", message));
        }
        let configuration = self.configuration(model, period)?;
        let line = Line::at(line, self.baud, self.timeout_s);
        let allowed = self.changeable.of(model)?;
        let robot = Conversation::new(line, configuration, period);
        let robot = robot.with_door(self.door.as_ref(), allowed);
        Ok(Box::new(remote::Remote::new(robot, self.told(model))))
    }

    fn notes(&self) -> Vec<String> {
        let at = self
            .line
            .as_ref()
            .map_or_else(String::new, |l| format!(" at {l}"));
        let runs = if self.rls.is_some() {
            " and the learning run"
        } else {
            " runs"
        };
        vec![format!(
            "the law{runs} aboard the robot{at}, in single precision"
        )]
    }

    fn ideal(&self, references: &[Vec<f64>], period: f64) -> Option<Vec<Vec<f64>>> {
        self.law.ideal(references, period)
    }
}

impl Aboard {
    /// What the robot tells: parameters of the plant's equations that are learned aboard, those that enter
    /// linearly and that the file leaves free.
    fn told(&self, model: &Model) -> Told {
        let frozen = |id: &str| model.parameters.iter().any(|p| p.name == id && !p.free);
        let parameters = model.plant.parameters.iter().enumerate();
        let learned = parameters.filter(|(_, p)| self.rls.is_some() && p.linear && !frozen(p.id));
        Told::new(model, learned.map(|(i, _)| i).collect())
    }
}

declare_part!(&META);
