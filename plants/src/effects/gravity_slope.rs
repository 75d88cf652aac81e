//! A floor that is not level.

use crate::declare_effect;
use loopsight_core::{Effect, EffectMeta, Parameter, PlaceKind, Reading, Real, Role};

/// Gravity on a slope: the floor is not level.
///
/// ```text
/// w = cosine · cos(heading) + sine · sin(heading) = -g sin(slope) · cos(heading - uphill)
/// ```
///
/// | symbol | what | unit |
/// |---|---|---|
/// | `heading` | heading of the vehicle, zero at the start of the log | rad |
/// | `cosine` | acceleration at heading zero | that of the channel, m/s² |
/// | `sine` | acceleration at heading π/2 | that of the channel |
///
/// The two components are linear; slope and direction follow from them:
/// `sin(slope) = √(cosine² + sine²)/g`, `uphill = atan2(-sine, -cosine)`.
///
/// Assumptions: one plane for the whole log, a heading that is that of the model (integrated from
/// the yaw rate); the force across the heading is carried by the wheels. The moment that a centre
/// of mass off the axle would add to the yaw is left out.
///
/// Reference: J. Y. Wong (2008), "Theory of Ground Vehicles", 4th edition, Wiley, section 3.1,
/// grade resistance.
#[derive(Clone, Copy, Debug)]
pub struct GravitySlope;

impl Effect for GravitySlope {
    const META: EffectMeta = EffectMeta {
        id: "gravity_slope",
        summary: "a slope under a vehicle: pushes downhill, whatever the heading",
        symptom: "faster one way and slower on the way back; the residual of the forward speed goes with the heading, once per turn of the vehicle",
        remedy: "level the floor, or feed forward the force of the slope with the heading",
        equation: "w = cosine cos(heading) + sine sin(heading)",
        reference: "Wong (2008), Theory of Ground Vehicles, 4th ed., section 3.1 (grade resistance)",
        example: "[[effect]]\n[effect.gravity_slope]\nat = [\"body.forward\"]\ncosine = -0.3\nsine = 0.1\n",
        places: &[PlaceKind::Effort],
        reads: &[Role::Heading, Role::Forward],
        parameters: &[
            Parameter::new("cosine", "a", "channel", "acceleration at heading zero")
                .or(0.0)
                .scaled(0.3),
            Parameter::new("sine", "b", "channel", "acceleration at heading π/2")
                .or(0.0)
                .scaled(0.3)
                .shown_by(Role::Heading),
        ],
        rarity: 2,
        ..EffectMeta::PLAIN
    };

    fn contribution<S: Real>(at: &Reading<'_, S>, _z: &[S; 0], p: &[S; 2]) -> S {
        let heading = at.get(Role::Heading);
        let (sin, cos) = heading.sin_cos();
        p[0] * cos + p[1] * sin
    }
}

declare_effect!(GravitySlope, "gravity_slope");

#[cfg(test)]
mod tests {
    use crate::effects::testing::*;

    use super::*;

    #[test]
    fn pushes_downhill() {
        // 2 degrees, uphill at heading 0.4 rad.
        let (force, uphill) = (9.81 * 0.0349f64, 0.4f64);
        let p = [-force * uphill.cos(), -force * uphill.sin()];
        for heading in [0.0, 0.4, 2.0, 3.5] {
            let w = GravitySlope::contribution(&reading(&[(Role::Heading, heading)]), &[], &p);
            assert!((w + force * (heading - uphill).cos()).abs() < 1e-12);
        }
    }
}
