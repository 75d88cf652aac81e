//! A sensor that does not know the direction.

use crate::declare_effect;
use loopsight_core::{Effect, EffectMeta, Parameter, PlaceKind, Reading, Real, Shows};

/// Magnitude sensor: what goes the other way is read with the wrong sign, or not at all.
///
/// ```text
/// y_measured = y                      y >= 0
/// y_measured = y (1 - 2 turned)       y < 0
/// ```
///
/// | symbol | what | unit |
/// |---|---|---|
/// | `y` | the signal | that of the channel |
/// | `turned` | how much of a negative signal is turned: 1 gives the magnitude, `½` nothing at all, 0 the signal itself | 1 |
///
/// A tachometer that counts pulses, a shaft encoder with one track, or a current sensor behind a rectifier has
/// `turned = 1`. A current sensor whose amplifier ends at zero has `½`.
///
/// Assumptions: no threshold about zero. With nothing but such sensors the sign of the plant's gain is not
/// determined: the machine that turns the other way gives the same log. A fit keeps the sign it begins with.
///
/// Reference: E. O. Doebelin (2003), "Measurement Systems", 5th edition, McGraw-Hill, chapter 4: tachometers that
/// count or rectify do not sense the direction.
#[derive(Clone, Copy, Debug)]
pub struct SensorMagnitude;

impl Effect for SensorMagnitude {
    const META: EffectMeta = EffectMeta {
        id: "sensor_magnitude",
        summary: "the sensor gives the magnitude only, whichever way the signal goes",
        symptom: "the measured signal is never negative, although the input changes its sign: it touches zero and comes back up at every reversal",
        remedy: "give the reading the sign of the command where the machine follows it at once; otherwise a sensor that knows the direction, such as an encoder with two tracks",
        equation: "y_measured = y where y >= 0, else y (1 - 2 turned)",
        reference: "Doebelin (2003), Measurement Systems, 5th ed., chapter 4 (tachometers that do not sense the direction)",
        example: "[[effect]]\n[effect.sensor_magnitude]\nat = [\"sensor.speed\"]\nturned = 1.0\n",
        places: &[PlaceKind::Output],
        parameters: &[Parameter::new(
            "turned",
            "σ",
            "1",
            "1: the magnitude; 0.5: nothing of a negative signal; 0: the signal with its sign",
        )
        .within(0.0, 1.0)
        .or(0.0)
        .nonlinear()
        .scaled(0.5)
        .starting_at(&[1.0, 0.5])],
        shows: Shows::NeverNegative,
        ..EffectMeta::PLAIN
    };

    fn contribution<S: Real>(at: &Reading<'_, S>, _z: &[S; 0], p: &[S; 1]) -> S {
        if at.nominal < S::zero() {
            -(p[0] + p[0]) * at.nominal
        } else {
            S::zero()
        }
    }
}

declare_effect!(SensorMagnitude, "sensor_magnitude");

#[cfg(test)]
mod tests {
    use crate::effects::testing::*;

    use super::*;

    fn read(y: f64, turned: f64) -> f64 {
        let at = Reading {
            nominal: y,
            ..reading(&[])
        };
        y + SensorMagnitude::contribution(&at, &[], &[turned])
    }

    #[test]
    fn the_magnitude_or_nothing_of_what_goes_backwards() {
        for y in [-3.0, -0.2, 0.0, 2.5] {
            assert_eq!(read(y, 1.0), y.abs());
            assert_eq!(read(y, 0.5), y.max(0.0));
            assert_eq!(read(y, 0.0), y);
        }
    }
}
