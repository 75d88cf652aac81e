//! A small system of linear equations, solved in place.

use loopsight_core::Real;

/// What is left of a difference by less than this share of its terms is but rounding.
const ROUNDING: f64 = 1e-6;

/// Why there is no safe solution.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Singular {
    /// This row is zero: no unknown appears in the equation.
    Row(usize),
    /// This column is zero: the unknown appears in no equation.
    Column(usize),
    /// Rows depend on each other: less than a millionth of one is left where the others are taken from it.
    Dependent,
    /// An entry is not a finite number.
    NotFinite,
}

/// Solves `A x = b` by Gaussian elimination with partial pivoting, each row in units of its largest entry:
///
/// ```text
/// the k-th pivot is the largest |a_ik|/max_j |a_ij| of the rows that are left
/// a_ij <- a_ij - (a_ik/a_kk) a_kj, zero where this is less than 1e-6 of its terms
/// ```
///
/// So the units of equations and unknowns do not matter. `a` (row by row, `b.len()²` entries) and `scale` (as
/// long as `b`) are overwritten; `b` becomes `x`. Matrices without a pivot are refused.
///
/// # Errors
///
/// A matrix that is singular, not finite, or of another length.
///
/// Reference: Golub, Van Loan (2013), "Matrix Computations", 3.4 and 3.5.2.
///
/// ```
/// use loopsight_controllers::solve;
/// let (mut a, mut b) = ([0.0, 2.0, 1.0, 1.0], [4.0, 5.0]);
/// solve(&mut a, &mut b, &mut [0.0; 2]).unwrap();
/// assert_eq!(b, [3.0, 2.0]);
/// ```
pub fn solve<S: Real>(a: &mut [S], b: &mut [S], scale: &mut [S]) -> Result<(), Singular> {
    let n = b.len();
    if a.len() != n * n || scale.len() != n {
        return Err(Singular::NotFinite);
    }
    for (row, scale) in a.chunks_exact(n).zip(scale.iter_mut()) {
        *scale = row[1..].iter().fold(row[0].abs(), |m, v| m.max(v.abs()));
    }
    for k in 0..n {
        for i in k + 1..n {
            if a[i * n + k].abs() * scale[k] > a[k * n + k].abs() * scale[i] {
                for j in k..n {
                    a.swap(k * n + j, i * n + j);
                }
                b.swap(k, i);
                scale.swap(k, i);
            }
        }
        let pivot = a[k * n + k];
        // A value that is not a number is no pivot either.
        let usable = pivot.abs() > S::zero();
        if !usable {
            return Err(why(a, b, scale));
        }
        for i in k + 1..n {
            let factor = a[i * n + k] / pivot;
            for j in k + 1..n {
                let (whole, taken) = (a[i * n + j], factor * a[k * n + j]);
                let left = whole - taken;
                let rounding = S::of(ROUNDING) * (whole.abs() + taken.abs());
                a[i * n + j] = if left.abs() <= rounding {
                    S::zero()
                } else {
                    left
                };
            }
            let above = b[k];
            b[i] -= factor * above;
        }
    }
    for i in (0..n).rev() {
        let mut sum = b[i];
        for j in i + 1..n {
            sum -= a[i * n + j] * b[j];
        }
        b[i] = sum / a[i * n + i];
    }
    // A sum is finite where all of it is. An infinite entry may leave a solution that is none.
    let sum = b
        .iter()
        .zip(scale.iter())
        .fold(S::zero(), |sum, (x, s)| sum + *x + *s);
    if sum.is_finite() {
        Ok(())
    } else {
        Err(Singular::NotFinite)
    }
}

/// Why there is no pivot. A row that is zero was never swapped, and a column that is zero stayed so.
#[cold]
fn why<S: Real>(a: &[S], b: &[S], scale: &[S]) -> Singular {
    let n = b.len();
    let zero = |v: &S| *v == S::zero();
    if !a.iter().chain(b).chain(scale).all(|v| v.is_finite()) {
        Singular::NotFinite
    } else if let Some(row) = scale.iter().position(zero) {
        Singular::Row(row)
    } else if let Some(column) = (0..n).find(|j| a[*j..].iter().step_by(n).all(zero)) {
        Singular::Column(column)
    } else {
        Singular::Dependent
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, rng_seed: proptest::test_runner::RngSeed::Fixed(7), ..ProptestConfig::default() })]
        #[test]
        fn the_solution_solves(
            matrix in prop::array::uniform9(-1.0f64..1.0),
            x in prop::array::uniform3(-5.0f64..5.0),
            rows in prop::array::uniform3(-8i32..8),
            columns in prop::array::uniform3(-8i32..8),
        ) {
            let mut a = matrix;
            let mut b = [0.0; 3];
            for i in 0..3 {
                // A dominant diagonal, then units of any size.
                a[i * 3 + i] += 4.0f64.copysign(a[i * 3 + i]);
                for j in 0..3 {
                    a[i * 3 + j] *= 10f64.powi(rows[i] + columns[j]);
                }
                b[i] = (0..3).map(|j| a[i * 3 + j] * x[j]).sum();
            }
            let solved = solve(&mut a, &mut b, &mut [0.0; 3]);
            prop_assert_eq!(solved, Ok(()));
            // Unknowns of very different size share a row: judge by the largest contribution.
            let largest = (0..3).map(|j| (x[j] * 10f64.powi(columns[j])).abs()).fold(0.0, f64::max);
            for j in 0..3 {
                prop_assert!((b[j] - x[j]).abs() * 10f64.powi(columns[j]) <= 1e-12 * largest);
            }
        }
    }

    #[test]
    fn singular_matrices_are_told_apart() {
        let solve = |mut a: [f64; 4]| super::solve(&mut a, &mut [1.0, 2.0], &mut [0.0; 2]);
        assert_eq!(solve([1.0, 2.0, 0.0, 0.0]), Err(Singular::Row(1)));
        assert_eq!(solve([1.0, 0.0, 3.0, 0.0]), Err(Singular::Column(1)));
        assert_eq!(solve([1.0, 2.0, 2.0, 4.0]), Err(Singular::Dependent));
        for (i, entry) in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY]
            .into_iter()
            .enumerate()
        {
            for at in 0..6 {
                for (mut a, mut b) in [([1.0, 2.0, 3.0, 4.0], [1.0, 2.0]), ([0.0; 4], [0.0; 2])] {
                    let to = if at < 4 { &mut a[at] } else { &mut b[at - 4] };
                    *to = entry;
                    let solved = super::solve(&mut a, &mut b, &mut [0.0; 2]);
                    assert_eq!(solved, Err(Singular::NotFinite), "{i}, {at}");
                }
            }
        }
        assert_eq!(solve([1.0, 0.0, 0.0, 1e-12]), Ok(()));
    }
}
