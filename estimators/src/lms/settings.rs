//! `[estimator.lms]`: the settings, on a host and without one, and what is wrong with them.

use core::fmt;

use crate::estimate::NO_START;

/// The table of `lms` in TOML.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "std",
    derive(serde::Serialize, serde::Deserialize),
    serde(default, deny_unknown_fields)
)]
pub struct LmsSettings {
    /// `μ` in (0, 2).
    pub step: f64,
    /// `γ` in [0, 1).
    pub leakage: f64,
    /// `ε`, above 0.
    pub regularization: f64,
}

impl Default for LmsSettings {
    fn default() -> Self {
        Self {
            step: 0.1,
            leakage: 0.0,
            regularization: 1e-4,
        }
    }
}

impl LmsSettings {
    pub(super) fn check(&self) -> Result<(), LmsError> {
        if !(self.step > 0.0 && self.step < 2.0) {
            return Err(LmsError::Step(self.step));
        }
        if !(self.leakage >= 0.0 && self.leakage < 1.0) {
            return Err(LmsError::Leakage(self.leakage));
        }
        // Above 0 also in single precision.
        if !(self.regularization >= 1e-30 && self.regularization <= 1e30) {
            return Err(LmsError::Regularization(self.regularization));
        }
        Ok(())
    }
}

/// Why an estimator could not be made. Each variant carries the value that was found.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum LmsError {
    /// No parameters, or one that is not finite.
    Theta,
    /// `step` outside (0, 2).
    Step(f64),
    /// `leakage` outside [0, 1).
    Leakage(f64),
    /// `regularization` not a number above 0.
    Regularization(f64),
}

impl LmsError {
    /// The setting that is to blame; empty for the start value.
    pub fn key(&self) -> &'static str {
        match self {
            LmsError::Theta => "",
            LmsError::Step(_) => "step",
            LmsError::Leakage(_) => "leakage",
            LmsError::Regularization(_) => "regularization",
        }
    }
}

impl fmt::Display for LmsError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            LmsError::Theta => f.write_str(NO_START),
            LmsError::Step(found) => write!(
                f,
                "`step` is {found}, expected a number above 0 and below 2"
            ),
            LmsError::Leakage(found) => write!(
                f,
                "`leakage` is {found}, expected a number from 0 and below 1"
            ),
            LmsError::Regularization(found) => write!(
                f,
                "`regularization` is {found}, expected a number from 1e-30 to 1e30"
            ),
        }
    }
}

impl core::error::Error for LmsError {}

#[cfg(feature = "std")]
mod part {
    use loopsight_core::Estimator;
    use loopsight_model::declare_part;
    use loopsight_model::registry::{BuildError, EstimatorPart, PartMeta, Setting};
    use nalgebra::DVector;

    use super::LmsSettings;
    use crate::Lms;

    const META: PartMeta = PartMeta {
        id: "lms",
        role: "estimator",
        summary: "normalised least mean squares with leakage: a gradient step per sample",
        equation: "θ <- θ + μ φ (y - φᵀθ)/(ε + φᵀφ) + γ (θ₀ - θ)",
        reference: "Haykin (2002), Adaptive Filter Theory, 4th ed., ch. 5 and 6; Goodwin, Sin (1984), \
                    Adaptive Filtering, Prediction and Control, section 3.3",
        example: "[estimator.lms]\nstep = 0.1\nleakage = 1e-4\n",
        settings: &[
            Setting::new(
                "step",
                "1",
                "μ: share of the error that one sample takes away, above 0 and below 2; default 0.1",
            ),
            Setting::new(
                "leakage",
                "1",
                "γ: share of the way back to the start in a sample, from 0 and below 1; default 0",
            ),
            Setting::new(
                "regularization",
                "1",
                "ε: added to the square of the scaled regressor (measurement unit squared), above 0; \
                 default 1e-4",
            ),
        ],
    };

    #[typetag::serde(name = "lms")]
    impl EstimatorPart for LmsSettings {
        fn meta(&self) -> &'static PartMeta {
            &META
        }
        fn build(&self, theta: &[f64]) -> Result<Box<dyn Estimator<f64>>, BuildError> {
            let lms = Lms::new(DVector::from_column_slice(theta), self)
                .map_err(|error| BuildError::at(error.key(), error.to_string()))?;
            Ok(Box::new(lms))
        }
    }
    declare_part!(&META);
}
