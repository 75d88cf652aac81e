//! Simulation of a model over a recorded run.

use std::convert::Infallible;

use crate::registry::HostReal;
use crate::run::Run;

use super::Simulator;

/// The model simulated over a run from the inputs alone, from the plant state `x0`; corrected by the
/// measurements where the run has an [observer](Run::observer).
///
/// `each` gets the index of the sample and what the sensors would have read. The first sample is
/// the initial state itself.
pub fn free_run<S: HostReal>(
    simulator: &mut Simulator<'_, S>,
    x0: &[S],
    run: &Run,
    mut each: impl FnMut(usize, &[S]),
) {
    follow(simulator, x0, run, |k, predicted, _| each(k, predicted));
}

/// As [`free_run`]; `each` gets the simulator as well, as it is at the sample.
pub fn follow<'m, S: HostReal>(
    simulator: &mut Simulator<'m, S>,
    x0: &[S],
    run: &Run,
    mut each: impl FnMut(usize, &[S], &mut Simulator<'m, S>),
) {
    let _: Result<(), Infallible> = try_follow(simulator, x0, run, |k, predicted, now| {
        each(k, predicted, now);
        Ok(())
    });
}

/// As [`follow`]; an error that `each` returns ends the simulation.
///
/// # Errors
///
/// That of `each`.
pub fn try_follow<'m, S: HostReal, E>(
    simulator: &mut Simulator<'m, S>,
    x0: &[S],
    run: &Run,
    mut each: impl FnMut(usize, &[S], &mut Simulator<'m, S>) -> Result<(), E>,
) -> Result<(), E> {
    if run.is_empty() {
        return Ok(());
    }
    let mut predicted = vec![S::zero(); simulator.model.measured.len()];
    simulator.reset(x0, run.input(0));
    for k in 0..run.len() {
        if k > 0 {
            simulator.advance_to(run, k);
        }
        simulator.measure(&mut predicted);
        each(k, &predicted, simulator)?;
        if let Some(observer) = run.observer() {
            simulator.correct(observer, k, run.sample(k), &predicted);
        }
    }
    Ok(())
}
