//! A bias of the sensor.

use crate::declare_effect;
use loopsight_core::{Effect, EffectMeta, Parameter, PlaceKind, Reading, Real};

/// Sensor offset: a constant is added to what the sensor reads.
///
/// ```text
/// y_measured = y + offset
/// ```
///
/// | symbol | what | unit |
/// |---|---|---|
/// | `y` | the signal | that of the channel |
/// | `offset` | what is added | that of the channel |
///
/// Assumptions: constant over the log. On an encoder that only speeds are made from it has no
/// influence.
///
/// Reference: D. H. Titterton, J. L. Weston (2004), "Strapdown Inertial Navigation Technology", 2nd
/// edition, IET, chapter 4, fixed bias.
#[derive(Clone, Copy, Debug)]
pub struct SensorOffset;

impl Effect for SensorOffset {
    const META: EffectMeta = EffectMeta {
        id: "sensor_offset",
        summary: "a constant is added to what the sensor reads",
        symptom: "the residual is the same constant at every speed, standing still included",
        remedy: "take the mean at rest and subtract it before each run",
        equation: "y_measured = y + offset",
        reference: "Titterton, Weston (2004), Strapdown Inertial Navigation Technology, 2nd ed., chapter 4 (fixed bias)",
        example: "[[effect]]\n[effect.sensor_offset]\nat = [\"sensor.angular_velocity\"]\noffset = 0.02\n",
        places: &[PlaceKind::Output],
        parameters: &[
            Parameter::new("offset", "y_0", "channel", "what the sensor reads at zero")
                .or(0.0)
                .nonlinear()
                .scaled(0.1),
        ],
        rarity: 2,
        ..EffectMeta::PLAIN
    };

    fn contribution<S: Real>(_at: &Reading<'_, S>, _z: &[S; 0], p: &[S; 1]) -> S {
        p[0]
    }
}

declare_effect!(SensorOffset, "sensor_offset");

#[cfg(test)]
mod tests {
    use crate::effects::testing::*;

    use super::*;

    #[test]
    fn is_what_the_sensor_reads_at_zero() {
        assert_eq!(
            SensorOffset::contribution(&reading(&[]), &[], &[0.02]),
            0.02
        );
    }
}
