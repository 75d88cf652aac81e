//! Identification while the loop runs.

mod settings;

use nalgebra::{DVector, Dyn};

use crate::model::Model;
use crate::registry::{BuildError, EstimatorPart};
use crate::regression::{Regression, RegressionError, Scheme};
use loopsight_core::learning::{Guarded, Lesson, Range, Withheld};
use loopsight_core::{AffineModel, Estimator, Innovation, Observation, Observer};
pub use settings::LearningSettings;

/// One recursive estimator per controlled state, fed with the regressions of the model and guarded
/// (see [`Guarded`]).
///
/// It watches a loop as its [`Observer`]; nothing is allocated in
/// [`observe`](Observer::observe).
pub struct Identification {
    settings: LearningSettings,
    regression: Regression,
    rows: Vec<Row>,
    /// Present values of all parameters of the model.
    values: Vec<f64>,
    /// Indices of those that are learned, without repetition.
    learned: Vec<usize>,
    /// As long as the longest regressor: where an estimator starts over.
    start: Vec<f64>,
}

struct Row {
    estimator: Guarded<f64, Box<dyn Estimator<f64>>, Dyn>,
    lesson: Lesson<f64>,
}

/// Why identification cannot be set up.
#[derive(Debug, thiserror::Error)]
pub enum IdentificationError {
    /// The model offers no regression.
    #[error(transparent)]
    Regression(#[from] RegressionError),
    /// The estimator's table is wrong.
    #[error(transparent)]
    Build(#[from] BuildError),
    /// A setting of `[learning]` is wrong; the key is a path within that table.
    #[error(transparent)]
    Learning(BuildError),
}

impl Identification {
    /// Estimators built from `part` for the free parameters of `model`, starting from the model's
    /// values (0 where there is none), for a loop with `period` (s).
    ///
    /// # Errors
    ///
    /// [`IdentificationError`] where the model has no regression, or a setting is wrong.
    pub fn new(
        model: &Model,
        scheme: Scheme,
        part: &dyn EstimatorPart,
        settings: &LearningSettings,
        period: f64,
    ) -> Result<Self, IdentificationError> {
        let regression = Regression::with_effects(model, scheme, period)?;
        settings
            .check(model)
            .map_err(IdentificationError::Learning)?;
        let values: Vec<f64> = model
            .parameters
            .iter()
            .map(|p| p.value.unwrap_or(0.0))
            .collect();
        let mut rows = Vec::new();
        let mut learned = Vec::new();
        for row in 0..regression.len() {
            let parameters = regression.parameters(row);
            let ranges: Vec<Range<f64>> = parameters
                .iter()
                .map(|j| settings.range(model, *j))
                .collect::<Result<_, _>>()
                .map_err(IdentificationError::Learning)?;
            let start = parameters.iter().zip(&ranges);
            let start = DVector::from_iterator(
                parameters.len(),
                start.map(|(j, range)| values[*j].clamp(range.low, range.high)),
            );
            let estimator = part.build(start.as_slice())?;
            let guards = settings.guards(model, row, period);
            let guarded = Guarded::new(estimator, start, &ranges, guards).ok_or_else(|| {
                let message = "an estimator has another number of parameters than was asked for";
                BuildError::at("", message)
            })?;
            rows.push(Row {
                estimator: guarded,
                lesson: Lesson::none(Withheld::NoRegressor),
            });
            learned.extend_from_slice(parameters);
        }
        learned.sort_unstable();
        learned.dedup();
        let mut identification = Self {
            settings: settings.clone(),
            regression,
            rows,
            start: vec![0.0; values.len()],
            values,
            learned,
        };
        identification.gather();
        Ok(identification)
    }

    /// Number of regressions, each with its estimator.
    pub fn len(&self) -> usize {
        self.rows.len()
    }

    /// True without any regression.
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// Indices (into the model's parameters) of what the `row`-th estimator estimates.
    pub fn parameters(&self, row: usize) -> &[usize] {
        self.regression.parameters(row)
    }

    /// The `row`-th estimator: estimates, deviations, excitation.
    pub fn estimator(&self, row: usize) -> &Guarded<f64, Box<dyn Estimator<f64>>, Dyn> {
        &self.rows[row].estimator
    }

    /// What the last tick taught the `row`-th estimator, or why nothing.
    pub fn lesson(&self, row: usize) -> Lesson<f64> {
        self.rows[row].lesson
    }

    /// Sentences for reports: which parameters that a fit would estimate in `model` are not learned here, and why;
    /// which effects are left out.
    pub fn notes(&self, model: &Model) -> Vec<String> {
        let free = model.parameters.iter().enumerate().filter(|(_, p)| p.free);
        free.filter(|(j, _)| !self.learned.contains(j))
            .map(|(_, parameter)| {
                let why = if parameter.declaration.linear {
                    "it does not show in the rates of the controlled signals"
                } else {
                    "it enters non-linearly"
                };
                format!("not learned: {}, because {why}", parameter.name)
            })
            .chain(Regression::left_out(model).into_iter().map(|id| {
                format!(
                    "learned as if there were no {id}: it acts on a sensor, or has a state that \
                     nothing measures"
                )
            }))
            .collect()
    }

    /// Present values of all parameters of the model: the learned ones as they are estimated, the
    /// others as they were.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// Indices of the parameters that are learned.
    pub fn learned(&self) -> &[usize] {
        &self.learned
    }

    /// Combines the estimates. A parameter that several rows estimate gets their mean, weighted with the inverse
    /// variances, or unweighted where a row has no variance.
    fn gather(&mut self) {
        for &j in &self.learned {
            let (mut mean, mut weights) = (0.0, 0.0);
            for (row, of) in self.rows.iter().enumerate() {
                let parameters = self.regression.parameters(row);
                if let Some(k) = parameters.iter().position(|p| *p == j) {
                    let deviation = of.estimator.deviation(k);
                    let weight = (deviation * deviation).recip();
                    let weight = if weight.is_normal() { weight } else { 1e-12 };
                    weights += weight;
                    // The estimate of a single row stays exactly as it is.
                    mean += weight / weights * (of.estimator.theta()[k] - mean);
                }
            }
            self.values[j] = mean;
        }
        self.regression.set_values(&self.values);
    }
}

impl Observer<f64> for Identification {
    fn observe(&mut self, seen: &Observation<'_, f64>) {
        let withheld = Withheld::by(&seen.sample, seen.outcome, self.settings.while_saturated);
        if withheld == Some(Withheld::Stale) {
            // A late answer would teach the regression a wrong rate.
            self.regression.pass_over(seen.applied);
            for row in &mut self.rows {
                row.lesson = Lesson::none(Withheld::Stale);
            }
            return;
        }
        let time = seen.sample.time;
        let ready = self.regression.push(time, seen.measured, seen.applied);
        for (row, of) in self.rows.iter_mut().enumerate() {
            of.lesson = if ready {
                let (phi, y) = self.regression.row(row);
                of.estimator.update(phi, y, withheld)
            } else {
                Lesson::none(Withheld::NoRegressor)
            };
        }
        self.gather();
    }

    fn teach(&self, model: &mut dyn AffineModel<f64>) {
        if self.settings.certainty_equivalence {
            for j in &self.learned {
                model.learn(*j, self.values[*j]);
            }
        }
    }

    /// Also of a tick that taught nothing, as long as there was a prediction.
    fn innovation(&self, row: usize) -> Option<Innovation<f64>> {
        self.rows.get(row)?.lesson.innovation()
    }

    fn residual(&self, row: usize, values: &[f64]) -> Option<f64> {
        Observer::innovation(self, row)?;
        let (phi, y) = self.regression.row(row);
        let parameters = self.regression.parameters(row).iter().zip(phi);
        let explained = parameters.map(|(j, phi)| phi * values.get(*j).unwrap_or(&f64::NAN));
        Some(y - explained.sum::<f64>())
    }

    fn restart(&mut self, values: &[f64]) {
        for (row, of) in self.rows.iter_mut().enumerate() {
            let parameters = self.regression.parameters(row);
            for (to, j) in self.start.iter_mut().zip(parameters) {
                *to = values.get(*j).copied().unwrap_or(0.0);
            }
            of.estimator.reset(&self.start[..parameters.len()]);
        }
        self.gather();
    }
}
