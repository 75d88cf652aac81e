//! The excitation of a stream of regressors, direction by direction.

use nalgebra::allocator::Allocator;
use nalgebra::{DefaultAllocator, Dim, OMatrix, OVector, U1};

use crate::Real;

/// Most sweeps of rotations per sample; warm-started, one or two are the rule.
const SWEEPS: usize = 8;

/// Square of the correlation from which on two directions are turned where one of them is excited and the
/// other is not: what is left out of a regressor must have nothing to do with what stays.
const APART: f64 = 0.01 * 0.01;

/// The same where both are excited, or both are not: there it only says how right `√m` is.
const ALIKE: f64 = 0.1 * 0.1;

/// An off-diagonal entry below this share of the diagonal is rounding.
const ROUNDING: f64 = 1e-6;

/// Ratio of the diagonal's difference to twice the entry beside it from which on an angle is small: series take
/// the place of roots.
const SMALL: f64 = 20.0;

/// Rotations after which the directions are made orthonormal again.
const ROTATIONS: u8 = 100;

/// Share of the least excitation below which a direction counts as absent.
const ABSENT: f64 = 0.1;

/// The mean of `ψψᵀ` over a window that forgets exponentially, in directions that hardly correlate.
///
/// ```text
/// M_k = M_{k-1} + (ψ_k ψ_kᵀ - M_{k-1})/min(k, W)        QᵀM Q = diag(m) + R
/// R_ij² ≤ c² max(m_i, f) max(m_j, f)                     f = (m₀/10)²
/// ```
///
/// `QᵀMQ` is what is kept, and a sample is taken in as `Qᵀψ`. It moves the matrix by the `W`-th part of
/// itself at most, so that the directions of the sample before are nearly those of this one: Jacobi's
/// rotations go on where they ended, and only with pairs that correlate by more than `c`. By that rule the
/// diagonal entries are the eigenvalues to a relative `(n - 1) c`, also the least, and `m_i` is what it says in
/// any case: the mean square of `q_iᵀψ`.
///
/// `c` is 0.01 where one of the two is excited and the other is not: what is taken out of a regressor would
/// else be blamed on what stays, a bias of `c √(m_j/m_i)` of the error of what is not excited. Where both are, or
/// both are not, nothing depends on it and 0.1 will do. A sample turns each pair once; more often only where
/// one turned far, as in the beginning.
///
/// The directions are made orthonormal again now and then: each is made orthogonal to those before it, and as
/// long as 1 by a step of Newton's iteration, `q ← q (3 - qᵀq)/2`.
///
/// Reference: G. H. Golub, C. F. Van Loan (2013), "Matrix Computations", 4th edition, section 8.5
/// (cyclic Jacobi) and 5.2 (Gram–Schmidt); J. Demmel, K. Veselić (1992), "Jacobi's method is more accurate than
/// QR", SIAM Journal on Matrix Analysis and Applications 13(4), 1204–1245 (the rule by which pairs are
/// turned); R. R. Bitmead (1984), "Persistence of excitation conditions
/// and the convergence of adaptive schemes", IEEE Transactions on Information Theory 30(2), 183–191.
#[derive(Clone, Debug)]
pub(super) struct Information<S: Real, D: Dim>
where
    DefaultAllocator: Allocator<D> + Allocator<D, D>,
{
    /// Upper triangle of `QᵀMQ`; the rest is not used.
    rotated: OMatrix<S, D, D>,
    /// `Q`, one direction per column.
    directions: OMatrix<S, D, D>,
    /// `Qᵀψ` of the last sample.
    seen: OVector<S, D>,
    /// `m₀²` and `f`.
    floors: [S; 2],
    window: S,
    samples: S,
    /// `1/min(k, W)`.
    share: S,
    rotations: u8,
}

impl<S: Real, D: Dim> Information<S, D>
where
    DefaultAllocator: Allocator<D> + Allocator<D, D>,
{
    /// Over `window` samples; `least` is `m₀`.
    pub(super) fn new(dim: D, window: f64, least: f64) -> Self {
        let absent = least * ABSENT;
        let mut information = Self {
            rotated: OMatrix::zeros_generic(dim, dim),
            directions: OMatrix::zeros_generic(dim, dim),
            seen: OVector::zeros_generic(dim, U1),
            floors: [S::of(least * least), S::of(absent * absent)],
            window: S::of(window),
            samples: S::zero(),
            share: S::one(),
            rotations: 0,
        };
        information.clear();
        information
    }

    pub(super) fn clear(&mut self) {
        self.rotated.fill(S::zero());
        self.directions.fill_with_identity();
        self.samples = S::zero();
        self.rotations = 0;
    }

    /// Takes one regressor and returns `|ψ|²`; `None`, and nothing happens, when that is not finite.
    pub(super) fn take(&mut self, psi: &[S]) -> Option<S> {
        let n = self.seen.len();
        let (a, directions) = (self.rotated.as_mut_slice(), self.directions.as_slice());
        let seen = self.seen.as_mut_slice();
        let mut square = S::zero();
        for (to, direction) in seen.iter_mut().zip(directions.chunks_exact(n)) {
            *to = dot(direction, psi);
            square += *to * *to;
        }
        if !square.is_finite() {
            return None;
        }
        if self.samples < self.window {
            self.samples = (self.samples + S::one()).min(self.window);
            self.share = S::one() / self.samples;
        }
        let share = self.share;
        for q in 0..n {
            for p in 0..n {
                if p <= q {
                    let old = a[q * n + p];
                    a[q * n + p] = old + share * (seen[p] * seen[q] - old);
                }
            }
        }
        if self.sweep() {
            self.straighten();
        }
        Some(square)
    }

    /// Whether the directions `p` and `q`, `p` below `q`, are to be turned.
    #[inline(always)]
    fn correlate(&self, p: usize, q: usize) -> bool {
        let (n, a) = (self.seen.len(), self.rotated.as_slice());
        let [floor, least] = self.floors;
        let (own, other, off) = (a[p * n + p], a[q * n + q], a[q * n + p]);
        let apart = (own - floor) * (other - floor) < S::zero();
        let correlated = S::of(if apart { APART } else { ALIKE });
        off * off > correlated * (own.max(least) * other.max(least))
    }

    /// Turns pairs of directions that correlate, each once; true where one of them turned far. The loops are
    /// of fixed length, which a compiler unrolls.
    #[inline(always)]
    fn sweep(&mut self) -> bool {
        let n = self.seen.len();
        let mut far = false;
        for p in 0..n {
            for q in 0..n {
                if p < q && self.correlate(p, q) {
                    far |= self.rotate(p, q);
                }
            }
        }
        far
    }

    /// Turns pairs until none turns far.
    #[cold]
    #[inline(never)]
    fn straighten(&mut self) {
        for _ in 0..SWEEPS {
            if !self.sweep() {
                break;
            }
        }
    }

    /// Makes the entry `(p, q)` zero, `p` below `q`, unless it is but rounding. True where the angle is not
    /// small, so that other entries, too, are not what they were.
    #[inline(never)]
    fn rotate(&mut self, p: usize, q: usize) -> bool {
        let n = self.seen.len();
        let a = self.rotated.as_mut_slice();
        let (own, other, off) = (a[p * n + p], a[q * n + q], a[q * n + p]);
        if off.abs() <= S::of(ROUNDING) * (own + other) {
            return false;
        }
        let (one, half) = (S::one(), S::of(0.5));
        let ratio = half * (other - own) / off;
        let far = ratio.abs() <= S::of(SMALL);
        let (tangent, cosine) = if far {
            steep(ratio)
        } else {
            let first = half / ratio;
            let tangent = first - first * first * first;
            let square = tangent * tangent;
            (tangent, one - half * square * (one - S::of(0.75) * square))
        };
        let sine = tangent * cosine;
        let turn = |x: S, y: S| (cosine * x - sine * y, sine * x + cosine * y);
        a[p * n + p] = (own - tangent * off).max(S::zero());
        a[q * n + q] = (other + tangent * off).max(S::zero());
        a[q * n + p] = S::zero();
        for k in 0..p {
            let (to_p, to_q) = (p * n + k, q * n + k);
            (a[to_p], a[to_q]) = turn(a[to_p], a[to_q]);
        }
        for k in p + 1..q {
            let (to_p, to_q) = (k * n + p, q * n + k);
            (a[to_p], a[to_q]) = turn(a[to_p], a[to_q]);
        }
        for k in q + 1..n {
            let (to_p, to_q) = (k * n + p, k * n + q);
            (a[to_p], a[to_q]) = turn(a[to_p], a[to_q]);
        }
        let (before, after) = self.directions.as_mut_slice().split_at_mut(q * n);
        for (own, other) in before[p * n..].iter_mut().zip(&mut after[..n]).take(n) {
            (*own, *other) = turn(*own, *other);
        }
        (self.seen[p], self.seen[q]) = turn(self.seen[p], self.seen[q]);
        self.rotations += 1;
        if self.rotations == ROTATIONS {
            self.orthonormalize();
        }
        far
    }

    /// Takes out of the directions what rounding has put into them: each is made orthogonal to those
    /// before it, and as long as 1 by a step of Newton's iteration.
    #[cold]
    fn orthonormalize(&mut self) {
        let n = self.seen.len();
        let directions = self.directions.as_mut_slice();
        for q in 0..n {
            let (before, rest) = directions.split_at_mut(q * n);
            let own = &mut rest[..n];
            for other in before.chunks_exact(n) {
                let along = dot(other, own);
                for (to, from) in own.iter_mut().zip(other) {
                    *to -= along * *from;
                }
            }
            let length = S::of(0.5) * (S::of(3.0) - dot(own, own));
            for to in own {
                *to *= length;
            }
        }
        self.rotations = 0;
    }

    /// The excitation `m` of the `i`-th direction.
    fn mean(&self, i: usize) -> S {
        self.rotated[(i, i)]
    }

    /// Whether a direction is not excited, `√m < m₀`.
    pub(super) fn masks(&self) -> bool {
        let n = self.seen.len();
        (0..n).any(|i| self.mean(i) < self.floors[0])
    }

    /// Of `psi`, the last sample, the part along directions with `√m ≥ m₀`; `|ψ'|²`.
    pub(super) fn excited(&self, psi: &mut [S]) -> S {
        let n = psi.len();
        psi.fill(S::zero());
        let mut square = S::zero();
        for (i, direction) in self.directions.as_slice().chunks_exact(n).enumerate() {
            if self.mean(i) >= self.floors[0] {
                let along = self.seen[i];
                square += along * along;
                for (to, d) in psi.iter_mut().zip(direction) {
                    *to += along * *d;
                }
            }
        }
        square
    }

    /// `m₀²`.
    pub(super) fn floor(&self) -> S {
        self.floors[0]
    }

    /// Whether a direction is as good as absent, `√m < m₀/10`.
    pub(super) fn hides(&self) -> bool {
        let n = self.seen.len();
        (0..n).any(|i| self.mean(i) < self.floors[1])
    }

    /// Takes out of `change` what is along directions that are as good as absent.
    pub(super) fn present(&self, change: &mut [S], scratch: &mut [S]) {
        let n = change.len();
        scratch.fill(S::zero());
        for (i, direction) in self.directions.as_slice().chunks_exact(n).enumerate() {
            if self.mean(i) >= self.floors[1] {
                let along = dot(direction, change);
                for (to, d) in scratch.iter_mut().zip(direction) {
                    *to += along * *d;
                }
            }
        }
        change.copy_from_slice(scratch);
    }

    /// `√m` of the least excited direction.
    pub(super) fn least(&self) -> S {
        let n = self.seen.len();
        (1..n).fold(self.mean(0), |a, i| a.min(self.mean(i))).sqrt()
    }

    /// `√(m_min/m_max)`; 0 where nothing is excited.
    pub(super) fn balance(&self) -> S {
        let n = self.seen.len();
        let greatest = (0..n).fold(S::zero(), |a, i| a.max(self.mean(i)));
        if greatest > S::zero() {
            self.least() / greatest.sqrt()
        } else {
            S::zero()
        }
    }
}

/// Tangent and cosine of the smaller angle by which a pair is turned, where the difference of its diagonal
/// entries is `ratio` times twice the entry beside them.
#[cold]
fn steep<S: Real>(ratio: S) -> (S, S) {
    let one = S::one();
    let size = ratio.abs() + (one + ratio * ratio).sqrt();
    let tangent = if ratio < S::zero() { -one } else { one } / size;
    (tangent, one / (one + tangent * tangent).sqrt())
}

fn dot<S: Real>(a: &[S], b: &[S]) -> S {
    let products = a.iter().zip(b).map(|(a, b)| *a * *b);
    products
        .reduce(|sum, product| sum + product)
        .unwrap_or(S::zero())
}

#[cfg(test)]
mod tests {
    use nalgebra::{Const, Matrix3, Vector3};

    use super::*;

    const WINDOW: f64 = 200.0;
    const LEAST: f64 = 0.02;

    /// Numbers from -1 to 1 without structure.
    struct Random(u64);

    impl Random {
        fn next(&mut self) -> f64 {
            self.0 = self
                .0
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (self.0 >> 33) as f64 / f64::from(1u32 << 30) - 1.0
        }
    }

    /// Regressors whose directions and sizes change, some of them hardly excited, for half a million samples
    /// in single precision: the directions stay orthonormal, what is said of them is the mean itself made
    /// nearly diagonal, and the excitations are the eigenvalues to what was promised.
    #[test]
    fn directions_follow_the_mean_and_stay_orthonormal() {
        let mut random = Random(3);
        let mut information: Information<f32, Const<3>> = Information::new(Const, WINDOW, LEAST);
        let mut mean = Matrix3::<f64>::zeros();
        let (mut axes, mut sizes) = (Matrix3::identity(), [1.0; 3]);
        let (mut worst, mut rotations) = ([0.0f64; 3], 0);
        for k in 0..500_000 {
            if k % 500 == 0 {
                axes = Matrix3::from_fn(|_, _| random.next());
                sizes = [0, 1, 2].map(|_| 10f64.powf(2.0 * random.next() - 1.0));
            }
            let parts = Vector3::from(sizes.map(|size| size * random.next()));
            let psi = (axes * parts).map(|v| v as f32);
            let before = information.rotations;
            assert!(information.take(psi.as_slice()).is_some());
            rotations += u32::from(information.rotations != before);
            let psi = psi.map(f64::from);
            mean += (psi * psi.transpose() - mean) / f64::from(k + 1).min(WINDOW);
            if k % 97 != 0 {
                continue;
            }
            let q = information.directions.map(f64::from);
            let skew = (q.transpose() * q - Matrix3::identity()).abs().max();
            let seen = q.transpose() * mean * q;
            let floor = (LEAST * ABSENT).powi(2);
            let of = |i: usize| seen[(i, i)].max(floor);
            let excited = |i: usize| information.mean(i) >= information.floor();
            for (i, j) in [(0, 1), (0, 2), (1, 2)] {
                let correlation = seen[(i, j)].abs() / (of(i) * of(j)).sqrt();
                let alike = excited(i) == excited(j);
                let may = if alike { ALIKE } else { APART }.sqrt();
                worst[0] = worst[0].max(correlation / may);
            }
            let mut exact = mean.symmetric_eigenvalues();
            let mut said = information.rotated.diagonal().map(f64::from);
            exact.as_mut_slice().sort_by(f64::total_cmp);
            said.as_mut_slice().sort_by(f64::total_cmp);
            for (exact, said) in exact.iter().zip(&said) {
                if *exact > floor {
                    worst[1] = worst[1].max((said / exact - 1.0).abs());
                }
            }
            worst[2] = worst[2].max(skew);
        }
        println!("{worst:.9?}; {rotations} samples turned");
        assert!(worst[0] < 1.01, "{worst:?}");
        assert!(worst[1] < 2.0 * ALIKE.sqrt(), "{worst:?}");
        assert!(worst[2] < 1e-5, "{worst:?}");
        assert!(rotations > 10_000, "{rotations}");
    }

    /// What is not excited is left out of a regressor, what is absent out of a change.
    #[test]
    fn parts_are_those_along_excited_directions() {
        let mut information: Information<f64, Const<2>> = Information::new(Const, WINDOW, LEAST);
        let along = [0.6, 0.8];
        let mut random = Random(4);
        for _ in 0..1000 {
            let (a, b) = (random.next(), 1e-4 * random.next());
            let psi = [a * along[0] - b * along[1], a * along[1] + b * along[0]];
            information.take(&psi);
            let mut part = psi;
            let left = information.excited(&mut part);
            assert!((left - a * a).abs() < 1e-3 * a.abs() + 1e-7, "{left} {a}");
            let across = part[1] * along[0] - part[0] * along[1];
            assert!(across.abs() < 1e-3 * a.abs() + 1e-7, "{across}");
        }
        assert!(information.hides() && information.balance() < 1e-3);
        let mut change = [along[0] - 5.0 * along[1], along[1] + 5.0 * along[0]];
        information.present(&mut change, &mut [0.0; 2]);
        for (left, along) in change.iter().zip(along) {
            assert!((left - along).abs() < 1e-2, "{change:?}");
        }
        assert!(information.take(&[1e200, 0.0]).is_none());
    }
}
