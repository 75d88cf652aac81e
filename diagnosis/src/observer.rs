//! The observer of models that cannot be simulated from the inputs alone, and the test for them.

use std::borrow::Cow;

use loopsight_core::Real;
use loopsight_model::model::Model;
use loopsight_model::registry::HostReal;
use loopsight_model::run::{Rows, Run};
use loopsight_model::simulate::{Simulator, StateObserver};
use loopsight_model::{DUAL_WIDTH, DualOf, NARROW_WIDTH, TINY_WIDTH, derivative, variable_of};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use serde::Serialize;

use crate::floor;
use crate::growth::{Growth, Linearised, Path, unstable};
use crate::progress::{Cancelled, Work};
use crate::telling::attach_telling;

/// How an observer corrected a free run by the measurements, and why.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Correction {
    /// `unstable` or `integrating`.
    pub because: Because,
    /// Time constant with which the observer forgets old measurements, s.
    pub horizon_s: f64,
    /// In words.
    pub statement: String,
}

/// Why a model cannot be simulated from the inputs alone.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Because {
    /// Errors of the state grow exponentially.
    Unstable,
    /// Errors of the state add up over time.
    Integrating,
}

impl Correction {
    /// The correction of `runs`; `None` where they are simulated from the inputs alone.
    pub(crate) fn of(runs: &[Run]) -> Option<Self> {
        let observer = runs.iter().find_map(|run| run.observer())?;
        let horizon = observer.horizon;
        let (because, why) = match observer.doubling {
            Some(time) => (
                Because::Unstable,
                format!(
                    "is unstable (an error of its state doubles in {})",
                    seconds(time)
                ),
            ),
            None => (
                Because::Integrating,
                format!(
                    "integrates (it has drifted too far after {})",
                    seconds(horizon)
                ),
            ),
        };
        Some(Self {
            because,
            horizon_s: horizon,
            statement: format!(
                "the model {why}: an observer corrects its free run by the measurements, and forgets each within {}",
                seconds(horizon)
            ),
        })
    }
}

/// Two significant digits.
fn seconds(value: f64) -> String {
    let decimals = (1.0 - value.abs().log10().floor()).clamp(0.0, 4.0) as usize;
    format!("{value:.decimals$} s")
}

/// Samples of one run over which the growth of errors is followed.
const LOOKED_AT: usize = 20_000;
/// Shortest horizon, and that of the first look, in sampling periods.
pub(crate) const SHORTEST: f64 = 10.0;
const FIRST: f64 = 20.0;
/// Noise is taken to be at least this share of a signal's standard deviation.
const LEAST_NOISE: f64 = 1e-4;
/// Largest uncertainty of a state that is not observed, in its standard deviations.
const FURTHEST: f64 = 1e3;

/// `runs`, each with an observer where `model` needs one; unchanged where it does not.
pub(crate) fn attach_observer<'r>(
    model: &Model,
    values: &[f64],
    runs: &'r [Run],
    work: &Work<'_>,
) -> Result<Cow<'r, [Run]>, Cancelled> {
    match growth(model, values, runs, work)? {
        Some(growth) => {
            let values = values.to_vec();
            Ok(attach_telling(model, values, runs, &growth, None, work)?.0)
        }
        None => Ok(Cow::Borrowed(runs)),
    }
}

/// How errors of the state grow; `None` where they do not.
pub(crate) fn growth(
    model: &Model,
    values: &[f64],
    runs: &[Run],
    work: &Work<'_>,
) -> Result<Option<Growth>, Cancelled> {
    if runs.iter().any(|r| r.observer().is_some()) || values.iter().any(|v| !v.is_finite()) {
        return Ok(None);
    }
    let design = Design::new(model, values, runs, work);
    let paths = design.paths(runs, work)?;
    Ok(Growth::of(
        &paths,
        &design.deviation,
        &work.criteria().free_run,
    ))
}

/// Whether `model` leaves its rest without any input within the instants `time`.
pub(crate) fn unstable_at_rest(
    model: &Model,
    values: &[f64],
    time: &[f64],
    work: &Work<'_>,
) -> Result<bool, Cancelled> {
    let (n_inputs, n_measured) = (model.plant.inputs.len(), model.measured.len());
    let rows = |width: usize, value: f64| Rows::new(width, vec![value; width * time.len()]);
    let rest = Run::new(
        "",
        time.to_vec(),
        rows(n_inputs, 0.0),
        rows(n_measured, f64::NAN),
    );
    // Instants that do not increase are no experiment.
    let Ok(rest) = rest else {
        return Ok(false);
    };
    let rest = [rest];
    let design = Design::new(model, values, &rest, work);
    let (paths, criteria) = (design.paths(&rest, work)?, &work.criteria().free_run);
    Ok(paths.iter().any(|path| unstable(path, criteria)))
}

/// `runs` with the observer that suits `growth`.
pub(crate) fn attach_observer_for<'r>(
    model: &Model,
    values: &[f64],
    runs: &'r [Run],
    growth: &Growth,
    work: &Work<'_>,
) -> Result<Cow<'r, [Run]>, Cancelled> {
    let design = Design::new(model, values, runs, work);
    let mut observed = Vec::with_capacity(runs.len());
    for run in runs {
        match design.observed(run, growth, work)? {
            Some(run) => observed.push(run),
            None => return Ok(Cow::Borrowed(runs)),
        }
    }
    Ok(Cow::Owned(observed))
}

/// `others` with an observer of the same horizon and for the same `values` as that of `runs`.
pub(crate) fn attach_same_observer<'r>(
    model: &Model,
    others: &'r [Run],
    runs: &[Run],
    work: &Work<'_>,
) -> Result<Cow<'r, [Run]>, Cancelled> {
    let Some(observer) = runs.iter().find_map(|run| run.observer()) else {
        return Ok(Cow::Borrowed(others));
    };
    let growth = Growth {
        horizon: observer.horizon,
        doubling: observer.doubling,
        observed: observer.observed.clone(),
    };
    attach_observer_for(model, &observer.values, others, &growth, work)
}

/// What the gains of an observer are computed from.
struct Design<'a> {
    /// The model without the effects that have states or memory. Gains need not be exact, and they correct only
    /// the plant's state.
    model: Model,
    values: &'a [f64],
    /// By signal.
    deviation: Vec<f64>,
    noise: Vec<f64>,
}

impl<'a> Design<'a> {
    fn new(model: &Model, values: &'a [f64], runs: &[Run], work: &Work<'_>) -> Self {
        let criteria = &work.criteria().log;
        let mut model = model.clone();
        model.effects.retain(|e| !e.meta.is_dynamic());
        let mut deviation = Vec::new();
        let mut noise = Vec::new();
        for (signal, measured) in model.measured.iter().enumerate() {
            let (sensor, std) =
                floor::noise(&measured.sensor, signal, &floor::Part::all(runs), criteria);
            noise.push(sensor.max(LEAST_NOISE * std).max(f64::MIN_POSITIVE));
            deviation.push(std);
        }
        Self {
            model,
            values,
            deviation,
            noise,
        }
    }

    /// The linearisations along the first samples of each run, without those where they diverge.
    fn paths(&self, runs: &[Run], work: &Work<'_>) -> Result<Vec<Path>, Cancelled> {
        let certain = self.certain(1.0);
        let path = |run: &Run| {
            let n = run.len().min(LOOKED_AT);
            let fade = FIRST * run.median_period();
            let mut path = Path::new(&run.time()[..n]);
            let followed = self.filter(run, n, fade, &certain, work, |step| path.push(step))?;
            Ok(followed.map(|_| path))
        };
        let paths: Result<Vec<_>, _> = runs.par_iter().map(path).collect();
        Ok(paths?.into_iter().flatten().collect())
    }

    /// None where the filter diverges.
    fn observed(
        &self,
        run: &Run,
        growth: &Growth,
        work: &Work<'_>,
    ) -> Result<Option<Run>, Cancelled> {
        let horizon = growth.horizon.max(SHORTEST * run.median_period());
        let nx = self.model.n_states();
        let stride = nx * run.n_measured();
        let mut gains = vec![0.0; stride * run.len()];
        let uncertain = self.certain(1.0);
        let warm = run
            .time()
            .iter()
            .position(|t| t - run.time()[0] > 3.0 * horizon)
            .unwrap_or(run.len());
        // The initial state is estimated, so the gains begin at their steady values.
        let Some(uncertain) = self.filter(run, warm, horizon, &uncertain, work, |_| {})? else {
            return Ok(None);
        };
        let last = self.filter(run, run.len(), horizon, &uncertain, work, |step| {
            let rows = gains[step.k * stride..].chunks_exact_mut(run.n_measured());
            for (row, to) in rows.take(nx).enumerate() {
                for (column, gain) in to.iter_mut().enumerate() {
                    *gain = step.gain[(row, column)];
                }
            }
        })?;
        if last.is_none() {
            return Ok(None);
        }
        Ok(Some(run.clone().with_observer(StateObserver {
            gains,
            observed: growth.observed.clone(),
            horizon,
            doubling: growth.doubling,
            stride,
            values: self.values.to_vec(),
            slopes: self.slopes(),
        })))
    }

    /// Slopes of the sensors, by signal.
    fn slopes(&self) -> Vec<f64> {
        let simulator: Simulator<'_, f64> = Simulator::new(&self.model, self.values);
        (0..self.model.measured.len())
            .map(|signal| simulator.slope(signal))
            .collect()
    }

    /// Uncertainty of the state before anything is known: many deviations of what is measured.
    fn certain(&self, unknown: f64) -> DMatrix<f64> {
        let nx = self.model.n_states();
        DMatrix::from_diagonal(&DVector::from_fn(nx, |i, _| {
            let measured = self.model.measured_index(i);
            let scale = measured.map_or(unknown, |signal| self.deviation[signal]);
            let scale = if scale > 0.0 { scale } else { unknown };
            100.0 * scale * scale
        }))
    }

    /// An extended Kalman filter with fading memory and without process noise: a measurement made `t` ago has the
    /// weight `e^(-2t/fade)`. So no error lasts longer, and an unstable mode is stabilised. `A` is the derivative
    /// of the state by the state before. `C` is that of the measurement, which for a sensor of means depends on
    /// the whole interval.
    ///
    /// ```text
    /// P <- e^(2h/fade) P    S = C P Cᵀ + R    K = A P Cᵀ S⁻¹    P <- A P Aᵀ - K S Kᵀ
    /// ```
    ///
    /// (B. D. O. Anderson, 1971, "Stability properties of Kalman–Bucy filters", Journal of the
    /// Franklin Institute 291, 137–144; H. W. Sorenson, J. E. Sacks, 1971, "Recursive fading memory
    /// filtering", Information Sciences 3, 101–119.) Returns the last `P`; `None` where it diverges.
    fn filter(
        &self,
        run: &Run,
        samples: usize,
        fade: f64,
        uncertain: &DMatrix<f64>,
        work: &Work<'_>,
        each: impl FnMut(&Linearised<'_>),
    ) -> Result<Option<DMatrix<f64>>, Cancelled> {
        let nx = self.model.n_states();
        if nx <= TINY_WIDTH {
            self.filter_by::<TINY_WIDTH>(run, samples, fade, uncertain, work, each)
        } else if nx <= NARROW_WIDTH {
            self.filter_by::<NARROW_WIDTH>(run, samples, fade, uncertain, work, each)
        } else {
            self.filter_by::<DUAL_WIDTH>(run, samples, fade, uncertain, work, each)
        }
    }

    /// [`Design::filter`] with `N` derivatives at a time.
    fn filter_by<const N: usize>(
        &self,
        run: &Run,
        samples: usize,
        fade: f64,
        uncertain: &DMatrix<f64>,
        work: &Work<'_>,
        mut each: impl FnMut(&Linearised<'_>),
    ) -> Result<Option<DMatrix<f64>>, Cancelled>
    where
        DualOf<N>: HostReal,
    {
        let (nx, ny) = (self.model.n_states(), self.model.measured.len());
        let mut p = uncertain.clone();
        if run.len() < 2 {
            return Ok(Some(p));
        }
        let dual = |value: &f64| DualOf::<N>::of(*value);
        let values: Vec<DualOf<N>> = self.values.iter().map(dual).collect();
        // One simulator for every few states: a dual number has a fixed number of derivatives.
        let mut simulators: Vec<Simulator<'_, DualOf<N>>> = (0..nx)
            .step_by(N)
            .map(|_| Simulator::new(&self.model, &values))
            .collect();
        let mut x = self.model.state_from(self.values, run.sample(0));
        let start: Vec<DualOf<N>> = x.iter().map(dual).collect();
        for simulator in &mut simulators {
            simulator.reset(&start, run.input(0));
        }
        let mut predicted = vec![dual(&0.0); ny];
        let (mut a, mut c) = (DMatrix::zeros(nx, nx), DMatrix::zeros(ny, nx));
        let mut innovation = DVector::zeros(ny);
        // Their transposes, and what is between them and the gain.
        let (mut at, mut ct) = (DMatrix::zeros(nx, nx), DMatrix::zeros(nx, ny));
        let (mut pc, mut apc) = (DMatrix::zeros(nx, ny), DMatrix::zeros(nx, ny));
        let (mut s, mut gain) = (DMatrix::zeros(ny, ny), DMatrix::zeros(nx, ny));
        let (mut ks, mut kt) = (DMatrix::zeros(nx, ny), DMatrix::zeros(ny, nx));
        let (mut ap, mut transposed) = (DMatrix::zeros(nx, nx), DMatrix::zeros(nx, nx));
        let mut correction = DVector::zeros(nx);
        for k in 1..samples.min(run.len()) {
            work.go_on()?;
            for (block, simulator) in simulators.iter_mut().enumerate() {
                let first = block * N;
                for (i, state) in simulator.state_mut().iter_mut().enumerate() {
                    *state = variable_of(x[i], i.wrapping_sub(first));
                }
                simulator.advance_to(run, k);
                simulator.measure(&mut predicted);
                for column in first..(first + N).min(nx) {
                    for (row, state) in simulator.state().iter().enumerate() {
                        a[(row, column)] = derivative(state, column - first);
                    }
                    for (row, y) in predicted.iter().enumerate() {
                        c[(row, column)] = derivative(y, column - first) / self.noise[row];
                    }
                }
            }
            for (i, (y, p)) in run.sample(k).iter().zip(&predicted).enumerate() {
                innovation[i] = (y - p.value()) / self.noise[i];
                if !innovation[i].is_finite() {
                    innovation[i] = 0.0;
                    c.row_mut(i).fill(0.0);
                }
            }
            p *= (2.0 * (run.time()[k] - run.time()[k - 1]) / fade).exp();
            a.transpose_to(&mut at);
            c.transpose_to(&mut ct);
            p.mul_to(&ct, &mut pc);
            c.mul_to(&pc, &mut s);
            for i in 0..ny {
                s[(i, i)] += 1.0;
            }
            let Some(cholesky) = s.clone().cholesky() else {
                return Ok(None);
            };
            a.mul_to(&pc, &mut apc);
            apc.mul_to(&cholesky.inverse(), &mut gain);
            a.mul_to(&p, &mut ap);
            ap.mul_to(&at, &mut p);
            gain.mul_to(&s, &mut ks);
            gain.transpose_to(&mut kt);
            p.gemm(-1.0, &ks, &kt, 1.0);
            p.transpose_to(&mut transposed);
            p += &transposed;
            p *= 0.5;
            for i in 0..nx {
                let most = FURTHEST * FURTHEST * uncertain[(i, i)];
                if p[(i, i)] > most {
                    let less = (most / p[(i, i)]).sqrt();
                    p.row_mut(i).scale_mut(less);
                    p.column_mut(i).scale_mut(less);
                }
                p[(i, i)] = p[(i, i)].max(0.0);
            }
            gain.mul_to(&innovation, &mut correction);
            if let Some(state) = simulators.first().map(Simulator::state) {
                for (i, x) in x.iter_mut().enumerate() {
                    *x = state[i].value() + correction[i];
                }
            }
            if x.iter().any(|v| !v.is_finite()) {
                return Ok(None);
            }
            for (mut column, noise) in gain.column_iter_mut().zip(&self.noise) {
                column /= *noise;
            }
            for (mut row, noise) in c.row_iter_mut().zip(&self.noise) {
                row *= *noise;
            }
            each(&Linearised {
                k,
                x: &x,
                a: &a,
                c: &c,
                gain: &gain,
            });
        }
        Ok(Some(p))
    }
}

#[cfg(test)]
mod tests {
    use loopsight_model::simulate::free_run;
    use loopsight_plants as _;

    use super::*;
    use crate::swing::swing;

    /// Where a free run that starts off ends, with the sensor off by a factor, and the same factor in the recording.
    fn corrected(scale: f64) -> f64 {
        let text = "[plant.dc_axis]\nK_A = -0.001\nK_C = 8.0\n[log.measured.speed]\n";
        let plain = Model::from_toml("axis.toml", text).unwrap().0;
        let run = swing(&plain, 200);
        let growth = Growth {
            horizon: 0.3,
            doubling: None,
            observed: vec![0],
        };
        let quiet = Work::quiet();
        let runs = [run];
        let observed =
            attach_observer_for(&plain, &plain.values(), &runs, &growth, &quiet).unwrap();
        let observer = observed[0].observer().unwrap().clone();
        let read = runs[0].measured().iter().map(|y| scale * y).collect();
        let inputs = Rows::new(1, runs[0].inputs().to_vec());
        let off = Run::new("", runs[0].time().to_vec(), inputs, Rows::new(1, read)).unwrap();
        let off = off.with_observer(observer);
        let mut scaled = plain
            .with_effect("sensor_scale", &["sensor.speed"])
            .unwrap();
        scaled.parameters.last_mut().unwrap().value = Some(scale - 1.0);
        let mut simulator = Simulator::new(&scaled, &scaled.values());
        let mut last = 0.0;
        free_run(&mut simulator, &[5.0, 0.0], &off, |k, y| {
            if k == 20 {
                last = y[0] / scale - runs[0].measured()[k];
            }
        });
        last
    }

    #[test]
    fn a_sensor_that_reads_too_much_corrects_no_more() {
        let right = corrected(1.0);
        assert!(right.abs() > 0.1, "an error of 5 still is {right}");
        for scale in [0.5, 8.0, 1000.0] {
            let left = corrected(scale);
            assert!((left - right).abs() < 1e-9, "{left} for {right}");
        }
    }
}
