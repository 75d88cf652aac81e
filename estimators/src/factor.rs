//! A covariance that stays positive definite: `P = U D Uᵀ`.

use core::cmp::Ordering;

use loopsight_core::Real;
use nalgebra::allocator::Allocator;
use nalgebra::{DefaultAllocator, Dim, OMatrix, OVector, U1};

/// Added to each entry of `D` in each measurement: none becomes zero.
pub(crate) const LEAST: f64 = 1e-30;

/// A covariance as `U D Uᵀ` (`U` unit upper triangular, `D` diagonal).
///
/// Each entry of `D` is multiplied by positive numbers, or has positive ones added, so that `P` cannot
/// become indefinite however many updates there are, in `f32` as in `f64` (1e-30 keeps an entry of `D` from
/// underflow).
///
/// Reference: G. J. Bierman (1977), "Factorization Methods for Discrete Sequential Estimation", ch. V
/// (a measurement) and appendix III.C (Agee's and Turner's rank-one sum).
#[derive(Clone, Debug)]
pub(crate) struct Factor<S: Real, D: Dim>
where
    DefaultAllocator: Allocator<D> + Allocator<D, D>,
{
    /// Strictly upper triangle of `U`; the rest is not used.
    u: OMatrix<S, D, D>,
    d: OVector<S, D>,
    /// `Uᵀφ`.
    seen: OVector<S, D>,
    scratch: OVector<S, D>,
    /// `1 + 4 n²` rounding units.
    enlargement: S,
}

impl<S: Real, D: Dim> Factor<S, D>
where
    DefaultAllocator: Allocator<D> + Allocator<D, D>,
{
    pub(crate) fn new(dim: D) -> Self {
        let zero = OVector::zeros_generic(dim, U1);
        let n = S::of(zero.len() as f64);
        Self {
            u: OMatrix::zeros_generic(dim, dim),
            d: zero.clone(),
            seen: zero.clone(),
            scratch: zero,
            enlargement: S::one() + S::of(4.0) * n * n * rounding_unit(),
        }
    }

    /// The greatest diagonal entry `p` so that what [`Factor::entry`] says of it stays at `limit`.
    pub(crate) fn shown_below(&self, limit: S) -> S {
        limit / (self.enlargement + self.enlargement - S::one())
    }

    /// `P = variance I`.
    pub(crate) fn restart(&mut self, variance: S) {
        self.u.fill(S::zero());
        self.d.fill(variance);
    }

    /// Prepares for the regressor `phi`, and returns `φᵀPφ`.
    pub(crate) fn spread(&mut self, phi: &[S]) -> S {
        let f = self.seen.as_mut_slice();
        let (u, d) = (self.u.as_slice(), self.d.as_slice());
        let n = d.len();
        let mut spread = S::zero();
        for j in 0..n {
            let mut sum = phi[j];
            for i in 0..j {
                sum += u[j * n + i] * phi[i];
            }
            f[j] = sum;
            spread += d[j] * sum * sum;
        }
        spread
    }

    /// The `i`-th entry of `P φ`, for the `φ` of [`Factor::spread`].
    pub(crate) fn gain(&self, i: usize) -> S {
        let (u, d, f) = (self.u.as_slice(), self.d.as_slice(), self.seen.as_slice());
        let n = d.len();
        let mut sum = d[i] * f[i];
        for j in i + 1..n {
            sum += u[j * n + i] * (d[j] * f[j]);
        }
        sum
    }

    /// Takes in a measurement of `φᵀθ`, prepared by [`Factor::spread`], whose noise has the variance
    /// `noise`, and multiplies `P` by `growth`.
    pub(crate) fn absorb(&mut self, noise: S, growth: S) {
        let (f, b) = (self.seen.as_slice(), self.scratch.as_mut_slice());
        let (u, d) = (self.u.as_mut_slice(), self.d.as_mut_slice());
        let n = d.len();
        let least = S::of(LEAST);
        let mut alpha = noise;
        let mut inverse = S::one() / alpha;
        for j in 0..n {
            let (p, v) = (f[j] * inverse, d[j] * f[j]);
            let before = alpha;
            alpha += v * f[j];
            inverse = S::one() / alpha;
            d[j] = least + d[j] * (before * inverse) * growth;
            for i in 0..j {
                let old = u[j * n + i];
                u[j * n + i] = old - b[i] * p;
                b[i] += old * v;
            }
            b[j] = v;
        }
    }

    /// `φᵀP⁻¹φ`: what is known along `phi`.
    pub(crate) fn known(&mut self, phi: &[S]) -> S {
        let x = self.scratch.as_mut_slice();
        let (u, d) = (self.u.as_slice(), self.d.as_slice());
        let n = d.len();
        x.copy_from_slice(phi);
        let mut sum = S::zero();
        for j in (0..n).rev() {
            for i in 0..j {
                x[i] -= u[j * n + i] * x[j];
            }
            sum += x[j] * x[j] / d[j];
        }
        sum
    }

    /// `P ← P + weight x xᵀ`, `weight` not below 0.
    pub(crate) fn add(&mut self, weight: S, x: impl Fn(usize) -> S) {
        let work = self.scratch.as_mut_slice();
        let (u, d) = (self.u.as_mut_slice(), self.d.as_mut_slice());
        let n = d.len();
        for (i, to) in work.iter_mut().enumerate() {
            *to = x(i);
        }
        let mut c = weight;
        for j in (0..n).rev() {
            let own = work[j];
            let before = d[j];
            d[j] = before + c * own * own;
            let share = c * own / d[j];
            for i in 0..j {
                let old = u[j * n + i];
                work[i] -= own * old;
                u[j * n + i] = old + share * work[i];
            }
            c *= before / d[j];
        }
    }

    /// The `i`-th diagonal entry of `P`.
    fn variance(&self, i: usize) -> S {
        let (u, d) = (self.u.as_slice(), self.d.as_slice());
        let n = d.len();
        let mut sum = d[i];
        for k in i + 1..n {
            sum += u[k * n + i] * u[k * n + i] * d[k];
        }
        sum
    }

    /// Holds each diagonal entry of `P` at `cap`: `P⁻¹ ← P⁻¹ + (1/cap - 1/P_ii) e_i e_iᵀ`.
    pub(crate) fn bound(&mut self, cap: S) {
        let n = self.d.len();
        let mut beyond = false;
        for i in 0..n {
            beyond |= self.variance(i) > cap;
        }
        if beyond {
            self.cut(cap);
        }
    }

    #[cold]
    fn cut(&mut self, cap: S) {
        let n = self.d.len();
        for i in 0..n {
            let variance = self.variance(i);
            if variance > cap {
                for j in 0..n {
                    self.seen[j] = match j.cmp(&i) {
                        Ordering::Less => S::zero(),
                        Ordering::Equal => S::one(),
                        Ordering::Greater => self.u[(i, j)],
                    };
                }
                self.absorb(cap * (variance / (variance - cap)), S::one());
            }
        }
    }

    /// An entry of `P`: rounded once more, the diagonal enlarged by more than what those roundings and a
    /// Cholesky factorisation can take away (Higham 2002, theorem 10.7), so that the whole is positive
    /// definite, and exactly symmetric. The enlargement is not fed back.
    pub(crate) fn entry(&self, row: usize, column: usize) -> S {
        let (u, d) = (self.u.as_slice(), self.d.as_slice());
        let n = d.len();
        let (i, j) = (row.min(column), row.max(column));
        let mut sum = if i == j { d[j] } else { u[j * n + i] * d[j] };
        for k in j + 1..n {
            sum += u[k * n + i] * d[k] * u[k * n + j];
        }
        if i == j { sum * self.enlargement } else { sum }
    }
}

/// Half the distance from 1 to the next number.
fn rounding_unit<S: Real>() -> S {
    let mut unit = S::one();
    while S::one() + unit > S::one() {
        unit *= S::of(0.5);
    }
    unit
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Const, Matrix3, Vector3};

    /// Every operation against the same one on the full matrix.
    #[test]
    fn the_factors_do_what_the_matrix_does() {
        let mut factor: Factor<f64, Const<3>> = Factor::new(Const);
        factor.restart(2.0);
        let mut full = Matrix3::identity() * 2.0;
        let close = |factor: &Factor<f64, Const<3>>, full: &Matrix3<f64>| {
            for (i, j) in (0..9).map(|k| (k % 3, k / 3)) {
                let (a, b) = (factor.entry(i, j), full[(i, j)]);
                assert!((a - b).abs() < 1e-12, "{i}, {j}: {a} {full}");
            }
        };
        for k in 0..30 {
            let k = f64::from(k);
            let phi = Vector3::new((0.7 * k).sin(), 1.0, (1.3 * k).cos());
            let spread = factor.spread(phi.as_slice());
            assert!((spread - phi.dot(&(full * phi))).abs() < 1e-12);
            let gain = full * phi;
            for i in 0..3 {
                assert!((factor.gain(i) - gain[i]).abs() < 1e-12);
            }
            factor.absorb(0.5, 1.25);
            full = (full - gain * gain.transpose() / (0.5 + spread)) * 1.25;
            close(&factor, &full);
            let along = Vector3::new(0.3, (0.4 * k).cos(), -0.2);
            let known = factor.known(along.as_slice());
            let inverse = full.try_inverse().unwrap();
            assert!((known - along.dot(&(inverse * along))).abs() < 1e-9 * known);
            factor.add(0.1, |i| along[i]);
            full += along * along.transpose() * 0.1;
            close(&factor, &full);
        }
        factor.bound(0.2);
        for i in 0..3 {
            assert!(factor.variance(i) <= 0.2 + 1e-12);
        }
    }
}
