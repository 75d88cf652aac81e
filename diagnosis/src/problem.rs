//! The least-squares problem of a fit to the free run.

use std::cell::{Cell, RefCell};
use std::rc::Rc;

use loopsight_model::model::{Model, ModelParameter};
use loopsight_model::run::Run;
use nalgebra::{DMatrix, DVector};

use crate::error::FitError;
use crate::first::first_weights;
use crate::flatness::Named;
use crate::kept::Kept;
use crate::linearised::{Linearised, zeros};
use crate::noise::Block;
use crate::positions::Positions;
use crate::prediction::{Solution, estimated_states, for_each_run, predict_with, residuals};
use crate::progress::{Cancelled, Work};
use crate::score::Tally;
use crate::sensitivities::{By, sensitivities};
use crate::sizes::sizes;

pub(crate) struct Problem<'a> {
    pub(crate) model: &'a Model,
    pub(crate) runs: &'a [Run],
    pub(crate) work: Work<'a>,
    /// Indices of the estimated parameters.
    pub(crate) free: Vec<usize>,
    /// Plant states whose initial values are estimated, and parameters that are estimated in each run as these are.
    pub(crate) visible: Vec<usize>,
    /// One over the standard deviation of each signal, over the root of the number of samples.
    pub(crate) weights: Vec<f64>,
    /// Unknown = scaled unknown × scale.
    pub(crate) scales: Vec<f64>,
    /// Size of each parameter of the model in these recordings.
    sizes: Vec<f64>,
    pub(crate) lower: DVector<f64>,
    pub(crate) upper: DVector<f64>,
    /// Moving-average coefficient by signal; empty in the first pass.
    pub(crate) rounding: Vec<f64>,
    pub(crate) evaluations: Cell<u64>,
    cache: RefCell<Option<Rc<Linearised>>>,
    pub(crate) samples: f64,
    /// How many times as much the first samples of a run count, by run, sample and signal, see [`first_weights`].
    pub(crate) first: Vec<Vec<f64>>,
    /// Samples that the fit may see, by run; all where there is none.
    seen: Option<&'a [Vec<bool>]>,
    /// Initial states that are not estimated, by run.
    pub(crate) known_states: Option<Vec<DVector<f64>>>,
    /// Where positions are measured and not simulated.
    pub(crate) positions: Option<Positions>,
    /// The best that was seen in the first pass, and the root of its cost.
    best: RefCell<Option<(f64, Solution)>>,
    /// Whether the free runs of the best are kept, for who judges it.
    pub(crate) keeps: bool,
    kept: RefCell<Kept>,
}

impl<'a> Problem<'a> {
    pub(crate) fn new(model: &'a Model, runs: &'a [Run], work: Work<'a>) -> Result<Self, FitError> {
        Self::with(model, runs, None, None, work)
    }

    /// As [`Problem::new`], with only those samples of each run that are `seen`. Initial states are estimated
    /// where they are not `known_states`.
    pub(crate) fn with(
        model: &'a Model,
        runs: &'a [Run],
        seen: Option<&'a [Vec<bool>]>,
        known_states: Option<Vec<DVector<f64>>>,
        work: Work<'a>,
    ) -> Result<Self, FitError> {
        work.go_on()?;
        let free: Vec<usize> = (0..model.parameters.len())
            .filter(|i| model.parameters[*i].free)
            .collect();
        let mut tallies = vec![Tally::default(); model.measured.len()];
        let mut samples = 0.0;
        for (index, run) in runs.iter().enumerate() {
            for k in 0..run.len() {
                let counts = seen.is_none_or(|s| s[index][k]);
                for (tally, y) in tallies.iter_mut().zip(run.sample(k)) {
                    tally.add(*y, *y);
                    samples += f64::from(u8::from(y.is_finite() && counts));
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
        let visible = match known_states {
            Some(_) => Vec::new(),
            None => estimated_states(model, &model.declared_values(), runs),
        };
        let first = match known_states {
            Some(_) => Vec::new(),
            None => first_weights(model, runs, work.criteria()),
        };
        let deviations: Vec<f64> = tallies.iter().map(Tally::std).collect();
        let sizes = sizes(model, runs, &deviations);
        let mut scales = Vec::new();
        let mut lower = Vec::new();
        let mut upper = Vec::new();
        for &i in &free {
            let (scale, [low, high]) = range(&model.parameters[i], sizes[i]);
            scales.push(scale);
            lower.push(low / scale);
            upper.push(high / scale);
        }
        let own: Vec<usize> = model.per_run().collect();
        for _ in runs {
            for state in &visible {
                let own = state.checked_sub(model.n_states()).map(|k| own[k]);
                let range = own.map(|i| range(&model.parameters[i], sizes[i]));
                let (scale, [low, high]) =
                    range.unwrap_or((1.0, [f64::NEG_INFINITY, f64::INFINITY]));
                scales.push(scale);
                lower.push(low / scale);
                upper.push(high / scale);
            }
        }
        Ok(Self {
            model,
            runs,
            work,
            free,
            visible,
            weights,
            scales,
            sizes,
            lower: DVector::from_vec(lower),
            upper: DVector::from_vec(upper),
            rounding: Vec::new(),
            evaluations: Cell::new(0),
            cache: RefCell::new(None),
            samples,
            first,
            seen,
            known_states,
            positions: None,
            best: RefCell::new(None),
            keeps: false,
            kept: RefCell::default(),
        })
    }

    /// The scaled unknowns for parameter values and initial states.
    pub(crate) fn pack(&self, values: &[f64], states: &[DVector<f64>]) -> DVector<f64> {
        let mut scaled: Vec<f64> = self
            .free
            .iter()
            .map(|i| self.model.parameters[*i].declaration.nearest(values[*i]))
            .collect();
        for x0 in states {
            scaled.extend(self.visible.iter().map(|s| x0[*s]));
        }
        for (value, scale) in scaled.iter_mut().zip(&self.scales) {
            *value /= scale;
        }
        DVector::from_vec(scaled)
    }

    /// The solution at scaled unknowns.
    pub(crate) fn solution(&self, scaled: &DVector<f64>) -> Solution {
        let (values, states) = self.unpack(scaled);
        Solution { values, states }
    }

    /// Scales the unknowns so that each moves the residuals alike, as the damping of the solver
    /// expects (J. J. Moré, 1978, "The Levenberg-Marquardt algorithm", section 6).
    pub(crate) fn balance(&mut self, mut scaled: DVector<f64>) -> Result<DVector<f64>, Cancelled> {
        let dead = self.work.criteria().parameters.dead;
        let mut linear = self.linearise_once(&scaled)?;
        for (i, mut column) in linear.jacobian.column_iter_mut().enumerate() {
            let norm = column.norm();
            if norm > dead && norm.is_finite() {
                self.scales[i] /= norm;
                self.lower[i] *= norm;
                self.upper[i] *= norm;
                scaled[i] *= norm;
                column /= norm;
            }
        }
        // The point is the same in other units: nothing needs to be simulated again.
        linear.at.clone_from(&scaled);
        self.keep(linear);
        Ok(scaled)
    }

    /// The parameter values and initial states of scaled unknowns.
    pub(crate) fn unpack(&self, scaled: &DVector<f64>) -> (Vec<f64>, Vec<DVector<f64>>) {
        let mut values = nominal(self.model);
        for (k, i) in self.free.iter().enumerate() {
            values[*i] = scaled[k] * self.scales[k];
        }
        let states: Vec<DVector<f64>> = (0..self.runs.len())
            .map(|run| {
                if let Some(known) = &self.known_states {
                    return known[run].clone();
                }
                let mut x0 = DVector::zeros(self.model.n_starts());
                let first = self.free.len() + run * self.visible.len();
                for (k, state) in self.visible.iter().enumerate() {
                    x0[*state] = scaled[first + k] * self.scales[first + k];
                }
                x0
            })
            .collect();
        // What differs from run to run is for all of them what it is on average.
        for (k, i) in self.model.per_run().enumerate() {
            let of_runs = states.iter().map(|x0| x0[self.model.n_states() + k]);
            values[i] = of_runs.sum::<f64>() / states.len() as f64;
        }
        (values, states)
    }

    fn rows(&self) -> usize {
        self.runs.iter().map(Run::len).sum::<usize>() * self.model.measured.len()
    }

    /// Weight of row `row` of run `run`; zero where the fit may not look.
    pub(crate) fn weight(&self, run: usize, row: usize) -> f64 {
        let n_signals = self.weights.len();
        if self.seen.is_some_and(|seen| !seen[run][row / n_signals]) {
            return 0.0;
        }
        let weight = self.weights[row % n_signals];
        match self.first.get(run) {
            // The second pass weighs by the noise alone.
            Some(first) if row < first.len() && self.rounding.is_empty() => weight * first[row],
            _ => weight,
        }
    }

    /// Rows of the first samples, which count more than others: one sample of a run, or all in which the machine rests.
    pub(crate) fn first_rows(&self) -> impl Iterator<Item = usize> + '_ {
        let n_signals = self.weights.len();
        let starts = (self.runs.iter().enumerate()).scan(0, move |row, (index, run)| {
            let first = *row;
            *row += run.len() * n_signals;
            let count = self.first.get(index).map_or(n_signals, Vec::len);
            Some(first..(first + count).min(*row))
        });
        starts.flatten()
    }

    pub(crate) fn residual_vector(&self, scaled: &DVector<f64>) -> Result<DVector<f64>, Cancelled> {
        let (values, states) = self.unpack(scaled);
        let mut all = Vec::with_capacity(self.rows());
        let predicted = self.free_runs(&values, &states)?;
        for (index, predicted) in predicted.iter().enumerate() {
            all.extend_from_slice(self.weighted(index, predicted, scaled).as_slice());
        }
        let all = DVector::from_vec(all);
        if self.keeps {
            let mut kept = self.kept.borrow_mut();
            kept.keep(all.norm(), &values, &states, predicted);
        }
        self.remember(&all, values, states);
        Ok(all)
    }

    /// The free runs of a solution, row by row; none where they were not kept, or positions are measured ones.
    pub(crate) fn runs_of(&self, solution: &Solution) -> Option<Vec<Vec<f64>>> {
        let kept = self.kept.take();
        kept.of(solution).filter(|_| self.positions.is_none())
    }

    /// Weighted residuals of one run.
    fn weighted(&self, run: usize, predicted: &[f64], scaled: &DVector<f64>) -> DVector<f64> {
        let mut residual = residuals(predicted, &self.runs[run]);
        for (row, value) in residual.iter_mut().enumerate() {
            *value *= self.weight(run, row);
        }
        self.filter(run, residual.as_mut_slice(), scaled);
        residual
    }

    /// The free runs with these values, from these initial states.
    pub(crate) fn free_runs(
        &self,
        values: &[f64],
        states: &[DVector<f64>],
    ) -> Result<Vec<Vec<f64>>, Cancelled> {
        let (positions, model, work) = (self.positions.as_ref(), self.model, &self.work);
        for_each_run(self.runs, states, |run, x0| {
            predict_with(positions, model, values, x0, run, work)
        })
    }

    /// Keeps the solution of least error, in case the work is cancelled.
    fn remember(&self, residual: &DVector<f64>, values: Vec<f64>, states: Vec<DVector<f64>>) {
        let error = residual.norm();
        let mut best = self.best.borrow_mut();
        let better = error.is_finite() && best.as_ref().is_none_or(|(least, _)| error < *least);
        if better && self.rounding.is_empty() {
            *best = Some((error, Solution { values, states }));
        }
    }

    /// The best that was seen so far in the first pass, and its error relative to the standard deviation.
    pub(crate) fn best(&self) -> Option<(f64, Solution)> {
        self.best.borrow().clone()
    }

    /// Weighted residuals, and their Jacobian by the scaled unknowns. What was computed last is kept.
    pub(crate) fn linearise(&self, scaled: &DVector<f64>) -> Result<Rc<Linearised>, Cancelled> {
        if let Some(linear) = self.cache.borrow().as_ref()
            && linear.at == *scaled
        {
            return Ok(Rc::clone(linear));
        }
        self.forget();
        let (values, states) = self.unpack(scaled);
        let (rows, columns) = (self.rows(), self.scales.len());
        let mut all = DVector::zeros(rows);
        let mut jacobian = zeros(rows, columns);
        let mut first_row = 0;
        let (positions, model, work) = (self.positions.as_ref(), self.model, &self.work);
        let by = By {
            parameters: &self.free,
            states: &self.visible,
        };
        let sensitivities = for_each_run(self.runs, &states, |run, x0| {
            sensitivities(positions, model, &values, x0, run, by, work)
        })?;
        for (index, s) in sensitivities.iter().enumerate() {
            let residual = self.weighted(index, &s.predicted, scaled);
            let rows = residual.len();
            all.rows_mut(first_row, rows).copy_from(&residual);
            self.weigh(index, first_row, &s.jacobian, &mut jacobian);
            self.filter_jacobian(index, first_row, rows, &mut jacobian);
            first_row += rows;
        }
        self.remember(&all, values, states);
        Ok(self.keep(Linearised {
            at: scaled.clone(),
            residual: all,
            jacobian,
        }))
    }

    /// Puts derivatives of one run, weighted, into those of all residuals from the `first_row` on. Columns: free parameters,
    /// then initial states of that run.
    fn weigh(
        &self,
        index: usize,
        first_row: usize,
        slopes: &DMatrix<f64>,
        jacobian: &mut DMatrix<f64>,
    ) {
        let weight = |(row, measured): (usize, &f64)| {
            let counts = measured.is_finite();
            if counts { self.weight(index, row) } else { 0.0 }
        };
        let measured = self.runs[index].measured().iter().enumerate();
        let weights: Vec<f64> = measured.map(weight).collect();
        for (column, from) in slopes.column_iter().enumerate() {
            let to = if column < self.free.len() {
                column
            } else {
                column + index * self.visible.len()
            };
            let mut rows = jacobian.view_mut((first_row, to), (weights.len(), 1));
            for (to_row, (slope, weight)) in rows.iter_mut().zip(from.iter().zip(&weights)) {
                *to_row = -slope * weight * self.scales[to];
            }
        }
    }

    /// The Jacobian by derivatives of each run.
    pub(crate) fn jacobian_of(&self, slopes: &[DMatrix<f64>]) -> DMatrix<f64> {
        let mut jacobian = zeros(self.rows(), self.scales.len());
        let mut first_row = 0;
        for (index, slopes) in slopes.iter().enumerate() {
            self.weigh(index, first_row, slopes, &mut jacobian);
            first_row += slopes.nrows();
        }
        jacobian
    }

    /// As [`Problem::linearise`], for who changes it: it is not kept.
    pub(crate) fn linearise_once(&self, scaled: &DVector<f64>) -> Result<Linearised, Cancelled> {
        let linear = self.linearise(scaled)?;
        self.forget();
        Ok(Rc::unwrap_or_clone(linear))
    }

    /// Keeps what need not be simulated again.
    pub(crate) fn keep(&self, linear: Linearised) -> Rc<Linearised> {
        let linear = Rc::new(linear);
        self.cache.replace(Some(Rc::clone(&linear)));
        linear
    }

    /// Keeps nothing of what was linearised.
    pub(crate) fn forget(&self) {
        self.cache.replace(None);
    }

    /// The estimated parameters, to describe flat directions with.
    pub(crate) fn named(&self) -> Vec<Named<'_>> {
        self.free
            .iter()
            .zip(&self.scales)
            .map(|(i, scale)| {
                let parameter = &self.model.parameters[*i];
                Named {
                    name: &parameter.name,
                    declared: self.sizes[*i],
                    scale: *scale,
                }
            })
            .collect()
    }

    /// Residuals and Jacobian by run and signal, in time order.
    pub(crate) fn blocks(
        &self,
        residual: &DVector<f64>,
        jacobian: &DMatrix<f64>,
    ) -> Vec<Vec<Block>> {
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

/// The size of a parameter, and its least and largest value.
fn range(parameter: &ModelParameter, size: f64) -> (f64, [f64; 2]) {
    let scale = size.max(parameter.value.map_or(0.0, f64::abs));
    let (low, high) = parameter.declaration.bounds();
    (scale, [low, high])
}

/// The file's values, else the defaults, else zero.
fn nominal(model: &Model) -> Vec<f64> {
    model
        .parameters
        .iter()
        .map(|p| p.value.unwrap_or(0.0))
        .collect()
}
