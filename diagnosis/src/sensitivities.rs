//! The free run with its derivatives.

use loopsight_core::Real;
use loopsight_model::model::Model;
use loopsight_model::registry::HostReal;
use loopsight_model::run::Run;
use loopsight_model::simulate::Simulator;
use loopsight_model::{DUAL_WIDTH, DualOf, NARROW_WIDTH, TINY_WIDTH, derivative, variable_of};
use nalgebra::DMatrix;
use rayon::prelude::*;

use crate::linearised::zeros;
use crate::positions::{Positions, run_with};
use crate::progress::{Cancelled, Work};

/// The free run over `run` and its derivatives by some parameters and initial states.
pub(crate) struct Sensitivities {
    /// Predictions, row by row: sample by sample, signal by signal.
    pub(crate) predicted: Vec<f64>,
    /// One row per prediction; first the `parameters`, then the `states`.
    pub(crate) jacobian: DMatrix<f64>,
}

/// The unknowns that a simulation is differentiated by, by index.
#[derive(Clone, Copy)]
pub(crate) struct By<'a> {
    pub(crate) parameters: &'a [usize],
    /// Initial states of the plant.
    pub(crate) states: &'a [usize],
}

/// Simulates `run` from `x0`, differentiated by the parameters and initial states that are listed
/// (forward mode, [`TINY_WIDTH`], [`NARROW_WIDTH`] or [`DUAL_WIDTH`] at a time; several passes at once),
/// with the positions as measured where they are given.
pub(crate) fn sensitivities(
    positions: Option<&Positions>,
    model: &Model,
    values: &[f64],
    x0: &[f64],
    run: &Run,
    by: By<'_>,
    work: &Work<'_>,
) -> Result<Sensitivities, Cancelled> {
    let columns = by.parameters.len() + by.states.len();
    let rows = run.len() * model.measured.len();
    let mut predicted = vec![0.0; rows];
    let mut jacobian = zeros(rows, columns);
    let pass = Pass {
        positions,
        model,
        values,
        x0,
        run,
        by,
        work,
    };
    // Each pass has the prediction, and the first one writes it.
    let mut of_first = Some(&mut predicted);
    let (mut first, mut slopes) = (0, jacobian.as_mut_slice());
    let mut passes = Vec::new();
    while first < columns || passes.is_empty() {
        let width = width(columns - first);
        let of_pass = width.min(columns - first);
        let (own, rest) = slopes.split_at_mut(of_pass * rows);
        passes.push((width, first, own, of_first.take()));
        (first, slopes) = (first + of_pass, rest);
    }
    let simulate = |(width, first, slopes, predicted): (_, _, _, Option<&mut Vec<f64>>)| match width
    {
        TINY_WIDTH => pass.run::<TINY_WIDTH>(first, slopes, predicted),
        NARROW_WIDTH => pass.run::<NARROW_WIDTH>(first, slopes, predicted),
        _ => pass.run::<DUAL_WIDTH>(first, slopes, predicted),
    };
    match passes.len() {
        1 => passes.into_iter().try_for_each(simulate)?,
        _ => passes.into_par_iter().try_for_each(simulate)?,
    }
    Ok(Sensitivities {
        predicted,
        jacobian,
    })
}

/// How many derivatives the next pass takes of so many that are `left`: two narrow passes cost less than a wide and a narrow
/// one.
fn width(left: usize) -> usize {
    if left <= TINY_WIDTH {
        TINY_WIDTH
    } else if left <= NARROW_WIDTH || (DUAL_WIDTH + 1..=2 * NARROW_WIDTH).contains(&left) {
        NARROW_WIDTH
    } else {
        DUAL_WIDTH
    }
}

/// A simulation that is differentiated by some of the unknowns.
struct Pass<'a> {
    positions: Option<&'a Positions>,
    model: &'a Model,
    values: &'a [f64],
    x0: &'a [f64],
    run: &'a Run,
    by: By<'a>,
    work: &'a Work<'a>,
}

impl Pass<'_> {
    /// Simulates with the derivatives of `N` columns from the `first`, column by column into `slopes`; with the prediction
    /// into `predicted` where that is wanted.
    fn run<const N: usize>(
        &self,
        first: usize,
        slopes: &mut [f64],
        mut predicted: Option<&mut Vec<f64>>,
    ) -> Result<(), Cancelled>
    where
        DualOf<N>: HostReal,
    {
        self.work.count_differentiated(self.run.len());
        let By { parameters, states } = self.by;
        let last = (first + N).min(parameters.len() + states.len());
        let seed = |value: f64, place: Option<usize>| match place {
            Some(column) if (first..last).contains(&column) => variable_of(value, column - first),
            _ => DualOf::<N>::of(value),
        };
        let of_parameter =
            |(i, v): (usize, &f64)| seed(*v, parameters.iter().position(|p| *p == i));
        let of_state = |(i, v): (usize, &f64)| {
            let place = states.iter().position(|s| *s == i);
            seed(*v, place.map(|k| parameters.len() + k))
        };
        let values: Vec<DualOf<N>> = self.values.iter().enumerate().map(of_parameter).collect();
        let x0: Vec<DualOf<N>> = self.x0.iter().enumerate().map(of_state).collect();
        let n = self.model.measured.len();
        let rows = (self.run.len() * n).max(1);
        let mut simulator = Simulator::new(self.model, &values).without_trail();
        run_with(
            self.positions,
            &mut simulator,
            &x0,
            self.run,
            n,
            |k, outputs| {
                self.work.go_on()?;
                for (i, output) in outputs.iter().enumerate() {
                    let row = k * outputs.len() + i;
                    if let Some(predicted) = &mut predicted {
                        predicted[row] = output.value();
                    }
                    for (column, slopes) in slopes.chunks_exact_mut(rows).enumerate() {
                        slopes[row] = derivative(output, column);
                    }
                }
                Ok(())
            },
        )
    }
}
