//! Transport delay of a command.

use crate::declare_effect;
use loopsight_core::{Effect, EffectMeta, Parameter, PlaceKind, Reading, Real};

use super::LONGEST_S;

/// Input delay: the command arrives later than it was logged.
///
/// ```text
/// u_effective(t) = u(t - delay)
/// ```
///
/// | symbol | what | unit |
/// |---|---|---|
/// | `u` | the command, constant between the samples of the log | that of the channel |
/// | `delay` | time from the log to the actuator | s |
///
/// Over an integration step the delayed command is replaced by its mean, which moves continuously
/// with the delay: its derivative by the delay exists and is exact for the model that is computed.
///
/// Reference: K. J. Åström, B. Wittenmark (1997), "Computer-Controlled Systems", 3rd edition,
/// section 2.3, sampling of systems with time delay.
#[derive(Clone, Copy, Debug)]
pub struct InputDelay;

impl Effect for InputDelay {
    const META: EffectMeta = EffectMeta {
        id: "input_delay",
        summary: "the command takes effect later than logged",
        symptom: "after each step of the command the residual is a short pulse of the size of the missed motion, and the residual is correlated with the input at short lags",
        remedy: "shorten the path from command to actuator; predict the state over the delay in the controller",
        equation: "u_effective(t) = u(t - delay)",
        reference: "Åström, Wittenmark (1997), Computer-Controlled Systems, 3rd ed., section 2.3",
        example: "[[effect]]\n[effect.input_delay]\nat = [\"input.right\", \"input.left\"]\ndelay = 0.02\n",
        places: &[PlaceKind::Input],
        parameters: &[
            Parameter::new("delay", "τ", "s", "time from the log to the actuator")
                .within(0.0, LONGEST_S)
                .or(0.0)
                .nonlinear()
                .scaled(0.01),
        ],
        memory: true,
        rarity: 0,
        ..EffectMeta::PLAIN
    };

    fn contribution<S: Real>(at: &Reading<'_, S>, _z: &[S; 0], p: &[S; 1]) -> S {
        let [delay] = *p;
        at.past.mean(S::of(at.from) - delay, S::of(at.to) - delay) - at.nominal
    }
}

declare_effect!(InputDelay, "input_delay");

#[cfg(test)]
mod tests {
    use loopsight_core::Past;

    use crate::effects::testing::*;

    use super::*;

    /// A command that was 0 and is 1 from t = 1 s on.
    struct Step;
    impl Past<f64> for Step {
        fn mean(&self, from: f64, to: f64) -> f64 {
            ((to - 1.0).max(0.0) - (from - 1.0).max(0.0)) / (to - from)
        }
    }

    #[test]
    fn a_step_arrives_after_the_delay() {
        let effective = |from: f64| {
            let at = Reading {
                time: from,
                from,
                to: from + 0.01,
                nominal: 1.0,
                past: &Step,
                ..reading(&[])
            };
            1.0 + InputDelay::contribution(&at, &[], &[0.035])
        };
        assert!(effective(1.02).abs() < 1e-12);
        assert!((effective(1.03) - 0.5).abs() < 1e-9);
        assert!((effective(1.04) - 1.0).abs() < 1e-12);
    }
}
