//! Least squares on the error of the free run.

use std::cell::{Cell, RefCell};
use std::collections::BTreeMap;
use std::convert::Infallible;

use basin::{
    BoundedLevenbergMarquardt, BoxBounds, ConstraintDescription, ConstraintSet, Constraints,
    Executor, Jacobian, Residual,
};
use loopsight_core::model::Model;
use loopsight_core::run::Run;
use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ContinuousCDF, StudentsT};

use crate::compare::Comparison;
use crate::fit::{Estimate, Fit, FitError, FitSettings, Method, Verdict};
use crate::flatness::{DEAD, Flatness, Named};
use crate::noise::{self, Block};
use crate::prediction::{InitialStates, predict, residuals, sensitivities, visible_states};
use crate::regression::batch;
use crate::score::Tally;

/// Fits the free parameters and the initial states of all runs.
///
/// With `ŷ(θ, x₀)` the free run as the sensors would have read it, and each signal weighted by its
/// standard deviation,
///
/// ```text
/// θ, x₀ = argmin Σ_runs Σ_k Σ_i ((y_i(k) - ŷ_i(k))/std(y_i))²
/// ```
///
/// by Levenberg–Marquardt within the ranges of the declarations, with exact derivatives (dual
/// numbers through the integrator). Missing measurements count nothing. (L. Ljung, 1999, "System
/// Identification", 2nd edition, section 7.2 and chapter 10; output error is section 4.2.)
///
/// Where the residuals turn out to be those of rounded counts (a moving average with `c` near -1
/// and nothing slower, see [`noise::Arma`]), a second pass weights them by that: the maximum
/// likelihood estimate for `e(k) = ε(k) + c ε(k-1)`, with the value of `ε` before each run as one
/// more unknown. Other colours are left as they are: they are a model error, and a fit to the free
/// run should see it.
pub(crate) fn fit(
    model: &Model,
    runs: &[Run],
    settings: &FitSettings,
    progress: &(dyn Fn(u64, f64) + Sync),
) -> Result<Fit, FitError> {
    let mut problem = Problem::new(model, runs, progress)?;
    let start = problem.start(settings)?;
    let start = problem.balance(start);
    let mut solution = problem.solve(&start, settings.max_iterations)?;
    if let Some(start) = problem.whiten(&solution) {
        let start = problem.balance(start);
        solution = problem.solve(&start, settings.max_iterations)?;
    }
    Ok(problem.result(&solution))
}

/// A residual whose noise model has `c` below this and `a` within ±[`SLOW`] is rounded counts.
const ROUNDED: f64 = -0.8;
/// See [`ROUNDED`].
const SLOW: f64 = 0.3;
/// Spans of the regressions that a fit may start from, s.
const SPANS: [f64; 3] = [0.0, 0.05, 0.2];

/// Unknowns, weighted residuals there, and their Jacobian.
type Linearised = (DVector<f64>, DVector<f64>, DMatrix<f64>);

struct Problem<'a> {
    model: &'a Model,
    runs: &'a [Run],
    progress: &'a (dyn Fn(u64, f64) + Sync),
    /// Indices of the estimated parameters.
    free: Vec<usize>,
    /// Plant states whose initial values are estimated.
    visible: Vec<usize>,
    /// One over the standard deviation of each signal, over the root of the number of samples.
    weights: Vec<f64>,
    /// Unknown = scaled unknown × scale.
    scales: Vec<f64>,
    lower: DVector<f64>,
    upper: DVector<f64>,
    /// Moving-average coefficient by signal; empty in the first pass.
    rounding: Vec<f64>,
    evaluations: Cell<u64>,
    cache: RefCell<Option<Linearised>>,
    samples: f64,
}

impl<'a> Problem<'a> {
    fn new(
        model: &'a Model,
        runs: &'a [Run],
        progress: &'a (dyn Fn(u64, f64) + Sync),
    ) -> Result<Self, FitError> {
        let free: Vec<usize> = (0..model.parameters.len())
            .filter(|i| model.parameters[*i].free)
            .collect();
        let mut tallies = vec![Tally::default(); model.measured.len()];
        let mut samples = 0.0;
        for run in runs {
            for k in 0..run.len() {
                for (tally, y) in tallies.iter_mut().zip(run.sample(k)) {
                    tally.add(*y, *y);
                    samples += f64::from(u8::from(y.is_finite()));
                }
            }
        }
        let weights: Vec<f64> = tallies
            .iter()
            .map(|t| {
                let std = t.std();
                // A signal that never moves tells nothing.
                if std > 0.0 {
                    1.0 / (std * f64::sqrt(samples))
                } else {
                    0.0
                }
            })
            .collect();
        let visible = visible_states(model, &nominal(model));
        let mut scales = Vec::new();
        let mut lower = Vec::new();
        let mut upper = Vec::new();
        for &i in &free {
            let declaration = model.parameters[i].declaration;
            let scale = declaration
                .scale
                .max(model.parameters[i].value.map_or(0.0, f64::abs));
            let (low, high) = declaration.bounds();
            scales.push(scale);
            lower.push(low / scale);
            upper.push(high / scale);
        }
        for _ in runs {
            for _ in &visible {
                scales.push(1.0);
                lower.push(f64::NEG_INFINITY);
                upper.push(f64::INFINITY);
            }
        }
        Ok(Self {
            model,
            runs,
            progress,
            free,
            visible,
            weights,
            scales,
            lower: DVector::from_vec(lower),
            upper: DVector::from_vec(upper),
            rounding: Vec::new(),
            evaluations: Cell::new(0),
            cache: RefCell::new(None),
            samples,
        })
    }

    /// The file's values, and those of regressions; whichever runs closest to the data.
    fn start(&self, settings: &FitSettings) -> Result<DVector<f64>, FitError> {
        let mut candidates = Vec::new();
        if self.model.missing_values().is_empty() {
            candidates.push(self.model.values());
        }
        let mut failure = None;
        for span in SPANS {
            match batch(self.model, self.runs, settings.scheme, span) {
                Ok(values) => candidates.push(values),
                Err(error) => failure = Some(error),
            }
        }
        if let (true, Some(error)) = (candidates.is_empty(), failure) {
            return Err(error);
        }
        let mut best: Option<(f64, DVector<f64>)> = None;
        for values in candidates {
            let initial = InitialStates::guess(self.model, &values, self.runs);
            let mut scaled: Vec<f64> = self
                .free
                .iter()
                .map(|i| self.model.parameters[*i].declaration.nearest(values[*i]))
                .collect();
            for x0 in &initial.states {
                scaled.extend(self.visible.iter().map(|s| x0[*s]));
            }
            for (value, scale) in scaled.iter_mut().zip(&self.scales) {
                *value /= scale;
            }
            let scaled = DVector::from_vec(scaled);
            let cost = self.residual_vector(&scaled).norm_squared();
            if cost.is_finite() && best.as_ref().is_none_or(|(least, _)| cost < *least) {
                best = Some((cost, scaled));
            }
        }
        best.map(|(_, start)| start).ok_or_else(|| {
            FitError::Solver("the free run diverges from every starting point".to_owned())
        })
    }

    /// Turns to the second pass if the residuals at `solution` are rounded counts; returns where it
    /// starts.
    fn whiten(&mut self, solution: &DVector<f64>) -> Option<DVector<f64>> {
        let (residual, jacobian) = self.linearise(solution);
        let blocks = self.blocks(&residual, &jacobian);
        let n_signals = self.weights.len();
        let rounding: Vec<f64> = (0..n_signals)
            .map(|signal| {
                let series: Vec<&[f64]> = blocks
                    .iter()
                    .map(|b| b[signal].residual.as_slice())
                    .collect();
                let model = noise::Arma::fit(&series);
                let rounded = model.c < ROUNDED && model.a.abs() < SLOW;
                if rounded { model.c } else { 0.0 }
            })
            .collect();
        if rounding.iter().all(|c| *c == 0.0) {
            return None;
        }
        self.rounding = rounding;
        self.cache.replace(None);
        let more = self.runs.len() * n_signals;
        // In units of the first residuals, so that all unknowns are of order one.
        let scale = residual.norm() / (residual.len() as f64).sqrt();
        self.scales.extend(std::iter::repeat_n(scale, more));
        self.lower = self
            .lower
            .clone()
            .resize_vertically(self.scales.len(), f64::NEG_INFINITY);
        self.upper = self
            .upper
            .clone()
            .resize_vertically(self.scales.len(), f64::INFINITY);
        Some(solution.clone().resize_vertically(self.scales.len(), 0.0))
    }

    /// Scales the unknowns so that each moves the residuals alike, as the damping of the solver
    /// expects (J. J. Moré, 1978, "The Levenberg-Marquardt algorithm", section 6).
    fn balance(&mut self, mut scaled: DVector<f64>) -> DVector<f64> {
        let (_, jacobian) = self.linearise(&scaled);
        for (i, column) in jacobian.column_iter().enumerate() {
            let norm = column.norm();
            if norm > DEAD && norm.is_finite() {
                self.scales[i] /= norm;
                self.lower[i] *= norm;
                self.upper[i] *= norm;
                scaled[i] *= norm;
            }
        }
        self.cache.replace(None);
        scaled
    }

    /// First of the unknowns `ε` before the runs.
    fn first_before(&self) -> usize {
        self.free.len() + self.runs.len() * self.visible.len()
    }

    /// In the second pass, turns the weighted residuals of one run into `ε`.
    fn filter(&self, run: usize, residual: &mut [f64], scaled: &DVector<f64>) {
        let n_signals = self.weights.len();
        for (signal, c) in self.rounding.iter().enumerate() {
            if *c == 0.0 {
                continue;
            }
            let unknown = self.first_before() + run * n_signals + signal;
            let mut before = scaled[unknown] * self.scales[unknown];
            for value in residual.iter_mut().skip(signal).step_by(n_signals) {
                *value -= c * before;
                before = *value;
            }
        }
    }

    /// As [`Problem::filter`] for the rows of the Jacobian that belong to one run.
    fn filter_jacobian(
        &self,
        run: usize,
        first_row: usize,
        rows: usize,
        jacobian: &mut DMatrix<f64>,
    ) {
        let n_signals = self.weights.len();
        for (signal, c) in self.rounding.iter().enumerate() {
            if *c == 0.0 {
                continue;
            }
            let unknown = self.first_before() + run * n_signals + signal;
            for column in 0..jacobian.ncols() {
                let mut before = if column == unknown {
                    self.scales[unknown]
                } else {
                    0.0
                };
                for row in (first_row + signal..first_row + rows).step_by(n_signals) {
                    let value = &mut jacobian[(row, column)];
                    *value -= c * before;
                    before = *value;
                }
            }
        }
    }

    /// Parameter values and initial states behind scaled unknowns.
    fn unpack(&self, scaled: &DVector<f64>) -> (Vec<f64>, Vec<Vec<f64>>) {
        let mut values = nominal(self.model);
        for (k, i) in self.free.iter().enumerate() {
            values[*i] = scaled[k] * self.scales[k];
        }
        let states = (0..self.runs.len())
            .map(|run| {
                let mut x0 = vec![0.0; self.model.n_states()];
                let first = self.free.len() + run * self.visible.len();
                for (k, state) in self.visible.iter().enumerate() {
                    x0[*state] = scaled[first + k] * self.scales[first + k];
                }
                x0
            })
            .collect();
        (values, states)
    }

    fn rows(&self) -> usize {
        self.runs.iter().map(Run::len).sum::<usize>() * self.model.measured.len()
    }

    fn weigh(&self, residual: &mut [f64]) {
        for (i, value) in residual.iter_mut().enumerate() {
            *value *= self.weights[i % self.weights.len()];
        }
    }

    fn residual_vector(&self, scaled: &DVector<f64>) -> DVector<f64> {
        let (values, states) = self.unpack(scaled);
        let mut all = Vec::with_capacity(self.rows());
        for (index, (run, x0)) in self.runs.iter().zip(&states).enumerate() {
            let mut residual = residuals(&predict(self.model, &values, x0, run), run);
            self.weigh(residual.as_mut_slice());
            self.filter(index, residual.as_mut_slice(), scaled);
            all.extend_from_slice(residual.as_slice());
        }
        DVector::from_vec(all)
    }

    /// Weighted residuals, and their Jacobian by the scaled unknowns.
    fn linearise(&self, scaled: &DVector<f64>) -> (DVector<f64>, DMatrix<f64>) {
        if let Some((at, residual, jacobian)) = self.cache.borrow().as_ref()
            && at == scaled
        {
            return (residual.clone(), jacobian.clone());
        }
        let (values, states) = self.unpack(scaled);
        let n_free = self.free.len();
        let n_visible = self.visible.len();
        let mut all = DVector::zeros(self.rows());
        let mut jacobian = DMatrix::zeros(self.rows(), self.scales.len());
        let mut first_row = 0;
        for (index, (run, x0)) in self.runs.iter().zip(&states).enumerate() {
            let s = sensitivities(self.model, &values, x0, run, &self.free, &self.visible);
            let residual = residuals(&s.predicted, run);
            for row in 0..residual.len() {
                let signal = row % self.weights.len();
                let seen = run.measured[row].is_finite();
                let weight = if seen { self.weights[signal] } else { 0.0 };
                all[first_row + row] = residual[row] * weight;
                for column in 0..n_free + n_visible {
                    let to = if column < n_free {
                        column
                    } else {
                        column + index * n_visible
                    };
                    jacobian[(first_row + row, to)] =
                        -s.jacobian[(row, column)] * weight * self.scales[to];
                }
            }
            let rows = residual.len();
            let of_run = &mut all.as_mut_slice()[first_row..first_row + rows];
            self.filter(index, of_run, scaled);
            self.filter_jacobian(index, first_row, rows, &mut jacobian);
            first_row += rows;
        }
        *self.cache.borrow_mut() = Some((scaled.clone(), all.clone(), jacobian.clone()));
        (all, jacobian)
    }

    fn solve(&self, start: &DVector<f64>, max_iterations: u64) -> Result<DVector<f64>, FitError> {
        let solver = BoundedLevenbergMarquardt::<DVector<f64>, DMatrix<f64>>::new()
            .with_absolute_scaled_gradient_tolerance(1e-14)
            .with_tau(1e-6)
            .with_relative_cost_change_tolerance(1e-9)
            .with_relative_step_tolerance(1e-10);
        let result = Executor::from_start(Borrowed(self), solver, start.clone())
            .max_iter(max_iterations)
            .run();
        let result = match result {
            Ok(result) => result,
            Err(error) => return Err(FitError::Solver(error.to_string())),
        };
        let solution = result.param().clone();
        if solution.iter().any(|v| !v.is_finite()) {
            return Err(FitError::Solver(
                "the parameters left the finite numbers".to_owned(),
            ));
        }
        Ok(solution)
    }

    fn result(&self, solution: &DVector<f64>) -> Fit {
        let (mut values, _) = self.unpack(solution);
        for i in &self.free {
            // The solver stays strictly inside the range; at its end the end is meant.
            let declaration = self.model.parameters[*i].declaration;
            for end in [declaration.bounds().0, declaration.bounds().1] {
                if (values[*i] - end).abs() < 1e-9 * declaration.scale {
                    values[*i] = end;
                }
            }
        }
        let (residual, jacobian) = self.linearise(solution);
        let gram = jacobian.tr_mul(&jacobian);
        let norms: Vec<f64> = (0..gram.ncols()).map(|i| gram[(i, i)].sqrt()).collect();
        let quantile = StudentsT::new(0.0, 1.0, (self.samples - norms.len() as f64).max(1.0))
            .map_or(1.96, |t| t.inverse_cdf(0.975));

        let flatness = Flatness::of(&gram, &norms, &self.named());
        let blocks = self.blocks(&residual, &jacobian);
        let inverse = flatness.inverse(&norms);
        let covariance =
            noise::covariance(&blocks, self.model.measured.len(), &inverse, norms.len());

        let mut fitted = self.model.clone();
        fitted.set_values(&values);
        let mut parameters = BTreeMap::new();
        for (index, parameter) in fitted.parameters.iter().enumerate() {
            let Some(value) = parameter.value else {
                continue;
            };
            let mut estimate = Estimate {
                value,
                unit: parameter.unit.clone(),
                std_error: None,
                interval95: None,
                verdict: Verdict::Held,
            };
            if let Some(k) = self.free.iter().position(|i| *i == index) {
                let error = covariance[(k, k)].max(0.0).sqrt() * self.scales[k];
                let known = error.is_finite() && !flatness.dead[k] && !flatness.flat[k];
                let (low, high) = parameter.declaration.bounds();
                if known {
                    estimate.std_error = Some(error);
                    // A value beyond the admissible range is not believed, however likely.
                    estimate.interval95 = Some([
                        (value - quantile * error).max(low),
                        (value + quantile * error).min(high),
                    ]);
                }
                let margin = 1e-4 * parameter.declaration.scale;
                estimate.verdict = if flatness.dead[k] {
                    Verdict::Dead
                } else if flatness.flat[k] {
                    Verdict::Flat
                } else if value - low < margin || high - value < margin {
                    Verdict::AtBound
                } else if quantile * error > value.abs() {
                    Verdict::NotPinned
                } else {
                    Verdict::Good
                };
            }
            parameters.insert(parameter.name.clone(), estimate);
        }
        Fit {
            comparison: Comparison::empty(),
            parameters,
            method: Method::OutputError,
            nrmse_before: None,
            nrmse_fit: f64::NAN,
            iterations: self.evaluations.get(),
            flat: flatness.words,
            model: fitted,
            history: Vec::new(),
        }
    }

    /// The estimated parameters, for what is said of flat directions.
    fn named(&self) -> Vec<Named<'_>> {
        self.free
            .iter()
            .zip(&self.scales)
            .map(|(i, scale)| {
                let parameter = &self.model.parameters[*i];
                Named {
                    name: &parameter.name,
                    declared: parameter.declaration.scale,
                    scale: *scale,
                }
            })
            .collect()
    }

    /// Residuals and Jacobian by run and signal, in time order.
    fn blocks(&self, residual: &DVector<f64>, jacobian: &DMatrix<f64>) -> Vec<Vec<Block>> {
        let n_signals = self.weights.len();
        let mut first_row = 0;
        self.runs
            .iter()
            .map(|run| {
                let blocks = (0..n_signals)
                    .map(|signal| {
                        let rows: Vec<usize> = (0..run.len())
                            .map(|k| first_row + k * n_signals + signal)
                            .collect();
                        Block {
                            residual: rows.iter().map(|r| residual[*r]).collect(),
                            jacobian: jacobian.select_rows(&rows),
                        }
                    })
                    .collect();
                first_row += run.len() * n_signals;
                blocks
            })
            .collect()
    }
}

/// The file's values, defaults where it is silent, zero where there is neither.
fn nominal(model: &Model) -> Vec<f64> {
    model
        .parameters
        .iter()
        .map(|p| p.value.unwrap_or(0.0))
        .collect()
}

/// The problem as the solver sees it.
struct Borrowed<'p, 'a>(&'p Problem<'a>);

impl Residual for Borrowed<'_, '_> {
    type Param = DVector<f64>;
    type Output = DVector<f64>;
    type Error = Infallible;
    fn residual(&self, scaled: &DVector<f64>) -> Result<DVector<f64>, Infallible> {
        Ok(self.0.residual_vector(scaled))
    }
}

impl Jacobian for Borrowed<'_, '_> {
    type Jacobian = DMatrix<f64>;
    fn jacobian(&self, scaled: &DVector<f64>) -> Result<DMatrix<f64>, Infallible> {
        let (residual, jacobian) = self.0.linearise(scaled);
        self.0.evaluations.set(self.0.evaluations.get() + 1);
        (self.0.progress)(self.0.evaluations.get(), residual.norm());
        Ok(jacobian)
    }
}

impl Constraints for Borrowed<'_, '_> {
    type Set = ConstraintSet<BoxBounds<DVector<f64>>>;
    fn constraints(&self) -> <Self::Set as ConstraintDescription>::Borrowed<'_> {
        ConstraintSet::new().with_bounds(BoxBounds::new(Some(&self.0.lower), Some(&self.0.upper)))
    }
}
