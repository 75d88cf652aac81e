//! Wheels of different size.

use crate::declare_effect;
use loopsight_core::{Effect, EffectMeta, Parameter, PlaceKind, Reading, Real, Role};

/// Wheels of different size: odometry that takes them for equal turns straight runs into arcs.
///
/// ```text
/// angle_counted = angle / (1 + side · mismatch)        side = +1 right, -1 left
/// ```
///
/// | symbol | what | unit |
/// |---|---|---|
/// | `angle` | what the encoder would count with the nominal radius, or a wheel's speed made from it | that of the channel |
/// | `mismatch` | half the relative difference of the radii, right above left | 1 |
///
/// A larger wheel turns less for the same way over ground. Assumptions: the body moves as the
/// model says; only what the encoders make of it changes. (A larger wheel also pushes less and
/// runs faster at the same voltage; that is a `gain_asymmetry` beside it.)
///
/// Reference: J. Borenstein, L. Feng (1996), "Measurement and correction of systematic odometry
/// errors in mobile robots", IEEE Transactions on Robotics and Automation 12(6), 869–880: unequal
/// wheel diameters, `E_d`, of the UMBmark test.
#[derive(Clone, Copy, Debug)]
pub struct WheelRadiusMismatch;

impl Effect for WheelRadiusMismatch {
    const META: EffectMeta = EffectMeta {
        id: "wheel_radius_mismatch",
        summary: "left and right wheels of different size",
        symptom: "odometry reports a turn on straight runs, in proportion to the speed, the other way round backwards",
        remedy: "measure the arc of a long straight run (UMBmark) and give each wheel its own radius; inflate or exchange the tyre",
        equation: "angle_counted = angle / (1 + side mismatch)",
        reference: "Borenstein, Feng (1996), IEEE Transactions on Robotics and Automation 12(6), 869-880 (UMBmark, E_d)",
        example: "[[effect]]\n[effect.wheel_radius_mismatch]\nat = [\"encoder.right\", \"encoder.left\"]\nmismatch = 0.01\n",
        places: &[PlaceKind::Output],
        reads: &[Role::Shaft],
        sided: true,
        shared_only: true,
        parameters: &[Parameter::new(
            "mismatch",
            "ε",
            "1",
            "half the relative difference of the radii, right above left",
        )
        .within(-0.5, 0.5)
        .or(0.0)
        .nonlinear()
        .scaled(0.02)],
        ..EffectMeta::PLAIN
    };

    fn contribution<S: Real>(at: &Reading<'_, S>, _z: &[S; 0], p: &[S; 1]) -> S {
        let larger = at.side * p[0];
        -at.nominal * larger / (S::one() + larger)
    }
}

declare_effect!(WheelRadiusMismatch, "wheel_radius_mismatch");

#[cfg(test)]
mod tests {
    use crate::effects::testing::*;

    use super::*;

    #[test]
    fn the_larger_wheel_turns_less() {
        for (side, expected) in [(1.0, 10.0 / 1.01), (-1.0, 10.0 / 0.99)] {
            let at = Reading {
                nominal: 10.0,
                side,
                ..reading(&[])
            };
            let w: f64 = WheelRadiusMismatch::contribution(&at, &[], &[0.01]);
            assert!((10.0 + w - expected).abs() < 1e-12);
        }
    }
}
