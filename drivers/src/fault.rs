//! Faults of the sensors of a simulated robot.

use loopsight_model::registry::BuildError;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use crate::robot::unknown;

/// A fault of a sensor, from `start_s` on for `duration_s` (by default to the end).
///
/// What goes wrong with the body, a motor or the battery is physics: an effect of the robot's own
/// model file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum SensorFault {
    /// An encoder counts nothing: its shaft seems to stand. The turns of that time are lost.
    DeadEncoder {
        /// Angle of the shaft, as in the sensor's `of`; `None`: all encoders.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        of: Option<String>,
        /// When it begins, s.
        #[serde(default)]
        start_s: f64,
        /// How long it lasts, s; `None`: to the end.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        duration_s: Option<f64>,
    },
    /// A measured signal keeps the value it had.
    Frozen {
        /// The signal.
        signal: String,
        /// When it begins, s.
        #[serde(default)]
        start_s: f64,
        /// How long it lasts, s; `None`: to the end.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        duration_s: Option<f64>,
    },
    /// Samples get lost at random, each independently: the one before is handed out again, not
    /// fresh.
    Stale {
        /// Share of the samples that get lost, 0 to 1.
        share: f64,
        /// When it begins, s.
        #[serde(default)]
        start_s: f64,
        /// How long it lasts, s; `None`: to the end.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        duration_s: Option<f64>,
    },
}

/// A span of time, s.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Span {
    from: f64,
    to: f64,
}

impl Span {
    fn new(key: &str, start: f64, duration: Option<f64>) -> Result<Self, BuildError> {
        if !(start >= 0.0 && start.is_finite()) {
            return Err(BuildError::at(
                &format!("{key}.start_s"),
                format!("found {start} s, expected a time from 0 s on"),
            ));
        }
        let duration = duration.unwrap_or(f64::INFINITY);
        if duration.is_nan() || duration <= 0.0 {
            return Err(BuildError::at(
                &format!("{key}.duration_s"),
                format!("found {duration} s, expected a number above 0 s"),
            ));
        }
        Ok(Self {
            from: start,
            to: start + duration,
        })
    }

    /// Instants are sums of rounded periods: one that should be the first is in.
    fn has(&self, time: f64) -> bool {
        let early = 1e-9 * time.abs().max(1.0);
        time + early >= self.from && time + early < self.to
    }
}

/// The faults of a robot, ready to happen.
#[derive(Clone, Debug)]
pub(crate) struct Faults {
    dead: Vec<(Span, Option<usize>)>,
    frozen: Vec<(Span, usize)>,
    stale: Vec<(Span, f64)>,
    random: ChaCha8Rng,
}

impl Faults {
    /// Faults of the shafts `shafts` (by id and number) and of the measured signals `measured`.
    pub(crate) fn new(
        list: &[SensorFault],
        shafts: &[(String, usize)],
        measured: &[&str],
        seed: u64,
    ) -> Result<Self, BuildError> {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        // Beside the encoders' phases (0) and the noise (1): a fault changes neither.
        random.set_stream(2);
        let mut faults = Self {
            dead: Vec::new(),
            frozen: Vec::new(),
            stale: Vec::new(),
            random,
        };
        for (i, fault) in list.iter().enumerate() {
            faults.add(&format!("fault[{i}]"), fault, shafts, measured)?;
        }
        Ok(faults)
    }

    fn add(
        &mut self,
        at: &str,
        fault: &SensorFault,
        shafts: &[(String, usize)],
        measured: &[&str],
    ) -> Result<(), BuildError> {
        match fault {
            SensorFault::DeadEncoder {
                of,
                start_s,
                duration_s,
            } => {
                let key = format!("{at}.dead_encoder");
                let span = Span::new(&key, *start_s, *duration_s)?;
                if shafts.is_empty() {
                    return Err(BuildError::at(&key, "no encoder counts on this robot")
                        .help("`frozen` is the fault of a signal without an encoder"));
                }
                let Some(id) = of else {
                    self.dead.push((span, None));
                    return Ok(());
                };
                let Some((_, shaft)) = shafts.iter().find(|(name, _)| name == id) else {
                    let ids: Vec<&str> = shafts.iter().map(|(name, _)| name.as_str()).collect();
                    return Err(misnamed(&format!("{key}.of"), "counted shaft", id, &ids));
                };
                self.dead.push((span, Some(*shaft)));
            }
            SensorFault::Frozen {
                signal,
                start_s,
                duration_s,
            } => {
                let key = format!("{at}.frozen");
                let span = Span::new(&key, *start_s, *duration_s)?;
                let Some(index) = measured.iter().position(|id| id == signal) else {
                    let key = format!("{key}.signal");
                    return Err(misnamed(&key, "measured signal", signal, measured));
                };
                self.frozen.push((span, index));
            }
            SensorFault::Stale {
                share,
                start_s,
                duration_s,
            } => {
                let key = format!("{at}.stale");
                let span = Span::new(&key, *start_s, *duration_s)?;
                if !(0.0..=1.0).contains(share) {
                    return Err(BuildError::at(
                        &format!("{key}.share"),
                        format!("found {share}, expected a share from 0 to 1"),
                    ));
                }
                self.stale.push((span, *share));
            }
        }
        Ok(())
    }

    /// Whether the encoder of a shaft counts at `time` s.
    pub(crate) fn counts(&self, shaft: usize, time: f64) -> bool {
        !self
            .dead
            .iter()
            .any(|(span, of)| of.is_none_or(|of| of == shaft) && span.has(time))
    }

    /// Whether a measured signal keeps its value at `time` s.
    pub(crate) fn freezes(&self, signal: usize, time: f64) -> bool {
        self.frozen
            .iter()
            .any(|(span, of)| *of == signal && span.has(time))
    }

    /// Whether the sample of `time` s gets lost; to be asked once for each.
    pub(crate) fn lose(&mut self, time: f64) -> bool {
        let mut lost = false;
        for (span, share) in &self.stale {
            // A draw for each, so that a span that is over does not shift the others.
            let draw: f64 = self.random.random();
            lost |= span.has(time) && draw < *share;
        }
        lost
    }
}

/// An id that names nothing, at the key that names it.
fn misnamed(key: &str, what: &str, found: &str, ids: &[&str]) -> BuildError {
    BuildError {
        key: key.to_owned(),
        ..unknown(key, what, found, ids)
    }
}

#[cfg(test)]
mod tests {
    use loopsight_model::config::TomlSource;

    use super::*;
    use crate::fixture::{WHEEL, build, twil_encoders};
    use crate::{Limit, Simulated};

    const PERIOD: f64 = 0.01;

    /// Half a minute straight ahead: time, speeds, fresh.
    fn drive(fault: &str) -> Vec<(f64, [f64; 2], bool)> {
        #[derive(Deserialize)]
        struct File {
            fault: Vec<SensorFault>,
        }
        let source = TomlSource::parse("faults.toml", fault).unwrap();
        let file = source.read::<File>().unwrap();
        let settings = Simulated {
            fault: file.fault,
            limit: Some(Limit::All(12.0)),
            ..Simulated::default()
        };
        let mut driver = build(&settings, &twil_encoders(), None, &[]).unwrap();
        let mut applied = [0.0; 2];
        (0..3000)
            .map(|_| {
                let mut y = [0.0; 2];
                let sample = driver.read(&mut y).unwrap();
                driver.write(&[6.0, 6.0], &mut applied).unwrap();
                (sample.time, y, sample.fresh)
            })
            .collect()
    }

    #[test]
    fn a_dead_encoder_shows_half_the_speed_and_a_turn_and_comes_back() {
        let healthy = drive("fault = []");
        let rows = drive(
            "fault = [{ dead_encoder = { of = \"shaft_angle_right\", start_s = 10.0, duration_s = 1.0 } }]",
        );
        let count = WHEEL * std::f64::consts::TAU / 8192.0 / PERIOD;
        for (k, ((time, y, fresh), (_, whole, _))) in rows.iter().zip(&healthy).enumerate() {
            assert!(fresh);
            if (1000..1100).contains(&k) {
                assert!((y[0] - whole[0] / 2.0).abs() < count, "{y:?} at {time} s");
                assert!(y[1] < -0.1, "{y:?} at {time} s");
            } else {
                assert!((y[0] - whole[0]).abs() < 1e-9, "{y:?} at {time} s");
            }
        }
        let all = drive("fault = [{ dead_encoder = { start_s = 20.0 } }]");
        assert!(
            all[2000..]
                .iter()
                .all(|(_, y, _)| y.iter().all(|y| y.abs() < 1e-12))
        );
    }

    #[test]
    fn lost_samples_hand_out_the_one_before_at_the_rate_asked_for() {
        let healthy = drive("fault = []");
        let rows = drive("fault = [{ stale = { share = 0.05, start_s = 5.0 } }]");
        assert_eq!(
            rows,
            drive("fault = [{ stale = { share = 0.05, start_s = 5.0 } }]")
        );
        let lost = rows.iter().filter(|(_, _, fresh)| !fresh).count();
        // Four standard deviations of a binomial: 125 ± 43.
        assert!((82..=168).contains(&lost), "{lost} of 2500");
        for k in 1..rows.len() {
            let expected = if rows[k].2 { healthy[k] } else { rows[k - 1] };
            assert_eq!(
                (rows[k].0, rows[k].1),
                (expected.0, expected.1),
                "sample {k}"
            );
        }
    }

    #[test]
    fn a_frozen_signal_keeps_its_value_and_the_other_one_moves() {
        let rows = drive(
            "fault = [{ frozen = { signal = \"linear_velocity\", start_s = 0.02, duration_s = 0.5 } }]",
        );
        assert!((2..52).all(|k| rows[k].1[0] == rows[1].1[0]));
        assert!(rows[52].1[0] > 2.0 * rows[1].1[0]);
    }

    #[test]
    fn faults_that_name_nothing_are_pointed_at() {
        let refused = |fault: SensorFault| {
            let settings = Simulated {
                fault: vec![fault],
                ..Simulated::default()
            };
            let error = build(&settings, &twil_encoders(), None, &[]).err().unwrap();
            (error.key.clone(), error.help.unwrap_or_default())
        };
        let dead = |of: &str, start_s| SensorFault::DeadEncoder {
            of: Some(of.to_owned()),
            start_s,
            duration_s: None,
        };
        assert_eq!(
            refused(dead("shaft_angle_rigth", 0.0)),
            (
                "fault[0].dead_encoder.of".to_owned(),
                "did you mean `shaft_angle_right`?".to_owned()
            )
        );
        assert_eq!(
            refused(dead("shaft_angle_right", -1.0)).0,
            "fault[0].dead_encoder.start_s"
        );
        let stale = SensorFault::Stale {
            share: 5.0,
            start_s: 0.0,
            duration_s: None,
        };
        assert_eq!(refused(stale).0, "fault[0].stale.share");
        let frozen = SensorFault::Frozen {
            signal: "linear_velocty".to_owned(),
            start_s: 0.0,
            duration_s: None,
        };
        assert_eq!(
            refused(frozen),
            (
                "fault[0].frozen.signal".to_owned(),
                "did you mean `linear_velocity`?".to_owned()
            )
        );
    }
}
