//! A bias of the actuator.

use crate::declare_effect;
use loopsight_core::{Effect, EffectMeta, Parameter, PlaceKind, Reading, Real};

/// Input offset: a constant is added to every command.
///
/// ```text
/// u_effective = u + offset
/// ```
///
/// | symbol | what | unit |
/// |---|---|---|
/// | `u` | the command | that of the channel |
/// | `offset` | what is added | that of the channel |
///
/// Assumptions: constant over the log. Where an effort channel has the same sign and gain as the
/// input (a wheel of a `ddmr`, the shaft of a `dc_axis`) it cannot be told from a constant force
/// there.
///
/// Reference: L. Ljung (1999), "System Identification", 2nd edition, section 14.1, drifts and
/// detrending.
#[derive(Clone, Copy, Debug)]
pub struct InputOffset;

impl Effect for InputOffset {
    const META: EffectMeta = EffectMeta {
        id: "input_offset",
        summary: "a constant is added to every command",
        symptom: "the residual drifts the same way whatever the command; the robot creeps at zero command",
        remedy: "subtract the offset from the command; trim the amplifier",
        equation: "u_effective = u + offset",
        reference: "Ljung (1999), System Identification, 2nd ed., section 14.1",
        example: "[[effect]]\n[effect.input_offset]\nat = [\"input.right\"]\noffset = 0.2\n",
        places: &[PlaceKind::Input],
        parameters: &[
            Parameter::new("offset", "u_0", "channel", "what is added to the command")
                .or(0.0)
                .scaled(0.3),
        ],
        is_static: true,
        ..EffectMeta::PLAIN
    };

    fn contribution<S: Real>(_at: &Reading<'_, S>, _z: &[S; 0], p: &[S; 1]) -> S {
        p[0]
    }
}

declare_effect!(InputOffset, "input_offset");

#[cfg(test)]
mod tests {
    use crate::effects::testing::*;

    use super::*;

    #[test]
    fn is_added_to_any_command() {
        for u in [-5.0, 0.0, 5.0] {
            let at = Reading {
                nominal: u,
                ..reading(&[])
            };
            assert_eq!(u + InputOffset::contribution(&at, &[], &[0.5]), u + 0.5);
        }
    }
}
