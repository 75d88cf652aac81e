//! Identification while the loop runs.

use serde::{Deserialize, Serialize};

use crate::model::Model;
use crate::registry::{BuildError, EstimatorPart};
use crate::regression::{Regression, RegressionError, Scheme};
use crate::{AffineModel, Estimator, Innovation, Observation, Observer};

/// `[learning]` of a loop file: what is done with an estimator, whichever it is.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LearningSettings {
    /// The controller uses the estimates as if they were true. Otherwise it keeps the model of the
    /// model file, and the estimates are only watched.
    pub certainty_equivalence: bool,
}

/// One recursive estimator per controlled state, fed with the regressions of the model.
///
/// It watches a loop as its [`Observer`]; nothing is allocated in
/// [`observe`](Observer::observe).
pub struct Identification {
    settings: LearningSettings,
    regression: Regression,
    estimators: Vec<Box<dyn Estimator<f64>>>,
    innovations: Vec<Option<Innovation<f64>>>,
    /// As long as the longest regressor: where an estimator starts over.
    start: Vec<f64>,
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
}

impl Identification {
    /// Estimators built from `part` for the free parameters of `model`, starting from the model's
    /// values (0 where there is none).
    pub fn new(
        model: &Model,
        scheme: Scheme,
        part: &dyn EstimatorPart,
        settings: &LearningSettings,
    ) -> Result<Self, IdentificationError> {
        let regression = Regression::new(model, scheme)?;
        let mut estimators = Vec::new();
        for row in 0..regression.len() {
            let start: Vec<f64> = regression
                .parameters(row)
                .iter()
                .map(|j| model.parameters[*j].value.unwrap_or(0.0))
                .collect();
            estimators.push(part.build(&start)?);
        }
        let innovations = vec![None; estimators.len()];
        let lengths = (0..regression.len()).map(|row| regression.parameters(row).len());
        let longest = lengths.max().unwrap_or(0);
        Ok(Self {
            settings: settings.clone(),
            start: vec![0.0; longest],
            regression,
            estimators,
            innovations,
        })
    }

    /// Number of regressions, each with its estimator.
    pub fn len(&self) -> usize {
        self.estimators.len()
    }

    /// True without any regression.
    pub fn is_empty(&self) -> bool {
        self.estimators.is_empty()
    }

    /// Indices (into the model's parameters) of what the `row`-th estimator estimates.
    pub fn parameters(&self, row: usize) -> &[usize] {
        self.regression.parameters(row)
    }

    /// The `row`-th estimator.
    pub fn estimator(&self, row: usize) -> &dyn Estimator<f64> {
        self.estimators[row].as_ref()
    }

    /// What the last tick taught the `row`-th estimator; `None` when there was nothing to learn.
    pub fn innovation(&self, row: usize) -> Option<Innovation<f64>> {
        self.innovations[row]
    }
}

impl Observer<f64> for Identification {
    fn observe(&mut self, seen: &Observation<'_, f64>) {
        self.innovations.fill(None);
        if !seen.sample.fresh {
            // A late answer would teach the regression a wrong rate.
            self.regression.restart();
            return;
        }
        let time = seen.sample.time;
        if self.regression.push(time, seen.measured, seen.applied) {
            for (row, estimator) in self.estimators.iter_mut().enumerate() {
                let (phi, y) = self.regression.row(row);
                self.innovations[row] = Some(estimator.update(phi, y));
            }
        }
    }

    fn teach(&self, model: &mut dyn AffineModel<f64>) {
        if !self.settings.certainty_equivalence {
            return;
        }
        for (row, estimator) in self.estimators.iter().enumerate() {
            let parameters = self.regression.parameters(row);
            for (parameter, value) in parameters.iter().zip(estimator.theta()) {
                model.learn(*parameter, *value);
            }
        }
    }

    fn innovation(&self, row: usize) -> Option<Innovation<f64>> {
        *self.innovations.get(row)?
    }

    fn residual(&self, row: usize, values: &[f64]) -> Option<f64> {
        self.innovation(row)?;
        let (phi, y) = self.regression.row(row);
        let parameters = self.regression.parameters(row).iter().zip(phi);
        let explained = parameters.map(|(j, phi)| phi * values.get(*j).unwrap_or(&f64::NAN));
        Some(y - explained.sum::<f64>())
    }

    fn restart(&mut self, values: &[f64]) {
        for (row, estimator) in self.estimators.iter_mut().enumerate() {
            let parameters = self.regression.parameters(row);
            for (to, j) in self.start.iter_mut().zip(parameters) {
                *to = values.get(*j).copied().unwrap_or(0.0);
            }
            estimator.reset(&self.start[..parameters.len()]);
        }
    }
}
