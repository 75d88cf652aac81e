//! Identification while the loop runs.

use crate::model::Model;
use crate::registry::{BuildError, EstimatorPart};
use crate::regression::{Regression, RegressionError, Scheme};
use crate::{Estimator, Innovation, Observer, Sample, Tick};

/// One recursive estimator per controlled state, fed with the regressions of the model.
///
/// It watches a loop as its [`Observer`]; nothing is allocated in
/// [`observe`](Observer::observe).
pub struct Identification {
    regression: Regression,
    estimators: Vec<Box<dyn Estimator<f64>>>,
    innovations: Vec<Option<Innovation<f64>>>,
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
        Ok(Self {
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
    fn observe(
        &mut self,
        _tick: &Tick<f64>,
        sample: &Sample<f64>,
        measured: &[f64],
        applied: &[f64],
    ) {
        self.innovations.fill(None);
        if !sample.fresh {
            // A late answer would teach the regression a wrong rate.
            self.regression.restart();
            return;
        }
        if self.regression.push(sample.time, measured, applied) {
            for (row, estimator) in self.estimators.iter_mut().enumerate() {
                let (phi, y) = self.regression.row(row);
                self.innovations[row] = Some(estimator.update(phi, y));
            }
        }
    }
}

impl Observer<f64> for Option<Identification> {
    fn observe(
        &mut self,
        tick: &Tick<f64>,
        sample: &Sample<f64>,
        measured: &[f64],
        applied: &[f64],
    ) {
        if let Some(identification) = self {
            identification.observe(tick, sample, measured, applied);
        }
    }
}
