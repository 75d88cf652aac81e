//! The key `supervisor` of a loop file: a table, `false`, or absent.

use std::fmt;

use serde::de::value::MapAccessDeserializer;
use serde::de::{Error, MapAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::SupervisorSettings;

/// `[supervisor]` of a loop file, or `supervisor = false`.
#[derive(Clone, Debug, PartialEq)]
pub enum Supervision {
    /// `supervisor = false`: no supervisor.
    Nobody,
    /// By these settings.
    By(SupervisorSettings),
}

impl Serialize for Supervision {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Supervision::Nobody => serializer.serialize_bool(false),
            Supervision::By(settings) => settings.serialize(serializer),
        }
    }
}

impl<'de> Deserialize<'de> for Supervision {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Either;
        impl<'de> Visitor<'de> for Either {
            type Value = Supervision;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a table `[supervisor]`, or `false`")
            }

            fn visit_bool<E: Error>(self, watched: bool) -> Result<Supervision, E> {
                if watched {
                    return Err(E::custom(
                        "found true, expected a table `[supervisor]`, or `false`",
                    ));
                }
                Ok(Supervision::Nobody)
            }

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Supervision, A::Error> {
                SupervisorSettings::deserialize(MapAccessDeserializer::new(map))
                    .map(Supervision::By)
            }
        }
        deserializer.deserialize_any(Either)
    }
}

/// Periods without a fresh sample that are no fault yet.
const STALE: f64 = 5.0;
/// Time without a number after which a loop without learning stops, s.
const LOST: f64 = 0.5;
/// Periods of what takes a window of half a second or a second at 100 Hz.
const WINDOW: f64 = 50.0;
/// Periods for which a speed that does not change is no dead encoder yet: 0.3 s at 100 Hz.
const FROZEN: f64 = 30.0;
/// Times its largest reference by which a signal is off only where it goes the wrong way.
const WRONG_WAY: f64 = 2.0;

impl SupervisorSettings {
    /// The settings of a loop that uses what it learns and whose file has no `[supervisor]`: the defaults, no
    /// shorter than a supervisor of a loop with this `period` (s) needs.
    pub fn of_learning(period: f64) -> Self {
        let this = Self::default();
        Self {
            window_s: this.window_s.max(WINDOW * period),
            innovation_s: this.innovation_s.max(2.0 * WINDOW * period),
            tracking_s: this.tracking_s.max(2.0 * WINDOW * period),
            frozen_s: this.frozen_s.max(FROZEN * period),
            stale_s: this.stale_s.max(STALE * period),
            calm_s: this.calm_s.max(2.0 * WINDOW * period),
            ..this
        }
    }

    /// The settings of any other loop whose file has no `[supervisor]`: it stops where no number is measured any
    /// more, and where a signal has gone the wrong way, farther than its largest reference.
    pub fn of_any(period: f64) -> Self {
        Self {
            stale_s: LOST.max(2.0 * STALE * period),
            tracking_share: WRONG_WAY,
            frozen_s: f64::INFINITY,
            innovation: f64::INFINITY,
            ..Self::of_learning(period)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, Serialize, Deserialize)]
    struct File {
        #[serde(default, skip_serializing_if = "Option::is_none")]
        supervisor: Option<Supervision>,
    }

    fn read(text: &str) -> Result<Option<Supervision>, String> {
        let file: File = toml::from_str(text).map_err(|e| e.to_string())?;
        let again: File = toml::from_str(&toml::to_string(&file).unwrap()).unwrap();
        assert_eq!(again.supervisor, file.supervisor);
        Ok(file.supervisor)
    }

    #[test]
    fn a_table_or_false_or_nothing() {
        assert_eq!(read("").unwrap(), None);
        assert_eq!(
            read("supervisor = false").unwrap(),
            Some(Supervision::Nobody)
        );
        let by = read("[supervisor]\nfalls = 5\n").unwrap();
        let expected = SupervisorSettings {
            falls: 5,
            ..SupervisorSettings::default()
        };
        assert_eq!(by, Some(Supervision::By(expected)));
        let error = read("supervisor = true").unwrap_err();
        assert!(error.contains("or `false`"), "{error}");
        let error = read("[supervisor]\nfals = 5\n").unwrap_err();
        assert!(error.contains("unknown field `fals`"), "{error}");
    }

    #[test]
    fn what_is_assumed_suits_the_period() {
        assert_eq!(
            SupervisorSettings::of_learning(0.01),
            SupervisorSettings::default()
        );
        let slow = SupervisorSettings::of_any(1.0);
        assert_eq!((slow.stale_s, slow.tracking_s), (10.0, 100.0));
    }
}
