//! A gain that changes as time goes by.

use crate::declare_effect;
use loopsight_core::{Effect, EffectMeta, Parameter, PlaceKind, Reading, Real, Shows};

/// Gain drift: what a command does changes with time alone.
///
/// ```text
/// u_effective = u (1 + rate · t)
/// ```
///
/// | symbol | what | unit |
/// |---|---|---|
/// | `u` | the command | that of the channel |
/// | `rate` | growth of the gain per second, as a share of the gain at the start; a battery that runs down has a negative one | 1/s |
/// | `t` | time since the start of the run | s |
///
/// Assumptions: so little of the battery, or of the way to a warm machine, passes during a run that the change is
/// straight; it does not depend on what the machine does (`winding_heating` and `battery_sag` do); each run begins with
/// the gain of the model. Where a recording is several runs the last is not so, and a diagnosis does not try the effect.
///
/// Where every command has the same magnitude (a PRBS) winding heating without cooling is the same.
///
/// In a running loop nothing compensates it: its time is that of a recording. Learn the gain there.
///
/// Reference: L. Ljung (1999), "System Identification: Theory for the User", 2nd edition, chapter 11, systems that change in
/// time; G. L. Plett (2015), "Battery Management Systems, Volume 1: Battery Modeling", Artech House, chapter
/// 2, open-circuit voltage over the state of charge.
#[derive(Clone, Copy, Debug)]
pub struct GainDrift;

impl Effect for GainDrift {
    const META: EffectMeta = EffectMeta {
        id: "gain_drift",
        summary: "what a command does changes with time alone: a battery that runs down, magnets that warm up",
        symptom: "the model is right in the middle of the log, and too strong at one end and too weak at the other, by the same percentage at every level of the command",
        remedy: "measure the supply and divide the command by it; let the machine warm up before identifying; estimate the gain while running",
        equation: "u_effective = u (1 + rate t)",
        reference: "Ljung (1999), System Identification, 2nd ed., chapter 11; Plett (2015), Battery Management Systems, Volume 1, chapter 2 (open-circuit voltage)",
        example: "[[effect]]\n[effect.gain_drift]\nat = [\"input.right\", \"input.left\"]\nrate = -0.001\n",
        places: &[PlaceKind::Input],
        parameters: &[Parameter::new(
            "rate",
            "r",
            "1/s",
            "growth of the gain per second, as a share of that at the start",
        )
        .or(0.0)
        .scaled(0.005)],
        shows: Shows::OneRun,
        rarity: 2,
        ..EffectMeta::PLAIN
    };

    fn contribution<S: Real>(at: &Reading<'_, S>, _z: &[S; 0], p: &[S; 1]) -> S {
        at.nominal * p[0] * S::of(at.time)
    }
}

declare_effect!(GainDrift, "gain_drift");

#[cfg(test)]
mod tests {
    use crate::effects::testing::*;

    use super::*;

    #[test]
    fn a_battery_that_runs_down_gives_less_later() {
        let effective = |time: f64| {
            let at = Reading {
                time,
                nominal: -8.0,
                ..reading(&[])
            };
            -8.0 + GainDrift::contribution(&at, &[], &[-0.002])
        };
        assert_eq!(effective(0.0), -8.0);
        assert!((effective(100.0) + 6.4).abs() < 1e-12);
    }
}
