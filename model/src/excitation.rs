//! What a robot is excited with, as TOML: inputs of an experiment, references of a loop.
//!
//! It is in this crate because loops, simulations and experiments all need it, and their crates do not
//! depend on each other.
//!
//! ```toml
//! [inputs]
//! voltage_right = { prbs = { amplitude = 9.0, hold_s = 0.5, seed = 1 } }
//! voltage_left = { sum = [{ constant = 2.0 }, { sine = { amplitude = 1.0, frequency_hz = 0.5 } }] }
//! ```
//!
//! Values are in the SI unit of the signal they drive; those of a file in the unit of its column.
//!
//! Reference: L. Ljung (1999), "System Identification: Theory for the User", 2nd edition, section
//! 13.3, on pseudo-random binary signals, sums of sines and chirps.

mod points;
mod sequence;

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::config::nearest;
use crate::registry::BuildError;
use loopsight_core::Signal;
pub use points::Between;
use points::Points;
use sequence::Kind;
pub use sequence::{Sequence, sample_rows};

/// One signal over time, as written. [`Excitation::build`] makes it ready to be sampled.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Excitation {
    /// `y = value`.
    Constant(f64),
    /// Steps: `y = value` of the last `[time, value]` that has come; 0 before the first.
    Steps {
        /// `[time (s), value]`, times increasing.
        at: Vec<[f64; 2]>,
    },
    /// `y` goes from `from` to `to` in a straight line, then stays.
    Ramp {
        /// Value up to `start_s`.
        #[serde(default)]
        from: f64,
        /// Value at the end.
        to: f64,
        /// When it begins, s.
        #[serde(default)]
        start_s: f64,
        /// How long it takes, s.
        duration_s: f64,
    },
    /// `y = amplitude sin(2π frequency t + phase)`.
    Sine {
        /// Amplitude.
        amplitude: f64,
        /// Frequency, Hz.
        frequency_hz: f64,
        /// Phase at time 0, rad.
        #[serde(default)]
        phase_rad: f64,
    },
    /// A sine whose frequency rises from `from_hz` to `to_hz` in a straight line over
    /// `duration_s` and then stays: `y = amplitude sin(2π (from t + (to - from) t²/(2 duration)))`.
    Chirp {
        /// Amplitude.
        amplitude: f64,
        /// Frequency at time 0, Hz.
        from_hz: f64,
        /// Frequency at the end, Hz.
        to_hz: f64,
        /// How long the sweep takes, s.
        duration_s: f64,
    },
    /// Pseudo-random binary: `±amplitude`, drawn anew every `hold_s`. Signals with the same seed
    /// get independent sequences.
    Prbs {
        /// Amplitude.
        amplitude: f64,
        /// How long each value is held, s.
        hold_s: f64,
        /// Seed; the same seed gives the same sequence on every machine.
        #[serde(default = "one")]
        seed: u64,
        /// The same sequence for every signal with this seed.
        #[serde(default)]
        common: bool,
    },
    /// Pseudo-random with several levels, equally spaced from `-amplitude` to `amplitude`.
    MultiLevel {
        /// Amplitude.
        amplitude: f64,
        /// How long each value is held, s.
        hold_s: f64,
        /// Number of levels; an odd number has 0 among them.
        levels: u32,
        /// Seed; the same seed gives the same sequence on every machine.
        #[serde(default = "one")]
        seed: u64,
        /// The same sequence for every signal with this seed.
        #[serde(default)]
        common: bool,
    },
    /// Through points, e.g. a robot's speeds on its way.
    Waypoints {
        /// `[time (s), value]`, times increasing.
        at: Vec<[f64; 2]>,
        /// What runs between two points.
        #[serde(default)]
        between: Between,
    },
    /// A column of a log or of any other table with a column of times.
    File {
        /// The file, relative to the one that names it.
        path: String,
        /// The column, with or without its unit; `None`: the one named like the signal.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        column: Option<String>,
        /// What runs between two rows.
        #[serde(default)]
        between: Between,
    },
    /// The sum of several.
    Sum(Vec<Excitation>),
}

/// Reads a column of a file: path as written, name of the column with or without its unit. Returns
/// `[time (s), value]` in SI units, times increasing.
pub type ReadColumn<'a> = dyn Fn(&str, &str) -> Result<Vec<[f64; 2]>, BuildError> + 'a;

/// For whoever has no files.
fn no_files(path: &str, _: &str) -> Result<Vec<[f64; 2]>, BuildError> {
    Err(BuildError::at(
        "path",
        format!("`{path}` cannot be read: there are no files here"),
    ))
}

/// What is driven, and how its files are read.
#[derive(Clone, Copy)]
struct Driven<'a> {
    signal: &'a str,
    read: &'a ReadColumn<'a>,
}

fn one() -> u64 {
    1
}

impl Excitation {
    /// Checks the numbers. `signal` names what is driven: it makes random sequences of several
    /// signals independent of each other, whatever their seeds.
    ///
    /// ```
    /// use loopsight_model::excitation::Excitation;
    /// let steps = Excitation::Steps { at: vec![[1.0, 9.0], [2.0, -9.0]] }.build("voltage_right")?;
    /// assert_eq!([0.99, 1.0, 2.5].map(|t| steps.sample(t)), [0.0, 9.0, -9.0]);
    /// # Ok::<(), loopsight_model::registry::BuildError>(())
    /// ```
    ///
    /// # Errors
    ///
    /// [`BuildError`] where a number is out of its range, or where a file would be needed.
    pub fn build(&self, signal: &str) -> Result<Sequence, BuildError> {
        let read: &ReadColumn<'_> = &no_files;
        self.build_at("", stream_of(signal), Driven { signal, read })
    }

    fn build_at(
        &self,
        path: &str,
        stream: u64,
        driven: Driven<'_>,
    ) -> Result<Sequence, BuildError> {
        let at = |key: &str| join(path, key);
        let finite = |key: &str, value: f64| {
            if value.is_finite() {
                Ok(())
            } else {
                Err(BuildError::at(
                    &at(key),
                    format!("found {value}, expected a finite number"),
                ))
            }
        };
        let above_zero = |key: &str, value: f64, unit: &str| {
            if value > 0.0 && value.is_finite() {
                Ok(())
            } else {
                Err(BuildError::at(
                    &at(key),
                    format!("found {value} {unit}, expected a number above 0 {unit}"),
                ))
            }
        };
        let random = |amplitude: f64, hold: f64, levels: u32, seed: u64, common: bool| {
            let stream = if common { 0 } else { stream };
            Sequence::random((amplitude, hold), levels, (seed, stream))
        };
        match self {
            Self::Constant(value) => finite("constant", *value)?,
            Self::Steps { at: list } => {
                if !list.is_empty() {
                    in_order(&at("steps.at"), list)?;
                }
                return Ok(Sequence(Kind::Steps(list.clone())));
            }
            Self::Waypoints { at: list, between } => {
                in_order(&at("waypoints.at"), list)?;
                return Ok(Sequence(Kind::Points(Points::new(list.clone(), *between))));
            }
            Self::File {
                path: file,
                column,
                between,
            } => {
                let column = column.as_deref().unwrap_or(driven.signal);
                let list = (driven.read)(file, column).map_err(|e| BuildError {
                    key: at(&format!("file.{}", e.key)),
                    ..e
                })?;
                in_order(&at("file.path"), &list)?;
                return Ok(Sequence(Kind::Points(Points::new(list, *between))));
            }
            Self::Ramp {
                from,
                to,
                start_s,
                duration_s,
            } => {
                finite("ramp.from", *from)?;
                finite("ramp.to", *to)?;
                finite("ramp.start_s", *start_s)?;
                above_zero("ramp.duration_s", *duration_s, "s")?;
            }
            Self::Sine {
                amplitude,
                frequency_hz,
                phase_rad,
            } => {
                finite("sine.amplitude", *amplitude)?;
                above_zero("sine.frequency_hz", *frequency_hz, "Hz")?;
                finite("sine.phase_rad", *phase_rad)?;
            }
            Self::Chirp {
                amplitude,
                from_hz,
                to_hz,
                duration_s,
            } => {
                finite("chirp.amplitude", *amplitude)?;
                finite("chirp.from_hz", *from_hz)?;
                finite("chirp.to_hz", *to_hz)?;
                above_zero("chirp.duration_s", *duration_s, "s")?;
            }
            Self::Prbs {
                amplitude,
                hold_s,
                seed,
                common,
            } => {
                finite("prbs.amplitude", *amplitude)?;
                above_zero("prbs.hold_s", *hold_s, "s")?;
                return Ok(random(*amplitude, *hold_s, 2, *seed, *common));
            }
            Self::MultiLevel {
                amplitude,
                hold_s,
                levels,
                seed,
                common,
            } => {
                finite("multi_level.amplitude", *amplitude)?;
                above_zero("multi_level.hold_s", *hold_s, "s")?;
                if *levels < 2 {
                    return Err(BuildError::at(
                        &at("multi_level.levels"),
                        format!("found {levels}, expected 2 levels or more"),
                    ));
                }
                return Ok(random(*amplitude, *hold_s, *levels, *seed, *common));
            }
            Self::Sum(parts) => {
                let parts: Result<Vec<Sequence>, BuildError> = parts
                    .iter()
                    .enumerate()
                    .map(|(i, part)| {
                        let own = stream.rotate_left(7).wrapping_add(i as u64 + 1);
                        part.build_at(&at(&format!("sum[{i}]")), own, driven)
                    })
                    .collect();
                return Ok(Sequence(Kind::Sum(parts?)));
            }
        }
        Ok(Sequence(Kind::Plain(self.clone())))
    }
}

/// One sequence per signal, in the order of `signals`; signals that are not given stay at 0. The
/// key of an error is the path within the table, as in `voltage_right.prbs.hold_s`.
///
/// # Errors
///
/// [`BuildError`] where a signal is unknown, or an excitation cannot be built.
pub fn build(
    given: &BTreeMap<String, Excitation>,
    signals: &[Signal],
) -> Result<Vec<Sequence>, BuildError> {
    build_with(given, signals, &no_files)
}

/// As [`build()`], where files can be read.
///
/// # Errors
///
/// As [`build()`], and where a file cannot be read.
pub fn build_with(
    given: &BTreeMap<String, Excitation>,
    signals: &[Signal],
    read: &ReadColumn<'_>,
) -> Result<Vec<Sequence>, BuildError> {
    if let Some(unknown) = given.keys().find(|k| signals.iter().all(|s| s.id != *k)) {
        let ids: Vec<&str> = signals.iter().map(|s| s.id).collect();
        let error = BuildError::at(
            unknown,
            format!(
                "there is no signal `{unknown}` to drive, expected one of {}",
                ids.join(", ")
            ),
        );
        return Err(match nearest(unknown, ids) {
            Some(name) => error.help(format!("did you mean `{name}`?")),
            None => error,
        });
    }
    signals
        .iter()
        .map(|signal| match given.get(signal.id) {
            Some(excitation) => {
                let driven = Driven {
                    signal: signal.id,
                    read,
                };
                excitation.build_at(signal.id, stream_of(signal.id), driven)
            }
            None => Ok(Sequence::default()),
        })
        .collect()
}

fn in_order(key: &str, list: &[[f64; 2]]) -> Result<(), BuildError> {
    points::mistake(list).map_or(Ok(()), |message| Err(BuildError::at(key, message)))
}

fn join(path: &str, key: &str) -> String {
    if path.is_empty() {
        key.to_owned()
    } else {
        format!("{path}.{key}")
    }
}

/// A random stream of its own for every name (FNV-1a), never the common stream 0.
fn stream_of(name: &str) -> u64 {
    let hash = name.bytes().fold(0xcbf2_9ce4_8422_2325_u64, |hash, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
    });
    hash.max(1)
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIGNALS: [Signal; 2] = [
        Signal::new("voltage_right", "V_r", "V", "right"),
        Signal::new("voltage_left", "V_l", "V", "left"),
    ];

    fn prbs(seed: u64) -> Excitation {
        Excitation::Prbs {
            amplitude: 9.0,
            hold_s: 0.5,
            seed,
            common: false,
        }
    }

    #[test]
    fn a_file_reads_as_documented() {
        let text = "voltage_right = { prbs = { amplitude = 9.0, hold_s = 0.5 } }\n\
                    voltage_left = { sum = [{ constant = 2.0 }, { steps = { at = [[1.0, 3.0]] } }] }\n";
        let given: BTreeMap<String, Excitation> = toml::from_str(text).unwrap();
        assert_eq!(given["voltage_right"], prbs(1));
        let both = build(&given, &SIGNALS).unwrap();
        assert_eq!(sample_rows(&both[1..], &[0.0, 1.0]), [2.0, 5.0]);
    }

    #[test]
    fn a_wrong_name_or_number_is_pointed_at() {
        let wrong = BTreeMap::from([("voltage_rigth".to_owned(), prbs(1))]);
        let error = build(&wrong, &SIGNALS).unwrap_err();
        assert_eq!(error.help.as_deref(), Some("did you mean `voltage_right`?"));
        let zero = Excitation::Sum(vec![
            prbs(1),
            Excitation::Prbs {
                amplitude: 1.0,
                hold_s: 0.0,
                seed: 1,
                common: false,
            },
        ]);
        let error = build(
            &BTreeMap::from([("voltage_left".to_owned(), zero)]),
            &SIGNALS,
        )
        .unwrap_err();
        assert_eq!(error.key, "voltage_left.sum[1].prbs.hold_s");
        let back = Excitation::Steps {
            at: vec![[2.0, 1.0], [1.0, 0.0]],
        };
        assert!(back.build("").unwrap_err().message.contains("entry 2"));
    }

    #[test]
    fn a_file_gives_the_column_of_its_signal_or_the_one_named() {
        let text = "voltage_right = { file = { path = \"w.csv\" } }\n\
                    voltage_left = { file = { path = \"w.csv\", column = \"u\", between = \"held\" } }\n";
        let given: BTreeMap<String, Excitation> = toml::from_str(text).unwrap();
        let read = |path: &str, column: &str| match (path, column) {
            ("w.csv", "voltage_right") => Ok(vec![[0.0, 1.0], [1.0, 3.0]]),
            ("w.csv", "u") => Ok(vec![[0.0, 5.0], [1.0, 7.0]]),
            _ => Err(BuildError::at("column", format!("no {column}"))),
        };
        let both = build_with(&given, &SIGNALS, &read).unwrap();
        assert_eq!(sample_rows(&both, &[0.5]), [2.0, 5.0]);
        let error =
            build_with(&given, &SIGNALS, &|_, _| Ok(vec![[1.0, 0.0], [0.0, 0.0]])).unwrap_err();
        assert_eq!(error.key, "voltage_right.file.path");
        assert!(error.message.contains("entry 2"), "{error}");
        let error = build(&given, &SIGNALS).unwrap_err();
        assert!(error.message.contains("w.csv"), "{error}");
    }
}
