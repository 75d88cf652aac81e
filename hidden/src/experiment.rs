//! What the motors are commanded.

use loopsight_model::excitation::{Excitation, Sequence};

use crate::driven::Driven;
use crate::error::HiddenError;
use crate::random::Random;
use crate::robot::{Kind, Robot};

/// Distance of the samples of the machines of motors and wheels, s.
pub const PERIOD: f64 = 0.01;
/// Length of their experiments, s.
pub const DURATION: f64 = 25.0;
/// Largest command, V.
const FULL: f64 = 9.0;
/// Samples of an experiment, that at time 0 included.
pub(crate) const SAMPLES: usize = 2501;

/// The commands of a recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Experiment {
    /// Pseudo-random binary voltages of ±9 V, drawn anew every 0.5 s: the paper's identification.
    Prbs,
    /// Seven levels from -9 V to 9 V, drawn anew every 0.5 s: to judge models on that were fitted
    /// to [`Experiment::Prbs`].
    MultiLevel,
    /// Rest, a chirp, steps with rests between them, slow ramps: shows what random levels hide.
    Mixed,
}

impl Experiment {
    /// All of them.
    pub const ALL: [Experiment; 3] = [Self::Prbs, Self::MultiLevel, Self::Mixed];

    /// Name in file names, e.g. `multi_level`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Prbs => "prbs",
            Self::MultiLevel => "multi_level",
            Self::Mixed => "mixed",
        }
    }

    /// The commands from each sample to the next: V, or of a rig in the unit of its command. A rig
    /// gets those of the axis by the number of the sample, scaled to its own range.
    pub(crate) fn commands(self, robot: Robot, seed: u64) -> Result<Vec<[f64; 2]>, HiddenError> {
        match robot.kind() {
            Kind::Driven(driven) => self.voltages(driven, seed),
            Kind::Rig(sheet) => {
                let [centre, amplitude] = sheet.command;
                let scaled = |v: f64| centre + amplitude * v / FULL;
                let voltages = self.voltages(Driven::Axis, seed)?;
                Ok(voltages.iter().map(|[v, _]| [scaled(*v), 0.0]).collect())
            }
        }
    }

    fn voltages(self, robot: Driven, seed: u64) -> Result<Vec<[f64; 2]>, HiddenError> {
        let [right, left] = match self {
            Self::Prbs => random(
                robot,
                |seed| Excitation::Prbs {
                    amplitude: FULL,
                    hold_s: 0.5,
                    seed,
                    common: false,
                },
                seed,
            ),
            Self::MultiLevel => random(
                robot,
                |seed| Excitation::MultiLevel {
                    amplitude: FULL,
                    hold_s: 0.5,
                    levels: 7,
                    seed,
                    common: false,
                },
                seed,
            ),
            Self::Mixed => return mixed(seed),
        }?;
        Ok((0..SAMPLES)
            .map(|k| {
                let t = k as f64 * PERIOD;
                [right.sample(t), left.sample(t)]
            })
            .collect())
    }
}

fn random(
    robot: Driven,
    make: impl Fn(u64) -> Excitation,
    seed: u64,
) -> Result<[Sequence; 2], HiddenError> {
    let names = match robot {
        Driven::Twil => ["voltage_right", "voltage_left"],
        Driven::Axis => ["voltage", "none"],
    };
    Ok([make(seed).build(names[0])?, make(seed).build(names[1])?])
}

/// Time without command before, between and after the parts of the mixed experiment, s.
const REST: f64 = 0.5;

/// Rest, 8 s of chirp, rest, ten steps of 0.5 s with rests of 0.3 s, ramps of 7 s, rest.
fn mixed(seed: u64) -> Result<Vec<[f64; 2]>, HiddenError> {
    let mut random = Random::new(seed, 7);
    let first_sign = random.sign();
    let chirp = |amplitude: f64, from_hz: f64, to_hz: f64| {
        Excitation::Chirp {
            amplitude,
            from_hz,
            to_hz,
            duration_s: 8.0,
        }
        .build("chirp")
    };
    let chirps = [chirp(8.0 * first_sign, 0.2, 3.0)?, chirp(7.0, 0.3, 4.0)?];
    let levels = [3.0, 6.0, 9.0];
    let steps: Vec<[f64; 2]> = (0..10)
        .map(|i| {
            let mut level = || {
                let pick = (random.uniform() * 4.0) as usize;
                levels.get(pick).map_or(0.0, |v| v * random.sign())
            };
            let (right, left) = (level(), level());
            // Standing still for a whole step would say nothing.
            if right == 0.0 && left == 0.0 {
                [levels[i % 3], 0.0]
            } else {
                [right, left]
            }
        })
        .collect();
    let ramp_sign = [random.sign(), random.sign()];
    Ok((0..SAMPLES)
        .map(|k| {
            let mut t = k as f64 * PERIOD + 1e-9 - REST;
            if t < 0.0 {
                return [0.0; 2];
            }
            if t < 8.0 {
                return [chirps[0].sample(t), chirps[1].sample(t)];
            }
            t -= 8.0 + REST;
            if t < 0.0 {
                return [0.0; 2];
            }
            if t < 8.0 {
                let step = (t / 0.8) as usize;
                let on = t - 0.8 * step as f64;
                return match steps.get(step) {
                    Some(levels) if on < 0.5 => *levels,
                    _ => [0.0; 2],
                };
            }
            t -= 8.0;
            if t < 7.0 {
                return [
                    ramp_sign[0] * 9.0 * triangle(t / 7.0),
                    ramp_sign[1] * 6.0 * triangle(2.0 * t / 7.0),
                ];
            }
            [0.0; 2]
        })
        .collect())
}

/// 0, up to 1 at a quarter, down to -1 at three quarters, 0; period 1.
fn triangle(x: f64) -> f64 {
    let x = x.rem_euclid(1.0);
    if x < 0.25 {
        4.0 * x
    } else if x < 0.75 {
        2.0 - 4.0 * x
    } else {
        4.0 * x - 4.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commands_stay_within_the_drive_and_repeat() {
        for experiment in Experiment::ALL {
            for robot in [Robot::Twil, Robot::Axis] {
                let a = experiment.commands(robot, 3).unwrap();
                assert_eq!(a.len(), SAMPLES);
                assert!(a.iter().flatten().all(|v| v.abs() <= 9.0));
                assert_eq!(a, experiment.commands(robot, 3).unwrap());
                assert_ne!(a, experiment.commands(robot, 4).unwrap());
            }
        }
    }

    #[test]
    fn two_levels_and_seven() {
        let levels = |e: Experiment| {
            let mut found: Vec<i64> = e
                .commands(Robot::Twil, 1)
                .unwrap()
                .iter()
                .map(|v| v[0].round() as i64)
                .collect();
            found.sort_unstable();
            found.dedup();
            found
        };
        assert_eq!(levels(Experiment::Prbs), [-9, 9]);
        assert_eq!(levels(Experiment::MultiLevel), [-9, -6, -3, 0, 3, 6, 9]);
    }
}
