//! The free run at the measured positions.

use loopsight_core::{EffectMeta, Role};
use loopsight_model::model::{Model, pseudo_inverse};
use loopsight_model::registry::HostReal;
use loopsight_model::run::Run;
use loopsight_model::simulate::{Simulator, try_follow};
use nalgebra::DMatrix;

/// Sets the integrals of the plant (angles, distances) to the measured ones, while the speeds run free.
///
/// ```text
/// q(k) += J (y(k) - ŷ(k))        J = H_q⁺ where q is measured, Δt H_v⁺ where its rate v is
/// ```
///
/// with `H` the sensitivity of the measured signals to the state.
///
/// With an effect that reads a position (cogging, a pendulum's weight, a spring) the error of the free run has
/// many minima: a model that is a little wrong has turned half a cog too far after some seconds, and each cog
/// gives a minimum. At the measured positions the effect is a known function of time, and the error has one
/// minimum. A fit of the free run starts from there.
///
/// This is an observer that corrects only the positions. For the idea: H. D. I. Abarbanel, D. R. Creveling,
/// R. Farsian, M. Kostuk, 2009, "Dynamical state and parameter estimation", SIAM J. Applied Dynamical Systems 8,
/// 1341–1381.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Positions {
    /// Corrections by state: its index, and one factor per measured signal.
    direct: Vec<(usize, Vec<f64>)>,
    /// The same, times the sampling interval.
    by_rate: Vec<(usize, Vec<f64>)>,
}

impl Positions {
    /// Whether an effect reads a position.
    pub(crate) fn matter_to(meta: &EffectMeta) -> bool {
        let position = |role: &Role| matches!(role, Role::Position | Role::Shaft | Role::Heading);
        meta.reads.iter().any(position)
    }

    /// The positions that follow from the measured signals of `model`. None where no position does, or where an
    /// effect has memory: its past would contain jumps.
    pub(crate) fn of(model: &Model, values: &[f64]) -> Option<Self> {
        if model.effects.iter().any(|e| e.meta.memory) {
            return None;
        }
        let (jacobian, _) = model.measurement_jacobian(values, &vec![0.0; model.n_states()]);
        let inverse: DMatrix<f64> = pseudo_inverse(&jacobian)?;
        let state = |id: &str| model.plant.states.iter().position(|s| s.id == id);
        let row = |i: usize| -> Option<Vec<f64>> {
            let row: Vec<f64> = inverse.row(i).iter().copied().collect();
            row.iter().any(|v| *v != 0.0).then_some(row)
        };
        let mut positions = Self {
            direct: Vec::new(),
            by_rate: Vec::new(),
        };
        for (rate, integral) in model.plant.integrals {
            let Some(integral) = state(integral) else {
                continue;
            };
            if let Some(row) = row(integral) {
                positions.direct.push((integral, row));
            } else if let Some(row) = state(rate).and_then(row) {
                positions.by_rate.push((integral, row));
            }
        }
        (!positions.direct.is_empty() || !positions.by_rate.is_empty()).then_some(positions)
    }

    /// The states whose values are the measured positions.
    pub(crate) fn states(&self) -> impl Iterator<Item = usize> + '_ {
        let of = |(state, _): &(usize, Vec<f64>)| *state;
        self.direct.iter().chain(&self.by_rate).map(of)
    }

    /// As [`try_follow`], the positions corrected after each sample; `corrected` gets the simulator then.
    pub(crate) fn run<S: HostReal, E>(
        &self,
        simulator: &mut Simulator<'_, S>,
        x0: &[S],
        run: &Run,
        n_measured: usize,
        mut each: impl FnMut(usize, &[S]) -> Result<(), E>,
        mut corrected: impl FnMut(&mut Simulator<'_, S>),
    ) -> Result<(), E> {
        if run.is_empty() {
            return Ok(());
        }
        let mut predicted = vec![S::zero(); n_measured];
        simulator.reset(x0, run.input(0));
        for k in 0..run.len() {
            let mut interval = 0.0;
            if k > 0 {
                interval = run.time()[k] - run.time()[k - 1];
                simulator.advance_to(run, k);
            }
            simulator.measure(&mut predicted);
            each(k, &predicted)?;
            let corrections = [(&self.direct, 1.0), (&self.by_rate, interval)];
            for (rows, factor) in corrections {
                for (state, row) in rows {
                    for ((y, p), gain) in run.sample(k).iter().zip(&predicted).zip(row) {
                        if y.is_finite() {
                            let step = (S::of(*y) - *p).times(S::of(gain * factor));
                            simulator.state_mut()[*state] += step;
                        }
                    }
                }
            }
            corrected(simulator);
        }
        Ok(())
    }
}

/// The free run, with the positions as measured where they are given; an error of `each` ends it.
pub(crate) fn run_with<S: HostReal, E>(
    positions: Option<&Positions>,
    simulator: &mut Simulator<'_, S>,
    x0: &[S],
    run: &Run,
    n_measured: usize,
    mut each: impl FnMut(usize, &[S]) -> Result<(), E>,
) -> Result<(), E> {
    match positions {
        // An observer corrects the positions as well.
        Some(positions) if run.observer().is_none() => {
            positions.run(simulator, x0, run, n_measured, each, |_| ())
        }
        _ => try_follow(simulator, x0, run, |k, outputs, _| each(k, outputs)),
    }
}
