//! Why work fails.

use loopsight_model::regression::RegressionError;

use crate::figure::figure;
use crate::progress::Cancelled;

/// Why a model cannot be compared with measurements.
#[derive(Debug, thiserror::Error, PartialEq)]
pub enum CompareError {
    /// Parameters have no value.
    #[error("the model gives no value for {}: fit it first, or write the values into the file", .0.join(", "))]
    MissingValues(Vec<String>),
    /// Nothing is measured.
    #[error("the model's log has no measured signal")]
    NothingMeasured,
    /// The runs are not those of this model.
    #[error(
        "the runs have {found} {what}, and the model has {expected}: they are not of one machine"
    )]
    OtherMachine {
        /// Inputs, or measured signals.
        what: &'static str,
        /// How many the runs have.
        found: usize,
        /// How many the model has.
        expected: usize,
    },
    /// There is no sample.
    #[error("the recording has no sample")]
    NoSamples,
    /// The simulation diverged.
    #[error(
        "the free run{} diverges after {} s: the model is unstable with these parameters",
        of_run(run),
        figure(*time, 3)
    )]
    Diverged {
        /// The run.
        run: String,
        /// When, s.
        time: f64,
    },
    /// The work was cancelled.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// ` of <run>` where the run has a name.
fn of_run(name: &str) -> String {
    if name.is_empty() {
        String::new()
    } else {
        format!(" of `{name}`")
    }
}

/// Why a fit failed.
#[derive(Debug, thiserror::Error)]
pub enum FitError {
    /// See [`CompareError`].
    #[error(transparent)]
    Compare(CompareError),
    /// Nothing to estimate.
    #[error("no parameter of the model is free: name some under `free` in [fit]")]
    NothingFree,
    /// Fewer samples than parameters.
    #[error("{samples} samples cannot determine {parameters} parameters")]
    TooFewSamples {
        /// Usable samples.
        samples: usize,
        /// Free parameters.
        parameters: usize,
    },
    /// Known parameters without a value.
    #[error("the model gives no value for {}, and a fit does not estimate it: write it into the file, or name it under `free` in [fit]", .0.join(", "))]
    Unknown(Vec<String>),
    /// A parameter that the regression cannot estimate.
    #[error(
        "`{parameter}` enters the equations non-linearly: recursive least squares cannot estimate it; use --method output-error, or name it under `fixed` in [fit]"
    )]
    NotLinear {
        /// Its name.
        parameter: String,
    },
    /// A parameter that differs from run to run.
    #[error(
        "`{parameter}` differs from run to run (`per_run` in [fit]), and recursive least squares finds one value for all: use --method output-error"
    )]
    PerRun {
        /// Its name.
        parameter: String,
    },
    /// The plant offers no regression.
    #[error(
        "no parameter to estimate moves the rate of a state of the plant `{0}` that is controlled or measured, so there is no regression for recursive least squares; use --method output-error"
    )]
    NoRegression(String),
    /// The solver gave up.
    #[error("the solver gave up: {0}")]
    Solver(String),
    /// The estimator's table is wrong.
    #[error(transparent)]
    Build(#[from] loopsight_model::registry::BuildError),
    /// The estimator is not linked.
    #[error("no estimator `{0}` is linked into this program")]
    NoEstimator(String),
    /// The work was cancelled.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

impl FitError {
    /// Whether the free run of the model diverges.
    pub(crate) fn is_divergence(&self) -> bool {
        matches!(self, Self::Compare(CompareError::Diverged { .. }))
    }
}

impl From<CompareError> for FitError {
    fn from(error: CompareError) -> Self {
        match error {
            CompareError::Cancelled(cancelled) => FitError::Cancelled(cancelled),
            other => FitError::Compare(other),
        }
    }
}

impl From<RegressionError> for FitError {
    fn from(error: RegressionError) -> Self {
        match error {
            RegressionError::NoRates(plant) => FitError::NoRegression(plant),
            RegressionError::NotLinear(parameter) => FitError::NotLinear { parameter },
            RegressionError::Unknown(parameter) => FitError::Unknown(vec![parameter]),
        }
    }
}
