//! Incremental encoders: what counting does to an angle, and to the velocities made of it.

use loopsight_model::model::{Model, signals};
use loopsight_model::registry::BuildError;
use loopsight_model::sensor::Sensor;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use crate::robot::unknown;

/// Counts the marks that pass while a shaft turns.
///
/// ```text
/// N = floor(φ/Δ + p)
/// ```
///
/// | symbol | what | unit |
/// |---|---|---|
/// | `φ` | angle of the shaft | rad |
/// | `Δ` | angle of one count | rad |
/// | `p` | where between two marks the shaft stood at `φ = 0`, in `[0, 1)` | 1 |
/// | `N` | counts | 1 |
///
/// Assumptions: ideal quadrature, no missed counts, marks equally spaced. A count that rose by `n`
/// while the shaft turned by `δ` obeys `|n Δ - δ| < Δ`; over random `p` the mean of `n Δ` is `δ`.
///
/// Reference: R. H. Brown, S. C. Schneider, M. G. Mulligan (1992), "Analysis of algorithms for
/// velocity estimation from discrete position versus time data", IEEE Transactions on Industrial
/// Electronics 39(1), 11–19.
///
/// ```
/// use loopsight_drivers::Counter;
/// let mut counter = Counter::new(0.1, 0.5, 0.0);
/// assert_eq!(counter.turn_to(0.04), 0.0);
/// assert_eq!(counter.turn_to(0.06), 1.0);
/// assert_eq!(counter.turn_to(-0.16), -3.0);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Counter {
    resolution: f64,
    phase: f64,
    count: f64,
}

impl Counter {
    /// A counter of marks `resolution` rad apart, with `phase` in `[0, 1)`, on a shaft at `angle`.
    pub fn new(resolution: f64, phase: f64, angle: f64) -> Self {
        let mut counter = Self {
            resolution,
            phase,
            count: 0.0,
        };
        counter.turn_to(angle);
        counter
    }

    /// Turns the shaft to `angle` rad; returns the counts since the last call, a whole number.
    pub fn turn_to(&mut self, angle: f64) -> f64 {
        let count = (angle / self.resolution + self.phase).floor();
        let since = count - self.count;
        self.count = count;
        since
    }

    /// Angle of one count, rad.
    pub fn resolution(&self) -> f64 {
        self.resolution
    }
}

/// Where the angle of a counted shaft comes from.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Angle {
    /// A signal of the plant.
    Signal(usize),
    /// The integral of a measured signal.
    Integral(usize),
}

/// One encoder; signals that share a shaft share its counts and so their rounding.
#[derive(Clone, Debug)]
struct Shaft {
    /// The signal whose angle, or whose integral, is counted.
    id: String,
    angle: Angle,
    counter: Counter,
    /// Angle at the last reading, rad.
    last: f64,
    /// Counted minus true turn in the last period, rad.
    rounding: f64,
}

/// The rounding of `shaft` enters `measured` with `gain`.
#[derive(Clone, Copy, Debug)]
struct Wire {
    measured: usize,
    shaft: usize,
    gain: f64,
}

/// The encoders of a robot. A measured signal gets what counting does to its shafts:
/// `Σ gain (n Δ - δ)/T` is added, which makes a mean `Σ gain δ/T` into `Σ gain n Δ/T`.
#[derive(Clone, Debug, Default)]
pub(crate) struct Encoders {
    shafts: Vec<Shaft>,
    wires: Vec<Wire>,
}

impl Encoders {
    /// The encoders behind all measured signals, with random phases.
    pub(crate) fn new(model: &Model, random: &mut ChaCha8Rng) -> Result<Self, BuildError> {
        let mut shafts: Vec<Shaft> = Vec::new();
        let mut wires = Vec::new();
        for (measured, m) in model.measured.iter().enumerate() {
            let Sensor::EncoderCounts(encoder) = &m.sensor else {
                continue;
            };
            let mut wire = |id: &str, angle: Angle, gain: f64| {
                let resolution = encoder.resolution();
                let known = shafts
                    .iter()
                    .position(|s| s.angle == angle && s.counter.resolution() == resolution);
                let shaft = known.unwrap_or_else(|| {
                    shafts.push(Shaft {
                        id: id.to_owned(),
                        angle,
                        counter: Counter::new(resolution, random.random(), 0.0),
                        last: 0.0,
                        rounding: 0.0,
                    });
                    shafts.len() - 1
                });
                wires.push(Wire {
                    measured,
                    shaft,
                    gain,
                });
            };
            if encoder.of.is_empty() {
                wire(m.signal.id, Angle::Integral(measured), 1.0);
            }
            for (id, gain) in &encoder.of {
                let known = signals(model.plant).enumerate().find(|(_, s)| s.id == *id);
                match known {
                    Some((index, signal)) if signal.unit == "rad" => {
                        wire(id, Angle::Signal(index), *gain)
                    }
                    _ => {
                        let angles: Vec<&str> = signals(model.plant)
                            .filter(|s| s.unit == "rad")
                            .map(|s| s.id)
                            .collect();
                        let mut error = unknown("model", "shaft angle", id, &angles);
                        error.message +=
                            &format!(" (rad), for the encoder behind `{}`", m.signal.id);
                        return Err(error);
                    }
                }
            }
        }
        Ok(Self { shafts, wires })
    }

    /// The counted shafts by the signal that turns them, with their numbers.
    pub(crate) fn shafts(&self) -> Vec<(String, usize)> {
        let numbered = self.shafts.iter().enumerate();
        numbered.map(|(number, s)| (s.id.clone(), number)).collect()
    }

    /// Counts begin at the present angles; `now` are the signals of the plant.
    pub(crate) fn start(&mut self, now: &[f64]) {
        for shaft in &mut self.shafts {
            if let Angle::Signal(index) = shaft.angle {
                shaft.last = now[index];
                shaft.counter.turn_to(shaft.last);
            }
        }
    }

    /// Counts up to the present angles and rounds the means `measured` over `period` s; a shaft
    /// that does not count (by its number) seems to stand.
    pub(crate) fn count(
        &mut self,
        now: &[f64],
        period: f64,
        measured: &mut [f64],
        counts: impl Fn(usize) -> bool,
    ) {
        for (number, shaft) in self.shafts.iter_mut().enumerate() {
            let angle = match shaft.angle {
                Angle::Signal(index) => now[index],
                Angle::Integral(index) => shaft.last + measured[index] * period,
            };
            let turned = shaft.counter.turn_to(angle) * shaft.counter.resolution();
            let counted = if counts(number) { turned } else { 0.0 };
            shaft.rounding = counted - (angle - shaft.last);
            shaft.last = angle;
        }
        for wire in &self.wires {
            measured[wire.measured] += wire.gain * self.shafts[wire.shaft].rounding / period;
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        /// The sum of all counts tracks the angle within one count, however the shaft turns.
        #[test]
        fn counts_track_the_angle_within_one(
            phase in 0.0..1.0f64,
            resolution in 1e-4..0.5f64,
            turns in proptest::collection::vec(-2.0..2.0f64, 1..200),
        ) {
            let mut counter = Counter::new(resolution, phase, 0.0);
            let (mut angle, mut sum) = (0.0, 0.0);
            for turn in turns {
                angle += turn;
                sum += counter.turn_to(angle);
                prop_assert!((sum * resolution - angle).abs() < resolution * (1.0 + 1e-9));
            }
        }
    }

    #[test]
    fn the_mean_over_phases_is_the_angle() {
        let phases = 1000;
        for angle in [0.003, 0.0377, -0.02] {
            let mean: f64 = (0..phases)
                .map(|i| {
                    let phase = (f64::from(i) + 0.5) / f64::from(phases);
                    0.01 * Counter::new(0.01, phase, 0.0).turn_to(angle)
                })
                .sum::<f64>()
                / f64::from(phases);
            assert!((mean - angle).abs() < 0.01 / f64::from(phases));
        }
    }
}
