//! The pseudo-inverse of a matrix.

use nalgebra::DMatrix;

/// Moore–Penrose inverse, singular values below 1e-9 of the largest left out; `None` when it
/// cannot be computed (not finite).
pub fn pseudo_inverse(matrix: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    if matrix.iter().any(|v| !v.is_finite()) {
        return None;
    }
    // The decomposition below refuses a matrix without rows or columns; its inverse has none either.
    if matrix.is_empty() {
        return Some(matrix.transpose());
    }
    let largest = matrix.iter().fold(0.0f64, |a, v| a.max(v.abs()));
    matrix
        .clone()
        .pseudo_inverse(1e-9 * largest.max(f64::MIN_POSITIVE))
        .ok()
}
