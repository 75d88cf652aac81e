//! A composed model as a velocity controller sees it.

mod direction;
mod inversion;
mod lateness;
mod prediction;
mod treatment;

use nalgebra::{DMatrix, DVector};

use crate::model::Model;
use crate::pseudo_inverse::pseudo_inverse;
use crate::registry::HostReal;
use crate::simulate::bound::{Bounds, Scene};
use loopsight_core::AffineModel;
use loopsight_core::{NoPast, Observation, Place};

use inversion::Inversion;
use prediction::Predictor;
pub use treatment::Treatment;

/// A model as a velocity controller sees it: `dy/dt = f(y) + G(y) u` in the controlled states, with
/// the effects of the model file in it.
///
/// ```text
/// f(y)   = F(x, 0, w(x̄))      G(y) e_j = F(x, e_j, w(x̄)) - f(y)      F: plant, then effects on rates
/// x̄ = x, but for its controlled states  ȳ = y + clamp(r - y, -band, band)
/// E(V)   = V + Σ effects on inputs      invert: the V of least size with E(V) = u
/// ```
///
/// | symbol | what | unit |
/// |---|---|---|
/// | `x`, `y` | state of the plant, its controlled states | of the signals |
/// | `r` | where `y` is wanted, see [`AffineModel::aim`] | of `y` |
/// | `band` | change of `y` from rest at which sign-like effects have their full size | of `y` |
/// | `w` | efforts of the effects | of the channels |
/// | `V`, `u` | commands, inputs at the plant | of the inputs |
///
/// No effect is treated by its name. Evaluating them shows which can be compensated
/// ([`Affine::treatments`]) and how they act.
///
/// **Direction.** Dry friction has a sign, and near rest the sign of a measured speed is that of its
/// noise. A controller that compensated that would chatter, and would not help a robot that sticks.
/// So efforts are evaluated at the wanted state `r`, or at most a `band` from `y` towards it. At rest
/// this has the direction in which the robot is to move; on the way, the direction in which it moves;
/// at the reference, that of the reference, without noise. `band` is found from the effects
/// (`direction.rs`), and is 0 where none of them has a sign.
///
/// **Delay.** [`Affine::predicting`] adds a predictor of the state that the next command will meet.
///
/// Reference: A. Isidori (1995), "Nonlinear Control Systems", ch. 5; H. Olsson, K. J. Åström,
/// C. Canudas de Wit, M. Gäfvert, P. Lischinsky (1998), "Friction models and friction compensation",
/// European Journal of Control 4, 176–195, section 5 (the desired velocity in a compensation);
/// G. Tao, P. V. Kokotović (1996), "Adaptive Control of Systems with Actuator and Sensor
/// Nonlinearities", Wiley, ch. 2 (inverses of what lies before the plant).
#[derive(Clone)]
pub struct Affine {
    /// Everything in the file.
    whole: Model,
    /// The plant with what acts on it at once; its extended state is that of `bounds`.
    model: Model,
    /// Those of its effects that are compensated.
    bounds: Bounds,
    treatments: Vec<Treatment>,
    values: Vec<f64>,
    /// `values` changed since anything was made from them.
    learned: bool,
    p: Vec<f64>,
    /// The extended state as far as it is known, controlled states as last asked for.
    state: Vec<f64>,
    /// The same towards the aim.
    ahead: Vec<f64>,
    aim: Vec<f64>,
    bands: Vec<f64>,
    u: Vec<f64>,
    w: Vec<f64>,
    signals: Vec<f64>,
    dx: Vec<f64>,
    inversion: Inversion,
    to_state: DMatrix<f64>,
    offset: DVector<f64>,
    difference: DVector<f64>,
    estimate: DVector<f64>,
    predictor: Option<Box<Predictor>>,
}

impl Model {
    /// The control-affine view with the model's present values; `None` where the plant declares
    /// no controlled states.
    pub fn affine(&self) -> Option<Affine> {
        let n = self.plant.controlled.len();
        if n == 0 {
            return None;
        }
        let treatments = treatment::treatments(self);
        let acts = |i: usize| treatments[i].acts_at_once();
        let model = self.keeping(acts, Vec::new());
        let mut bounds = Bounds::of(&model);
        let size = model.n_states() + bounds.states;
        let compensated: Vec<bool> = treatments
            .iter()
            .filter(|t| t.acts_at_once())
            .map(Treatment::is_compensated)
            .collect();
        for list in [&mut bounds.inputs, &mut bounds.efforts, &mut bounds.bodies] {
            list.retain(|b| compensated[b.effect]);
        }
        let values = self.values();
        let nx = self.n_states();
        let (jacobian, offset) = self.measurement_jacobian(&values, &vec![0.0; nx]);
        let to_state =
            pseudo_inverse(&jacobian).unwrap_or_else(|| DMatrix::zeros(nx, offset.len()));
        let mut affine = Affine {
            p: self.lower(&values),
            values,
            learned: false,
            state: vec![0.0; size],
            ahead: vec![0.0; size],
            aim: vec![f64::NAN; n],
            bands: vec![0.0; n],
            u: vec![0.0; self.plant.inputs.len()],
            w: vec![0.0; self.n_efforts()],
            signals: vec![0.0; self.n_signals()],
            dx: vec![0.0; nx],
            inversion: Inversion::new(self.plant.inputs.len()),
            difference: DVector::zeros(offset.len()),
            estimate: DVector::zeros(nx),
            to_state,
            offset,
            predictor: None,
            whole: self.clone(),
            model,
            bounds,
            treatments,
        };
        affine.bands = affine.find_bands();
        Some(affine)
    }

    /// The model with the effects `keep` names by index, measuring `measured`; parameters stay in
    /// their places.
    fn keeping(
        &self,
        keep: impl Fn(usize) -> bool,
        measured: Vec<crate::model::MeasuredSignal>,
    ) -> Model {
        let mut model = self.clone();
        model.effects = (self.effects.iter().enumerate())
            .filter(|(i, _)| keep(*i))
            .map(|(_, effect)| effect.clone())
            .collect();
        model.measured = measured;
        model
    }
}

impl Affine {
    /// What becomes of each effect of the model, in its order.
    pub fn treatments(&self) -> &[Treatment] {
        &self.treatments
    }

    /// For each controlled state the change from rest at which efforts that depend on its sign have their full size,
    /// in its unit; 0 where none does. For controllers that compensate friction themselves.
    pub fn bands(&self) -> &[f64] {
        &self.bands
    }

    /// Updates everything that depends on values that changed.
    fn use_learned(&mut self) {
        if !std::mem::take(&mut self.learned) {
            return;
        }
        let model = &self.model;
        model.lower_into(&self.values, &mut self.p);
        if let Some(predictor) = &mut self.predictor {
            predictor.set_values(&self.values);
        }
    }

    /// Puts the controlled states at `y`, and those of the efforts towards the aim.
    fn place(&mut self, y: &[f64]) {
        for (i, (state, value)) in self.model.plant.controlled.iter().zip(y).enumerate() {
            self.state[*state] = *value;
            let band = self.bands[i];
            let way = self.aim[i] - value;
            self.ahead[*state] = if way.is_finite() {
                value + way.clamp(-band, band)
            } else {
                *value
            };
        }
    }

    /// The rate of the plant's states with the inputs `u` at the plant, into `dx`.
    fn rate(&mut self) {
        let (model, p, u) = (&self.model, &self.p, &self.u);
        let (values, signals) = (&self.values, &mut self.signals);
        let nx = model.n_states();
        self.w.fill(0.0);
        if !self.bounds.efforts.is_empty() {
            model.signals_at(p, &self.ahead[..nx], u, signals);
            let scene = scene(values, &self.ahead, signals);
            for bound in &self.bounds.efforts {
                if let Place::Effort(i) = bound.place {
                    self.w[i] += scene.contribution(bound, self.w[i], &NoPast);
                }
            }
        }
        let dynamics = f64::dynamics(model.dynamics);
        dynamics.derivative(&self.state[..nx], u, &self.w, p, &mut self.dx);
        if !self.bounds.bodies.is_empty() {
            model.signals_at(p, &self.state[..nx], u, signals);
            let scene = scene(values, &self.state, signals);
            for bound in &self.bounds.bodies {
                if let Place::Rate(i) = bound.place {
                    self.dx[i] += scene.contribution(bound, self.dx[i], &NoPast);
                }
            }
        }
    }

    /// Replaces the commands by the inputs that they cause at the plant.
    fn effective(&mut self, command: &mut [f64]) {
        if self.bounds.inputs.is_empty() {
            return;
        }
        let nx = self.model.n_states();
        let (model, signals) = (&self.model, &mut self.signals);
        model.signals_at(&self.p, &self.state[..nx], command, signals);
        let scene = scene(&self.values, &self.state, signals);
        for bound in &self.bounds.inputs {
            if let Place::Input(i) = bound.place {
                command[i] += scene.contribution(bound, command[i], &NoPast);
            }
        }
    }
}

/// Where effects are evaluated that are the same at any time.
fn scene<'a>(values: &'a [f64], x: &'a [f64], signals: &'a [f64]) -> Scene<'a, f64> {
    Scene {
        values,
        x,
        signals,
        time: 0.0,
        interval: (0.0, 0.0),
    }
}

impl AffineModel<f64> for Affine {
    fn size(&self) -> usize {
        self.model.plant.controlled.len()
    }

    fn evaluate(&mut self, y: &[f64], drift: &mut [f64], input_matrix: &mut [f64]) {
        let controlled = self.model.plant.controlled;
        let n = controlled.len();
        if y.len() != n || drift.len() != n || input_matrix.len() != n * n {
            return;
        }
        self.use_learned();
        self.place(y);
        self.u.fill(0.0);
        self.rate();
        for (row, state) in controlled.iter().enumerate() {
            drift[row] = self.dx[*state];
        }
        for column in 0..n {
            self.u.fill(0.0);
            self.u[column] = 1.0;
            self.rate();
            for (row, state) in controlled.iter().enumerate() {
                input_matrix[row * n + column] = self.dx[*state] - drift[row];
            }
        }
    }

    fn aim(&mut self, wanted: &[f64]) {
        for (to, from) in self.aim.iter_mut().zip(wanted) {
            *to = *from;
        }
    }

    fn invert(&mut self, y: &[f64], input: &mut [f64]) -> bool {
        if self.bounds.inputs.is_empty() || input.len() != self.u.len() {
            return true;
        }
        self.place(y);
        let mut inversion = std::mem::take(&mut self.inversion);
        let reached = inversion.solve(input, &mut |command| self.effective(command));
        self.inversion = inversion;
        reached
    }

    fn pass(&mut self, y: &[f64], command: &mut [f64]) {
        if command.len() == self.u.len() {
            self.place(y);
            self.effective(command);
        }
    }

    /// What is not finite, or no parameter of the model, is ignored.
    fn learn(&mut self, parameter: usize, value: f64) {
        if let Some(known) = self.values.get_mut(parameter)
            && value.is_finite()
            && *known != value
        {
            *known = value;
            self.learned = true;
        }
    }

    fn ahead(&self) -> f64 {
        self.predictor.as_ref().map_or(0.0, |p| p.commands_late())
    }

    fn track(&mut self, seen: &Observation<'_, f64>, controlled: &mut [f64]) {
        self.use_learned();
        let measured = seen.measured;
        let usable = measured.len() == self.offset.len() && measured.iter().all(|v| v.is_finite());
        if let Some(predictor) = &mut self.predictor {
            predictor.advance(&seen.tick, seen.applied);
            if usable {
                predictor.correct(seen, &self.to_state, &self.offset);
                predictor.predict(self.model.plant.controlled, controlled);
                self.state.copy_from_slice(predictor.state());
            }
        } else if usable {
            for (i, to) in self.difference.iter_mut().enumerate() {
                *to = measured[i] - self.offset[i];
            }
            self.to_state.mul_to(&self.difference, &mut self.estimate);
            self.state[..self.estimate.len()].copy_from_slice(self.estimate.as_slice());
        }
        self.ahead.copy_from_slice(&self.state);
    }
}
