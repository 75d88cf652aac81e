//! The products of the columns of a Jacobian with each other.

use std::ops::Range;

use nalgebra::DMatrix;

/// Rows that a product of two columns takes at once.
const LANES: usize = 8;

/// `JᵀJ`, each product computed once. A column counts from its first entry that is not zero to its last, in whole lanes, so
/// that no digit differs: the initial states of a run move nothing in the others.
pub(crate) fn gram(jacobian: &DMatrix<f64>) -> DMatrix<f64> {
    let (rows, n) = jacobian.shape();
    let ends: Vec<Range<usize>> = (jacobian.column_iter())
        .map(|column| {
            let column = column.as_slice();
            let first = column.iter().position(|v| *v != 0.0).unwrap_or(0);
            let last = column.iter().rposition(|v| *v != 0.0).map_or(0, |i| i + 1);
            first / LANES * LANES..last.next_multiple_of(LANES).min(rows)
        })
        .collect();
    let mut gram = DMatrix::zeros(n, n);
    for i in 0..n {
        for j in 0..=i {
            let from = ends[i].start.max(ends[j].start);
            let to = ends[i].end.min(ends[j].end).max(from);
            let part = |column: usize| jacobian.view((from, column), (to - from, 1));
            let product = part(i).dot(&part(j));
            gram[(i, j)] = product;
            gram[(j, i)] = product;
        }
    }
    gram
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chance::white;

    #[test]
    fn it_has_every_digit_of_the_whole_product() {
        let (rows, columns) = (61, 5);
        let mut jacobian = DMatrix::from_vec(rows, columns, white(rows * columns, 1));
        // Two initial states, of one run each, and one that moves nothing.
        jacobian.view_mut((30, 2), (31, 1)).fill(0.0);
        jacobian.view_mut((0, 3), (17, 1)).fill(0.0);
        jacobian.column_mut(4).fill(0.0);
        assert_eq!(gram(&jacobian), jacobian.tr_mul(&jacobian));
        assert_eq!(gram(&DMatrix::zeros(0, 3)), DMatrix::zeros(3, 3));
    }
}
