//! A load that is taken up or set down.

use crate::declare_effect;
use loopsight_core::{Effect, EffectMeta, Parameter, PlaceKind, Reading, Real, Role};

/// Payload change: mass and inertia change at an unknown time.
///
/// ```text
/// m(t) = m (1 + fraction · H(t))          H(t) = ½ (1 + tanh((t - time)/width))
/// v' = nominal/(1 + fraction H) - max(fraction, 0) H'/(1 + fraction H) · v
/// ```
///
/// | symbol | what | unit |
/// |---|---|---|
/// | `nominal` | the rate without the effect | that of the channel |
/// | `v` | the speed | that of the channel's flow |
/// | `fraction` | relative growth of the mass, or of the inertia of an axis | 1 |
/// | `yaw_fraction` | relative growth of the inertia about the vertical of a vehicle | 1 |
/// | `time` | when it changes, since the start of each run | s |
/// | `width` | how long the change takes | s |
///
/// The load is at rest before it is taken up, and shares the momentum then; a load that is set down
/// takes its momentum along.
///
/// Assumptions: all forces stay as they are (a heavier robot that rubs harder is a friction beside
/// it), the centre of mass stays over the axle; the inertia is all of it, rotors included; the
/// change comes once, at the same time in each run.
///
/// Reference: I. Newton (1687), second law; M. Basseville, I. V. Nikiforov (1993), "Detection of
/// Abrupt Changes: Theory and Application", Prentice Hall, chapter 1, a jump of a parameter at an
/// unknown time.
#[derive(Clone, Copy, Debug)]
pub struct PayloadChange;

impl Effect for PayloadChange {
    const META: EffectMeta = EffectMeta {
        id: "payload_change",
        summary: "mass and inertia change at an unknown time",
        symptom: "the model is right up to a moment and wrong from then on: it accelerates too fast (or too slowly) while its final speeds stay right",
        remedy: "estimate while running, with forgetting; tell the controller when a load is taken up",
        equation: "rate = (nominal - max(fraction, 0) H'(t) v)/(1 + fraction H(t)), H(t) = (1 + tanh((t - time)/width))/2",
        reference: "Newton (1687); Basseville, Nikiforov (1993), Detection of Abrupt Changes, chapter 1",
        example: "[[effect]]\n[effect.payload_change]\nat = [\"inertia.forward\", \"inertia.yaw\"]\nfraction = 0.3\nyaw_fraction = 0.2\ntime = 12.0\n",
        places: &[PlaceKind::Body],
        reads: &[Role::Flow],
        shared_only: true,
        parameters: &[
            Parameter::new(
                "fraction",
                "δ",
                "1",
                "relative growth of the mass, or of the inertia of an axis",
            )
            .above(-0.9)
            .or(0.0)
            .nonlinear()
            .scaled(0.2)
            .on_sides(&[0, 1]),
            Parameter::new(
                "yaw_fraction",
                "δ_ω",
                "1",
                "relative growth of the inertia about the vertical",
            )
            .above(-0.9)
            .or(0.0)
            .nonlinear()
            .scaled(0.2)
            .on_sides(&[-1]),
            Parameter::new("time", "t_0", "s", "when it changes")
                .within(0.0, f64::INFINITY)
                .or(0.0)
                .nonlinear()
                .scaled(0.5)
                .starting_within(&[0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9]),
            Parameter::new("width", "s", "s", "how long the change takes")
                .above(0.0)
                .or(0.2)
                .known()
                .nonlinear()
                .scaled(0.1),
        ],
        rarity: 2,
        ..EffectMeta::PLAIN
    };

    fn contribution<S: Real>(at: &Reading<'_, S>, _z: &[S; 0], p: &[S; 4]) -> S {
        let [fraction, yaw_fraction, time, width] = *p;
        let grown = if at.side < S::zero() {
            yaw_fraction
        } else {
            fraction
        };
        let ramp = ((S::of(at.time) - time) / width).tanh();
        let half = S::of(0.5);
        let growth = grown * half * (S::one() + ramp);
        let taken_up = if grown < S::zero() {
            S::zero()
        } else {
            grown * half * (S::one() - ramp * ramp) / width
        };
        -(at.nominal * growth + taken_up * at.get(Role::Flow)) / (S::one() + growth)
    }
}

declare_effect!(PayloadChange, "payload_change");

#[cfg(test)]
mod tests {
    use crate::effects::testing::*;

    use super::*;

    #[test]
    fn a_heavier_robot_accelerates_less_from_then_on() {
        let p = [0.25, 0.6, 10.0, 0.2];
        for (time, side, expected) in [
            (5.0, 1.0, 2.0),
            (10.0, 1.0, 2.0 / 1.125),
            (15.0, 1.0, 1.6),
            (15.0, 0.0, 1.6),
            (15.0, -1.0, 1.25),
        ] {
            let at = Reading {
                time,
                side,
                nominal: 2.0,
                ..reading(&[])
            };
            let rate: f64 = 2.0 + PayloadChange::contribution(&at, &[], &p);
            assert!((rate - expected).abs() < 1e-12, "{time} {side}");
        }
    }

    /// Coasting, a load at rest that is taken up leaves the momentum as it was; one that is set
    /// down leaves the speed.
    #[test]
    fn momentum_is_kept() {
        for (fraction, expected) in [(0.25, 3.0 / 1.25), (-0.25, 3.0)] {
            let p = [fraction, 0.0, 1.0, 0.05];
            let mut v = 3.0;
            for k in 0..20_000 {
                let at = Reading {
                    time: 1e-4 * f64::from(k),
                    side: 1.0,
                    ..reading(&[(Role::Flow, v)])
                };
                v += 1e-4 * PayloadChange::contribution(&at, &[], &p);
            }
            assert!((v - expected).abs() < 1e-3, "{v} {expected}");
        }
    }
}
