//! A small system of linear equations, solved in place.

use loopsight_core::Real;

/// A pivot below this, after rows and columns were scaled to a largest entry of 1, is no pivot.
const LEAST_PIVOT: f64 = 1e-6;

/// Why there is no safe solution.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Singular {
    /// This row is zero: no unknown appears in the equation.
    Row(usize),
    /// This column is zero: the unknown appears in no equation.
    Column(usize),
    /// Rows depend on each other; the best pivot that is left, relative to the largest entries.
    Dependent(f64),
    /// An entry is not a finite number.
    NotFinite,
}

/// Solves `A x = b` by Gaussian elimination with partial pivoting, rows and columns scaled first,
/// so that the units of equations and unknowns do not matter.
///
/// `a` (row by row, `b.len()²` entries) and `scale` (as long as `b`) are overwritten; `b` becomes
/// `x`. Matrices with a scaled pivot below 1e-6 are refused.
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
    // An entry that is not finite leaves a solution that is none, or is found where there is none.
    let because = |a: &[S], b: &[S], why| {
        let finite = a.iter().chain(b).all(|value| value.is_finite());
        Err(if finite { why } else { Singular::NotFinite })
    };
    for i in 0..n {
        let row = &mut a[i * n..(i + 1) * n];
        let largest = row[1..].iter().fold(row[0].abs(), |m, v| m.larger(v.abs()));
        if largest == S::zero() {
            return because(a, b, Singular::Row(i));
        }
        for value in row {
            *value /= largest;
        }
        b[i] /= largest;
    }
    for j in 0..n {
        let largest = (1..n).fold(a[j].abs(), |m, i| m.larger(a[i * n + j].abs()));
        if largest == S::zero() {
            return because(a, b, Singular::Column(j));
        }
        for i in 0..n {
            a[i * n + j] /= largest;
        }
        scale[j] = largest;
    }
    for k in 0..n {
        let mut best = k;
        for i in k + 1..n {
            if a[i * n + k].abs() > a[best * n + k].abs() {
                best = i;
            }
        }
        let pivot = a[best * n + k];
        if pivot.abs() < S::of(LEAST_PIVOT) {
            return because(a, b, Singular::Dependent(pivot.abs().value()));
        }
        if best != k {
            for j in k..n {
                a.swap(k * n + j, best * n + j);
            }
            b.swap(k, best);
        }
        for i in k + 1..n {
            let factor = a[i * n + k] / pivot;
            for j in k + 1..n {
                let above = a[k * n + j];
                a[i * n + j] -= factor * above;
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
    for (value, scale) in b.iter_mut().zip(scale.iter()) {
        *value /= *scale;
    }
    // A sum is finite where all of it is.
    if b.iter().fold(S::zero(), |sum, v| sum + *v).is_finite() {
        Ok(())
    } else {
        Err(Singular::NotFinite)
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
        assert_eq!(solve([1.0, 2.0, 2.0, 4.0]), Err(Singular::Dependent(0.0)));
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
