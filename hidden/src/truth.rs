//! What was hidden, in words and numbers, so that a finding can be compared with it.

use crate::{Hidden, Robot};

/// A number with name and unit.
#[derive(Clone, Debug, PartialEq)]
pub struct Quantity {
    /// Name, e.g. `level`.
    pub name: &'static str,
    /// Value.
    pub value: f64,
    /// Unit, e.g. `V`.
    pub unit: &'static str,
}

/// One hidden effect.
#[derive(Clone, Debug, PartialEq)]
pub struct Concealed {
    /// Which.
    pub effect: Hidden,
    /// One line: what is hidden.
    pub doc: &'static str,
    /// Size it was hidden with; 1 is noticeable, twice that hard to miss.
    pub size: f64,
    /// Channels of the fitted plant at which it sits.
    pub at: Vec<&'static str>,
    /// The values that a fit of the effect at these channels should find, in the units it has
    /// there: torques at a shaft as the motor voltage that would make them. Empty where the truth
    /// has another form than any such effect.
    pub fitted: Vec<Quantity>,
    /// The truth has another form than the effect that would be fitted: the values above are the
    /// nearest, and a good fit may well find others.
    pub approximate: bool,
    /// The values of the physics that made the recording.
    pub physical: Vec<Quantity>,
}

impl Concealed {
    pub(crate) fn new(effect: Hidden, size: f64, at: &[&'static str]) -> Self {
        Self {
            effect,
            doc: effect.doc(),
            size,
            at: at.to_vec(),
            fitted: Vec::new(),
            approximate: false,
            physical: Vec::new(),
        }
    }

    /// What it is on this machine, and the channels of its plant at which it sits.
    pub(crate) fn told(mut self, doc: &'static str, at: &[&'static str]) -> Self {
        self.doc = doc;
        self.at = at.to_vec();
        self
    }

    pub(crate) fn fitted(mut self, name: &'static str, value: f64, unit: &'static str) -> Self {
        self.fitted.push(Quantity { name, value, unit });
        self
    }

    pub(crate) fn physical(mut self, name: &'static str, value: f64, unit: &'static str) -> Self {
        self.physical.push(Quantity { name, value, unit });
        self
    }

    /// A value by name, among the fitted ones first.
    pub fn value(&self, name: &str) -> Option<f64> {
        let all = self.fitted.iter().chain(&self.physical);
        all.into_iter().find(|q| q.name == name).map(|q| q.value)
    }
}

/// Everything about a recording that its reader is not told.
#[derive(Clone, Debug, PartialEq)]
pub struct Truth {
    /// The machine.
    pub robot: Robot,
    /// What was hidden, in the order asked for; empty on the clean machine.
    pub hidden: Vec<Concealed>,
    /// True parameters of the model by name, with units, those of a machine without the effect.
    pub lumped: Vec<Quantity>,
    /// Time constant of the windings, s: to a lumped model an actuator lag. None without a motor on
    /// a voltage.
    pub winding_time_constant: Option<f64>,
}

impl Truth {
    /// As TOML.
    pub fn to_toml(&self) -> String {
        let mut text = format!("robot = \"{}\"\n\n[lumped]\n", self.robot.name());
        quantities(&mut text, &self.lumped);
        if let Some(time_constant) = self.winding_time_constant {
            text.push_str(&format!(
                "\n# The windings' inductance, which the lumped model does not have.\n\
                 [winding]\ntime_constant = {time_constant:?} # s\n"
            ));
        }
        for hidden in &self.hidden {
            let at: Vec<String> = hidden.at.iter().map(|c| format!("\"{c}\"")).collect();
            text.push_str(&format!(
                "\n# {}\n[[hidden]]\neffect = \"{}\"\nsize = {:?}\nat = [{}]\n",
                hidden.doc,
                hidden.effect,
                hidden.size,
                at.join(", ")
            ));
            if !hidden.fitted.is_empty() {
                let about = if hidden.approximate { ", about" } else { "" };
                text.push_str(&format!(
                    "\n# As a fitted model would have it{about}.\n[hidden.fitted]\n"
                ));
                quantities(&mut text, &hidden.fitted);
            }
            if !hidden.physical.is_empty() {
                text.push_str("\n# As the simulated parts have it.\n[hidden.physical]\n");
                quantities(&mut text, &hidden.physical);
            }
        }
        text
    }
}

fn quantities(text: &mut String, all: &[Quantity]) {
    for Quantity { name, value, unit } in all {
        text.push_str(&format!("{name} = {:?} # {unit}\n", significant(*value, 6)));
    }
}

/// `value` with so many significant digits.
pub(crate) fn significant(value: f64, digits: usize) -> f64 {
    let text = format!("{:.*e}", digits.saturating_sub(1), value);
    let rounded: f64 = text.parse().unwrap_or(value);
    // Minus zero reads badly.
    rounded + 0.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digits() {
        assert_eq!(significant(0.123_456_789, 6), 0.123_457);
        assert_eq!(significant(-12.0, 6), -12.0);
        assert_eq!(significant(0.0, 6), 0.0);
    }
}
