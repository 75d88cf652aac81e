//! `[estimator.rls]`: the settings, on a host and without one, and what is wrong with them.

use core::fmt;

use loopsight_core::Real;

use crate::estimate::NO_START;
use crate::factor::LEAST;

/// What is forgotten; see [`crate::Rls`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(
    feature = "std",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "snake_case")
)]
pub enum Forgetting {
    /// In each sample the same share of everything.
    #[default]
    Constant,
    /// More where errors are large, less where they are small.
    Variable,
    /// Only what the sample says something about.
    Directional,
}

/// The table of `rls` in TOML.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "std",
    derive(serde::Serialize, serde::Deserialize),
    serde(default, deny_unknown_fields)
)]
pub struct RlsSettings {
    /// Forgetting `λ` in (0, 1]; 1 weighs all samples alike.
    pub forgetting: f64,
    /// What is forgotten; all but `constant` need a `forgetting` below 1.
    pub rule: Forgetting,
    /// `λ_min` of the rule `variable`; `None` for `λ^10`: a tenth of the memory.
    #[cfg_attr(feature = "std", serde(skip_serializing_if = "Option::is_none"))]
    pub least_forgetting: Option<f64>,
    /// The covariance starts as this multiple of the identity. Large against
    /// `(expected size of θ / noise of y)²`, the start is forgotten after a few samples.
    pub initial_covariance: f64,
    /// `p_max`; `None` for the initial covariance: never less certain than at the start.
    #[cfg_attr(feature = "std", serde(skip_serializing_if = "Option::is_none"))]
    pub covariance_limit: Option<f64>,
}

impl Default for RlsSettings {
    fn default() -> Self {
        Self {
            forgetting: 1.0,
            rule: Forgetting::Constant,
            least_forgetting: None,
            initial_covariance: 1e6,
            covariance_limit: None,
        }
    }
}

impl RlsSettings {
    /// The limit of the covariance and the least forgetting, when everything is as it must be.
    pub(super) fn check<S: Real>(&self, n: usize) -> Result<(f64, f64), RlsError> {
        let (lambda, initial) = (self.forgetting, self.initial_covariance);
        let limit = self.covariance_limit.unwrap_or(initial);
        if !(lambda > 0.0 && lambda <= 1.0) {
            return Err(RlsError::Forgetting(lambda));
        }
        if self.rule != Forgetting::Constant && lambda == 1.0 {
            return Err(RlsError::NothingForgotten);
        }
        let least = self
            .least_forgetting
            .unwrap_or((0..10).fold(1.0, |power, _| power * lambda));
        if self.least_forgetting.is_some() && !(least > 0.0 && least <= lambda) {
            return Err(RlsError::LeastForgetting(least));
        }
        if !(initial >= LEAST && S::of(initial).is_finite()) {
            return Err(RlsError::InitialCovariance(initial));
        }
        // The greatest number that can turn up is a variance that was just forgotten, times n².
        let most = match self.rule {
            Forgetting::Variable => least,
            Forgetting::Constant | Forgetting::Directional => lambda,
        };
        let greatest = S::of(limit) / S::of(most) * S::of((n * n) as f64);
        if !(limit >= initial && greatest.is_finite()) {
            return Err(RlsError::CovarianceLimit(limit));
        }
        Ok((limit, least))
    }
}

/// Why an estimator could not be made. Each variant carries the value that was found.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum RlsError {
    /// No parameters, or one that is not finite.
    Theta,
    /// `forgetting` outside (0, 1].
    Forgetting(f64),
    /// A rule that forgets more or less, and `forgetting` 1.
    NothingForgotten,
    /// `least_forgetting` outside (0, `forgetting`].
    LeastForgetting(f64),
    /// `initial_covariance` not a number above 0.
    InitialCovariance(f64),
    /// `covariance_limit` below the initial covariance, or too large for the scalar.
    CovarianceLimit(f64),
}

impl RlsError {
    /// The setting that is to blame; empty for the start value.
    pub fn key(&self) -> &'static str {
        match self {
            RlsError::Theta => "",
            RlsError::Forgetting(_) | RlsError::NothingForgotten => "forgetting",
            RlsError::LeastForgetting(_) => "least_forgetting",
            RlsError::InitialCovariance(_) => "initial_covariance",
            RlsError::CovarianceLimit(_) => "covariance_limit",
        }
    }
}

impl fmt::Display for RlsError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            RlsError::Theta => f.write_str(NO_START),
            RlsError::Forgetting(found) => write!(
                f,
                "`forgetting` is {found}, expected a number above 0 and up to 1"
            ),
            RlsError::NothingForgotten => f.write_str(
                "`forgetting` is 1, expected a number below 1 for this `rule`: nothing is forgotten",
            ),
            RlsError::LeastForgetting(found) => write!(
                f,
                "`least_forgetting` is {found}, expected a number above 0 and up to `forgetting`"
            ),
            RlsError::InitialCovariance(found) => write!(
                f,
                "`initial_covariance` is {found}, expected a number above 0"
            ),
            RlsError::CovarianceLimit(found) => write!(
                f,
                "`covariance_limit` is {found}, expected a finite number not below \
                 `initial_covariance`"
            ),
        }
    }
}

impl core::error::Error for RlsError {}

#[cfg(feature = "std")]
mod part {
    use loopsight_core::Estimator;
    use loopsight_model::declare_part;
    use loopsight_model::registry::{BuildError, EstimatorPart, PartMeta, Setting};
    use nalgebra::DVector;

    use super::RlsSettings;
    use crate::Rls;
    use crate::estimate::declared::{COVARIANCE_LIMIT, INITIAL_COVARIANCE};

    const META: PartMeta = PartMeta {
        id: "rls",
        role: "estimator",
        summary: "recursive least squares with constant, variable or directional forgetting",
        equation: "K = P φ/(λ + φᵀP φ);  θ <- θ + K (y - φᵀθ);  P <- (P - K φᵀP)/λ, P_ii <= p_max",
        reference: "Åström, Wittenmark (2008), Adaptive Control, ch. 2 and 11; Bierman (1977), \
                    Factorization Methods for Discrete Sequential Estimation, ch. V; Fortescue et al. \
                    (1981), Automatica 17, 831-835; Cao, Schwartz (2000), Automatica 36, 1725-1731",
        example: "[estimator.rls]\nforgetting = 0.999\ninitial_covariance = 1e6\n",
        settings: &[
            Setting::new(
                "forgetting",
                "1",
                "weight of a sample against the next one, above 0 and up to 1; default 1: all \
                 samples count alike",
            ),
            Setting::new(
                "rule",
                "",
                "what is forgotten: \"constant\", the same share always; \"variable\", more where errors \
                 are large; \"directional\", only what a sample says something about; default \
                 \"constant\"",
            ),
            Setting::new(
                "least_forgetting",
                "1",
                "least weight of the rule \"variable\", above 0 and up to `forgetting`; default: its \
                 tenth power",
            ),
            INITIAL_COVARIANCE,
            COVARIANCE_LIMIT,
        ],
    };

    #[typetag::serde(name = "rls")]
    impl EstimatorPart for RlsSettings {
        fn meta(&self) -> &'static PartMeta {
            &META
        }
        fn build(&self, theta: &[f64]) -> Result<Box<dyn Estimator<f64>>, BuildError> {
            let rls = Rls::new(DVector::from_column_slice(theta), self)
                .map_err(|error| BuildError::at(error.key(), error.to_string()))?;
            Ok(Box::new(rls))
        }
    }
    declare_part!(&META);
}
