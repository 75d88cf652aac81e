//! An estimate with its covariance.

use loopsight_core::Real;
use nalgebra::allocator::Allocator;
use nalgebra::{DefaultAllocator, Dim, OVector};

use crate::factor::Factor;

/// An estimate, its covariance, and where both begin: what `rls` and `kalman` have in common.
#[derive(Clone, Debug)]
pub(crate) struct Estimate<S: Real, D: Dim>
where
    DefaultAllocator: Allocator<D> + Allocator<D, D>,
{
    theta: OVector<S, D>,
    pub(crate) factor: Factor<S, D>,
    initial: S,
    /// Greatest diagonal entry of `P`, less what rounding may add to it.
    cap: S,
}

impl<S: Real, D: Dim> Estimate<S, D>
where
    DefaultAllocator: Allocator<D> + Allocator<D, D>,
{
    /// `theta` with the covariance `initial I`, no diagonal entry of which may exceed `limit`.
    pub(crate) fn new(theta: OVector<S, D>, initial: f64, limit: f64) -> Self {
        let (dim, _) = theta.shape_generic();
        let factor = Factor::new(dim);
        let mut estimate = Self {
            cap: factor.shown_below(S::of(limit)),
            factor,
            initial: S::of(initial),
            theta,
        };
        estimate.restart();
        estimate
    }

    /// The covariance as in the beginning.
    pub(crate) fn restart(&mut self) {
        self.factor.restart(self.initial.min(self.cap));
    }

    /// `y - φᵀθ`.
    pub(crate) fn error(&self, regressor: &[S], measurement: S) -> S {
        error(self.theta.as_slice(), regressor, measurement)
    }

    /// Holds the diagonal of `P` at its limit.
    pub(crate) fn bound(&mut self) {
        self.factor.bound(self.cap);
    }

    /// `θ <- θ + P φ e/(noise + spread)`, for the `φ` of [`Factor::spread`] and what that returned; false, and
    /// nothing moved, where any of these is no finite number.
    pub(crate) fn advance(&mut self, innovation: S, noise: S, spread: S) -> bool {
        let step = innovation / (noise + spread);
        // A sum is finite where all of it is; one that is too large is refused as well.
        let mut sum = spread;
        for (i, theta) in self.theta.iter().enumerate() {
            sum += *theta + self.factor.gain(i) * step;
        }
        let finite = sum.is_finite();
        if finite {
            for (i, theta) in self.theta.iter_mut().enumerate() {
                *theta += self.factor.gain(i) * step;
            }
        }
        finite
    }

    pub(crate) fn theta(&self) -> &[S] {
        self.theta.as_slice()
    }

    /// An entry of `P`.
    pub(crate) fn covariance(&self, row: usize, column: usize) -> S {
        self.factor.entry(row, column)
    }

    /// As [`set`].
    pub(crate) fn set_theta(&mut self, theta: &[S]) -> bool {
        set(self.theta.as_mut_slice(), theta)
    }
}

/// `y - φᵀθ`.
pub(crate) fn error<S: Real>(theta: &[S], regressor: &[S], measurement: S) -> S {
    let products = regressor.iter().zip(theta);
    products.fold(measurement, |left, (phi, theta)| left - *phi * *theta)
}

/// Whether an estimate may start from `theta`: finite numbers, at least one.
pub(crate) fn is_start<S: Real>(theta: &[S]) -> bool {
    !theta.is_empty() && theta.iter().all(|v| v.is_finite())
}

/// What to say where [`is_start`] does not hold.
pub(crate) const NO_START: &str = "the start value is empty or not finite, expected finite numbers";

/// Moves `theta` to `to`; false, and nothing moved, where `to` has another length or is not finite.
pub(crate) fn set<S: Real>(theta: &mut [S], to: &[S]) -> bool {
    let fits = to.len() == theta.len() && to.iter().all(|v| v.is_finite());
    if fits {
        theta.copy_from_slice(to);
    }
    fits
}

/// All entries of a covariance, to compare.
#[cfg(test)]
pub(crate) fn covariance<S: Real>(of: &impl loopsight_core::Estimator<S>) -> std::vec::Vec<S> {
    let n = of.theta().len();
    let mut p = std::vec![S::zero(); n * n];
    of.covariance_into(&mut p);
    p
}

/// The settings of an estimate with its covariance, as `rls` and `kalman` declare them.
#[cfg(feature = "std")]
pub(crate) mod declared {
    use loopsight_model::registry::Setting;

    pub(crate) const INITIAL_COVARIANCE: Setting = Setting::new(
        "initial_covariance",
        "1",
        "the covariance starts as this multiple of the identity (scaled parameters squared over \
         measurement unit squared); default 1e6",
    );
    pub(crate) const COVARIANCE_LIMIT: Setting = Setting::new(
        "covariance_limit",
        "1",
        "greatest diagonal entry of the covariance, for times without excitation; default: the \
         initial covariance",
    );
}
