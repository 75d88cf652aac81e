//! `[learning]` of a loop file.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::config::nearest;
use crate::model::Model;
use crate::registry::BuildError;
use loopsight_core::learning::{Guards, Range};

/// `[learning]` of a loop file: what is done with an estimator, whichever it is.
///
/// The rate of a signal is that of a controlled state, in its unit per second.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LearningSettings {
    /// The controller uses the estimates as if they were true. Otherwise it keeps the model of the
    /// model file, and the estimates are only logged. Default: false.
    pub certainty_equivalence: bool,
    /// Learns also while an actuator saturates. Default: false.
    pub while_saturated: bool,
    /// By signal, size of an error of its rate that teaches nothing, in its unit per second. Default: 0.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub dead_zone: BTreeMap<String, f64>,
    /// By signal, least excitation of a direction that is learned (see [`loopsight_core::learning::Guarded`]),
    /// in its unit per second. Default: a twentieth of the signal's size per
    /// second.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub least_excitation: BTreeMap<String, f64>,
    /// Time over which excitation and noise are averaged, s. Default: 2 s.
    pub window_s: f64,
    /// How near an estimate may come to where the equations fail (an open bound, a gain of zero), as
    /// a share of the start's distance from there. Default: 0.1.
    pub clearance: f64,
    /// How many of its scales a parameter may be away from the model file's value, where `range` does not say how
    /// far it may go. Default: 10.
    pub reach: f64,
    /// By parameter, `[low, high]` within which it is estimated, in its unit. Default: what the plant
    /// and the effects declare.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub range: BTreeMap<String, [f64; 2]>,
}

/// Least excitation that stands out from noise, in sizes of the signal per second.
const LEAST_EXCITATION: f64 = 0.05;

impl Default for LearningSettings {
    fn default() -> Self {
        Self {
            certainty_equivalence: false,
            while_saturated: false,
            dead_zone: BTreeMap::new(),
            least_excitation: BTreeMap::new(),
            window_s: 2.0,
            clearance: 0.1,
            reach: Range::<f64>::REACH,
            range: BTreeMap::new(),
        }
    }
}

impl LearningSettings {
    /// An error where a name or a number is wrong for `model`.
    pub(super) fn check(&self, model: &Model) -> Result<(), BuildError> {
        let states = model.plant.controlled.iter();
        let signals: Vec<&str> = states.map(|i| model.plant.states[*i].id).collect();
        for (key, map) in [
            ("dead_zone", &self.dead_zone),
            ("least_excitation", &self.least_excitation),
        ] {
            for (id, value) in map {
                let path = format!("{key}.{id}");
                if !signals.contains(&id.as_str()) {
                    return Err(unknown(&path, "controlled signal", id, &signals));
                }
                if !(*value >= 0.0 && value.is_finite()) {
                    let message = format!("`{id}` is {value}, expected a number from 0 upwards");
                    return Err(BuildError::at(&path, message));
                }
            }
        }
        if !(self.window_s > 0.0 && self.window_s.is_finite()) {
            let message = format!(
                "`window_s` is {} s, expected a number above 0 s",
                self.window_s
            );
            return Err(BuildError::at("window_s", message));
        }
        if !(self.clearance > 0.0 && self.clearance < 1.0) {
            let message = format!(
                "`clearance` is {}, expected a number above 0 and below 1",
                self.clearance
            );
            return Err(BuildError::at("clearance", message));
        }
        if !(self.reach > 0.0 && self.reach.is_finite()) {
            let message = format!("`reach` is {}, expected a number above 0", self.reach);
            return Err(BuildError::at("reach", message));
        }
        let names: Vec<&str> = model.parameters.iter().map(|p| p.name.as_str()).collect();
        for (name, [low, high]) in &self.range {
            let path = format!("range.{name}");
            if !names.contains(&name.as_str()) {
                return Err(unknown(&path, "parameter", name, &names));
            }
            // NaN is not less than anything.
            if low.partial_cmp(high) != Some(std::cmp::Ordering::Less) {
                let message = format!("`{name}` is [{low}, {high}], expected [low, high]");
                return Err(BuildError::at(&path, message));
            }
        }
        Ok(())
    }

    /// Where the `index`-th parameter of `model` may go; an error when its start is not there.
    pub(super) fn range(&self, model: &Model, index: usize) -> Result<Range<f64>, BuildError> {
        let parameter = &model.parameters[index];
        let start = parameter.value.unwrap_or(0.0);
        let declaration = parameter.declaration;
        let declared = Range::of(declaration, parameter.size, start, self.clearance);
        let mut range = declared.within_reach(declaration.nearest(start), self.reach);
        if let Some([low, high]) = self.range.get(&parameter.name) {
            let admitted = Range {
                low: low.max(declaration.min),
                high: high.min(declaration.max),
                ..range
            };
            if !(admitted.low..=admitted.high).contains(&start) {
                let message = format!(
                    "`{}` starts at {start} {}, outside the range from {} to {}",
                    parameter.name, parameter.unit, admitted.low, admitted.high
                );
                return Err(BuildError::at(
                    &format!("range.{}", parameter.name),
                    message,
                ));
            }
            range = admitted;
        }
        Ok(range)
    }

    /// When the `row`-th regression of `model` is learned from.
    pub fn guards(&self, model: &Model, row: usize, period: f64) -> Guards {
        let signal = &model.plant.states[model.plant.controlled[row]];
        let of = |map: &BTreeMap<String, f64>| map.get(signal.id).copied();
        Guards {
            dead_zone: of(&self.dead_zone).unwrap_or(0.0),
            least_excitation: of(&self.least_excitation).unwrap_or(LEAST_EXCITATION * signal.size),
            window: (self.window_s / period).max(1.0),
        }
    }
}

fn unknown(path: &str, what: &str, found: &str, known: &[&str]) -> BuildError {
    let message = format!(
        "unknown {what} `{found}`, expected one of {}",
        known.join(", ")
    );
    let error = BuildError::at(path, message);
    match nearest(found, known.iter().copied()) {
        Some(name) => error.help(format!("did you mean `{name}`?")),
        None => error,
    }
}
