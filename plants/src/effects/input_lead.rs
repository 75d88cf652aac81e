//! A command that is logged after it acted.

use crate::declare_effect;
use loopsight_core::{Effect, EffectMeta, Parameter, PlaceKind, Reading, Real};

/// Input lead: the command acts before the time under which it was logged.
///
/// ```text
/// u_effective(t) = u_log(t + lead)
/// ```
///
/// | symbol | what | unit |
/// |---|---|---|
/// | `u_log` | the command as the log has it, constant or straight between its samples | that of the channel |
/// | `lead` | time from the actuator to the line of the log | s |
///
/// A program that sends its command, does the rest of its cycle and writes the log at the end of it makes such a log. So
/// does one that logs a command when a status message brings it back. The machine has no part in this. It is an effect
/// of how the log was written, and a model needs it only to follow that log.
///
/// A recording is known to its end, so a simulation of it can look ahead: a comparison, a fit, a diagnosis, and
/// `simulate` with commands from a file. After its last line the last command holds. In a running loop nothing is known ahead and
/// a command acts when it is sent: there the effect does nothing, and the notes of the loop say that it is left out.
///
/// A lead of all inputs is the same as measurements that are all early by the same time. It is one candidate, at
/// the inputs. With `input_delay` at the same input only the difference of the two would show, so a model has one of
/// them. Of the log that a lead makes, a delay of zero is the least bad, and friction, saturation or play stand in.
///
/// Over an integration step the command is replaced by its mean, which moves continuously with the
/// lead: its derivative by the lead exists and is exact for the model that is computed.
///
/// Reference: K. J. Åström, B. Wittenmark (1997), "Computer-Controlled Systems", 3rd edition, section 2.3, sampling of
/// systems with time delay; here the delay is below zero.
#[derive(Clone, Copy, Debug)]
pub struct InputLead;

/// The longest lead, s.
const LONGEST: f64 = 0.25;

impl Effect for InputLead {
    const META: EffectMeta = EffectMeta {
        id: "input_lead",
        summary: "the command is logged after it acted",
        symptom: "the machine answers before the log shows the command: before each step of the command the residual is a short pulse of the size of the motion that came early",
        remedy: "log the command in the cycle in which it is sent, with the time at which it is sent",
        equation: "u_effective(t) = u_log(t + lead)",
        reference: "Åström, Wittenmark (1997), Computer-Controlled Systems, 3rd ed., section 2.3, with a delay below zero",
        example: "[[effect]]\n[effect.input_lead]\nat = [\"input.right\", \"input.left\"]\nlead = 0.02\n",
        places: &[PlaceKind::Input],
        parameters: &[Parameter::new(
            "lead",
            "τ",
            "s",
            "time from the actuator to the line of the log",
        )
        .within(0.0, LONGEST)
        .or(0.0)
        .nonlinear()
        .scaled(0.01)],
        memory: true,
        ahead_s: LONGEST,
        rarity: 2,
        ..EffectMeta::PLAIN
    };

    fn contribution<S: Real>(at: &Reading<'_, S>, _z: &[S; 0], p: &[S; 1]) -> S {
        let [lead] = *p;
        at.past.mean(S::of(at.from) + lead, S::of(at.to) + lead) - at.nominal
    }
}

declare_effect!(InputLead, "input_lead");

#[cfg(test)]
mod tests {
    use loopsight_core::Past;

    use crate::effects::testing::*;

    use super::*;

    /// A command that was 0 and is logged as 1 from t = 1 s on.
    struct Step;
    impl Past<f64> for Step {
        fn mean(&self, from: f64, to: f64) -> f64 {
            ((to - 1.0).max(0.0) - (from - 1.0).max(0.0)) / (to - from)
        }
    }

    #[test]
    fn a_step_acts_before_it_is_logged() {
        let effective = |from: f64| {
            let at = Reading {
                time: from,
                from,
                to: from + 0.01,
                nominal: 0.0,
                past: &Step,
                ..reading(&[])
            };
            InputLead::contribution(&at, &[], &[0.035])
        };
        assert!(effective(0.95).abs() < 1e-12);
        assert!((effective(0.96) - 0.5).abs() < 1e-9);
        assert!((effective(0.97) - 1.0).abs() < 1e-12);
    }
}
