//! Simulated outputs, initial states, and the one-step prediction.

use std::borrow::Cow;

use loopsight_model::model::{Model, pseudo_inverse};
use loopsight_model::run::Run;
use loopsight_model::simulate::{Simulator, try_follow};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use crate::long::ENOUGH;
use crate::positions::{Positions, run_with};
use crate::progress::{Cancelled, Work};
use crate::sensitivities::{By, sensitivities};

/// Plant states whose initial values are estimated: those that influence the measurements at the beginning of a
/// run, or with an observer those that it observes. The others start at zero. Parameters that differ from run to run
/// stand behind the states, and are estimated as these are.
pub(crate) fn estimated_states(model: &Model, values: &[f64], runs: &[Run]) -> Vec<usize> {
    let observer = runs.iter().find_map(|run| run.observer());
    let mut estimated = observer.map_or_else(
        || model.seen_states(values),
        |observer| observer.observed.clone(),
    );
    estimated.extend(model.n_states()..model.n_starts());
    estimated
}

/// Whether a free parameter moves what is measured at the start of a run whatever its initial state: the surroundings of
/// a body whose state is how much warmer it is. Then a start that is held would hold the parameter, too; so it would where
/// a parameter differs from run to run.
pub(crate) fn moves_starts(
    model: &Model,
    solution: &Solution,
    runs: &[Run],
    work: &Work<'_>,
) -> Result<bool, Cancelled> {
    if model.per_run().next().is_some() {
        return Ok(true);
    }
    let free: Vec<usize> = (0..model.parameters.len())
        .filter(|i| model.parameters[*i].free)
        .collect();
    let by = By {
        parameters: &free,
        states: &[],
    };
    for (run, x0) in runs.iter().zip(&solution.states) {
        let first = run.part(0..run.len().min(1));
        let found = sensitivities(
            None,
            model,
            &solution.values,
            x0.as_slice(),
            &first,
            by,
            work,
        )?;
        if found.jacobian.iter().any(|slope| *slope != 0.0) {
            return Ok(true);
        }
    }
    Ok(false)
}

/// What `simulate` makes of each of some runs from its initial state. Several runs are simulated at once.
pub(crate) fn for_each_run<T: Send>(
    runs: &[Run],
    states: &[DVector<f64>],
    simulate: impl Fn(&Run, &[f64]) -> Result<T, Cancelled> + Sync,
) -> Result<Vec<T>, Cancelled> {
    let of = |(run, x0): (&Run, &DVector<f64>)| simulate(run, x0.as_slice());
    match runs {
        // One run needs no other thread.
        [_] => runs.iter().zip(states).map(of).collect(),
        _ => runs.par_iter().zip(states).map(of).collect(),
    }
}

/// The free run over `run`, without derivatives; row by row as in [`Sensitivities::predicted`].
pub(crate) fn predict(
    model: &Model,
    values: &[f64],
    x0: &[f64],
    run: &Run,
    work: &Work<'_>,
) -> Result<Vec<f64>, Cancelled> {
    predict_with(None, model, values, x0, run, work)
}

/// As [`predict`], with the positions as measured where they are given.
pub(crate) fn predict_with(
    positions: Option<&Positions>,
    model: &Model,
    values: &[f64],
    x0: &[f64],
    run: &Run,
    work: &Work<'_>,
) -> Result<Vec<f64>, Cancelled> {
    work.count_plain(run.len());
    let n = model.measured.len();
    let mut predicted = Vec::with_capacity(run.len() * n);
    let mut simulator = Simulator::new(model, values).without_trail();
    run_with(positions, &mut simulator, x0, run, n, |_, outputs| {
        predicted.extend_from_slice(outputs);
        work.go_on()
    })?;
    Ok(predicted)
}

/// Root mean squares of the plant's signals over the free runs.
pub(crate) fn signal_rms(
    model: &Model,
    values: &[f64],
    states: &[DVector<f64>],
    runs: &[Run],
    work: &Work<'_>,
) -> Result<Vec<f64>, Cancelled> {
    let mut squares = vec![0.0; model.n_signals()];
    let mut n = 0.0f64;
    let mut simulator = Simulator::new(model, values);
    for (run, x0) in runs.iter().zip(states) {
        try_follow(&mut simulator, x0.as_slice(), run, |_, _, now| {
            for (sum, value) in squares.iter_mut().zip(now.signals()) {
                *sum += value * value;
            }
            n += 1.0;
            work.go_on()
        })?;
    }
    Ok(squares.iter().map(|s| (s / n.max(1.0)).sqrt()).collect())
}

/// The values that a fit finds, with which a model is simulated over some runs.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Solution {
    /// Parameter values of the model.
    pub(crate) values: Vec<f64>,
    /// Initial states by run, behind them its parameters of its own ([`Model::per_run`]).
    pub(crate) states: Vec<DVector<f64>>,
}

/// Most Gauss–Newton steps where parameters are estimated with the initial states of a run.
const ITERATIONS_OWN: usize = 12;

/// Estimated initial plant states, one per run.
pub(crate) struct InitialStates {
    pub(crate) states: Vec<DVector<f64>>,
}

impl InitialStates {
    /// From the first sample of each run alone. What differs from run to run is as in `values`.
    pub(crate) fn guess(model: &Model, values: &[f64], runs: &[Run]) -> Self {
        let states = runs
            .iter()
            .map(|run| {
                let mut start = if run.is_empty() {
                    vec![0.0; model.n_states()]
                } else {
                    model.state_from(values, run.sample(0))
                };
                start.extend(model.per_run().map(|i| values[i]));
                DVector::from_vec(start)
            })
            .collect();
        Self { states }
    }

    /// Those that make the free-run error least, by Gauss–Newton from [`InitialStates::guess`].
    ///
    /// Only the beginning of a run tells anything about its initial state, and of a long one only that is looked at.
    /// (Where errors of the state last, an observer forgets them.) Where the plant is linear, two steps
    /// are exact to rounding. A step is taken only if it lowers the error.
    pub(crate) fn estimate(
        model: &Model,
        values: &[f64],
        runs: &[Run],
        work: &Work<'_>,
    ) -> Result<Self, Cancelled> {
        let guessed = Self::guess(model, values, runs).states;
        let visible = estimated_states(model, values, runs);
        let states = for_each_run(runs, &guessed, |run, x0| {
            let beginning = match run.len() {
                0..2 => return Ok(DVector::from_column_slice(x0)),
                2..=ENOUGH => Cow::Borrowed(run),
                _ => Cow::Owned(run.part(0..ENOUGH)),
            };
            Self::of_run(model, values, &beginning, x0, &visible, work)
        })?;
        Ok(Self { states })
    }

    /// That of one run, from `x0`.
    fn of_run(
        model: &Model,
        values: &[f64],
        run: &Run,
        x0: &[f64],
        visible: &[usize],
        work: &Work<'_>,
    ) -> Result<DVector<f64>, Cancelled> {
        let own: Vec<usize> = model.per_run().collect();
        let iterations = if own.is_empty() { 3 } else { ITERATIONS_OWN };
        let cost = |x: &DVector<f64>| {
            predict(model, values, x.as_slice(), run, work).map(|p| squares(&p, run))
        };
        let by = By {
            parameters: &[],
            states: visible,
        };
        let mut found = DVector::from_column_slice(x0);
        let mut best = cost(&found)?;
        for _ in 0..iterations {
            let s = sensitivities(None, model, values, found.as_slice(), run, by, work)?;
            let residual = residuals(&s.predicted, run);
            let Some(step) = least_squares(&s.jacobian, &residual) else {
                break;
            };
            let mut candidate = found.clone();
            for (k, state) in visible.iter().enumerate() {
                candidate[*state] += step[k];
            }
            for (value, i) in candidate.iter_mut().skip(model.n_states()).zip(&own) {
                *value = model.parameters[*i].declaration.nearest(*value);
            }
            let after = cost(&candidate)?;
            if after >= best || after.is_nan() {
                break;
            }
            let done = best - after <= 1e-12 * best;
            best = after;
            found = candidate;
            if done {
                break;
            }
        }
        Ok(found)
    }
}

/// `y - ŷ`, zero where the measurement is missing.
pub(crate) fn residuals(predicted: &[f64], run: &Run) -> DVector<f64> {
    DVector::from_iterator(
        predicted.len(),
        run.measured()
            .iter()
            .zip(predicted)
            .map(|(y, p)| if y.is_finite() { y - p } else { 0.0 }),
    )
}

fn squares(predicted: &[f64], run: &Run) -> f64 {
    residuals(predicted, run).norm_squared()
}

pub(crate) fn least_squares(
    jacobian: &DMatrix<f64>,
    residual: &DVector<f64>,
) -> Option<DVector<f64>> {
    let gram = jacobian.tr_mul(jacobian);
    Some(pseudo_inverse(&gram)? * jacobian.tr_mul(residual))
}

/// Predicts each sample from the one before: the plant state of the free run is corrected by the measurement,
/// then simulated for one sampling interval.
///
/// The correction is `x + H⁺ (y - ŷ)` with `H` the sensitivity of the measured signals to the state. For a
/// sensor that reads the state itself, the corrected state is the measurement. Effects keep their states and
/// memories.
pub(crate) fn one_step(
    model: &Model,
    values: &[f64],
    run: &Run,
    x0: &[f64],
    work: &Work<'_>,
    mut each: impl FnMut(usize, &[f64]),
) -> Result<(), Cancelled> {
    if run.len() < 2 {
        return Ok(());
    }
    let (of_run, state) = model.begun(values, x0);
    let (jacobian, _) = model.measurement_jacobian(&of_run, state);
    let Some(inverse) = pseudo_inverse(&jacobian) else {
        return Ok(());
    };
    let mut free = Simulator::new(model, values);
    let mut outputs = vec![0.0; model.measured.len()];
    let mut before = outputs.clone();
    let mut innovation = DVector::zeros(model.measured.len());
    free.reset(x0, run.input(0));
    let mut next = free.clone();
    for k in 1..run.len() {
        work.go_on()?;
        free.measure(&mut before);
        for (i, (y, p)) in run.sample(k - 1).iter().zip(&before).enumerate() {
            innovation[i] = if y.is_finite() { y - p } else { 0.0 };
        }
        next.clone_from(&free);
        let correction = &inverse * &innovation;
        for (x, c) in next.state_mut().iter_mut().zip(correction.iter()) {
            *x += c;
        }
        next.advance_to(run, k);
        next.measure(&mut outputs);
        each(k, &outputs);
        if let Some(observer) = run.observer() {
            free.correct(observer, k - 1, run.sample(k - 1), &before);
        }
        free.advance_to(run, k);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use loopsight_model::registry::HostReal;
    use loopsight_model::run::Rows;
    use loopsight_model::{DualOf, NARROW_WIDTH};
    use loopsight_plants as _;

    use super::*;

    /// What a simulation of everything predicts, its place included.
    fn with_all<S: HostReal>(model: &Model, run: &Run) -> Vec<f64> {
        let values: Vec<S> = model.values().into_iter().map(S::of).collect();
        let x0 = vec![S::zero(); model.n_states()];
        let mut all = Vec::new();
        let mut simulator = Simulator::new(model, &values);
        let followed: Result<(), Cancelled> =
            try_follow(&mut simulator, &x0, run, |k, outputs, now| {
                all.extend(outputs.iter().map(|y| y.value()));
                let place = &now.signals()[4..6];
                assert!(k == 0 || place.iter().any(|p| p.value() != 0.0));
                Ok(())
            });
        followed.unwrap();
        all
    }

    /// A robot in the plane: the signals that nobody looks at, and its place, are left out of a prediction.
    #[test]
    fn what_nobody_reads_changes_no_digit() {
        let text = "[plant.ddmr]\nK_A = -15.1\nK_B = 0.005\nK_C = 0.136\nK_D = -9.57\nK_E = -3.9\nK_F = 0.656\n\
                    half_track = 0.131\nwheel_radius = 0.05\n[log.measured.linear_velocity]\n\
                    [log.measured.angular_velocity]\n[[effect]]\n[effect.coulomb_friction]\n\
                    at = [\"wheel.right\"]\nlevel = 0.8\nwidth = 0.5\n[[effect]]\n[effect.input_delay]\n\
                    at = [\"input.right\"]\ndelay = 0.013\n";
        let (model, _) = Model::from_toml("robot.toml", text).unwrap();
        let time: Vec<f64> = (0..300).map(|k| 0.01 * f64::from(k)).collect();
        let volts = |t: &f64| [9.0 * (10.0 * t).sin(), 6.0 * (7.0 * t).cos()];
        let inputs = Rows::new(2, time.iter().flat_map(volts).collect());
        let measured = Rows::new(2, vec![0.0; 600]);
        let run = Run::new("", time, inputs, measured).unwrap();
        let (values, x0) = (model.values(), vec![0.0; model.n_states()]);
        let work = Work::quiet();
        let predicted = predict(&model, &values, &x0, &run, &work).unwrap();
        assert_eq!(predicted, with_all::<f64>(&model, &run));
        let by = By {
            parameters: &[0],
            states: &[0],
        };
        let found = sensitivities(None, &model, &values, &x0, &run, by, &work).unwrap();
        assert_eq!(
            found.predicted,
            with_all::<DualOf<NARROW_WIDTH>>(&model, &run)
        );
    }
}
