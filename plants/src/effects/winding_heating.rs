//! A motor that warms up.

use loopsight_core::{
    Effect, EffectMeta, Parameter, PlaceKind, Reading, Real, Role, declare_effect,
};

/// Winding heating: the resistance of the motor grows as it warms up, and the current falls.
///
/// ```text
/// R(t) = R · (1 + rate · t)          w = -U · rate t/(1 + rate t)
/// ```
///
/// | symbol | what | unit |
/// |---|---|---|
/// | `U` | voltage over the winding: the command less the back-emf | V |
/// | `t` | time since the start of the run | s |
/// | `rate` | relative growth of the resistance; copper grows by 0.39 % per kelvin | 1/s |
///
/// Assumptions: the growth is linear over a run, whatever the motor does (a run is short against
/// the thermal time constant of the motor and its load is about even); each run starts cold. The
/// back-emf is what the damping of the plant stands for, so viscous friction is taken for a part
/// of it.
///
/// Reference: IEC 60034-1, temperature rise by the resistance method: for copper
/// `R₂/R₁ = (235 + ϑ₂)/(235 + ϑ₁)`, ϑ in °C.
#[derive(Clone, Copy, Debug)]
pub struct WindingHeating;

impl Effect<1, 0> for WindingHeating {
    const META: EffectMeta = EffectMeta {
        id: "winding_heating",
        summary: "the resistance of the motor grows as it warms up",
        symptom: "the model is right at the beginning and too strong at the end: the residual grows with the time since the start, most of all when accelerating",
        remedy: "estimate the gain while running; let the motor warm up before identifying; cool it or ask less of it",
        equation: "w = -U rate t/(1 + rate t), U = command less back-emf",
        reference: "IEC 60034-1, resistance method: R2/R1 = (235 + T2)/(235 + T1) for copper",
        example: "[[effect]]\n[effect.winding_heating]\nat = [\"input.right\", \"input.left\"]\nrate = 0.004\n",
        places: &[PlaceKind::Input],
        reads: &[Role::Armature, Role::Drive],
        parameters: &[Parameter::new(
            "rate",
            "α",
            "1/s",
            "relative growth of the resistance per second",
        )
        .within(0.0, 1.0)
        .or(0.0)
        .scaled(0.005)],
        rarity: 2,
        ..EffectMeta::PLAIN
    };

    fn contribution<S: Real>(at: &Reading<'_, S>, _z: &[S; 0], p: &[S; 1]) -> S {
        // Less the back-emf: `nominal` may differ from the drive by effects before this one.
        let over_winding = at.nominal + at.get(Role::Armature) - at.get(Role::Drive);
        let growth = p[0] * S::of(at.time);
        -over_winding * growth / (S::one() + growth)
    }
}

declare_effect!(WindingHeating, "winding_heating", <1, 0>);

#[cfg(test)]
mod tests {
    use crate::effects::testing::*;

    use super::*;

    #[test]
    fn the_current_falls_as_the_resistance_grows() {
        // 9 V, of which 3 V are back-emf; 25 % more resistance after 50 s.
        let at = Reading {
            time: 50.0,
            nominal: 9.0,
            ..reading(&[(Role::Drive, 9.0), (Role::Armature, 6.0)])
        };
        let w: f64 = WindingHeating::contribution(&at, &[], &[0.005]);
        assert!((6.0 + w - 6.0 / 1.25).abs() < 1e-12);
    }
}
