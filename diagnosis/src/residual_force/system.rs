//! How forces pass through the filter: a linear system.

use loopsight_core::Place;
use loopsight_model::model::Model;
use loopsight_model::run::Run;
use loopsight_model::simulate::Simulator;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::filter::{Filtered, innovation, unknowns};
use super::linear::Linear;
use super::response::{Column, forces};
use crate::prediction::Solution;
use crate::progress::{Cancelled, Work};

/// A model that follows measurements, linearised once: any number of forces pass through it without a simulation.
///
/// ```text
/// δx⁻ = A δx + B f      δν = m (δr - C δx - D f)
/// δx⁺ = δx⁻ + K δν      δr⁺ = L δν                    δe = -W δν
/// ```
///
/// | symbol | what |
/// |---|---|
/// | `δx`, `f` | change of the state, and the force of an interval |
/// | `A`, `B`, `C`, `D` | derivatives of the state and of what is measured after an interval, by the state before it and by the force |
/// | `δν`, `m` | change of the innovation; zero where nothing is measured, or nothing predicted |
/// | `K`, `L` | the filter's corrections of the state, and of `r`, what was rounded off a count |
/// | `δe`, `W` | change of the white prediction, and what makes innovations white |
///
/// These are the derivatives of the simulation, exact as long as all that it knows of its past is the plant's state: there is
/// no such system where an effect has states of its own or a memory.
pub(super) struct System {
    places: Vec<Place>,
    /// States of the model, and signals that are measured.
    size: (usize, usize),
    /// By run and sample, from the first interval on, as far as the model does not run away: rows `δx⁺`, `δr⁺`, `δe`; columns `δx`, `δr`, `f`.
    steps: Vec<Vec<DMatrix<f64>>>,
}

impl System {
    /// That of a model, where its effects keep nothing from one interval to the next.
    pub(super) fn of(
        model: &Model,
        solution: &Solution,
        runs: &[Run],
        filtered: &[Filtered],
        work: &Work<'_>,
    ) -> Result<Option<Self>, Cancelled> {
        if model.effects.iter().any(|e| e.meta.is_dynamic()) {
            return Ok(None);
        }
        let mut system = Self {
            places: unknowns(model).iter().map(|(place, _)| *place).collect(),
            size: (model.n_states(), model.measured.len()),
            steps: Vec::new(),
        };
        let along = |((run, x0), filtered): ((&Run, &DVector<f64>), &Filtered)| {
            system.along(model, &solution.values, run, x0.as_slice(), filtered, work)
        };
        let runs = runs.par_iter().zip(&solution.states).zip(filtered);
        system.steps = runs.map(along).collect::<Result<_, Cancelled>>()?;
        Ok(Some(system))
    }

    /// Whether it knows all places of a force.
    pub(super) fn passes(&self, column: &Column) -> bool {
        let known = |(place, _): &(Place, _)| self.places.contains(place);
        !forces(column).is_empty() && forces(column).iter().all(known)
    }

    /// The steps along a run.
    fn along(
        &self,
        model: &Model,
        values: &[f64],
        run: &Run,
        x0: &[f64],
        filtered: &Filtered,
        work: &Work<'_>,
    ) -> Result<Vec<DMatrix<f64>>, Cancelled> {
        let (nx, ny) = self.size;
        let mut steps = Vec::new();
        if run.is_empty() {
            return Ok(steps);
        }
        let places = self.places.clone();
        let (of_run, state) = model.begun(values, x0);
        let mut linear = Linear::new(model, &of_run, places, state, run.input(0));
        let mut simulator = Simulator::new(model, values);
        simulator.reset(x0, run.input(0));
        let mut outputs = vec![0.0; ny];
        let mut rounded = vec![0.0; ny];
        let mut beyond = DVector::zeros(ny);
        for k in 0..run.len() {
            work.go_on()?;
            let ab = (k > 0).then(|| linear.step(simulator.state(), run, k));
            if k > 0 {
                simulator.advance_to(run, k);
            }
            simulator.measure(&mut outputs);
            innovation(run.sample(k), &outputs, &rounded, beyond.as_mut_slice());
            let correction = &filtered.gains[k] * &beyond;
            for (x, add) in simulator.state_mut().iter_mut().zip(correction.iter()) {
                *x += add;
            }
            let Some(ab) = ab else { continue };
            rounded.copy_from_slice(&correction.as_slice()[nx..]);
            let seen: Vec<bool> = (run.sample(k).iter().zip(&outputs))
                .map(|(sample, output)| sample.is_finite() && output.is_finite())
                .collect();
            let step = self.step(&ab, &seen, filtered, k);
            if step.iter().any(|v| !v.is_finite()) {
                // What has run away does not come back: no force shows from here on.
                break;
            }
            steps.push(step);
        }
        Ok(steps)
    }

    /// One step, from the derivatives `ab` of the simulation and the signals that are seen after it.
    fn step(
        &self,
        ab: &DMatrix<f64>,
        seen: &[bool],
        filtered: &Filtered,
        k: usize,
    ) -> DMatrix<f64> {
        let ((nx, ny), nf) = (self.size, self.places.len());
        let mut innovation = DMatrix::zeros(ny, nx + ny + nf);
        for i in (0..ny).filter(|i| seen[*i]) {
            for j in 0..nx {
                innovation[(i, j)] = -ab[(nx + i, j)];
            }
            innovation[(i, nx + i)] = 1.0;
            for j in 0..nf {
                innovation[(i, nx + ny + j)] = -ab[(nx + i, nx + j)];
            }
        }
        let mut step = DMatrix::zeros(nx + 2 * ny, nx + ny + nf);
        step.rows_mut(0, nx + ny)
            .copy_from(&(&filtered.gains[k] * &innovation));
        step.rows_mut(nx + ny, ny)
            .copy_from(&(&filtered.whiteners[k] * -innovation));
        for i in 0..nx {
            for j in 0..nx {
                step[(i, j)] += ab[(i, j)];
            }
            for j in 0..nf {
                step[(i, nx + ny + j)] += ab[(i, nx + j)];
            }
        }
        step
    }

    /// Changes of the white predictions by the forces of `batch`. One row per sample and signal.
    pub(super) fn passed(
        &self,
        runs: &[Run],
        batch: &[Column],
        work: &Work<'_>,
    ) -> Result<DMatrix<f64>, Cancelled> {
        let ((nx, ny), n) = (self.size, batch.len());
        let rows = runs.iter().map(Run::len).sum::<usize>() * ny;
        let mut out = DMatrix::zeros(rows, n);
        let mut after = DMatrix::zeros(nx + 2 * ny, n);
        let mut first = 0;
        for (run, steps) in runs.iter().zip(&self.steps) {
            let mut before = DMatrix::zeros(nx + ny + self.places.len(), n);
            for (k, step) in (1..).zip(steps) {
                work.go_on()?;
                for (c, column) in batch.iter().enumerate() {
                    for (i, place) in self.places.iter().enumerate() {
                        let there = forces(column).iter().filter(|(p, _)| p == place);
                        before[(nx + ny + i, c)] = there.map(|(_, f)| f[first + k]).sum();
                    }
                }
                after.gemm(1.0, step, &before, 0.0);
                before
                    .rows_mut(0, nx + ny)
                    .copy_from(&after.rows(0, nx + ny));
                out.rows_mut((first + k) * ny, ny)
                    .copy_from(&after.rows(nx + ny, ny));
            }
            first += run.len();
        }
        Ok(out)
    }
}
