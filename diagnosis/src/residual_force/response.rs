//! How a force that is not in the model would show in the filter's innovations.

use loopsight_core::{Place, Real};
use loopsight_model::model::Model;
use loopsight_model::run::Run;
use loopsight_model::simulate::Simulator;
use loopsight_model::{DUAL_WIDTH, Dual, derivative, variable};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::filter::{Filtered, innovation};
use crate::prediction::Solution;
use crate::progress::{Cancelled, Work};

/// A force or a parameter that could be different by one unit.
#[derive(Clone, Debug)]
pub(super) enum Column {
    /// A force at some places, by sample: constant over the interval that ends with it.
    Force(Vec<(Place, Vec<f64>)>),
    /// A parameter of the model, by index.
    Parameter(usize),
}

/// White innovations of all runs, and their changes by one unit of each column. These are exact derivatives of
/// the simulation as corrected by the filter, including the states and memories of effects. One row per sample
/// and signal.
pub(super) struct Responses {
    pub(super) innovations: DVector<f64>,
    /// By column: the change of the prediction.
    pub(super) columns: DMatrix<f64>,
}

/// Responses to `columns`, [`DUAL_WIDTH`] at a time.
pub(super) fn responses(
    model: &Model,
    solution: &Solution,
    runs: &[Run],
    filtered: &[Filtered],
    columns: &[Column],
    work: &Work<'_>,
) -> Result<Responses, Cancelled> {
    let ny = model.measured.len();
    let rows = runs.iter().map(Run::len).sum::<usize>() * ny;
    let innovations = DVector::from_iterator(
        rows,
        filtered.iter().flat_map(|f| f.innovations.iter().copied()),
    );
    let batches: Vec<DMatrix<f64>> = columns
        .par_chunks(DUAL_WIDTH)
        .map(|batch| batch_of(model, solution, runs, filtered, batch, work))
        .collect::<Result<_, Cancelled>>()?;
    let mut all = DMatrix::zeros(rows, columns.len());
    for (k, batch) in batches.iter().enumerate() {
        all.columns_mut(k * DUAL_WIDTH, batch.ncols())
            .copy_from(batch);
    }
    Ok(Responses {
        innovations,
        columns: all,
    })
}

fn batch_of(
    model: &Model,
    solution: &Solution,
    runs: &[Run],
    filtered: &[Filtered],
    batch: &[Column],
    work: &Work<'_>,
) -> Result<DMatrix<f64>, Cancelled> {
    let ny = model.measured.len();
    let rows = runs.iter().map(Run::len).sum::<usize>() * ny;
    let mut out = DMatrix::zeros(rows, batch.len());
    let values: Vec<Dual> = solution
        .values
        .iter()
        .enumerate()
        .map(|(i, v)| {
            let column = batch
                .iter()
                .position(|c| matches!(c, Column::Parameter(p) if *p == i));
            column.map_or(Dual::of(*v), |c| variable(*v, c))
        })
        .collect();
    let mut places: Vec<Place> = Vec::new();
    for (place, _) in batch.iter().flat_map(forces) {
        if !places.contains(place) {
            places.push(*place);
        }
    }
    let mut outputs = vec![Dual::of(0.0); ny];
    let mut beyond = vec![Dual::of(0.0); ny];
    let mut first = 0;
    for ((run, x0), filtered) in runs.iter().zip(&solution.states).zip(filtered) {
        let mut simulator = Simulator::new(model, &values).without_trail();
        let mut rounded = vec![Dual::of(0.0); ny];
        let nx = model.n_states();
        let correction = |beyond: &[Dual], k: usize, i: usize| {
            let innovations = beyond.iter().enumerate();
            innovations.fold(Dual::of(0.0), |sum, (j, innovation)| {
                sum + *innovation * Dual::of(filtered.gains[k][(i, j)])
            })
        };
        let x0: Vec<Dual> = x0.iter().map(|v| Dual::of(*v)).collect();
        if !run.is_empty() {
            simulator.reset(&x0, run.input(0));
            simulator.measure(&mut outputs);
            innovation(run.sample(0), &outputs, &rounded, &mut beyond);
            for (i, x) in simulator.state_mut().iter_mut().enumerate() {
                *x += correction(&beyond, 0, i);
            }
        }
        for k in 1..run.len() {
            work.go_on()?;
            for place in &places {
                let mut push = Dual::of(0.0);
                for (c, column) in batch.iter().enumerate() {
                    for (_, series) in forces(column).iter().filter(|(p, _)| p == place) {
                        push += variable(0.0, c) * Dual::of(series[first + k]);
                    }
                }
                simulator.push(*place, push);
            }
            simulator.advance_to(run, k);
            simulator.measure(&mut outputs);
            innovation(run.sample(k), &outputs, &rounded, &mut beyond);
            for (i, x) in simulator.state_mut().iter_mut().enumerate() {
                *x += correction(&beyond, k, i);
            }
            for (i, to) in rounded.iter_mut().enumerate() {
                *to = correction(&beyond, k, nx + i);
            }
            let whitener = &filtered.whiteners[k];
            for i in 0..ny {
                for (j, innovation) in beyond.iter().enumerate() {
                    for c in 0..batch.len() {
                        out[((first + k) * ny + i, c)] -=
                            whitener[(i, j)] * derivative(innovation, c);
                    }
                }
            }
        }
        first += run.len();
    }
    Ok(out)
}

fn forces(column: &Column) -> &[(Place, Vec<f64>)] {
    match column {
        Column::Force(list) => list,
        Column::Parameter(_) => &[],
    }
}
