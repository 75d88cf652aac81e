//! Cogging and everything else that is uneven around a turn.

use crate::declare_effect;
use loopsight_core::{Effect, EffectMeta, Parameter, PlaceKind, Reading, Real, Role};

/// Torque ripple: a force that goes up and down with the angle of the shaft, a few times per turn.
///
/// ```text
/// w = sine · sin(count · angle) + cosine · cos(count · angle)
/// ```
///
/// | symbol | what | unit |
/// |---|---|---|
/// | `angle` | angle of the shaft, zero at the start of the log or where the encoder has it | rad |
/// | `sine`, `cosine` | the two components | that of the channel, e.g. V |
/// | `count` | periods per turn of the shaft; behind a gear not necessarily whole | 1 |
///
/// Amplitude and phase are `√(sine² + cosine²)` and `atan2(cosine, sine)`. The error has a minimum
/// at each wrong count, so a fit starts from many.
///
/// Assumptions: one harmonic (attach it again for more), the same at all speeds and loads:
/// cogging, a bent shaft, an out-of-round wheel, rather than commutation ripple, which grows with
/// the current.
///
/// Reference: D. Hanselman (2006), "Brushless Permanent Magnet Motor Design", 2nd edition, Magna
/// Physics, on cogging torque.
#[derive(Clone, Copy, Debug)]
pub struct TorqueRipple;

impl Effect for TorqueRipple {
    const META: EffectMeta = EffectMeta {
        id: "torque_ripple",
        summary: "a force that goes up and down with the angle of the shaft (cogging)",
        symptom: "at slow constant commands the speed ripples, with a period that is a fixed angle and not a fixed time; the shaft comes to rest at preferred angles",
        remedy: "feed the ripple forward with the angle; avoid the slow speeds at which it meets a resonance; true or exchange the wheel or motor",
        equation: "w = sine sin(count angle) + cosine cos(count angle)",
        reference: "Hanselman (2006), Brushless Permanent Magnet Motor Design, 2nd ed., on cogging torque",
        example: "[[effect]]\n[effect.torque_ripple]\nat = [\"wheel.right\"]\nsine = 0.3\ncosine = 0.1\ncount = 12\n",
        places: &[PlaceKind::Effort],
        reads: &[Role::Shaft],
        simpler: &["gravity_pendulum"],
        parameters: &[
            Parameter::new("sine", "a", "channel", "the component with the sine")
                .or(0.0)
                .scaled(0.3),
            Parameter::new("cosine", "b", "channel", "the component with the cosine")
                .or(0.0)
                .scaled(0.3),
            Parameter::new("count", "n", "1", "periods per turn of the shaft")
                .within(0.2, 1000.0)
                .or(1.0)
                .nonlinear()
                .scaled(0.1)
                .starting_at(&COUNTS),
        ],
        rarity: 2,
        ..EffectMeta::PLAIN
    };

    fn contribution<S: Real>(at: &Reading<'_, S>, _z: &[S; 0], p: &[S; 3]) -> S {
        let [sine, cosine, count] = *p;
        let phase = count * at.get(Role::Shaft);
        let (sin, cos) = phase.sin_cos();
        sine * sin + cosine * cos
    }
}

declare_effect!(TorqueRipple, "torque_ripple");

/// Counts from which a fit starts.
const COUNTS: [f64; 24] = {
    let mut counts = [0.0; 24];
    let mut i = 0;
    while i < 24 {
        counts[i] = (i + 1) as f64;
        i += 1;
    }
    counts
};

#[cfg(test)]
mod tests {
    use crate::effects::testing::*;

    use super::*;

    #[test]
    fn repeats_count_times_per_turn() {
        let w = |angle| {
            TorqueRipple::contribution(&reading(&[(Role::Shaft, angle)]), &[], &[0.3f64, 0.4, 12.0])
        };
        for angle in [0.0, 0.2, 1.7] {
            assert!((w(angle) - w(angle + std::f64::consts::TAU / 12.0)).abs() < 1e-12);
        }
        let most = (0..10_000)
            .map(|i| w(f64::from(i) * 1e-4))
            .fold(0.0, f64::max);
        assert!((most - 0.5).abs() < 1e-5);
    }
}
