//! The input sequences among which an experiment is chosen.
//!
//! ```text
//! u_i(t) = s_i(t - rest)    rest <= t < duration - rest,    |s_i| <= limit
//! u_i(t) = 0                otherwise
//! ```
//!
//! Seven shapes, and what each is for:
//!
//! * fast and slow binary sequences: all frequencies, one amplitude;
//! * many and small levels: amplitudes;
//! * slow ramps through zero with rests: thresholds, breakaway;
//! * steps with coasting: transients, friction without drive;
//! * a chirp: frequencies one after the other.
//!
//! With several inputs each shape comes four times: every input its own, all equal (a vehicle drives
//! straight), in turns opposite (it turns on the spot), and the last two in alternation. All seeds are fixed.
//!
//! Reference: L. Ljung (1999), "System Identification: Theory for the User", 2nd edition, section
//! 13.3.

use loopsight_model::excitation::Excitation;
use loopsight_model::registry::BuildError;

use crate::experiment::Drive;

/// Time without command at the beginning and at the end, s.
const REST: f64 = 0.5;

/// Length of the straight runs and of the turns of an alternation, s: whole steps and levels.
const BLOCK: f64 = 2.4;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    FastBinary,
    SlowBinary,
    Levels,
    SmallLevels,
    Ramps,
    Steps,
    Chirp,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Pattern {
    /// The only input.
    Single,
    /// Every input its own.
    Own,
    /// All inputs equal.
    Equal,
    /// Inputs in turns opposite.
    Opposite,
    /// Equal and opposite in alternation.
    Alternating,
}

/// A shape for all inputs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Shape {
    kind: Kind,
    pattern: Pattern,
}

impl Shape {
    /// All of them for a plant with `inputs` inputs.
    pub(crate) fn all(inputs: usize) -> Vec<Shape> {
        let kinds = [
            Kind::Levels,
            Kind::SmallLevels,
            Kind::Ramps,
            Kind::Steps,
            Kind::Chirp,
            Kind::FastBinary,
            Kind::SlowBinary,
        ];
        let patterns: &[Pattern] = if inputs > 1 {
            &[
                Pattern::Own,
                Pattern::Alternating,
                Pattern::Equal,
                Pattern::Opposite,
            ]
        } else {
            &[Pattern::Single]
        };
        kinds
            .into_iter()
            .flat_map(|kind| patterns.iter().map(move |p| Shape { kind, pattern: *p }))
            .collect()
    }

    /// The pseudo-random binary sequence that is usually recorded first.
    pub(crate) fn usual(inputs: usize) -> Shape {
        Shape {
            kind: Kind::SlowBinary,
            pattern: if inputs > 1 {
                Pattern::Own
            } else {
                Pattern::Single
            },
        }
    }

    /// What it is, in words.
    pub(crate) fn name(self) -> String {
        let kind = match self.kind {
            Kind::FastBinary => "fast pseudo-random binary",
            Kind::SlowBinary => "pseudo-random binary",
            Kind::Levels => "pseudo-random levels",
            Kind::SmallLevels => "small pseudo-random levels",
            Kind::Ramps => "slow ramps through zero with rests",
            Kind::Steps => "steps with coasting",
            Kind::Chirp => "chirp",
        };
        let pattern = match self.pattern {
            Pattern::Single => "",
            Pattern::Own => ", every input its own",
            Pattern::Equal => ", inputs equal (straight)",
            Pattern::Opposite => ", inputs opposite (turning on the spot)",
            Pattern::Alternating => ", straight and turning on the spot in alternation",
        };
        format!("{kind}{pattern}")
    }

    /// The inputs over time, row by row.
    pub(crate) fn drive(
        self,
        inputs: &[&str],
        limit: f64,
        period: f64,
        duration: f64,
    ) -> Result<Drive, BuildError> {
        let sequences = inputs
            .iter()
            .enumerate()
            .map(|(i, name)| self.excitation(i, limit, duration).build(name))
            .collect::<Result<Vec<_>, _>>()?;
        let steps = (duration / period).round().max(2.0) as usize;
        let time: Vec<f64> = (0..=steps).map(|k| k as f64 * period).collect();
        let end = steps as f64 * period - REST;
        let values = time
            .iter()
            .flat_map(|t| {
                let on = *t > REST - 1e-9 && *t < end;
                let turning = self.pattern == Pattern::Alternating
                    && ((t - REST) / BLOCK + 1e-9).rem_euclid(2.0) >= 1.0;
                sequences.iter().enumerate().map(move |(i, s)| {
                    let sign = if turning && i % 2 == 1 { -1.0 } else { 1.0 };
                    if on { sign * s.sample(t - REST) } else { 0.0 }
                })
            })
            .map(|v| v.clamp(-limit, limit))
            .collect();
        Ok(Drive {
            time,
            inputs: values,
        })
    }

    /// What drives the input number `i`.
    fn excitation(self, i: usize, limit: f64, duration: f64) -> Excitation {
        let own = matches!(self.pattern, Pattern::Own);
        // Different inputs of one pattern are stretched in time, or take another turn.
        let (turn, stretch) = if own {
            (i, 1.0 + 0.37 * i as f64)
        } else {
            (0, 1.0)
        };
        let odd = i % 2 == 1;
        let sign = match self.pattern {
            Pattern::Opposite if odd => -1.0,
            Pattern::Own if odd && matches!(self.kind, Kind::Ramps | Kind::Steps) => -1.0,
            _ => 1.0,
        };
        let amplitude = sign * limit;
        let binary = |hold_s: f64, seed: u64| Excitation::Prbs {
            amplitude,
            hold_s,
            seed,
            common: !own,
        };
        let levels = |share: f64, hold_s: f64, seed: u64| Excitation::MultiLevel {
            amplitude: share * amplitude,
            hold_s,
            levels: 13,
            seed,
            common: !own,
        };
        match self.kind {
            Kind::FastBinary => binary(0.1, 11),
            Kind::SlowBinary => binary(0.5, 12),
            Kind::Levels => levels(1.0, 0.4, 13),
            Kind::SmallLevels => levels(0.3, 0.4, 14),
            Kind::Ramps => ramps(amplitude, stretch, duration),
            Kind::Steps => steps(amplitude, turn, duration),
            Kind::Chirp => Excitation::Chirp {
                amplitude,
                from_hz: 0.1 * stretch,
                to_hz: 5.0 * stretch,
                duration_s: duration,
            },
        }
    }
}

/// Shares of the limit that successive ramps reach.
const SUMMITS: [f64; 3] = [0.3, 1.0, 0.6];

/// Up, down through zero, back, rest; again with another summit.
fn ramps(amplitude: f64, stretch: f64, duration: f64) -> Excitation {
    let mut parts = Vec::new();
    let mut start_s = 0.0;
    let mut k = 0;
    while start_s < duration {
        let summit = amplitude * SUMMITS[k % SUMMITS.len()];
        for (to, quarters) in [(summit, 1.0), (-2.0 * summit, 2.0), (summit, 1.0)] {
            let duration_s = 1.2 * quarters * stretch;
            parts.push(Excitation::Ramp {
                from: 0.0,
                to,
                start_s,
                duration_s,
            });
            start_s += duration_s;
        }
        start_s += 0.6;
        k += 1;
    }
    Excitation::Sum(parts)
}

/// Shares of the limit of successive steps.
const LEVELS: [f64; 10] = [0.3, -0.5, 1.0, -0.2, 0.7, -1.0, 0.15, -0.7, 0.5, -0.3];

/// A second driven, most of a second coasting.
fn steps(amplitude: f64, turn: usize, duration: f64) -> Excitation {
    let mut at = Vec::new();
    let mut time = 0.0;
    let mut k = 3 * turn;
    while time < duration {
        at.push([time, amplitude * LEVELS[k % LEVELS.len()]]);
        at.push([time + 0.8, 0.0]);
        time += 1.5;
        k += 1;
    }
    Excitation::Steps { at }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_shape_keeps_the_limit_moves_and_ends_at_rest() {
        for names in [&["voltage"][..], &["right", "left"], &["a", "b", "c"]] {
            for shape in Shape::all(names.len()) {
                let drive = shape.drive(names, 6.0, 0.01, 20.0).unwrap();
                let n = names.len();
                assert_eq!(drive.inputs.len(), n * drive.time.len());
                assert!(drive.inputs.iter().all(|v| v.abs() <= 6.0), "{shape:?}");
                assert!(drive.inputs[..n].iter().all(|v| *v == 0.0), "{shape:?}");
                let last = drive.inputs.len() - n;
                assert!(drive.inputs[last..].iter().all(|v| *v == 0.0), "{shape:?}");
                let power = drive.inputs.iter().map(|v| v * v).sum::<f64>();
                assert!(power / drive.inputs.len() as f64 > 0.5, "{shape:?}");
            }
        }
    }
}
