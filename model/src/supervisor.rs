//! `[supervisor]` of a loop file, and its events in words.

mod choice;

use std::collections::BTreeMap;

use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};

use crate::config::nearest;
use crate::model::Model;
use crate::registry::BuildError;
use crate::sensor::Sensor;
use loopsight_core::supervisor::{Action, Cause, Event, Supervisor, Thresholds};

pub use choice::Supervision;

/// When a supervisor acts, see [`Supervisor`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SupervisorSettings {
    /// Window over which predictions are judged, s.
    pub window_s: f64,
    /// Times worse than the last good model at which the learned one is left.
    pub worse: f64,
    /// Times its usual size at which an innovation says that no model is right.
    pub innovation: f64,
    /// How long that may last, s.
    pub innovation_s: f64,
    /// Largest tracking error by controlled signal, in its unit.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub tracking: BTreeMap<String, f64>,
    /// Largest tracking error of the others, as a share of their largest reference so far.
    pub tracking_share: f64,
    /// How long a tracking error may be beyond its limit, s.
    pub tracking_s: f64,
    /// Least and greatest value of measured signals.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub range: BTreeMap<String, [f64; 2]>,
    /// How long a signal that should move may keep one value, s.
    pub frozen_s: f64,
    /// How long there may be no fresh sample, s.
    pub stale_s: f64,
    /// How long the learned model must have been good, while it learned, before it is handed over, s.
    pub calm_s: f64,
    /// How often in a minute the learned model may be left until it is not used again for a minute.
    pub falls: u32,
}

impl Default for SupervisorSettings {
    fn default() -> Self {
        Self {
            window_s: 0.5,
            worse: 2.0,
            innovation: 5.0,
            innovation_s: 1.0,
            tracking: BTreeMap::new(),
            tracking_share: 0.5,
            tracking_s: 1.0,
            range: BTreeMap::new(),
            frozen_s: 0.3,
            stale_s: 0.2,
            calm_s: 1.0,
            falls: 3,
        }
    }
}

impl SupervisorSettings {
    /// A supervisor for a loop with `model` and `rows` regressions; the key of an error is the path
    /// within the table.
    ///
    /// # Errors
    ///
    /// [`BuildError`] where a number is out of its range, or a signal is unknown.
    pub fn build(
        &self,
        model: &Model,
        rows: usize,
    ) -> Result<Supervisor<f64, Vec<f64>>, BuildError> {
        for (key, value, unit) in [
            ("window_s", self.window_s, " s"),
            ("worse", self.worse, ""),
            ("innovation", self.innovation, ""),
            ("innovation_s", self.innovation_s, " s"),
            ("tracking_share", self.tracking_share, ""),
            ("tracking_s", self.tracking_s, " s"),
            ("frozen_s", self.frozen_s, " s"),
            ("stale_s", self.stale_s, " s"),
            ("calm_s", self.calm_s, " s"),
        ] {
            if value.is_nan() || value <= 0.0 {
                let message = format!("found {value}{unit}, expected a number above 0{unit}");
                return Err(BuildError::at(key, message));
            }
        }
        let measured: Vec<&str> = model.measured.iter().map(|m| m.signal.id).collect();
        let controlled = model
            .plant
            .controlled
            .iter()
            .map(|i| model.plant.states[*i].id);
        let controlled: Vec<&str> = controlled.collect();
        named("tracking", "controlled signal", &self.tracking, &controlled)?;
        named("range", "measured signal", &self.range, &measured)?;
        if let Some((id, limit)) = self.tracking.iter().find(|(_, l)| l.is_nan() || **l <= 0.0) {
            let message = format!("found {limit}, expected a number above 0");
            return Err(BuildError::at(&format!("tracking.{id}"), message));
        }
        for (id, [low, high]) in &self.range {
            let ordered = low < high;
            if !ordered {
                let message = format!("found [{low}, {high}], expected the lower end first");
                return Err(BuildError::at(&format!("range.{id}"), message));
            }
        }
        let free = f64::INFINITY;
        let tracking = controlled.iter().map(|id| self.tracking.get(*id).copied());
        let range = |end: usize, none: f64| {
            let of = |id: &&str| self.range.get(*id).map_or(none, |r| r[end]);
            measured.iter().map(of).collect()
        };
        Ok(Supervisor::new(
            Thresholds {
                window: self.window_s,
                worse: self.worse,
                innovation: self.innovation,
                innovation_for: self.innovation_s,
                tracking_share: self.tracking_share,
                tracking_for: self.tracking_s,
                frozen: self.frozen_s,
                stale: self.stale_s,
                calm: self.calm_s,
                falls: self.falls,
            },
            model.values(),
            (rows, controlled.len()),
            tracking.map(|limit| limit.unwrap_or(free)).collect(),
            (range(0, -free), range(1, free)),
            {
                let shafts = shafts(model);
                (shafts.rows, shafts.counts)
            },
            |length| vec![0.0; length],
        ))
    }
}

/// What may freeze: the shafts of the encoders where all controlled signals come from such, and the signals.
struct Shafts {
    names: Vec<String>,
    /// The matrix that gives the speeds from the controlled signals, row by row.
    rows: Vec<f64>,
    /// Angle of one count; 0 of what is no shaft.
    counts: Vec<f64>,
}

fn shafts(model: &Model) -> Shafts {
    let n = model.plant.controlled.len();
    let measured = model.measured.iter().take(n);
    let (mut names, mut counts) = (Vec::<String>::new(), Vec::new());
    for m in measured.clone() {
        if let Sensor::EncoderCounts(encoder) = &m.sensor {
            for shaft in encoder.of.keys() {
                if !names.contains(shaft) {
                    names.push(shaft.clone());
                    counts.push(encoder.resolution());
                }
            }
        }
    }
    let gain = |i: usize, shaft: &str| match &model.measured[i].sensor {
        Sensor::EncoderCounts(encoder) => encoder.of.get(shaft).copied().unwrap_or(0.0),
        _ => 0.0,
    };
    let gains = DMatrix::from_fn(n, names.len(), |i, k| gain(i, &names[k]));
    let mut rows = Vec::new();
    let inverse = if gains.is_square() {
        gains.try_inverse()
    } else {
        None
    };
    match inverse {
        // Column by column, the transpose is the inverse row by row.
        Some(inverse) => rows.extend_from_slice(inverse.transpose().as_slice()),
        None => {
            names.clear();
            counts.clear();
        }
    }
    counts.resize(names.len() + n, 0.0);
    names.extend(measured.map(|m| m.signal.id.to_owned()));
    rows.extend_from_slice(DMatrix::<f64>::identity(n, n).as_slice());
    Shafts {
        names,
        rows,
        counts,
    }
}

/// Names of what a supervised loop may find frozen, for [`described`].
pub fn turning(model: &Model) -> Vec<String> {
    shafts(model).names
}

/// Every key of `given` is one of `ids`.
fn named<T>(
    key: &str,
    what: &str,
    given: &BTreeMap<String, T>,
    ids: &[&str],
) -> Result<(), BuildError> {
    let Some(unknown) = given.keys().find(|id| !ids.contains(&id.as_str())) else {
        return Ok(());
    };
    let message = format!(
        "there is no {what} `{unknown}`, expected one of {}",
        ids.join(", ")
    );
    let error = BuildError::at(&format!("{key}.{unknown}"), message);
    Err(match nearest(unknown, ids.iter().copied()) {
        Some(name) => error.help(format!("did you mean `{name}`?")),
        None => error,
    })
}

/// An event in words; `signals` are the loop's measured signals by id and unit, `turning` what
/// [`turning`] says.
pub fn described(event: &Event<f64>, signals: &[(&str, &str)], turning: &[String]) -> String {
    let (value, limit) = (event.value, event.limit);
    let id = |i: usize| signals.get(i).map_or("a signal", |s| s.0);
    let unit = |i: usize| signals.get(i).map_or("", |s| s.1);
    let why = match event.cause {
        Cause::Worse(i) => format!(
            "what was learned predicts {} {value:.1} times worse than the last good model (limit {limit})",
            id(i)
        ),
        Cause::Innovation(i) => format!(
            "no model explains {}: its innovation is {value:.1} times the usual (limit {limit})",
            id(i)
        ),
        Cause::Tracking(i) => format!(
            "{} is {value:.3} {} off its reference (limit {limit:.3} {})",
            id(i),
            unit(i),
            unit(i)
        ),
        Cause::Frozen(i) => format!(
            "{} has kept its speed for {value:.2} s although it should not: its sensor is dead, or it is blocked (limit {limit} s)",
            turning.get(i).map_or("a shaft", String::as_str)
        ),
        Cause::Range(i) => format!(
            "{} is {value:.4} {} (limit {limit} {})",
            id(i),
            unit(i),
            unit(i)
        ),
        Cause::Stale => format!("no fresh sample for {value:.2} s (limit {limit} s)"),
        Cause::Relapse => format!(
            "fell back {value:.0} times within a minute (limit {limit:.0}), so nothing that is learned is used for a minute"
        ),
        Cause::Calm => {
            format!("it predicted no worse than the last good model for {limit} s of learning")
        }
    };
    match event.action {
        Action::FellBack => format!("the last good model is back: {why}"),
        Action::Resumed => format!("the controller uses what was learned: {why}"),
        Action::Stopped => format!("stopped by the supervisor: {why}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn events_are_said_in_words() {
        let event = Event {
            action: Action::Stopped,
            cause: Cause::Tracking(0),
            value: 0.7,
            limit: 0.5,
        };
        assert_eq!(
            described(&event, &[("speed", "m/s")], &[]),
            "stopped by the supervisor: speed is 0.700 m/s off its reference (limit 0.500 m/s)"
        );
    }
}
