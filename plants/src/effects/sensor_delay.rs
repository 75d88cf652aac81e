//! A measurement that comes late.

use crate::declare_effect;
use loopsight_core::{Effect, EffectMeta, Parameter, PlaceKind, Reading, Real};

use super::LONGEST_S;

/// Sensor delay: the number in the log is an old one.
///
/// ```text
/// y_measured(t) = y(t - delay)
/// ```
///
/// | symbol | what | unit |
/// |---|---|---|
/// | `y` | the signal, as the sensor makes it (at an instant, or a mean over the last period) | that of the channel |
/// | `delay` | age of the measurement when it is stamped | s |
///
/// Assumptions: constant over the log. For a plant that does not change with time it cannot be
/// told from a delay of the input, unless several sensors have different ones.
///
/// Reference: K. J. Åström, B. Wittenmark (1997), "Computer-Controlled Systems", 3rd edition,
/// section 2.3.
#[derive(Clone, Copy, Debug)]
pub struct SensorDelay;

impl Effect for SensorDelay {
    const META: EffectMeta = EffectMeta {
        id: "sensor_delay",
        summary: "the measurement is older than its time stamp",
        symptom: "the measured curve lies behind the model's by a fixed time; the residual is a pulse at each start and stop, proportional to the rate of the signal",
        remedy: "stamp measurements where they are taken; shorten the bus cycle; predict over the delay in the controller",
        equation: "y_measured(t) = y(t - delay)",
        reference: "Åström, Wittenmark (1997), Computer-Controlled Systems, 3rd ed., section 2.3",
        example: "[[effect]]\n[effect.sensor_delay]\nat = [\"sensor.linear_velocity\", \"sensor.angular_velocity\"]\ndelay = 0.02\n",
        places: &[PlaceKind::Output],
        parameters: &[
            Parameter::new("delay", "τ", "s", "age of the measurement when stamped")
                .within(0.0, LONGEST_S)
                .or(0.0)
                .nonlinear()
                .scaled(0.01),
        ],
        memory: true,
        // Where nothing tells them apart, what is late is the command.
        rarity: 1,
        ..EffectMeta::PLAIN
    };

    fn contribution<S: Real>(at: &Reading<'_, S>, _z: &[S; 0], p: &[S; 1]) -> S {
        let [delay] = *p;
        at.past.mean(S::of(at.from) - delay, S::of(at.to) - delay) - at.nominal
    }
}

declare_effect!(SensorDelay, "sensor_delay");

#[cfg(test)]
mod tests {
    use crate::effects::testing::*;

    use super::*;

    #[test]
    fn shows_the_signal_of_then() {
        let at = Reading {
            from: 2.0,
            to: 2.0,
            nominal: 2.0,
            past: &Ramp,
            ..reading(&[])
        };
        let w: f64 = SensorDelay::contribution(&at, &[], &[0.03]);
        assert!((w + 0.03).abs() < 1e-15);
    }
}
