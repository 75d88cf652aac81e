//! A sensor with a wrong scale.

use crate::declare_effect;
use loopsight_core::{Effect, EffectMeta, Parameter, PlaceKind, Reading, Real};

/// Sensor scale: the sensor reads too much, or too little, in proportion.
///
/// ```text
/// y_measured = y · (1 + error)
/// ```
///
/// | symbol | what | unit |
/// |---|---|---|
/// | `y` | the signal | that of the channel |
/// | `error` | relative error of the scale | 1 |
///
/// Assumptions: the same at all levels and in both directions. Where every gain of the plant from
/// the inputs to this signal is estimated, they take it up; it shows where signals depend on each
/// other (a pose beside a speed, wheels beside the body).
///
/// Reference: D. H. Titterton, J. L. Weston (2004), "Strapdown Inertial Navigation Technology", 2nd
/// edition, IET, chapter 4, scale-factor error.
#[derive(Clone, Copy, Debug)]
pub struct SensorScale;

impl Effect for SensorScale {
    const META: EffectMeta = EffectMeta {
        id: "sensor_scale",
        summary: "the sensor reads too much or too little, in proportion",
        symptom: "the residual is a fixed percentage of the signal",
        remedy: "calibrate against a known distance, angle or speed",
        equation: "y_measured = y (1 + error)",
        reference: "Titterton, Weston (2004), Strapdown Inertial Navigation Technology, 2nd ed., chapter 4 (scale-factor error)",
        example: "[[effect]]\n[effect.sensor_scale]\nat = [\"sensor.linear_velocity\"]\nerror = -0.03\n",
        places: &[PlaceKind::Output],
        parameters: &[
            Parameter::new("error", "ε", "1", "relative error of the scale")
                .above(-1.0)
                .or(0.0)
                .nonlinear()
                .scaled(0.02),
        ],
        ..EffectMeta::PLAIN
    };

    fn contribution<S: Real>(at: &Reading<'_, S>, _z: &[S; 0], p: &[S; 1]) -> S {
        p[0] * at.nominal
    }
}

declare_effect!(SensorScale, "sensor_scale");

#[cfg(test)]
mod tests {
    use crate::effects::testing::*;

    use super::*;

    #[test]
    fn is_proportional_to_the_signal() {
        let at = Reading {
            nominal: -2.0,
            ..reading(&[])
        };
        let w: f64 = SensorScale::contribution(&at, &[], &[-0.03]);
        assert!((w - 0.06).abs() < 1e-15);
    }
}
