//! How a force that is not in the model would show in the filter's innovations.

use loopsight_core::{Place, Real};
use loopsight_model::model::Model;
use loopsight_model::run::Run;
use loopsight_model::simulate::Simulator;
use loopsight_model::{DUAL_WIDTH, Dual, derivative, variable};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::filter::{Filtered, innovation};
use super::system::System;
use crate::prediction::Solution;
use crate::progress::{Cancelled, Work};

/// Forces that pass through the system at once.
const AT_ONCE: usize = 64;

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

/// A model that follows measurements by way of the filter.
#[derive(Clone, Copy)]
pub(super) struct Following<'a> {
    pub(super) model: &'a Model,
    pub(super) solution: &'a Solution,
    pub(super) runs: &'a [Run],
    pub(super) filtered: &'a [Filtered],
    /// How forces pass through it, where that is known.
    pub(super) system: Option<&'a System>,
}

/// Responses to `columns`: forces by way of the system where it is known, the others by simulations, [`DUAL_WIDTH`] at a time.
pub(super) fn responses(
    following: &Following<'_>,
    columns: &[Column],
    work: &Work<'_>,
) -> Result<Responses, Cancelled> {
    let (model, runs) = (following.model, following.runs);
    let rows = runs.iter().map(Run::len).sum::<usize>() * model.measured.len();
    let innovations = DVector::from_iterator(
        rows,
        (following.filtered.iter()).flat_map(|f| f.innovations.iter().copied()),
    );
    let passes = |system: &&System| columns.iter().all(|c| system.passes(c));
    let system = following.system.filter(passes);
    let width = system.map_or(DUAL_WIDTH, |_| AT_ONCE);
    let batches: Vec<DMatrix<f64>> = columns
        .par_chunks(width)
        .map(|batch| match system {
            Some(system) => system.passed(runs, batch, work),
            None => batch_of(following, batch, work),
        })
        .collect::<Result<_, Cancelled>>()?;
    let mut all = DMatrix::zeros(rows, columns.len());
    for (k, batch) in batches.iter().enumerate() {
        all.columns_mut(k * width, batch.ncols()).copy_from(batch);
    }
    Ok(Responses {
        innovations,
        columns: all,
    })
}

fn batch_of(
    following: &Following<'_>,
    batch: &[Column],
    work: &Work<'_>,
) -> Result<DMatrix<f64>, Cancelled> {
    let Following {
        model,
        solution,
        runs,
        filtered,
        ..
    } = *following;
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

/// What a column is made of, where it is a force.
pub(super) fn forces(column: &Column) -> &[(Place, Vec<f64>)] {
    match column {
        Column::Force(list) => list,
        Column::Parameter(_) => &[],
    }
}

#[cfg(test)]
mod tests {
    use loopsight_model::run::Rows;
    use loopsight_plants as _;

    use super::*;
    use crate::chance::uniform;
    use crate::residual_force::filter::{filter, unknowns};

    const ROBOT: &str = "[plant.ddmr]\nK_A = -15.146\nK_B = 0.005\nK_C = 0.136\nK_D = -9.573\nK_E = -3.945\n\
                         K_F = 0.656\nhalf_track = 0.131\nwheel_radius = 0.05\n\
                         [log.measured.linear_velocity.sensor.encoder_counts]\ncounts_per_revolution = 400\n\
                         of = { shaft_angle_right = 0.025, shaft_angle_left = 0.025 }\n\
                         [log.measured.angular_velocity]\nsensor = \"instantaneous\"\n\
                         [[effect]]\n[effect.coulomb_friction]\nat = [\"wheel.right\", \"wheel.left\"]\nlevel = 0.5\n";

    fn robot(effect: &str) -> Model {
        Model::from_toml("robot.toml", &format!("{ROBOT}{effect}"))
            .unwrap()
            .0
    }

    /// Two runs with time stamps that scatter, some of whose samples are missing.
    fn runs() -> Vec<Run> {
        let mut random = uniform(1);
        let mut run = |n: usize| {
            let time = (0..n).map(|k| 0.01 * (k as f64 + 0.3 * random()));
            let time: Vec<f64> = time.collect();
            let inputs = (0..2 * n).map(|i| 6.0 * (0.07 * i as f64).sin() + random());
            let inputs = Rows::new(2, inputs.collect());
            let measured = (0..2 * n).map(|i| if i % 17 == 3 { f64::NAN } else { random() });
            Run::new("", time, inputs, Rows::new(2, measured.collect())).unwrap()
        };
        vec![run(90), run(60)]
    }

    /// Forces pass through the system as they do through a simulation.
    #[test]
    fn a_force_passes_as_it_does_in_a_simulation() {
        let (model, runs, work) = (robot(""), runs(), Work::quiet());
        let solution = Solution {
            values: model.values(),
            states: vec![DVector::zeros(model.n_states()); 2],
        };
        let (filtered, _) = filter(&model, &solution, &runs, &work).unwrap();
        let system = System::of(&model, &solution, &runs, &filtered, &work).unwrap();
        let system = system.unwrap();
        let places: Vec<Place> = unknowns(&model).iter().map(|(place, _)| *place).collect();
        let wave = |n: usize| (0..150).map(|k| (0.1 * (n * k) as f64).sin()).collect();
        let mut columns: Vec<Column> = (1..80)
            .map(|n| Column::Force(vec![(places[n % places.len()], wave(n))]))
            .collect();
        columns.push(Column::Force(vec![
            (places[0], wave(5)),
            (places[1], wave(7)),
        ]));
        let by = |system| {
            let following = Following {
                model: &model,
                solution: &solution,
                runs: &runs,
                filtered: &filtered,
                system,
            };
            responses(&following, &columns, &work).unwrap().columns
        };
        let (simulated, passed) = (by(None), by(Some(&system)));
        let size = simulated.amax();
        let off = (simulated - passed).amax();
        assert!(size > 0.0 && off < 1e-9 * size, "{off} {size}");
    }

    #[test]
    fn what_effects_keep_is_simulated() {
        let lag = "[[effect]]\n[effect.actuator_lag]\nat = [\"input.right\"]\nlag = 0.05\n";
        let delay = "[[effect]]\n[effect.input_delay]\nat = [\"input.right\"]\n";
        for effect in [lag, delay] {
            let model = robot(effect);
            let solution = Solution {
                values: model.values(),
                states: Vec::new(),
            };
            let system = System::of(&model, &solution, &[], &[], &Work::quiet()).unwrap();
            assert!(system.is_none(), "{effect}");
        }
    }
}
