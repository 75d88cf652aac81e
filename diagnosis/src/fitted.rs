//! The result of a fit.

use std::collections::BTreeMap;

use loopsight_model::model::Model;
use serde::Serialize;

use crate::arrive::Convergence;
use crate::compare::Comparison;
use crate::derived::{Known, derived};
use crate::estimate::{Estimate, OfRun, ParameterVerdict};
use crate::settings::Method;

/// The result of a fit.
#[derive(Clone, Debug, Serialize)]
pub struct Fit {
    /// The fitted model compared with the recording it was fitted to, or with the test recording.
    #[serde(flatten)]
    pub comparison: Comparison,
    /// The parameters by name.
    pub parameters: BTreeMap<String, Estimate>,
    /// The parameters that differ from run to run, by name. Under `parameters` is the mean over the runs.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub per_run: BTreeMap<String, Vec<OfRun>>,
    /// What follows from the plant's parameters, by name: see [`loopsight_core::Derived`].
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub derived: BTreeMap<String, Estimate>,
    /// The method that found them.
    pub method: Method,
    /// Free-run error before the fit; absent where the file gave no values.
    pub nrmse_before: Option<f64>,
    /// Free-run error on the recording it was fitted to.
    pub nrmse_fit: f64,
    /// Iterations (output error) or samples (recursive least squares).
    pub iterations: u64,
    /// Whether the fit to the free run converged, and from which start. None for recursive least squares and for
    /// a cancelled fit.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub convergence: Option<Convergence>,
    /// Combinations of parameters that the data do not determine, in words.
    pub flat: Vec<String>,
    /// The work was cancelled: these are the best values found until then. Standard errors and errors by signal
    /// are missing.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub cancelled: bool,
    /// What the fit knows of its estimated parameters together; none where it has no standard errors.
    #[serde(skip)]
    pub known: Option<Known>,
    /// The fitted model.
    #[serde(skip)]
    pub model: Model,
    /// Convergence of the estimate over the samples, for recursive least squares: name, then
    /// (time, value).
    #[serde(skip)]
    pub history: Vec<(String, Vec<(f64, f64)>)>,
}

impl Fit {
    /// The result of a cancelled fit: the values of `model`, with the error `nrmse`.
    pub(crate) fn cancelled(model: Model, method: Method, nrmse: f64, iterations: u64) -> Self {
        let parameters = model.parameters.iter().filter_map(|parameter| {
            let estimate = Estimate {
                value: parameter.value?,
                unit: parameter.unit.clone(),
                std_error: None,
                interval95: None,
                verdict: if parameter.free || parameter.per_run {
                    ParameterVerdict::Unfinished
                } else {
                    ParameterVerdict::Frozen
                },
            };
            Some((parameter.name.clone(), estimate))
        });
        Self {
            comparison: Comparison::of_error(nrmse),
            parameters: parameters.collect(),
            per_run: BTreeMap::new(),
            derived: derived(&model, None),
            method,
            nrmse_before: None,
            nrmse_fit: nrmse,
            iterations,
            convergence: None,
            flat: Vec::new(),
            cancelled: true,
            known: None,
            model,
            history: Vec::new(),
        }
    }
}
