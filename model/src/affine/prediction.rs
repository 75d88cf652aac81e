//! Prediction of the state at the time when the next command acts.

use nalgebra::{DMatrix, DVector};

use crate::simulate::Simulator;
use loopsight_core::{Observation, Place, Tick};

use super::Affine;
use super::lateness::{exact, lateness};

/// Correction rate of the predictor's models, as a share of one over the lateness: their errors then fade without
/// oscillation, although they are measured late.
const CALM: f64 = 0.2;

/// A predictor after Smith, with an observer of what disturbs the plant.
///
/// ```text
/// x₀' = F(x₀, V) + d            what the plant would do without delays and lags
/// x₁' = F(x₁, D V) + d          the same behind them, ŷ = sensors of x₁
/// y   = C x₀ + e                e = C⁺ (measured - ŷ), after the correction
/// x₀, x₁ += (1 - exp(-2 ω T)) e      d += Δd,  Δd = ω² T e      ω = 0.2/θ
/// x₀ += Φ Δd                    Φ = what a unit of d does to x₀ within the lateness of D
/// ```
///
/// | symbol | what | unit |
/// |---|---|---|
/// | `V` | applied commands | of the inputs |
/// | `D` | delays and lags of commands | |
/// | `x₀`, `x₁` | states of the model, ahead and now | of the signals |
/// | `y` | what the controller gets | of the controlled states |
/// | `d` | disturbance that explains what the model does not, at the controlled states | of `y` per s |
/// | `θ` | lateness of the whole, `∫ (C x₀ - ŷ) dt / C x₀(end)` of a step response | s |
///
/// With an exact model the controller acts on a plant without delay, and the response is the designed one, later by
/// the delay. Where the model is wrong, `e` is the difference, as in Smith's scheme: at rest `C x₀ = ŷ`, so that the
/// controller gets the measurement and no error is left. On a plant that integrates, `x₀` would be ahead by what the
/// disturbance does within the delay. `d` in both models, and `Φ Δd` in the one ahead, correct that.
///
/// Assumptions: the sensors of the controlled states and the delays of the inputs are alike within
/// each group, so that one lateness stands for them; disturbances that change slowly against `θ`.
///
/// Reference: O. J. M. Smith (1957), "Closer control of loops with dead time", Chemical Engineering
/// Progress 53, 217–219; J. E. Normey-Rico, E. F. Camacho (2007), "Control of Dead-time Processes",
/// Springer, ch. 5 to 7 (integrating plants, disturbance estimates).
#[derive(Clone)]
pub(super) struct Predictor {
    /// `x₁`.
    late: Simulator<'static, f64>,
    /// `x₀`.
    prompt: Simulator<'static, f64>,
    controlled: &'static [usize],
    predicted: Vec<f64>,
    residual: DVector<f64>,
    /// `e`, one per state of the plant.
    rest: DVector<f64>,
    disturbance: Vec<f64>,
    /// `Φ`, one per state of the plant.
    ahead: Vec<f64>,
    at_start: Vec<f64>,
    /// Tick at which both began; `None` before the first measurement.
    start: Option<u64>,
    lateness: f64,
    /// The part of it that is the commands'.
    of_commands: f64,
    correction: f64,
    learning: f64,
}

impl Affine {
    /// With a predictor, where the model holds anything that makes commands or measurements late or
    /// measurements wrong, or that has to be followed; else as it is. `period` is the loop's, s.
    #[must_use]
    pub fn predicting(mut self, period: f64) -> Self {
        let late = self.treatments.iter().any(|t| t.is_predicted());
        if late || self.bounds.states > 0 {
            self.predictor = Some(Box::new(Predictor::new(&self, period)));
        }
        self
    }

    /// How much later than a command without delays and sensors without delays one is felt and seen,
    /// s; `None` without a predictor.
    pub fn lateness(&self) -> Option<f64> {
        self.predictor.as_ref().map(|p| p.lateness)
    }

    /// What the predictor does, in words.
    pub fn predictor_note(&self) -> Option<String> {
        let late = self.lateness()?;
        let commands = self.predictor.as_ref()?.of_commands;
        let mut note = format!(
            "the controller acts on the state predicted {:.1} ms ahead",
            1e3 * late
        );
        if commands > 0.0 {
            note.push_str(&format!(
                "; references are asked for {:.1} ms before their time",
                1e3 * commands
            ));
        }
        Some(note)
    }
}

impl Predictor {
    fn new(affine: &Affine, period: f64) -> Self {
        let (whole, treatments) = (&affine.whole, &affine.treatments);
        let measured = whole.measured.clone();
        let late = whole.keeping(|i| treatments[i].is_known(), measured.clone());
        // What only falsifies a measurement is not late.
        let delays = |i: usize| treatments[i].is_predicted() && whole.effects[i].meta.is_dynamic();
        let only = whole.keeping(delays, measured);
        let of_input = |i: usize| {
            let at = &whole.effects[i].at;
            delays(i) && at.iter().all(|c| matches!(c.place, Place::Input(_)))
        };
        let of_commands = whole.keeping(of_input, exact(whole));
        let of_commands = lateness(whole, &of_commands, period);
        let lateness = lateness(whole, &only, period).max(0.5 * period);
        let omega = CALM / lateness.max(period);
        let nx = whole.n_states();
        Self {
            predicted: vec![0.0; late.measured.len()],
            residual: DVector::zeros(late.measured.len()),
            rest: DVector::zeros(nx),
            disturbance: vec![0.0; nx],
            ahead: whole.disturbed(of_commands),
            at_start: vec![0.0; nx],
            late: Simulator::owning(late, &affine.values),
            prompt: Simulator::owning(affine.model.clone(), &affine.values),
            controlled: whole.plant.controlled,
            start: None,
            lateness,
            of_commands,
            correction: -libm::expm1(-2.0 * omega * period),
            learning: omega * omega * period,
        }
    }

    pub(super) fn set_values(&mut self, values: &[f64]) {
        self.late.set_values(values);
        self.prompt.set_values(values);
    }

    /// How much later than now a command is felt, s.
    pub(super) fn commands_late(&self) -> f64 {
        self.of_commands
    }

    /// The extended state `x₀`.
    pub(super) fn state(&self) -> &[f64] {
        self.prompt.extended()
    }

    /// Takes the commands applied until `tick`.
    pub(super) fn advance(&mut self, tick: &Tick<f64>, applied: &[f64]) {
        if let Some(start) = self.start
            && applied.iter().all(|v| v.is_finite())
        {
            let until = tick.index.saturating_sub(start) as f64 * tick.period;
            self.late.advance(until, applied);
            self.prompt.advance(until, applied);
        }
    }

    /// Takes a measurement; one that is not fresh corrects nothing.
    ///
    /// Allocates only where it starts over: at the first tick, or after its models diverged.
    pub(super) fn correct(
        &mut self,
        seen: &Observation<'_, f64>,
        to_state: &DMatrix<f64>,
        offset: &DVector<f64>,
    ) {
        let measured = seen.measured;
        let lost = !self.late.state().iter().all(|v| v.is_finite());
        if self.start.is_none() || lost {
            for (i, to) in self.residual.iter_mut().enumerate() {
                *to = measured[i] - offset[i];
            }
            to_state.mul_to(&self.residual, &mut self.rest);
            self.at_start.copy_from_slice(self.rest.as_slice());
            self.restart(seen.tick.index);
            return;
        }
        if !seen.sample.fresh {
            return;
        }
        self.late.measure(&mut self.predicted);
        for (i, to) in self.residual.iter_mut().enumerate() {
            *to = measured[i] - self.predicted[i];
        }
        to_state.mul_to(&self.residual, &mut self.rest);
        for (i, error) in self.rest.iter_mut().enumerate() {
            let part = self.correction * *error;
            self.late.state_mut()[i] += part;
            self.prompt.state_mut()[i] += part;
            if self.controlled.contains(&i) {
                let change = self.learning * *error;
                self.disturbance[i] += change;
                self.prompt.state_mut()[i] += self.ahead[i] * change;
                self.late.push(Place::Rate(i), self.disturbance[i]);
                self.prompt.push(Place::Rate(i), self.disturbance[i]);
            }
            *error -= part;
        }
    }

    /// Both models at rest where the plant was measured, with no command under way.
    fn restart(&mut self, tick: u64) {
        let inputs = vec![0.0; self.late.inputs()];
        for simulator in [&mut self.late, &mut self.prompt] {
            for i in self.controlled {
                simulator.push(Place::Rate(*i), 0.0);
            }
            simulator.reset(&self.at_start, &inputs);
        }
        self.disturbance.fill(0.0);
        self.rest.fill(0.0);
        self.start = Some(tick);
    }

    /// The controlled states at the time when the next command acts.
    pub(super) fn predict(&self, controlled: &'static [usize], to: &mut [f64]) {
        for (to, i) in to.iter_mut().zip(controlled) {
            *to = self.prompt.state()[*i] + self.rest[*i];
        }
    }
}
