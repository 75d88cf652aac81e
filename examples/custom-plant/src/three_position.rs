//! A helmsman who knows three rudder angles.

use loopsight_core::{AffineModel, Command, ControlError, Controller, Tick};
use loopsight_model::declare_part;
use loopsight_model::model::Model;
use loopsight_model::registry::{BuildError, ControllerPart, PartMeta, Setting};
use serde::{Deserialize, Serialize};

/// Three-position control: each input is at plus or minus its level, or at 0.
///
/// ```text
/// e = r - y        u = level · sign(g) · s
/// s = sign(e) where |e| > band;  s stays until e changes its sign;  then s = 0
/// ```
///
/// | symbol | what | unit |
/// |---|---|---|
/// | `r`, `y`, `e` | reference, measurement and error of a controlled state | that of the state |
/// | `g` | what the state's own input does to its rate, from the model | of the state per s, per input |
/// | `level` | magnitude of the input | that of the input |
/// | `band` | error that is left alone | that of the state |
///
/// The state cycles around its reference; a wider band makes the cycle slower and wider.
///
/// Reference: Ya. Z. Tsypkin (1984), "Relay Control Systems", Cambridge University Press, chapter 1.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct ThreePosition {
    level: f64,
    band: f64,
}

const META: PartMeta = PartMeta {
    id: "three_position",
    role: "controller",
    summary: "a relay with a dead band: each input at plus or minus its level, or at 0",
    equation: "u = level sign(e) from |e| > band until e changes its sign, then 0",
    reference: "Tsypkin (1984), Relay Control Systems, Cambridge University Press, chapter 1",
    example: "[controller.three_position]\nlevel = 0.5\nband = 0.02\n",
    settings: &[
        Setting::new(
            "level",
            "",
            "magnitude of the inputs, in their unit; no default",
        ),
        Setting::new(
            "band",
            "",
            "error that is left alone, in the unit of the controlled states; no default",
        ),
    ],
};

#[typetag::serde(name = "three_position")]
impl ControllerPart for ThreePosition {
    fn meta(&self) -> &'static PartMeta {
        &META
    }

    fn build(&self, model: &Model, _period: f64) -> Result<Box<dyn Controller<f64>>, BuildError> {
        Ok(Box::new(self.relay(model.plant.controlled.len())?))
    }

    fn notes(&self) -> Vec<String> {
        vec![format!(
            "errors up to {} are left alone; beyond, the inputs are at ±{}",
            self.band, self.level
        )]
    }
}

declare_part!(&META);

impl ThreePosition {
    /// The controller for `n` controlled states.
    fn relay(&self, n: usize) -> Result<Relay, BuildError> {
        for (key, value) in [("level", self.level), ("band", self.band)] {
            if !(value > 0.0 && value.is_finite()) {
                let message = format!("`{key}` is {value}, expected a number above 0");
                return Err(BuildError::at(key, message));
            }
        }
        Ok(Relay {
            level: self.level,
            band: self.band,
            side: vec![0.0; n],
            drift: vec![0.0; n],
            matrix: vec![0.0; n * n],
        })
    }
}

/// The controller at work. What it needs lies here, so that a step allocates nothing.
struct Relay {
    level: f64,
    band: f64,
    /// To which side each state is pushed: 1, -1 or 0.
    side: Vec<f64>,
    drift: Vec<f64>,
    matrix: Vec<f64>,
}

impl Controller<f64> for Relay {
    fn step(
        &mut self,
        _tick: &Tick<f64>,
        reference: &[f64],
        measured: &[f64],
        model: &mut dyn AffineModel<f64>,
        command: &mut [f64],
    ) -> Result<Command, ControlError> {
        let n = self.side.len();
        if [reference.len(), measured.len(), model.size(), command.len()] != [n; 4] {
            return Err(ControlError::Sizes);
        }
        model.evaluate(measured, &mut self.drift, &mut self.matrix);
        let mut outcome = Command::default();
        for i in 0..n {
            let error = reference[i] - measured[i];
            if !error.is_finite() {
                // Without a measurement the last command is the best there is.
                outcome.held = true;
                continue;
            }
            if error.abs() > self.band {
                self.side[i] = error.signum();
            } else if error * self.side[i] <= 0.0 {
                self.side[i] = 0.0;
            }
            command[i] = self.level * self.side[i] * self.matrix[i * n + i].signum();
        }
        Ok(outcome)
    }

    fn reset(&mut self) {
        self.side.fill(0.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `y' = -2 u`: the input pushes the other way.
    struct Reversed;

    impl AffineModel<f64> for Reversed {
        fn size(&self) -> usize {
            1
        }
        fn evaluate(&mut self, _y: &[f64], drift: &mut [f64], input_matrix: &mut [f64]) {
            drift[0] = 0.0;
            input_matrix[0] = -2.0;
        }
    }

    #[test]
    fn pushes_beyond_the_band_until_the_error_is_gone() {
        let part = ThreePosition {
            level: 0.5,
            band: 0.1,
        };
        let mut relay = part.relay(1).unwrap();
        let tick = Tick {
            index: 0,
            time: 0.0,
            period: 0.1,
        };
        let mut u = [0.0];
        let mut at = |y: f64| {
            let outcome = relay.step(&tick, &[1.0], &[y], &mut Reversed, &mut u);
            assert_eq!(outcome.unwrap().held, y.is_nan());
            u[0]
        };
        let seen = [0.0, 0.95, f64::NAN, 1.01, 1.05, 1.2].map(&mut at);
        assert_eq!(seen, [-0.5, -0.5, -0.5, 0.0, 0.0, 0.5]);
        let wrong = ThreePosition {
            level: 0.5,
            band: 0.0,
        };
        assert_eq!(wrong.relay(1).err().unwrap().key, "band");
    }
}
