//! A motor that warms up.

use crate::declare_effect;
use loopsight_core::{Effect, EffectMeta, Parameter, PlaceKind, Reading, Real, Role};

/// Winding heating: what a winding loses warms it, its resistance grows, and the current falls.
///
/// ```text
/// z' = heating U²/(1 + z) - cooling z          R = R₀ (1 + z)          w = -U z/(1 + z)
/// ```
///
/// | symbol | what | unit |
/// |---|---|---|
/// | `U` | voltage over the winding: the command less the back-emf | V |
/// | `z` | relative growth of the resistance, zero at the start of a run; copper grows by 0.39 % per kelvin | 1 |
/// | `heating` | growth per second and square volt: temperature coefficient over heat capacity and cold resistance, `α/(C R₀)` | 1/(V² s) |
/// | `cooling` | one over the thermal time constant, `1/(C R_th)` | 1/s |
///
/// Assumptions: one temperature in a winding, which loses `U²/R` and nothing else; each run starts
/// cold. The back-emf is what the damping of the plant stands for, so viscous friction is taken for
/// a part of it.
///
/// Reference: IEC 60034-1, temperature rise by the resistance method: for copper
/// `R₂/R₁ = (235 + ϑ₂)/(235 + ϑ₁)`, ϑ in °C; one heat capacity and one thermal resistance as in
/// R. Krishnan (2001), "Electric Motor Drives", section 1.8.
#[derive(Clone, Copy, Debug)]
pub struct WindingHeating;

impl Effect for WindingHeating {
    const META: EffectMeta = EffectMeta {
        id: "winding_heating",
        summary: "the resistance of the motor grows as it warms up",
        symptom: "the model is right at the beginning and too strong at the end: the residual grows with the work the motor has done since the start, most of all when accelerating",
        remedy: "estimate the gain while running; let the motor warm up before identifying; cool it or ask less of it",
        equation: "z' = heating U^2/(1 + z) - cooling z; w = -U z/(1 + z), U = command less back-emf",
        reference: "IEC 60034-1, resistance method: R2/R1 = (235 + T2)/(235 + T1) for copper; Krishnan (2001), Electric Motor Drives, section 1.8",
        example: "[[effect]]\n[effect.winding_heating]\nat = [\"input.right\", \"input.left\"]\nheating = 0.0003\ncooling = 0.03\n",
        places: &[PlaceKind::Input],
        reads: &[Role::Armature, Role::Drive],
        parameters: &[
            Parameter::new(
                "heating",
                "h",
                "1/V^2/s",
                "relative growth of the resistance per second and square volt over the winding",
            )
            .within(0.0, 1.0)
            .or(0.0)
            .nonlinear()
            .scaled(0.0003)
            .starting_at(&[0.0003, 0.001]),
            Parameter::new("cooling", "c", "1/s", "one over the thermal time constant")
                .within(0.0, 10.0)
                .or(0.0)
                .nonlinear()
                .scaled(0.03)
                .starting_at(&[0.03]),
        ],
        states: 1,
        rarity: 2,
        ..EffectMeta::PLAIN
    };

    fn contribution<S: Real>(at: &Reading<'_, S>, z: &[S; 1], _p: &[S; 2]) -> S {
        -over_winding(at) * z[0] / (S::one() + z[0])
    }

    fn state_derivative<S: Real>(at: &Reading<'_, S>, z: &[S; 1], p: &[S; 2]) -> [S; 1] {
        let [heating, cooling] = *p;
        let u = over_winding(at);
        [heating * u * u / (S::one() + z[0]) - cooling * z[0]]
    }
}

declare_effect!(WindingHeating, "winding_heating");

/// Voltage over the winding: `nominal` may differ from the drive by effects before this one.
fn over_winding<S: Real>(at: &Reading<'_, S>) -> S {
    at.nominal + at.get(Role::Armature) - at.get(Role::Drive)
}

#[cfg(test)]
mod tests {
    use crate::effects::testing::*;

    use super::*;

    /// 9 V, of which 3 V are back-emf.
    fn driven() -> Reading<'static, f64> {
        Reading {
            nominal: 9.0,
            ..reading(&[(Role::Drive, 9.0), (Role::Armature, 6.0)])
        }
    }

    #[test]
    fn the_current_falls_as_the_resistance_grows() {
        let w: f64 = WindingHeating::contribution(&driven(), &[0.25], &[0.0, 0.0]);
        assert!((6.0 + w - 6.0 / 1.25).abs() < 1e-12);
    }

    /// Balance of what is lost and what is led away: `h U² = c z (1 + z)`.
    #[test]
    fn it_warms_until_it_cools_as_much() {
        let p = [0.0003, 0.02];
        let mut z = [0.0];
        for _ in 0..200_000 {
            z[0] += 0.01 * WindingHeating::state_derivative(&driven(), &z, &p)[0];
        }
        assert!(
            (0.0003 * 36.0 - 0.02 * z[0] * (1.0 + z[0])).abs() < 1e-9,
            "{z:?}"
        );
    }
}
