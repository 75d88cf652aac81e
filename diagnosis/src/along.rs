//! A model linearised along its free run, interval by interval.

use std::cell::Cell;

use loopsight_core::{Place, Real};
use loopsight_model::model::Model;
use loopsight_model::run::Run;
use loopsight_model::simulate::{Simulator, try_follow};
use loopsight_model::{DUAL_WIDTH, Dual, derivative, variable};

use crate::positions::Positions;
use crate::progress::{Cancelled, Work};

/// A model along one run.
#[derive(Default)]
pub(crate) struct Along {
    /// By sample: the plant's state.
    pub(crate) states: Vec<f64>,
    /// By sample: inputs, as effects with a memory pass them on.
    pub(crate) inputs: Vec<f64>,
    /// By sample: the step that ends there, row by row.
    pub(crate) steps: Vec<f64>,
}

/// A model along a run, with the derivatives by `n` states.
#[allow(clippy::too_many_arguments, reason = "a step of `Passage::of`")]
pub(crate) fn along(
    model: &Model,
    values: &[f64],
    positions: Option<&Positions>,
    run: &Run,
    x0: &[f64],
    places: &[Place],
    n: usize,
    work: &Work<'_>,
) -> Result<Along, Cancelled> {
    let ny = model.measured.len();
    let (rows, columns) = (n + ny, n + places.len());
    let dual = |from: &[f64]| from.iter().map(|v| Dual::of(*v)).collect::<Vec<Dual>>();
    let (values, x0) = (dual(values), dual(x0));
    let mut found = Along::default();
    let mut of_states = vec![0.0; run.len() * n * columns];
    let mut of_outputs = vec![0.0; run.len() * ny * columns];
    for first in (0..columns).step_by(DUAL_WIDTH) {
        work.count_differentiated(run.len());
        let last = (first + DUAL_WIDTH).min(columns);
        let seed = |value: f64, column: usize| match column {
            column if (first..last).contains(&column) => variable(value, column - first),
            _ => Dual::of(value),
        };
        let mut outputs = |k: usize, outputs: &[Dual]| {
            for (i, y) in outputs.iter().enumerate() {
                for column in first..last {
                    of_outputs[(k * ny + i) * columns + column] = derivative(y, column - first);
                }
            }
            work.go_on()
        };
        let sample = Cell::new(0);
        let mut states = |simulator: &mut Simulator<'_, Dual>| {
            let k = sample.replace(sample.get() + 1);
            if first == 0 {
                let state = simulator.state().iter().map(|v| v.value());
                found.states.extend(state);
                found
                    .inputs
                    .extend(simulator.passed_on().iter().map(|v| v.value()));
            }
            for (i, x) in simulator.whole_state_mut().iter_mut().enumerate() {
                for column in first..last {
                    of_states[(k * n + i) * columns + column] = derivative(x, column - first);
                }
                *x = seed(x.value(), i);
            }
            for (i, place) in places.iter().enumerate() {
                simulator.push(*place, seed(0.0, n + i));
            }
        };
        let mut simulator = Simulator::new(model, &values);
        match positions {
            Some(positions) => {
                positions.run(&mut simulator, &x0, run, ny, &mut outputs, &mut states)?;
            }
            None => try_follow(&mut simulator, &x0, run, |k, measured, simulator| {
                outputs(k, measured)?;
                states(simulator);
                Ok(())
            })?,
        }
    }
    found.steps.reserve(run.len() * rows * columns);
    for k in 0..run.len() {
        found
            .steps
            .extend_from_slice(&of_states[k * n * columns..][..n * columns]);
        found
            .steps
            .extend_from_slice(&of_outputs[k * ny * columns..][..ny * columns]);
    }
    Ok(found)
}

/// The states among `n` that show in what is measured: in it, or in the change of such a state.
pub(crate) fn showing(all: &[Along], (rows, columns): (usize, usize), n: usize) -> Vec<usize> {
    let mut reaches = vec![false; rows * columns];
    for step in all
        .iter()
        .flat_map(|along| along.steps.chunks_exact(rows * columns))
    {
        for (reaches, slope) in reaches.iter_mut().zip(step) {
            *reaches |= *slope != 0.0;
        }
    }
    let mut shown = vec![false; n];
    loop {
        let is_shown = |row: usize| row >= n || shown[row];
        let next = (0..n).find(|j| {
            !shown[*j] && (0..rows).any(|row| is_shown(row) && reaches[row * columns + j])
        });
        match next {
            Some(j) => shown[j] = true,
            None => break,
        }
    }
    (0..n).filter(|j| shown[*j]).collect()
}

/// Steps without the states that do not show.
pub(crate) fn reduced(
    steps: &[f64],
    (rows, columns): (usize, usize),
    n: usize,
    showing: &[usize],
) -> Vec<f64> {
    let kept = |size: usize| {
        showing
            .iter()
            .copied()
            .chain(n..size)
            .collect::<Vec<usize>>()
    };
    let (of_rows, of_columns) = (kept(rows), kept(columns));
    let mut all =
        Vec::with_capacity(steps.len() / (rows * columns) * of_rows.len() * of_columns.len());
    for step in steps.chunks_exact(rows * columns) {
        for row in &of_rows {
            all.extend(of_columns.iter().map(|column| step[row * columns + column]));
        }
    }
    all
}
