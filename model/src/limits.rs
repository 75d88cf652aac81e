//! `[limits]` of a loop file.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::config::nearest;
use crate::registry::BuildError;
use loopsight_core::{Limits, Signal};

/// Maximum and maximum rate of an input, or of the reference of a controlled signal.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SignalLimits {
    /// Largest magnitude, in the signal's unit.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub magnitude: Option<f64>,
    /// Largest rate, in the signal's unit per s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rate: Option<f64>,
}

/// Limits by signal, of a loop's inputs and of its references.
pub type LimitSettings = BTreeMap<String, SignalLimits>;

/// Limits of the inputs, and of the references of the controlled signals.
pub type BuiltLimits = (Option<Limits<Vec<f64>>>, Option<Limits<Vec<f64>>>);

/// Checks the numbers; the key of an error is the path within the table.
///
/// # Errors
///
/// [`BuildError`] where a signal is unknown, or a limit is not above 0.
pub fn build(
    given: &LimitSettings,
    inputs: &[Signal],
    controlled: &[Signal],
) -> Result<BuiltLimits, BuildError> {
    let known = |id: &str| inputs.iter().chain(controlled).any(|s| s.id == id);
    if let Some(unknown) = given.keys().find(|id| !known(id)) {
        let ids: Vec<&str> = inputs.iter().chain(controlled).map(|s| s.id).collect();
        let message = format!(
            "`{unknown}` is neither an input nor a controlled signal, expected one of {}",
            ids.join(", ")
        );
        let error = BuildError::at(unknown, message);
        return Err(match nearest(unknown, ids) {
            Some(name) => error.help(format!("did you mean `{name}`?")),
            None => error,
        });
    }
    for (id, limits) in given {
        for (key, value) in [("magnitude", limits.magnitude), ("rate", limits.rate)] {
            if let Some(value) = value.filter(|v| v.is_nan() || *v <= 0.0) {
                let message = format!("found {value}, expected a number above 0");
                return Err(BuildError::at(&format!("{id}.{key}"), message));
            }
        }
    }
    let of = |signals: &[Signal]| {
        let limits: Vec<SignalLimits> = signals
            .iter()
            .map(|s| given.get(s.id).copied().unwrap_or_default())
            .collect();
        if limits.iter().all(|l| *l == SignalLimits::default()) {
            return None;
        }
        let free = |limit: Option<f64>| limit.unwrap_or(f64::INFINITY);
        Some(Limits::new(
            limits.iter().map(|l| free(l.magnitude)).collect(),
            limits.iter().map(|l| free(l.rate)).collect(),
            vec![0.0; limits.len()],
        ))
    };
    Ok((of(inputs), of(controlled)))
}

#[cfg(test)]
mod tests {
    use super::*;

    const INPUTS: [Signal; 2] = [
        Signal::new("voltage_right", "V_r", "V", "right"),
        Signal::new("voltage_left", "V_l", "V", "left"),
    ];
    const SPEED: [Signal; 1] = [Signal::new("speed", "v", "m/s", "speed")];

    fn built(text: &str) -> Result<BuiltLimits, BuildError> {
        build(&toml::from_str(text).unwrap(), &INPUTS, &SPEED)
    }

    #[test]
    fn each_signal_has_its_own_and_the_others_none() {
        let (inputs, references) =
            built("voltage_left = { magnitude = 6.0 }\nspeed = { magnitude = 0.3, rate = 1.0 }\n")
                .unwrap();
        let mut voltages = [20.0, 20.0];
        assert!(inputs.unwrap().clamp(0.01, &mut voltages));
        assert_eq!(voltages, [20.0, 6.0]);
        let mut speed = [0.5];
        assert!(references.unwrap().clamp(0.1, &mut speed));
        assert_eq!(speed, [0.1]);
        assert_eq!(built("").unwrap(), (None, None));
    }

    #[test]
    fn wrong_names_and_numbers_are_pointed_at() {
        let error = built("voltage_lft = { magnitude = 6.0 }\n").unwrap_err();
        assert_eq!(error.help.as_deref(), Some("did you mean `voltage_left`?"));
        let error = built("speed = { rate = 0.0 }\n").unwrap_err();
        assert_eq!(error.key, "speed.rate");
    }
}
