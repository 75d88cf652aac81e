//! How a measured signal is made. The sensor is part of the model.

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use serde::{Deserialize, Serialize};

/// What lies between a signal of the plant and the number in the log.
///
/// A velocity that is the difference of two encoder counts is the *mean* over the last period. Compared with an
/// instantaneous velocity, even a perfect model seems to have half a sample of delay.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Sensor {
    /// The value at the time stamp (a tachometer, a gyro, an absolute encoder).
    #[default]
    Instantaneous,
    /// The mean since the previous time stamp: a difference of positions divided by the period.
    IntervalMean,
    /// As [`Sensor::IntervalMean`], from counted pulses with the resolution given.
    EncoderCounts(Encoder),
}

/// Counted pulses behind a velocity.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Encoder {
    /// Counts per revolution of the encoder shaft, after quadrature.
    pub counts_per_revolution: f64,
    /// Shaft angles that are counted and the gain from each angle's rate (rad/s) to the signal:
    /// `v = r/2 (right + left)` has `{ shaft_angle_right = r/2, shaft_angle_left = r/2 }`.
    /// Empty: the signal's own integral is counted.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub of: BTreeMap<String, f64>,
}

impl Encoder {
    /// Angle of one count, rad.
    pub fn resolution(&self) -> f64 {
        TAU / self.counts_per_revolution
    }

    /// Standard deviation that rounding to counts alone gives the difference of two readings over
    /// `period` s, in the signal's unit: each reading is off by a uniform ±½ count.
    pub fn noise(&self, period: f64) -> f64 {
        let gain = if self.of.is_empty() {
            1.0
        } else {
            self.of.values().map(|g| g * g).sum::<f64>().sqrt()
        };
        gain * self.resolution() * (2.0f64 / 12.0).sqrt() / period
    }
}

impl Sensor {
    /// True when the value is the mean over the last period.
    pub fn is_mean(&self) -> bool {
        !matches!(self, Sensor::Instantaneous)
    }

    /// Whether it is what a file need not say.
    pub(crate) fn is_default(&self) -> bool {
        *self == Sensor::default()
    }

    /// Name used in reports.
    pub fn name(&self) -> &'static str {
        match self {
            Sensor::Instantaneous => "instantaneous",
            Sensor::IntervalMean => "interval mean",
            Sensor::EncoderCounts(_) => "encoder counts",
        }
    }
}
