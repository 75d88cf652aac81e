//! An encoder disc that is off its centre.

use crate::declare_effect;
use loopsight_core::{Effect, EffectMeta, Parameter, PlaceKind, Reading, Real, Role};

/// Encoder ripple: an eccentric disc counts the angle unevenly, once per turn.
///
/// ```text
/// e(φ)           = sine · sin(count φ) + cosine · cos(count φ)
/// angle_measured = angle + e(φ)
/// speed_measured = speed · (1 + de/dφ)
/// ```
///
/// | symbol | what | unit |
/// |---|---|---|
/// | `φ` | angle of the shaft, zero at the start of the log or where the encoder has it | rad |
/// | `sine`, `cosine` | the error of the angle at `φ = π/2` and `φ = 0` (for a count of one) | rad |
/// | `count` | periods per turn of the shaft: one for an eccentric disc on it | 1 |
///
/// On a channel that is the angle itself (`encoder.right`) the error is added to the angle, and
/// acts on every signal that is made from its counts; on a channel that is a speed
/// (`sensor.track_speed_right`) it modulates the speed, which is the rate of the same error. A
/// disc of radius `ρ` that is off by `ε` has an amplitude of `ε/ρ`.
///
/// Assumptions: one harmonic; `count` is known. The signal goes on smoothly, counts are not
/// modelled here.
///
/// Reference: R. J. E. Merry, M. J. G. van de Molengraft, M. Steinbuch (2010), "Velocity and
/// acceleration estimation for optical incremental encoders", Mechatronics 20(1), 20–26, on
/// encoder imperfections.
#[derive(Clone, Copy, Debug)]
pub struct EncoderRipple;

impl Effect for EncoderRipple {
    const META: EffectMeta = EffectMeta {
        id: "encoder_ripple",
        summary: "an eccentric encoder disc: the angle is counted unevenly, once per turn",
        symptom: "at constant speed the measured speed goes up and down once per turn, by a fixed percentage at every speed; no force explains it, since its size grows with the speed",
        remedy: "centre the disc; subtract the error with a table over the angle; two read heads opposite each other",
        equation: "e = sine sin(count φ) + cosine cos(count φ); angle + e(φ), or speed (1 + de/dφ)",
        reference: "Merry, van de Molengraft, Steinbuch (2010), Mechatronics 20(1), 20-26",
        example: "[[effect]]\n[effect.encoder_ripple]\nat = [\"encoder.right\"]\nsine = 0.02\n",
        places: &[PlaceKind::Output],
        reads: &[Role::Shaft],
        parameters: &[
            Parameter::new("sine", "a", "rad", "the component with the sine")
                .within(-1.0, 1.0)
                .or(0.0)
                .nonlinear()
                .scaled(0.02),
            Parameter::new("cosine", "b", "rad", "the component with the cosine")
                .within(-1.0, 1.0)
                .or(0.0)
                .nonlinear()
                .scaled(0.02),
            Parameter::new("count", "n", "1", "periods per turn of the shaft")
                .above(0.0)
                .or(1.0)
                .known()
                .nonlinear(),
        ],
        rarity: 2,
        ..EffectMeta::PLAIN
    };

    fn contribution<S: Real>(at: &Reading<'_, S>, _z: &[S; 0], p: &[S; 3]) -> S {
        let [sine, cosine, count] = *p;
        let (sin, cos) = (count * at.get(Role::Shaft)).sin_cos();
        if at.is_position {
            sine * sin + cosine * cos
        } else {
            at.nominal * count * (sine * cos - cosine * sin)
        }
    }
}

declare_effect!(EncoderRipple, "encoder_ripple");

#[cfg(test)]
mod tests {
    use crate::effects::testing::*;

    use super::*;

    #[test]
    fn the_speed_is_the_rate_of_the_angle() {
        let p = [0.03, -0.02, 2.0];
        let angle = |phi: f64| {
            let at = Reading {
                nominal: phi,
                is_position: true,
                ..reading(&[(Role::Shaft, phi)])
            };
            phi + EncoderRipple::contribution(&at, &[], &p)
        };
        for phi in [0.0, 0.7, 4.0] {
            let speed = 3.0;
            let at = Reading {
                nominal: speed,
                ..reading(&[(Role::Shaft, phi)])
            };
            let measured = speed + EncoderRipple::contribution(&at, &[], &p);
            let numeric = (angle(phi + 1e-6) - angle(phi - 1e-6)) / 2e-6 * speed;
            assert!((measured - numeric).abs() < 1e-8);
        }
    }
}
