//! The equations of a plant as linear regressions in its parameters.

mod acting;

use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};

use crate::log_map::Hold;
use crate::model::Model;
use crate::pseudo_inverse::pseudo_inverse;
use crate::registry::HostReal;
use acting::Acting;
use loopsight_core::Dynamics;

/// How a regression is made from samples.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Scheme {
    /// Euler's, the paper's (40)(41): `(u(k+1) - u(k))/T = φ(u(k), V(k)) θ`. Biased on a
    /// continuous robot: it estimates `(e^{K_A T} - 1)/T` where `K_A` is meant.
    Euler,
    /// Integrated over the period: `(u(k+1) - u(k))/T = 1/T ∫ φ dt θ` with the state taken as a
    /// straight line between the samples, which Simpson's rule integrates exactly for quadratic
    /// regressors; the bias is of order `(K_A T)²/12`. Where the sensor itself is a mean over the
    /// period, the difference of two means is an integral weighted by a triangle over two periods:
    /// the inputs of both periods count half each, and the rule for that weight is
    /// `(φ(a) + φ((a + b)/2) + φ(b))/3`.
    #[default]
    Integrated,
}

/// Why a model offers no regression.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RegressionError {
    /// No parameter to estimate moves the rate of a controlled state, or of one that is measured.
    #[error(
        "no parameter to estimate moves the rate of a state of the plant `{0}` that is controlled or measured, so its \
         equations give no regression"
    )]
    NoRates(String),
    /// A free parameter enters non-linearly.
    #[error("`{0}` enters the equations non-linearly, so a linear regression cannot estimate it")]
    NotLinear(String),
    /// A known parameter has no value.
    #[error("`{0}` has no value, and a regression does not estimate it")]
    Unknown(String),
}

/// Share of a state that sensors must tell of it.
const TOLD: f64 = 0.999;

/// One scalar regression `y = φ · θ` per state, fed sample by sample: of the controlled states, and where it is made for a
/// fit, of every other state that sensors tell, too.
///
/// The regressors come from the plant's own equations: `φ_j` is the change of the state's rate when
/// parameter `j` alone is one, so estimators, fits and the plant cannot disagree. Nothing is
/// allocated after construction.
///
/// **Effects** ([`Regression::with_effects`]). A friction level at a wheel multiplies the motor's gain:
/// both are linear, their product is not. So the equations, effects included, are taken at the present
/// values `θ̂` ([`Regression::set_values`]), which loses nothing where they are linear:
///
/// ```text
/// φ_j = (f(θ̂ + s_j e_j) - f(θ̂))/s_j        y = Δx/Δt - f(θ̂) + φᵀθ̂
/// ```
///
/// Reference: L. Ljung, T. Söderström (1983), "Theory and Practice of Recursive Identification", section
/// 3.6 (recursive prediction errors: the gradient at the present estimate).
#[derive(Clone)]
pub struct Regression {
    model: Model,
    scheme: Scheme,
    base: Vec<f64>,
    rows: Vec<Row>,
    to_state: DMatrix<f64>,
    offset: DVector<f64>,
    means: bool,
    previous: Option<Previous>,
    x: DVector<f64>,
    difference: DVector<f64>,
    x_before: Vec<f64>,
    x_middle: Vec<f64>,
    input_before: Vec<f64>,
    input_mean: Vec<f64>,
    input_now: Vec<f64>,
    p: Vec<f64>,
    dx: Vec<f64>,
    w: Vec<f64>,
    values: Vec<f64>,
    acting: Option<Acting>,
}

#[derive(Clone, Copy)]
struct Previous {
    time: f64,
    period: Option<f64>,
}

#[derive(Clone)]
struct Row {
    state: usize,
    parameters: Vec<usize>,
    phi: Vec<f64>,
    y: f64,
}

/// Whether the measured signals tell each state.
pub fn told(model: &Model) -> Vec<bool> {
    let values: Vec<f64> = (model.parameters.iter())
        .map(|p| p.value.unwrap_or(0.0))
        .collect();
    let (jacobian, _) = model.measurement_jacobian(&values, &vec![0.0; model.n_states()]);
    let Some(inverse) = pseudo_inverse(&jacobian) else {
        return vec![true; model.n_states()];
    };
    let told = inverse * jacobian;
    told.diagonal().iter().map(|share| *share >= TOLD).collect()
}

impl Regression {
    /// The regressions of `model` in its free parameters: of its controlled states, and of those others that sensors tell and
    /// whose rates a free parameter moves, such as the speed of a load behind a spring.
    ///
    /// # Errors
    ///
    /// [`RegressionError`] where there is no such state, or a free parameter enters non-linearly.
    pub fn new(model: &Model, scheme: Scheme) -> Result<Self, RegressionError> {
        Self::without_rows(model, scheme)?.of_all_rates()
    }

    /// With a row for each controlled state, and for each other one that sensors tell and a free parameter moves.
    fn of_all_rates(mut self) -> Result<Self, RegressionError> {
        let controlled = self.model.plant.controlled;
        self.find_rows(controlled.iter().copied());
        let told = told(&self.model);
        let others = (0..told.len()).filter(|i| told[*i] && !controlled.contains(i));
        self.find_rows(others);
        let moved = |row: &Row| !row.parameters.is_empty();
        (self.rows).retain(|row| moved(row) || controlled.contains(&row.state));
        if self.rows.is_empty() {
            let plant = self.model.plant.id.to_owned();
            return Err(RegressionError::NoRates(plant));
        }
        Ok(self)
    }

    fn without_rows(model: &Model, scheme: Scheme) -> Result<Self, RegressionError> {
        let mut base = Vec::new();
        for (index, parameter) in model.parameters.iter().enumerate() {
            base.push(match (parameter.free, parameter.value) {
                (true, _) if !parameter.declaration.linear => {
                    return Err(RegressionError::NotLinear(parameter.name.clone()));
                }
                (true, _) => 0.0,
                (false, Some(value)) => value,
                // It follows from others.
                (false, None) if model.tie(index).is_some() => 0.0,
                (false, None) => return Err(RegressionError::Unknown(parameter.name.clone())),
            });
        }
        let nx = model.n_states();
        let (jacobian, offset) = model.measurement_jacobian(&base, &vec![0.0; nx]);
        let to_state =
            pseudo_inverse(&jacobian).unwrap_or_else(|| DMatrix::zeros(nx, offset.len()));
        Ok(Self {
            scheme,
            rows: Vec::new(),
            means: model.measured.iter().any(|m| m.sensor.is_mean()),
            previous: None,
            x: DVector::zeros(nx),
            difference: DVector::zeros(offset.len()),
            x_before: vec![0.0; nx],
            x_middle: vec![0.0; nx],
            input_before: vec![0.0; model.plant.inputs.len()],
            input_mean: vec![0.0; model.plant.inputs.len()],
            input_now: vec![0.0; model.plant.inputs.len()],
            p: vec![0.0; model.plant.parameters.len()],
            dx: vec![0.0; nx],
            w: vec![0.0; model.n_efforts()],
            values: base.clone(),
            to_state,
            offset,
            base,
            model: model.clone(),
            acting: None,
        })
    }

    /// The regressions of the controlled states of `model` with its effects, in those free parameters that enter linearly; the
    /// others keep their values. `period` (s) is that of the loop. Where nothing acts between command
    /// and rate it is that of [`Regression::new`].
    ///
    /// # Errors
    ///
    /// [`RegressionError`] where the plant has no controlled states, or a free parameter without a value enters
    /// non-linearly.
    pub fn with_effects(
        model: &Model,
        scheme: Scheme,
        period: f64,
    ) -> Result<Self, RegressionError> {
        if model.plant.controlled.is_empty() {
            return Err(RegressionError::NoRates(model.plant.id.to_owned()));
        }
        let mut regression = Self::acting(model, scheme, period)?;
        regression.find_rows(model.plant.controlled.iter().copied());
        Ok(regression)
    }

    /// As [`Regression::with_effects`], of all states that [`Regression::new`] reads.
    ///
    /// # Errors
    ///
    /// [`RegressionError`] where there is no such state, or a free parameter without a value enters non-linearly.
    pub fn with_effects_of_all(
        model: &Model,
        scheme: Scheme,
        period: f64,
    ) -> Result<Self, RegressionError> {
        Self::acting(model, scheme, period)?.of_all_rates()
    }

    fn acting(model: &Model, scheme: Scheme, period: f64) -> Result<Self, RegressionError> {
        let mut linear = model.clone();
        for parameter in &mut linear.parameters {
            parameter.free &= parameter.declaration.linear || parameter.value.is_none();
        }
        let mut regression = Self::without_rows(&linear, scheme)?;
        let values: Vec<f64> = (linear.parameters.iter())
            .map(|p| p.value.unwrap_or(0.0))
            .collect();
        regression.acting = Acting::new(&linear, &values, period);
        Ok(regression)
    }

    /// Ids of the effects of `model` that [`Regression::with_effects`] cannot take in: what is learned is
    /// the truer the less they do.
    pub fn left_out(model: &Model) -> Vec<&'static str> {
        let list = Acting::left_out(model).into_iter();
        list.map(|index| model.effects[index].meta.id).collect()
    }

    /// The values of all parameters at which the effects are taken from now on; ignored for another
    /// number of them.
    pub fn set_values(&mut self, values: &[f64]) {
        if let Some(acting) = &mut self.acting
            && acting.values.len() == values.len()
        {
            acting.values.copy_from_slice(values);
        }
    }

    /// A period whose sample is no use: what was applied in it is still under way where inputs are
    /// late.
    pub fn pass_over(&mut self, input: &[f64]) {
        self.previous = None;
        if input.len() == self.input_mean.len() && input.iter().all(|v| v.is_finite()) {
            self.take_input(None, input);
        }
    }

    /// Follows what was applied through the effects that make it late, into `input_now`.
    fn take_input(&mut self, span: Option<f64>, input: &[f64]) {
        self.input_now.copy_from_slice(input);
        if let Some(acting) = &mut self.acting {
            self.model.lower_into(&acting.values, &mut self.p);
            acting.follow(&self.model, &self.p, span, &mut self.input_now);
        }
    }

    /// A parameter belongs to a row when it moves that state's rate anywhere: tried at a few
    /// points without symmetry.
    fn find_rows(&mut self, states: impl Iterator<Item = usize>) {
        let nx = self.model.n_states();
        for state in states {
            let mut parameters = Vec::new();
            for (j, parameter) in self.model.parameters.clone().iter().enumerate() {
                let moves = parameter.free
                    && (0..3).any(|trial| {
                        let x: Vec<f64> = (0..nx)
                            .map(|i| 0.37 + 0.21 * (i as f64 + trial as f64))
                            .collect();
                        let u: Vec<f64> = (0..self.input_mean.len())
                            .map(|i| 1.3 - 0.7 * (i as f64) + 0.3 * trial as f64)
                            .collect();
                        self.regressor(&x, &u, state, j) != 0.0
                    });
                if moves {
                    parameters.push(j);
                }
            }
            let phi = vec![0.0; parameters.len()];
            self.rows.push(Row {
                state,
                parameters,
                phi,
                y: 0.0,
            });
        }
    }

    /// The rate at `x`: without effects that of the base values, or of those with parameter `unit` at
    /// one; with them that of the present values, or of those with parameter `unit` one scale more.
    fn rate(&mut self, x: &[f64], u: &[f64], unit: Option<usize>) {
        let dynamics: &dyn Dynamics<f64> = f64::dynamics(self.model.dynamics);
        let model = &self.model;
        if let Some(acting) = &mut self.acting {
            let kept = unit.map(|j| (j, acting.values[j]));
            if let Some((j, value)) = kept {
                acting.values[j] = value + model.parameters[j].scale();
            }
            model.lower_into(&acting.values, &mut self.p);
            let (w, dx) = (&mut self.w, &mut self.dx);
            acting.rate(model, dynamics, (x, u), &self.p, w, dx);
            if let Some((j, value)) = kept {
                acting.values[j] = value;
            }
            return;
        }
        self.values.copy_from_slice(&self.base);
        if let Some(j) = unit {
            self.values[j] = 1.0;
        }
        model.lower_into(&self.values, &mut self.p);
        dynamics.derivative(x, u, &self.w, &self.p, &mut self.dx);
    }

    fn regressor(&mut self, x: &[f64], u: &[f64], state: usize, j: usize) -> f64 {
        self.rate(x, u, None);
        let zero = self.dx[state];
        self.rate(x, u, Some(j));
        let change = self.dx[state] - zero;
        match self.acting {
            Some(_) => change / self.model.parameters[j].scale(),
            None => change,
        }
    }

    /// How the `index`-th input runs between samples: what [`Regression::push`] wants is its mean.
    pub fn hold(&self, index: usize) -> Hold {
        self.model.hold(index)
    }

    /// Number of scalar regressions.
    pub fn len(&self) -> usize {
        self.rows.len()
    }

    /// True without any regression.
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// Indices (into the model's parameters) of the `row`-th regression's `θ`.
    pub fn parameters(&self, row: usize) -> &[usize] {
        &self.rows[row].parameters
    }

    /// Index of the state whose rate the `row`-th regression explains.
    pub fn state(&self, row: usize) -> usize {
        self.rows[row].state
    }

    /// Regressor and left-hand side of the `row`-th regression, after a [`Regression::push`] that
    /// returned true.
    pub fn row(&self, row: usize) -> (&[f64], f64) {
        (&self.rows[row].phi, self.rows[row].y)
    }

    /// Forgets the samples: a new run begins.
    pub fn restart(&mut self) {
        self.previous = None;
    }

    /// Takes the sample at `time`, with the `input` that was applied since the one before. True
    /// when regressors are ready; false at the start of a run or when something is not finite.
    pub fn push(&mut self, time: f64, measured: &[f64], input: &[f64]) -> bool {
        for (to, (value, offset)) in self
            .difference
            .iter_mut()
            .zip(measured.iter().zip(self.offset.iter()))
        {
            *to = value - offset;
        }
        let usable = self.difference.iter().chain(input).all(|v| v.is_finite()) && time.is_finite();
        if !usable {
            self.previous = None;
            return false;
        }
        self.to_state.mul_to(&self.difference, &mut self.x);
        let mut ready = false;
        let step = self.previous.map(|before| time - before.time);
        let period = step.filter(|step| *step > 0.0);
        self.take_input(period, input);
        let input = core::mem::take(&mut self.input_now);
        if let (Some(step), Some(before)) = (period, self.previous) {
            ready = self.fill(step, before.period, &input);
        }
        self.x_before.copy_from_slice(self.x.as_slice());
        self.input_before.copy_from_slice(&input);
        self.input_now = input;
        if let Some(acting) = &mut self.acting {
            acting.remember(self.x.as_slice());
        }
        self.previous = Some(Previous { time, period });
        ready
    }

    fn fill(&mut self, step: f64, step_before: Option<f64>, input: &[f64]) -> bool {
        self.input_mean.copy_from_slice(input);
        let mut distance = step;
        if self.scheme == Scheme::Integrated && self.means {
            let Some(before) = step_before else {
                return false;
            };
            // The means lie in the middles of their periods.
            distance = 0.5 * (step + before);
            let share = before / (step + before);
            for (mean, (now, earlier)) in self
                .input_mean
                .iter_mut()
                .zip(input.iter().zip(&self.input_before))
            {
                *mean = share * earlier + (1.0 - share) * now;
            }
        }
        let after = core::mem::replace(&mut self.x, DVector::zeros(0));
        let before = core::mem::take(&mut self.x_before);
        let u = core::mem::take(&mut self.input_mean);
        let mut middle = core::mem::take(&mut self.x_middle);
        for (m, (a, b)) in middle.iter_mut().zip(before.iter().zip(after.iter())) {
            *m = 0.5 * (a + b);
        }
        let weights: [f64; 3] = match (self.scheme, self.means) {
            (Scheme::Euler, _) => [1.0, 0.0, 0.0],
            (Scheme::Integrated, false) => [1.0 / 6.0, 4.0 / 6.0, 1.0 / 6.0],
            (Scheme::Integrated, true) => [1.0 / 3.0; 3],
        };
        let points = [before.as_slice(), middle.as_slice(), after.as_slice()];
        let mut rows = core::mem::take(&mut self.rows);
        for row in &mut rows {
            let mut drift = 0.0;
            row.phi.fill(0.0);
            for (point, weight) in points.iter().zip(weights) {
                if weight == 0.0 {
                    continue;
                }
                self.rate(point, &u, None);
                drift += weight * self.dx[row.state];
                for (phi, &j) in row.phi.iter_mut().zip(&row.parameters) {
                    *phi += weight * self.regressor(point, &u, row.state, j);
                }
            }
            if let Some(acting) = &self.acting {
                for (phi, j) in row.phi.iter().zip(&row.parameters) {
                    drift -= phi * acting.values[*j];
                }
            }
            row.y = (after[row.state] - before[row.state]) / distance - drift;
        }
        self.rows = rows;
        self.x_middle = middle;
        self.input_mean = u;
        self.x_before = before;
        self.x = after;
        true
    }
}
