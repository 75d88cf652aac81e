//! Settings of a fit.

pub use loopsight_model::regression::Scheme;
use serde::Serialize;

/// How parameters are found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// Recursive least squares on a regression (the paper's way).
    Rls,
    /// Least squares on the error of the free run.
    OutputError,
}

/// Settings of a fit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FitSettings {
    /// The method.
    pub method: Method,
    /// The regression of [`Method::Rls`], and of the starting point of [`Method::OutputError`].
    pub scheme: Scheme,
    /// Most iterations of [`Method::OutputError`].
    pub max_iterations: u64,
}

impl Default for FitSettings {
    fn default() -> Self {
        Self {
            method: Method::OutputError,
            scheme: Scheme::Integrated,
            max_iterations: 100,
        }
    }
}

/// Settings of an improvement.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ImproveSettings {
    /// Where no effect of the library explains the rest, an expression for the residual force is a candidate, too.
    pub discover: bool,
}
