//! `[estimator.kalman]`: the settings, on a host and without one, and what is wrong with them.

use core::fmt;

use loopsight_core::Real;

use crate::estimate::NO_START;
use crate::factor::LEAST;

/// The table of `kalman` in TOML.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "std",
    derive(serde::Serialize, serde::Deserialize),
    serde(default, deny_unknown_fields)
)]
pub struct KalmanSettings {
    /// The covariance starts as this multiple of the identity.
    pub initial_covariance: f64,
    /// `q`, at least 0.
    pub drift: f64,
    /// `p_max`; `None` for the initial covariance.
    #[cfg_attr(feature = "std", serde(skip_serializing_if = "Option::is_none"))]
    pub covariance_limit: Option<f64>,
}

impl Default for KalmanSettings {
    fn default() -> Self {
        Self {
            initial_covariance: 1e6,
            drift: 1e-3,
            covariance_limit: None,
        }
    }
}

impl KalmanSettings {
    /// The limit of the covariance, when everything is as it must be.
    pub(super) fn check<S: Real>(&self, n: usize) -> Result<f64, KalmanError> {
        let initial = self.initial_covariance;
        let limit = self.covariance_limit.unwrap_or(initial);
        if !(initial >= LEAST && S::of(initial).is_finite()) {
            return Err(KalmanError::InitialCovariance(initial));
        }
        if !(self.drift >= 0.0 && S::of(self.drift).is_finite()) {
            return Err(KalmanError::Drift(self.drift));
        }
        // The greatest number that can turn up.
        let greatest = S::of(limit + self.drift) * S::of((n * n) as f64);
        if !(limit >= initial && greatest.is_finite()) {
            return Err(KalmanError::CovarianceLimit(limit));
        }
        Ok(limit)
    }
}

/// Why an estimator could not be made. Each variant carries the value that was found.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum KalmanError {
    /// No parameters, or one that is not finite.
    Theta,
    /// `initial_covariance` not a number above 0.
    InitialCovariance(f64),
    /// `drift` not a number from 0 upwards.
    Drift(f64),
    /// `covariance_limit` below the initial covariance, or too large for the scalar.
    CovarianceLimit(f64),
}

impl KalmanError {
    /// The setting that is to blame; empty for the start value.
    pub fn key(&self) -> &'static str {
        match self {
            KalmanError::Theta => "",
            KalmanError::InitialCovariance(_) => "initial_covariance",
            KalmanError::Drift(_) => "drift",
            KalmanError::CovarianceLimit(_) => "covariance_limit",
        }
    }
}

impl fmt::Display for KalmanError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            KalmanError::Theta => f.write_str(NO_START),
            KalmanError::InitialCovariance(found) => write!(
                f,
                "`initial_covariance` is {found}, expected a number above 0"
            ),
            KalmanError::Drift(found) => {
                write!(f, "`drift` is {found}, expected a number from 0 upwards")
            }
            KalmanError::CovarianceLimit(found) => write!(
                f,
                "`covariance_limit` is {found}, expected a finite number not below \
                 `initial_covariance`"
            ),
        }
    }
}

impl core::error::Error for KalmanError {}

#[cfg(feature = "std")]
mod part {
    use loopsight_core::Estimator;
    use loopsight_model::declare_part;
    use loopsight_model::registry::{BuildError, EstimatorPart, PartMeta, Setting};
    use nalgebra::DVector;

    use super::KalmanSettings;
    use crate::Kalman;
    use crate::estimate::declared::{COVARIANCE_LIMIT, INITIAL_COVARIANCE};

    const META: PartMeta = PartMeta {
        id: "kalman",
        role: "estimator",
        summary: "a Kalman filter for parameters that walk at random",
        equation: "P <- P + q I, P_ii <= p_max;  K = P φ/(1 + φᵀP φ);  θ <- θ + K (y - φᵀθ);  P <- P - K φᵀP",
        reference: "Ljung (1999), System Identification: Theory for the User, 2nd ed., section 11.3; \
                    Bierman (1977), Factorization Methods for Discrete Sequential Estimation, ch. V",
        example: "[estimator.kalman]\ninitial_covariance = 100.0\ndrift = 1e-3\n",
        settings: &[
            INITIAL_COVARIANCE,
            Setting::new(
                "drift",
                "1",
                "q: growth of the covariance in a sample, at least 0; default 1e-3",
            ),
            COVARIANCE_LIMIT,
        ],
    };

    #[typetag::serde(name = "kalman")]
    impl EstimatorPart for KalmanSettings {
        fn meta(&self) -> &'static PartMeta {
            &META
        }
        fn build(&self, theta: &[f64]) -> Result<Box<dyn Estimator<f64>>, BuildError> {
            let kalman = Kalman::new(DVector::from_column_slice(theta), self)
                .map_err(|error| BuildError::at(error.key(), error.to_string()))?;
            Ok(Box::new(kalman))
        }
    }
    declare_part!(&META);
}
