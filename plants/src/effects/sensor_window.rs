//! A sensor that averages.

use crate::declare_effect;
use loopsight_core::{Effect, EffectMeta, Parameter, PlaceKind, Reading, Real};

use super::LONGEST_S;

/// Sensor window: the sensor reports a moving mean.
///
/// ```text
/// y_measured(t) = mean of y over (t - window, t)
/// ```
///
/// | symbol | what | unit |
/// |---|---|---|
/// | `y` | the signal | that of the channel |
/// | `window` | length of the mean, beyond the averaging the sensor is declared with | s |
///
/// A sensor that is declared as a mean over its last period gets a mean over that period and the
/// window before it: the delay is that of both in a row, `(period + window)/2`, the shape one
/// rectangle.
///
/// Assumptions: equal weights. Motor controllers average the speed of an encoder so, often over
/// 100 ms.
///
/// Reference: CTRE Phoenix documentation, "Velocity measurement filter" (100 ms period, rolling
/// average of 64 samples); L. Ljung (1999), "System Identification", 2nd edition, section 14.4,
/// prefiltering.
#[derive(Clone, Copy, Debug)]
pub struct SensorWindow;

impl Effect for SensorWindow {
    const META: EffectMeta = EffectMeta {
        id: "sensor_window",
        summary: "the sensor reports a moving mean over a window",
        symptom: "the measured curve is a rounded copy that lies behind by half a window; after a step it rises along a straight line and is then right at once",
        remedy: "shorten the averaging of the sensor; take the angle and difference it yourself",
        equation: "y_measured(t) = mean of y over (t - window, t)",
        reference: "CTRE Phoenix documentation, velocity measurement filter; Ljung (1999), System Identification, 2nd ed., section 14.4",
        example: "[[effect]]\n[effect.sensor_window]\nat = [\"sensor.linear_velocity\", \"sensor.angular_velocity\"]\nwindow = 0.1\n",
        places: &[PlaceKind::Output],
        parameters: &[
            Parameter::new("window", "W", "s", "length of the moving mean")
                .within(0.0, LONGEST_S)
                .or(0.0)
                .nonlinear()
                .scaled(0.02),
        ],
        memory: true,
        rarity: 2,
        ..EffectMeta::PLAIN
    };

    fn contribution<S: Real>(at: &Reading<'_, S>, _z: &[S; 0], p: &[S; 1]) -> S {
        at.past.mean(S::of(at.from) - p[0], S::of(at.to)) - at.nominal
    }
}

declare_effect!(SensorWindow, "sensor_window");

#[cfg(test)]
mod tests {
    use crate::effects::testing::*;

    use super::*;

    #[test]
    fn lies_behind_by_half_a_window() {
        let at = Reading {
            from: 2.0,
            to: 2.0,
            nominal: 2.0,
            past: &Ramp,
            ..reading(&[])
        };
        let w: f64 = SensorWindow::contribution(&at, &[], &[0.1]);
        assert!((w + 0.05).abs() < 1e-15);
    }
}
