//! How fast a plant moves: for an experiment that suits it, and for time stamps that do not.

use loopsight_core::Real;
use loopsight_model::model::Model;
use loopsight_model::simulate::Simulator;
use loopsight_model::{Dual, derivative, variable};
use nalgebra::{DMatrix, Schur};

/// The time constants `1/|λ|` of a plant, s: `λ` are the eigenvalues of its equations, linearised
/// at a state to which its inputs drive it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Pace {
    pub(crate) fastest: f64,
    pub(crate) slowest: f64,
}

/// Beyond this ratio to the fastest a motion counts as an integral: it has no time constant.
const SPREAD: f64 = 1e3;

/// Instant after which the states are compared with those before, s.
const INSTANT: f64 = 1e-5;

impl Pace {
    /// Of `model` under the inputs `drive`.
    ///
    /// The state is the one that is reached from 0 in one time constant, because a plant may be singular at 0 (an
    /// empty tank). A few rounds find state and time constant together.
    #[cfg(feature = "cli")]
    pub(crate) fn of(model: &Model, drive: &[f64]) -> Self {
        Self::known(model, drive).unwrap_or(Self {
            fastest: 1.0,
            slowest: 1.0,
        })
    }

    /// As [`Pace::of`]; none where nothing has a time constant.
    pub(crate) fn known(model: &Model, drive: &[f64]) -> Option<Self> {
        let mut found = None;
        for _ in 0..4 {
            let pace = found.unwrap_or(Self {
                fastest: 1.0,
                slowest: 1.0,
            });
            let state = reached(model, drive, pace);
            match time_constants(model, &state, drive) {
                Some(pace) => found = Some(pace),
                None => break,
            }
        }
        found
    }

    /// Sampling period: five samples in the fastest time constant, s.
    #[cfg(feature = "cli")]
    pub(crate) fn period(&self) -> f64 {
        let most = 20_000.0;
        rounded_down(0.2 * self.fastest).max(rounded_down(2.0 * self.duration() / most))
    }

    /// How long an input stays constant: about until the slowest motion has settled, s.
    #[cfg(feature = "cli")]
    pub(crate) fn hold(&self) -> f64 {
        rounded_down(5.5 * self.slowest)
    }

    /// Length of an experiment: fifty draws of the inputs, s.
    #[cfg(feature = "cli")]
    pub(crate) fn duration(&self) -> f64 {
        50.0 * self.hold()
    }

    /// Longest integration step of a model, s.
    #[cfg(feature = "cli")]
    pub(crate) fn model_step(&self) -> f64 {
        (0.25 * self.period()).min(0.25 * self.fastest)
    }

    /// Longest integration step of a robot, much finer than the model's, s.
    #[cfg(feature = "cli")]
    pub(crate) fn robot_step(&self) -> f64 {
        0.04 * self.model_step()
    }
}

/// The largest of 1, 2, 5 times a power of ten that is not above `value`.
#[cfg(feature = "cli")]
pub(crate) fn rounded_down(value: f64) -> f64 {
    let power = value.log10().floor();
    let digit = value / 10f64.powf(power);
    let nice = [5.0, 2.0].into_iter().find(|n| digit >= n * (1.0 - 1e-9));
    let text = format!("{}e{power}", nice.unwrap_or(1.0));
    // Through text: 2e-3 as a file has it, not the nearest to 2 · 0.1³.
    text.parse().unwrap_or(value)
}

/// The state in one slowest time constant from 0 under `drive`.
fn reached(model: &Model, drive: &[f64], pace: Pace) -> Vec<f64> {
    let mut fine = model.clone();
    fine.max_step = (0.1 * pace.fastest).max(1e-5 * pace.slowest);
    let values = fine.values();
    let mut simulator = Simulator::new(&fine, &values);
    simulator.reset(&vec![0.0; fine.n_states()], drive);
    simulator.advance(pace.slowest, drive);
    simulator.state()[..fine.n_states()].to_vec()
}

/// Linearises `model` at `state`; `None` where nothing has a time constant.
fn time_constants(model: &Model, state: &[f64], drive: &[f64]) -> Option<Pace> {
    let n = state.len();
    let values: Vec<Dual> = model.values().iter().map(|v| Dual::of(*v)).collect();
    let mut simulator = Simulator::new(model, &values);
    let mut jacobian = DMatrix::zeros(n, n);
    for column in 0..n {
        let start: Vec<Dual> = state
            .iter()
            .enumerate()
            .map(|(i, x)| {
                if i == column {
                    variable(*x, 0)
                } else {
                    Dual::of(*x)
                }
            })
            .collect();
        simulator.reset(&start, drive);
        simulator.advance(INSTANT, drive);
        for row in 0..n {
            let here = f64::from(u8::from(row == column));
            let moved = derivative(&simulator.state()[row], 0);
            jacobian[(row, column)] = (moved - here) / INSTANT;
        }
    }
    if jacobian.iter().any(|v| !v.is_finite()) {
        return None;
    }
    let rates: Vec<f64> = Schur::try_new(jacobian, f64::EPSILON, 10_000)?
        .complex_eigenvalues()
        .iter()
        .map(|l| l.re.hypot(l.im))
        .collect();
    let fastest = rates.iter().fold(0.0f64, |a, r| a.max(*r));
    let slowest = rates
        .iter()
        .filter(|r| **r * SPREAD > fastest)
        .fold(fastest, |a, r| a.min(*r));
    // Rounding of the differences above.
    (fastest > 1e-8).then(|| Pace {
        fastest: 1.0 / fastest,
        slowest: 1.0 / slowest,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_paper_s_robot_gets_the_paper_s_experiment() {
        let text = "[plant.ddmr]\nK_A = -15.146\nK_B = 0.005\nK_C = 0.136\nK_D = -9.573\n\
                    K_E = -3.945\nK_F = 0.656\nhalf_track = 0.131\nwheel_radius = 0.05\n";
        let (model, _) = Model::from_toml("model.toml", text).unwrap();
        let pace = Pace::of(&model, &[0.0, 0.0]);
        assert!((pace.fastest - 1.0 / 15.146).abs() < 1e-4, "{pace:?}");
        assert!((pace.slowest - 1.0 / 9.573).abs() < 1e-4, "{pace:?}");
        assert_eq!((pace.period(), pace.hold()), (0.01, 0.5));
        assert_eq!((pace.duration(), pace.model_step()), (25.0, 0.0025));
    }

    #[test]
    fn numbers_are_rounded_to_what_one_would_write() {
        for (value, nice) in [
            (0.0132, 0.01),
            (0.5, 0.5),
            (0.52, 0.5),
            (47.0, 20.0),
            (1e-3, 1e-3),
        ] {
            assert_eq!(rounded_down(value), nice);
        }
    }
}
