//! A centre of mass that is not over the axle.

use crate::declare_effect;
use loopsight_core::{Effect, EffectMeta, Parameter, PlaceKind, Reading, Real, Role};

/// The centre of mass off the axle: turning pushes the vehicle forward, and driving resists
/// turning.
///
/// ```text
/// v' gets  forward · ω²          ω' gets  -yaw · v ω
/// ```
///
/// | symbol | what | unit |
/// |---|---|---|
/// | `v`, `ω` | forward speed, yaw rate | m/s, rad/s |
/// | `forward` | what `K_B` is short of: the offset, less what the rotors carry | m/rad² |
/// | `yaw` | what `K_E` is short of, `m d/(I + m d²)` | 1/m |
///
/// For a rigid body with its centre of mass `d` ahead of the axle both have the sign of `d`. Where
/// the plant's own `K_B` and `K_E` are estimated they take this up, and the effect adds nothing.
///
/// Assumptions: a rigid body in the plane; no load that swings.
///
/// Reference: T. G. Alves, W. F. Lages, R. V. B. Henriques (2018), IFAC PapersOnLine 51-15,
/// 437–442, equations (17), (31), (34), (37).
#[derive(Clone, Copy, Debug)]
pub struct CentrifugalOffset;

impl Effect for CentrifugalOffset {
    const META: EffectMeta = EffectMeta {
        id: "centrifugal_offset",
        summary: "the centre of mass off the axle: turning pushes forward, driving resists turning",
        symptom: "straight runs and slow turns are right, fast arcs are not: the residual of the forward speed goes with the square of the yaw rate, that of the yaw rate with speed times yaw rate",
        remedy: "estimate K_B and K_E; move the battery so that the centre of mass lies over the axle",
        equation: "v' gets forward ω^2; ω' gets -yaw v ω",
        reference: "Alves, Lages, Henriques (2018), IFAC PapersOnLine 51-15, 437-442, equations (17), (31), (34), (37)",
        example: "[[effect]]\n[effect.centrifugal_offset]\nat = [\"body.forward\", \"body.yaw\"]\nforward = 0.02\nyaw = 3.0\n",
        places: &[PlaceKind::Effort],
        reads: &[Role::Centrifugal],
        sided: true,
        shared_only: true,
        parameters: &[
            Parameter::new(
                "forward",
                "d",
                "m/rad^2",
                "forward acceleration per squared yaw rate",
            )
            .or(0.0)
            .scaled(0.005)
            .on_sides(&[1]),
            Parameter::new(
                "yaw",
                "e",
                "1/m",
                "yaw acceleration against the turn, per speed and yaw rate",
            )
            .or(0.0)
            .on_sides(&[-1]),
        ],
        ..EffectMeta::PLAIN
    };

    fn contribution<S: Real>(at: &Reading<'_, S>, _z: &[S; 0], p: &[S; 2]) -> S {
        let [forward, yaw] = *p;
        let coefficient = if at.side < S::zero() { yaw } else { forward };
        coefficient * at.get(Role::Centrifugal)
    }
}

declare_effect!(CentrifugalOffset, "centrifugal_offset");

#[cfg(test)]
mod tests {
    use crate::effects::testing::*;

    use super::*;

    #[test]
    fn each_axis_has_its_coefficient() {
        let mut at = reading(&[(Role::Centrifugal, 4.0)]);
        at.side = 1.0;
        assert_eq!(
            CentrifugalOffset::contribution(&at, &[], &[0.02, 3.0]),
            0.08
        );
        at.side = -1.0;
        assert_eq!(
            CentrifugalOffset::contribution(&at, &[], &[0.02, 3.0]),
            12.0
        );
    }
}
