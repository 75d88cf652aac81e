//! Least squares on the error of the free run.

use std::borrow::Cow;

use loopsight_model::model::Model;
use loopsight_model::run::Run;
use nalgebra::{DMatrix, DVector};

use crate::arrive::{Arrived, Convergence, Starts};
use crate::error::FitError;
use crate::fitted::Fit;
use crate::gram::gram;
use crate::narrow::narrowed;
use crate::noise;
use crate::observer::{Correction, attach_observer_for, growth};
use crate::prediction::InitialStates;
use crate::problem::Problem;
use crate::progress::{Cancelled, Work};
use crate::regression::batch;
use crate::settings::{FitSettings, Method};
use crate::solve::Effort;
use crate::telling::{Fitted, attach_telling};
use crate::unshown::tied;

/// Fits the free parameters and the initial states of all runs.
///
/// With `ŷ(θ, x₀)` the free run as the sensors would have read it, and each signal weighted by its
/// standard deviation,
///
/// ```text
/// θ, x₀ = argmin Σ_runs Σ_k Σ_i ((y_i(k) - ŷ_i(k))/std(y_i))²
/// ```
///
/// by Levenberg–Marquardt within the ranges of the declarations, with exact derivatives (dual
/// numbers through the integrator). Missing measurements count nothing. (L. Ljung, 1999, "System
/// Identification", 2nd edition, section 7.2 and chapter 10; output error is section 4.2.)
///
/// The residuals may turn out to be those of rounded counts: a moving average with `c` near -1 and nothing
/// slower, see [`noise::Arma`]. Then a second pass weights them accordingly. It is the maximum likelihood
/// estimate for `e(k) = ε(k) + c ε(k-1)`, with the value of `ε` before each run as one more unknown. Other
/// colours come from errors of the model, and are not weighted away.
pub(crate) fn fit(
    model: &Model,
    runs: &[Run],
    settings: &FitSettings,
    unaided: Unaided,
    work: &Work<'_>,
) -> Result<Fit, FitError> {
    let prepared = prepare(model, runs, settings, unaided, work)?;
    let mut problem = Problem::new(&prepared.model, &prepared.runs, work.clone())?;
    match in_two_passes(&mut problem, settings) {
        Err(FitError::Cancelled(cancelled)) => {
            let (error, best) = problem.best().ok_or(cancelled)?;
            let mut fitted = problem.model.clone();
            fitted.set_values(&best.values);
            let iterations = problem.evaluations.get();
            Ok(Fit::cancelled(
                fitted,
                Method::OutputError,
                error,
                iterations,
            ))
        }
        done => done,
    }
}

fn in_two_passes(problem: &mut Problem<'_>, settings: &FitSettings) -> Result<Fit, FitError> {
    let effort = Effort {
        iterations: settings.max_iterations,
        ..Effort::FULL
    };
    let Arrived {
        solution,
        settled,
        tried,
    } = problem.solve_in_two_passes(settings, Starts::All, effort)?;
    let mut fit = problem.result(&solution)?;
    let hopeless = problem.work.criteria().start.hopeless;
    let verdict = Convergence::of(fit.nrmse_fit, settled, tried, hopeless);
    fit.convergence = Some(verdict);
    Ok(fit)
}

/// The model with the values that a fit from its best start finds with some `effort`, and nothing said of how well they are
/// known.
///
/// # Errors
///
/// As [`fit`], and [`Cancelled`] wherever the work was.
pub(crate) fn fitted_values(
    model: &Model,
    runs: &[Run],
    unaided: Unaided,
    effort: Effort,
    work: &Work<'_>,
) -> Result<Model, FitError> {
    let settings = FitSettings::default();
    let prepared = prepare(model, runs, &settings, unaided, work)?;
    let mut problem = Problem::new(&prepared.model, &prepared.runs, work.clone())?;
    let arrived = problem.solve_in_two_passes(&settings, Starts::Best, effort)?;
    let mut fitted = problem.model.clone();
    fitted.set_values(&problem.values_at(&arrived.solution));
    Ok(fitted)
}

/// Whether a model that needs an observer with its first values is fitted to the free run, for values with which it needs none.
/// That takes much, and leads nowhere where a fit has already found that it needs one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Unaided {
    /// It is.
    Sought,
    /// A fit has found what it needs.
    Known,
}

impl Unaided {
    /// The same once a fit has found that an observer is needed, or not.
    pub(crate) fn after(self, observer: Option<&Correction>) -> Self {
        observer.map_or(self, |_| Self::Known)
    }
}

/// A model and recordings, ready for a fit.
pub(crate) struct Prepared<'a> {
    pub(crate) model: Cow<'a, Model>,
    /// The same with the values of the file, also where `model` has fitted ones.
    unfitted: Cow<'a, Model>,
    pub(crate) runs: Cow<'a, [Run]>,
}

impl Prepared<'_> {
    /// The model as it was given; where values are missing there, with those that it was fitted to first.
    pub(crate) fn given(&self) -> &Model {
        if self.unfitted.missing_values().is_empty() {
            &self.unfitted
        } else {
            &self.model
        }
    }
}

/// Horizons of the rounds of a fit with an observer, as shares of the last one. Each round designs the observer
/// for the present parameters, and fits the parameters with it. Horizons begin short, because with wrong
/// parameters a long free run leads nowhere.
const ROUNDS: [f64; 4] = [0.25, 0.5, 1.0, 1.0];
/// Effort of the fit of one round.
const ROUND: Effort = Effort {
    iterations: 16,
    tolerance: 1e-6,
    worth: None,
};

/// `model` and `runs` unchanged where the model can be simulated from the inputs alone, but for signs that suit the runs where
/// the file leaves their widths open.
///
/// Where it cannot, the runs get an observer, and the model gets the fitted values that the observer was made for.
/// An observer that suits the model makes the errors white. Inputs from a feedback loop bias the parameters
/// unless the errors are white (L. Ljung, 1999, "System Identification", 2nd edition, section 13.4).
pub(crate) fn prepare<'a>(
    model: &'a Model,
    runs: &'a [Run],
    settings: &FitSettings,
    unaided: Unaided,
    work: &Work<'_>,
) -> Result<Prepared<'a>, FitError> {
    let mut model = tied(model, runs, &work.criteria().log);
    if let Some(narrower) = narrowed(&model, runs, unaided, work)? {
        model = Cow::Owned(narrower);
    }
    let mut prepared = Prepared {
        runs: Cow::Borrowed(runs),
        model: model.clone(),
        unfitted: model.clone(),
    };
    let model = &*model;
    let Some(mut values) = first_values(model, runs, settings, work)? else {
        return Ok(prepared);
    };
    let Some(mut growth) = growth(model, &values, runs, work)? else {
        return Ok(prepared);
    };
    let mut present = model.clone();
    if unaided == Unaided::Sought
        && let Some(values) = free_values(model, runs, settings, work)?
    {
        present.set_values(&values);
        prepared.model = Cow::Owned(present);
        return Ok(prepared);
    }
    let first = Fitted {
        effort: ROUND,
        values: values.clone(),
        growth: growth.clone(),
    };
    for share in ROUNDS {
        let mut shortened = growth.clone();
        shortened.horizon *= share;
        prepared.runs = attach_observer_for(model, &values, runs, &shortened, work)?;
        present.set_values(&values);
        let mut problem = Problem::new(&present, &prepared.runs, work.silently())?;
        let states = InitialStates::guess(&present, &values, &prepared.runs).states;
        values = problem.solve_from(&values, &states, ROUND)?.values;
        // The observer stays, even if errors no longer grow with it: without it they would again.
        growth = self::growth(model, &values, runs, work)?.unwrap_or(growth);
    }
    (prepared.runs, values) = attach_telling(&present, values, runs, &growth, Some(&first), work)?;
    present.set_values(&values);
    prepared.model = Cow::Owned(present);
    Ok(prepared)
}

/// Values with which the model needs no observer, although it needs one with its first values: an arm on a spring
/// of stiffness 0 falls, but with some stiffness it swings back. They come from a fit to the free run, if that
/// leaves an error well below that of a constant.
fn free_values(
    model: &Model,
    runs: &[Run],
    settings: &FitSettings,
    work: &Work<'_>,
) -> Result<Option<Vec<f64>>, Cancelled> {
    let arrived = || -> Result<(f64, Vec<f64>), FitError> {
        let mut problem = Problem::new(model, runs, work.silently())?;
        let arrived = problem.arrive(settings, Starts::All, ROUND)?;
        let error = problem.residual_vector(&arrived.solution)?.norm();
        Ok((error, problem.solution(&arrived.solution).values))
    };
    let (error, values) = match arrived() {
        Ok(found) => found,
        Err(FitError::Cancelled(cancelled)) => return Err(cancelled),
        Err(_) => return Ok(None),
    };
    let stands =
        error < work.criteria().start.stands && growth(model, &values, runs, work)?.is_none();
    Ok(stands.then_some(values))
}

/// The file's values, or those of a regression where it gives none. Where the plant offers no regression, the
/// typical sizes that the declarations give.
fn first_values(
    model: &Model,
    runs: &[Run],
    settings: &FitSettings,
    work: &Work<'_>,
) -> Result<Option<Vec<f64>>, Cancelled> {
    if model.missing_values().is_empty() {
        return Ok(Some(model.values()));
    }
    match batch(model, runs, settings.scheme, 0.0, work) {
        Ok(values) => Ok(Some(values)),
        Err(FitError::Cancelled(cancelled)) => Err(cancelled),
        Err(FitError::NoRegression(_)) => Ok(Some(model.declared_values())),
        Err(_) => Ok(None),
    }
}

/// Norms of the rows, and the one in the middle of those that are not zero.
fn row_norms(jacobian: &DMatrix<f64>) -> (Vec<f64>, f64) {
    let norms: Vec<f64> = jacobian.row_iter().map(|row| row.norm()).collect();
    let mut some: Vec<f64> = norms.iter().copied().filter(|n| *n > 0.0).collect();
    if some.is_empty() {
        return (norms, 0.0);
    }
    let middle = some.len() / 2;
    let median = *some.select_nth_unstable_by(middle, f64::total_cmp).1;
    (norms, median)
}

/// Limits steep rows of a Jacobian. A shaft that is about to break loose acts like a switch: at that instant the
/// free run is extremely sensitive to all parameters alike. One such row would dominate all others.
fn limit_rows(jacobian: &mut DMatrix<f64>, steep: f64) {
    let (norms, median) = row_norms(jacobian);
    let limit = steep * median;
    for (mut row, norm) in jacobian.row_iter_mut().zip(norms) {
        if norm > limit {
            row *= limit / norm;
        }
    }
}

impl Problem<'_> {
    /// Solves from several starts, and once more where the residuals call for other weights.
    fn solve_in_two_passes(
        &mut self,
        settings: &FitSettings,
        starting: Starts,
        effort: Effort,
    ) -> Result<Arrived, FitError> {
        let mut arrived = self.arrive(settings, starting, effort)?;
        let start = if let Some(start) = self.whiten(&arrived.solution)? {
            self.balance(start)?
        } else if self.reweigh_starts(&arrived.solution)? {
            arrived.solution
        } else {
            return Ok(arrived);
        };
        (arrived.solution, arrived.settled) = self.solve_and_tell(&start, effort)?;
        Ok(arrived)
    }

    /// The steepest row of the Jacobian over the one in the middle.
    pub(crate) fn steepness(&self, at: &DVector<f64>) -> Result<f64, Cancelled> {
        let (mut norms, median) = row_norms(&self.linearise(at)?.jacobian);
        // First samples have a larger weight, but are not steeper.
        for row in self.first_rows() {
            norms[row] = 0.0;
        }
        Ok(norms.into_iter().fold(0.0, f64::max) / median)
    }

    /// The fit that a solution gives: estimates, intervals, errors.
    pub(crate) fn result(&self, solution: &DVector<f64>) -> Result<Fit, Cancelled> {
        let linear = self.linearise(solution)?;
        let (residual, mut jacobian) = (&linear.residual, linear.jacobian.clone());
        limit_rows(&mut jacobian, self.work.criteria().parameters.steep);
        let (flatness, inverse) = self.flat(&gram(&jacobian));
        let blocks = self.blocks(residual, &jacobian);
        let (signals, unknowns) = (self.model.measured.len(), jacobian.ncols());
        let noise = noise::models(&blocks, signals, &self.work)?;
        let mut covariance = noise::covariance(&blocks, &noise, &inverse, unknowns, &self.work)?;
        for omission in self.omissions(solution)? {
            if let Some(omitted) =
                self.omitted(&omission, (residual, &noise), &jacobian, &inverse)?
            {
                omitted.widen(&mut covariance);
            }
        }
        Ok(self.fit_of(solution, &covariance, flatness))
    }
}
