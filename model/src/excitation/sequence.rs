//! Excitations over time: sampling, without allocation.

use std::f64::consts::TAU;

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

use super::Excitation;
use super::points::Points;

/// A value is due this much (relative to the hold time) before its time: sampling instants are
/// sums of rounded periods.
pub(super) const EARLY: f64 = 1e-9;

/// An excitation that was checked, ready to be sampled.
#[derive(Clone, Debug)]
pub struct Sequence(pub(super) Kind);

#[derive(Clone, Debug)]
pub(super) enum Kind {
    /// Needs nothing but what the file says.
    Plain(Excitation),
    /// `[time, value]`: the value of the last one that has come, 0 before the first.
    Steps(Vec<[f64; 2]>),
    Points(Points),
    /// `amplitude (2 j/(levels - 1) - 1)`, `j` drawn anew every `hold` s.
    Random {
        amplitude: f64,
        hold: f64,
        levels: u32,
        source: Box<ChaCha8Rng>,
    },
    Sum(Vec<Sequence>),
}

impl Default for Sequence {
    /// Always 0.
    fn default() -> Self {
        Self(Kind::Plain(Excitation::Constant(0.0)))
    }
}

impl Sequence {
    /// `levels` values from `-amplitude` to `amplitude`, from a random stream of a seed.
    pub(super) fn random(
        (amplitude, hold): (f64, f64),
        levels: u32,
        (seed, stream): (u64, u64),
    ) -> Self {
        let mut source = ChaCha8Rng::seed_from_u64(seed);
        source.set_stream(stream);
        Self(Kind::Random {
            amplitude,
            hold,
            levels,
            source: Box::new(source),
        })
    }

    /// The value at `t` s. Random values are addressed by their number, so `t` may go anywhere;
    /// nothing is allocated.
    pub fn sample(&self, t: f64) -> f64 {
        match &self.0 {
            Kind::Plain(plain) => plain_sample(plain, t),
            Kind::Steps(at) => {
                let due = t + EARLY * t.abs().max(1.0);
                let come = at.partition_point(|[time, _]| *time <= due);
                come.checked_sub(1).map_or(0.0, |last| at[last][1])
            }
            Kind::Points(points) => points.sample(t),
            Kind::Random {
                amplitude,
                hold,
                levels,
                source,
            } => {
                let number = (t / hold + EARLY).floor().max(0.0) as u64;
                let mut source = ChaCha8Rng::clone(source);
                source.set_word_pos(u128::from(number));
                let level = (u64::from(source.next_u32()) * u64::from(*levels)) >> 32;
                amplitude * (2.0 * level as f64 / f64::from(levels - 1) - 1.0)
            }
            Kind::Sum(parts) => parts.iter().map(|p| p.sample(t)).sum(),
        }
    }
}

fn plain_sample(of: &Excitation, t: f64) -> f64 {
    match of {
        Excitation::Constant(value) => *value,
        Excitation::Ramp {
            from,
            to,
            start_s,
            duration_s,
        } => from + (to - from) * ((t - start_s) / duration_s).clamp(0.0, 1.0),
        Excitation::Sine {
            amplitude,
            frequency_hz,
            phase_rad,
        } => amplitude * (TAU * frequency_hz * t + phase_rad).sin(),
        Excitation::Chirp {
            amplitude,
            from_hz,
            to_hz,
            duration_s,
        } => {
            let sweep = t.clamp(0.0, *duration_s);
            let turns = from_hz * sweep
                + (to_hz - from_hz) * sweep * sweep / (2.0 * duration_s)
                + to_hz * (t - sweep).max(0.0);
            amplitude * (TAU * turns).sin()
        }
        // `build` turns these into kinds of their own.
        Excitation::Steps { .. }
        | Excitation::Prbs { .. }
        | Excitation::MultiLevel { .. }
        | Excitation::Waypoints { .. }
        | Excitation::File { .. }
        | Excitation::Sum(_) => 0.0,
    }
}

/// The sequences sampled at `time`, row by row.
pub fn sample_rows(sequences: &[Sequence], time: &[f64]) -> Vec<f64> {
    time.iter()
        .flat_map(|t| sequences.iter().map(|s| s.sample(*t)))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn prbs(seed: u64) -> Excitation {
        Excitation::Prbs {
            amplitude: 9.0,
            hold_s: 0.5,
            seed,
            common: false,
        }
    }

    #[test]
    fn prbs_holds_changes_and_repeats_with_the_seed() {
        let sequence = prbs(1).build("voltage_right").unwrap();
        let mut changes = 0;
        for k in 0..100_000 {
            // 0.01 k is below the exact instant for many k: the value must change on time.
            let value = sequence.sample(0.01 * f64::from(k));
            let expected = sequence.sample(0.5 * f64::from(k / 50) + 0.1);
            assert_eq!(value.to_bits(), expected.to_bits(), "sample {k}");
            assert!(value.abs() == 9.0);
            changes +=
                i32::from(k % 50 == 0 && value != sequence.sample(0.01 * f64::from(k) - 0.1));
        }
        assert!((900..1100).contains(&changes), "{changes} of 2000");
        let again = prbs(1).build("voltage_right").unwrap();
        let other = prbs(2).build("voltage_right").unwrap();
        let differ = |s: &Sequence| {
            (0..100).any(|k| s.sample(f64::from(k)) != sequence.sample(f64::from(k)))
        };
        assert!(!differ(&again) && differ(&other));
    }

    #[test]
    fn signals_with_one_seed_are_independent_unless_common() {
        let n = 20_000;
        let correlation = |a: &Excitation, b: &Excitation| {
            let (a, b) = (
                a.build("voltage_right").unwrap(),
                b.build("voltage_left").unwrap(),
            );
            let sum: f64 = (0..n)
                .map(|k| a.sample(0.5 * f64::from(k)) * b.sample(0.5 * f64::from(k)))
                .sum();
            sum / (81.0 * f64::from(n))
        };
        // Five standard deviations of the correlation of independent signs.
        assert!(correlation(&prbs(1), &prbs(1)).abs() < 5.0 / f64::from(n).sqrt());
        let common = Excitation::Prbs {
            amplitude: 9.0,
            hold_s: 0.5,
            seed: 1,
            common: true,
        };
        assert!((correlation(&common, &common) - 1.0).abs() < 1e-12);
        let sum = Excitation::Sum(vec![prbs(1), prbs(1)])
            .build("voltage_right")
            .unwrap();
        assert!(
            (0..100).any(|k| sum.sample(f64::from(k)) == 0.0),
            "parts of a sum are independent"
        );
    }

    #[test]
    fn levels_are_equally_spaced_and_all_used() {
        let sequence = Excitation::MultiLevel {
            amplitude: 6.0,
            hold_s: 0.1,
            levels: 5,
            seed: 3,
            common: false,
        }
        .build("voltage_left")
        .unwrap();
        let mut found: Vec<f64> = (0..1000)
            .map(|k| sequence.sample(0.1 * f64::from(k)))
            .collect();
        found.sort_by(f64::total_cmp);
        found.dedup();
        assert_eq!(found, [-6.0, -3.0, 0.0, 3.0, 6.0]);
    }

    #[test]
    fn smooth_ones_follow_their_equations() {
        let ramp = Excitation::Ramp {
            from: 1.0,
            to: 3.0,
            start_s: 1.0,
            duration_s: 4.0,
        }
        .build("")
        .unwrap();
        assert_eq!([0.0, 3.0, 9.0].map(|t| ramp.sample(t)), [1.0, 2.0, 3.0]);
        let chirp = Excitation::Chirp {
            amplitude: 2.0,
            from_hz: 0.5,
            to_hz: 4.5,
            duration_s: 10.0,
        }
        .build("")
        .unwrap();
        let phase = |t: f64| {
            chirp
                .sample(t)
                .atan2((2.0f64.powi(2) - chirp.sample(t).powi(2)).sqrt())
        };
        // Near a zero crossing the phase runs with the frequency: 0.5 Hz at the start, 4.5 Hz after.
        for (t, hz) in [(0.0, 0.5), (10.0, 4.5), (12.0, 4.5)] {
            let rate = (phase(t + 1e-6) - phase(t)) / 1e-6 / TAU;
            assert!((rate.abs() - hz).abs() < 1e-3, "{rate} Hz at {t} s");
        }
    }
}
