//! `[driver.linux_gpio]`, and what it comes to for a model.

use std::collections::BTreeMap;
use std::path::PathBuf;

use loopsight_model::model::Model;
use loopsight_model::registry::BuildError;
use loopsight_model::sensor::Sensor;
use serde::{Deserialize, Serialize};

use crate::robot::unknown;
use crate::twil_motor::WheelSettings;

/// A line of the GPIO chip.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(
    untagged,
    expecting = "expected a line number or a table `{ line, active_low }`"
)]
pub enum GpioLine {
    /// Acts when it is high.
    High(u32),
    /// Acts when it is high or low.
    Table {
        /// Number of the line.
        line: u32,
        /// It acts when it is low.
        active_low: bool,
    },
}

impl GpioLine {
    pub(crate) fn number(&self) -> u32 {
        match self {
            Self::High(line) | Self::Table { line, .. } => *line,
        }
    }
    pub(crate) fn active_low(&self) -> bool {
        matches!(
            self,
            Self::Table {
                active_low: true,
                ..
            }
        )
    }
}

/// Where the voltage behind the bridges is known from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(
    untagged,
    expecting = "expected a number of volts or a table `{ file, scale }`"
)]
pub enum SupplySetting {
    /// It does not change, V.
    Fixed(f64),
    /// It is measured.
    Measured {
        /// A file with a number, of an analogue input.
        file: PathBuf,
        /// Volts of the supply per unit of that number.
        scale: f64,
    },
}

/// Kinds of bridges.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum BridgeKind {
    /// PWM and direction.
    #[default]
    SignMagnitude,
    /// One PWM, half of it is 0 V.
    LockedAntiphase,
}

/// A motor with its encoder.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Motor {
    /// Chip and channel of the PWM.
    pub pwm: [u32; 2],
    /// Kind of the bridge.
    #[serde(default)]
    pub bridge: BridgeKind,
    /// Direction pin, of a sign–magnitude bridge.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub direction: Option<GpioLine>,
    /// Enable pin.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub enable: Option<GpioLine>,
    /// Brake pin.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub brake: Option<GpioLine>,
    /// Device and count of the encoder.
    pub counter: [u32; 2],
    /// The shaft that the encoder counts, as in the `of` of the model's sensors.
    pub shaft: String,
    /// Largest voltage, V.
    pub limit_v: f64,
    /// Largest rate of the voltage, V/s; none without it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub slew: Option<f64>,
    /// Ticks at 0 V between two directions.
    #[serde(default)]
    pub dead_ticks: u16,
    /// A positive voltage turns the shaft backwards.
    #[serde(default)]
    pub motor_reversed: bool,
    /// Counts fall while the shaft turns forwards.
    #[serde(default)]
    pub encoder_reversed: bool,
}

impl Motor {
    pub(crate) fn wheel(&self) -> WheelSettings<f64> {
        WheelSettings {
            slew: self.slew.unwrap_or(f64::INFINITY),
            dead_ticks: self.dead_ticks,
            motor_reversed: self.motor_reversed,
            encoder_reversed: self.encoder_reversed,
            ..WheelSettings::new(self.limit_v)
        }
    }

    fn check(&self, key: &str) -> Result<(), BuildError> {
        let positive = |name: &str, value: f64| {
            if value > 0.0 && value.is_finite() {
                return Ok(());
            }
            let message = format!("`{name}` is {value}, expected a number above 0");
            Err(BuildError::at(&format!("{key}.{name}"), message))
        };
        positive("limit_v", self.limit_v)?;
        self.slew.map_or(Ok(()), |slew| positive("slew", slew))?;
        match (self.bridge, &self.direction) {
            (BridgeKind::SignMagnitude, None) => {
                let message = "a sign-magnitude bridge has a direction pin, and none is given";
                Err(BuildError::at(key, message)
                    .help("add `direction = LINE`, or `bridge = \"locked_antiphase\"`"))
            }
            (BridgeKind::LockedAntiphase, Some(_)) => {
                let message = "a locked-antiphase bridge has no direction pin";
                Err(BuildError::at(&format!("{key}.direction"), message))
            }
            (BridgeKind::LockedAntiphase, None) if self.enable.is_none() => {
                let message = "a locked-antiphase bridge turns at full voltage while its PWM is off, \
                               so it has to have an enable pin";
                Err(BuildError::at(key, message).help("add `enable = LINE`"))
            }
            _ => Ok(()),
        }
    }
}

/// The motors in the order of the model's inputs.
pub(crate) fn in_order<'a>(
    motors: &'a BTreeMap<String, Motor>,
    model: &Model,
) -> Result<Vec<(&'static str, &'a Motor)>, BuildError> {
    let ids: Vec<&str> = model.plant.inputs.iter().map(|s| s.id).collect();
    for (id, motor) in motors {
        if !ids.contains(&id.as_str()) {
            return Err(unknown("motor", "input", id, &ids));
        }
        motor.check(&format!("motor.{id}"))?;
    }
    let inputs = model.plant.inputs.iter();
    inputs
        .map(|s| match motors.get(s.id) {
            Some(motor) if s.unit == "V" => Ok((s.id, motor)),
            Some(_) => {
                let message = format!("`{}` is in {}, expected an input in V", s.id, s.unit);
                Err(BuildError::at(&format!("motor.{}", s.id), message))
            }
            None => {
                let message = format!("no motor is given for the input `{}`", s.id);
                Err(BuildError::at("motor", message)
                    .help(format!("add [driver.linux_gpio.motor.{}]", s.id)))
            }
        })
        .collect()
}

/// What one count of each motor is in each measured signal, for readings `period` s apart.
pub(crate) fn gains(
    motors: &[(&'static str, &Motor)],
    model: &Model,
    period: f64,
) -> Result<Vec<f64>, BuildError> {
    let shafts: Vec<&str> = motors.iter().map(|(_, m)| m.shaft.as_str()).collect();
    let mut gains = Vec::new();
    for measured in &model.measured {
        let Sensor::EncoderCounts(encoder) = &measured.sensor else {
            let message = format!(
                "the model measures `{}` by {}, this driver has encoder counts only",
                measured.signal.id,
                measured.sensor.name()
            );
            return Err(BuildError::at("", message)
                .help("give the signal `sensor = { encoder_counts = { … } }` in the model file"));
        };
        let mut row = vec![0.0; motors.len()];
        let own = [(measured.signal.id.to_owned(), 1.0)].into();
        let of = if encoder.of.is_empty() {
            &own
        } else {
            &encoder.of
        };
        for (shaft, gain) in of {
            let Some(at) = shafts.iter().position(|s| s == shaft) else {
                let mut error = unknown("motor", "shaft", shaft, &shafts);
                error.key = "motor".to_owned();
                error.message += &format!(", for the encoder behind `{}`", measured.signal.id);
                return Err(error);
            };
            row[at] += gain * encoder.resolution() / period;
        }
        gains.extend(row);
    }
    Ok(gains)
}
