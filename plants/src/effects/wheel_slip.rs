//! The limit of traction.

use loopsight_core::{
    Effect, EffectMeta, Parameter, PlaceKind, Reading, Real, Role, declare_effect,
};

/// Wheel slip: the ground takes no more than the traction limit, and what exceeds it is lost.
///
/// ```text
/// drive = U + other efforts          w = (drive held within ±limit) - drive
/// ```
///
/// | symbol | what | unit |
/// |---|---|---|
/// | `U` | voltage over the winding: what the motor drives with, its back-emf deducted | V |
/// | `limit` | traction limit, as the voltage at standstill that reaches it | that of the channel, V |
///
/// A wheel that slips pushes with the limit, whatever its slip: `limit` is `μ N r` in newton
/// metres times winding resistance over torque constant and gear. Assumptions: the same forwards
/// and backwards, no lateral force, constant load on the wheel. The model knows one speed per
/// wheel, that over ground; an encoder on a wheel that spins shows more.
///
/// Reference: J. Y. Wong (2008), "Theory of Ground Vehicles", 4th edition, Wiley, section 3.1,
/// maximum tractive effort.
#[derive(Clone, Copy, Debug)]
pub struct WheelSlip;

impl Effect<1, 0> for WheelSlip {
    const META: EffectMeta = EffectMeta {
        id: "wheel_slip",
        summary: "the ground takes no more than the traction limit; what exceeds it is lost",
        symptom: "gentle starts are right, hard ones and reversals are too slow in the robot; the residual appears only where the acceleration is high",
        remedy: "limit the acceleration that is asked for; more weight on the driven wheels, softer tyres, a cleaner floor",
        equation: "w = (U + efforts) held within ±limit - (U + efforts)",
        reference: "Wong (2008), Theory of Ground Vehicles, 4th ed., section 3.1 (maximum tractive effort)",
        example: "[[effect]]\n[effect.wheel_slip]\nat = [\"wheel.right\", \"wheel.left\"]\nlimit = 5.0\n",
        places: &[PlaceKind::Effort],
        reads: &[Role::Armature],
        parameters: &[Parameter::new(
            "limit",
            "U_max",
            "channel",
            "traction limit, as the voltage at standstill that reaches it",
        )
        .above(0.0)
        .or(1000.0)
        .nonlinear()
        .starting_at(&[1.5, 3.0, 5.0, 8.0, 12.0, 20.0])],
        rarity: 2,
        ..EffectMeta::PLAIN
    };

    fn contribution<S: Real>(at: &Reading<'_, S>, _z: &[S; 0], p: &[S; 1]) -> S {
        let drive = at.get(Role::Armature) + at.nominal;
        drive.held(-p[0], p[0]) - drive
    }
}

declare_effect!(WheelSlip, "wheel_slip", <1, 0>);

#[cfg(test)]
mod tests {
    use crate::effects::testing::*;

    use super::*;

    #[test]
    fn what_exceeds_the_limit_is_lost() {
        let pushed = |drive: f64, friction: f64| {
            let at = Reading {
                nominal: friction,
                ..reading(&[(Role::Armature, drive)])
            };
            drive + friction + WheelSlip::contribution(&at, &[], &[5.0])
        };
        assert_eq!(pushed(4.0, -1.0), 3.0);
        assert_eq!(pushed(9.0, -1.0), 5.0);
        assert_eq!(pushed(-9.0, 1.0), -5.0);
    }
}
