//! Residuals near a point.

use nalgebra::{DMatrix, DVector};

/// A matrix of zeros which the system hands out as such: what stays zero is not written.
pub(crate) fn zeros(rows: usize, columns: usize) -> DMatrix<f64> {
    DMatrix::from_vec(rows, columns, vec![0.0; rows * columns])
}

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
