//! Residuals near a point.

use nalgebra::{DMatrix, DVector};

/// Residuals as linear functions of the unknowns.
#[derive(Clone)]
pub(crate) struct Linearised {
    /// The scaled unknowns.
    pub(crate) at: DVector<f64>,
    /// Weighted residuals there.
    pub(crate) residual: DVector<f64>,
    /// Their derivatives by the scaled unknowns.
    pub(crate) jacobian: DMatrix<f64>,
}
