//! How much a stream of regressors tells, direction by direction.

use nalgebra::allocator::Allocator;
use nalgebra::{DefaultAllocator, Dim, OMatrix, OVector, U1};

use crate::Real;

/// Sweeps of rotations; a symmetric matrix is diagonal to rounding after four to six.
const SWEEPS: usize = 8;

/// The mean of `ψψᵀ` over a window that forgets exponentially, with its eigenvalues.
///
/// ```text
/// M_k = M_{k-1} + (ψ_k ψ_kᵀ - M_{k-1})/min(k, W)        M = Q diag(m) Qᵀ
/// ```
///
/// The decomposition is Jacobi's, started anew at every sample, so that no rounding error adds up
/// however long it runs.
///
/// Reference: G. H. Golub, C. F. Van Loan (2013), "Matrix Computations", 4th edition, section 8.5
/// (cyclic Jacobi); R. R. Bitmead (1984), "Persistence of excitation conditions and the convergence of
/// adaptive schemes", IEEE Transactions on Information Theory 30(2), 183–191.
#[derive(Clone, Debug)]
pub(super) struct Information<S: Real, D: Dim>
where
    DefaultAllocator: Allocator<D> + Allocator<D, D>,
{
    mean: OMatrix<S, D, D>,
    /// `M` made diagonal.
    rotated: OMatrix<S, D, D>,
    /// `Q`, one direction per column.
    directions: OMatrix<S, D, D>,
    values: OVector<S, D>,
    window: S,
    samples: S,
}

impl<S: Real, D: Dim> Information<S, D>
where
    DefaultAllocator: Allocator<D> + Allocator<D, D>,
{
    pub(super) fn new(dim: D, window: f64) -> Self {
        let zero = OMatrix::zeros_generic(dim, dim);
        Self {
            mean: zero.clone(),
            rotated: zero.clone(),
            directions: zero,
            values: OVector::zeros_generic(dim, U1),
            window: S::of(window),
            samples: S::zero(),
        }
    }

    pub(super) fn clear(&mut self) {
        self.mean.fill(S::zero());
        self.values.fill(S::zero());
        self.samples = S::zero();
    }

    /// Takes one regressor; false, and nothing happens, when its square is not finite.
    pub(super) fn take(&mut self, psi: &[S]) -> bool {
        let square = psi.iter().fold(S::zero(), |sum, v| sum + *v * *v);
        if !square.is_finite() {
            return false;
        }
        self.samples = (self.samples + S::one()).smaller(self.window);
        for (i, a) in psi.iter().enumerate() {
            for (j, b) in psi.iter().enumerate() {
                let old = self.mean[(i, j)];
                self.mean[(i, j)] = old + (*a * *b - old) / self.samples;
            }
        }
        self.decompose();
        true
    }

    fn decompose(&mut self) {
        let n = self.values.len();
        self.rotated.copy_from(&self.mean);
        self.directions.fill_with_identity();
        let trace = (0..n).fold(S::zero(), |sum, i| sum + self.mean[(i, i)]);
        let negligible = trace * S::of(1e-9);
        for _ in 0..SWEEPS {
            let mut largest = S::zero();
            for p in 0..n {
                for q in p + 1..n {
                    largest = largest.larger(self.rotated[(p, q)].abs());
                    self.rotate(p, q);
                }
            }
            if largest <= negligible {
                break;
            }
        }
        for i in 0..n {
            self.values[i] = self.rotated[(i, i)].larger(S::zero());
        }
    }

    /// Makes the entry `(p, q)` zero.
    fn rotate(&mut self, p: usize, q: usize) {
        let (a, n) = (&mut self.rotated, self.values.len());
        let off = a[(p, q)];
        if off == S::zero() {
            return;
        }
        let two = S::of(2.0);
        let ratio = (a[(q, q)] - a[(p, p)]) / (two * off);
        let size = ratio.abs() + (S::one() + ratio * ratio).sqrt();
        let tangent = if ratio < S::zero() {
            -S::one() / size
        } else {
            S::one() / size
        };
        let cosine = S::one() / (S::one() + tangent * tangent).sqrt();
        let sine = tangent * cosine;
        for k in 0..n {
            let (x, y) = (a[(k, p)], a[(k, q)]);
            a[(k, p)] = cosine * x - sine * y;
            a[(k, q)] = sine * x + cosine * y;
        }
        for k in 0..n {
            let (x, y) = (a[(p, k)], a[(q, k)]);
            a[(p, k)] = cosine * x - sine * y;
            a[(q, k)] = sine * x + cosine * y;
        }
        for k in 0..n {
            let (x, y) = (self.directions[(k, p)], self.directions[(k, q)]);
            self.directions[(k, p)] = cosine * x - sine * y;
            self.directions[(k, q)] = sine * x + cosine * y;
        }
    }

    /// Replaces `vector` by its part along directions with `√m ≥ least`; false, and nothing is touched,
    /// where that is all of it: every direction is excited.
    pub(super) fn part(&self, vector: &mut [S], least: S, scratch: &mut [S]) -> bool {
        let floor = least * least;
        if self.values.iter().all(|m| *m >= floor) {
            return false;
        }
        scratch.fill(S::zero());
        for (i, m) in self.values.iter().enumerate() {
            if *m >= floor {
                let direction = self.directions.column(i);
                let along = (direction.iter().zip(vector.iter()))
                    .fold(S::zero(), |sum, (d, v)| sum + *d * *v);
                for (to, d) in scratch.iter_mut().zip(direction.iter()) {
                    *to += along * *d;
                }
            }
        }
        vector.copy_from_slice(scratch);
        true
    }

    /// `√m` of the least excited direction.
    pub(super) fn least(&self) -> S {
        let first = self.values[0];
        self.values.iter().fold(first, |a, m| a.smaller(*m)).sqrt()
    }

    /// `√(m_min/m_max)`; 0 where nothing is excited.
    pub(super) fn balance(&self) -> S {
        let greatest = self.values.iter().fold(S::zero(), |a, m| a.larger(*m));
        if greatest > S::zero() {
            self.least() / greatest.sqrt()
        } else {
            S::zero()
        }
    }
}
