//! The role of a recursive estimator.

use crate::Real;

/// What one update learned.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Innovation<S> {
    /// A-priori prediction error `y - phi . theta`, in the unit of `y`.
    pub innovation: S,
    /// Its variance relative to that of the measurement noise, `1 + phi' P phi`.
    pub relative_variance: S,
    /// False when the sample was not used (not finite).
    pub accepted: bool,
}

impl<S: Real> Innovation<S> {
    /// That of a sample that was not used.
    pub fn refused() -> Self {
        Self {
            innovation: S::of(f64::NAN),
            relative_variance: S::of(f64::NAN),
            accepted: false,
        }
    }
}

/// Recursive estimation of `y = phi . theta` from one scalar measurement at a time.
///
/// Implementations allocate nothing in [`Estimator::update`].
pub trait Estimator<S: Real>: Send {
    /// Takes one regressor (as long as `theta`) and its measurement.
    ///
    /// A sample with NaN or infinity, or a regressor of another length, leaves the estimate as it
    /// is and comes back with `accepted` false.
    fn update(&mut self, regressor: &[S], measurement: S) -> Innovation<S>;
    /// The same, where the innovation is known, or another one is to be learned from: the measurement is
    /// what the estimate predicts, and `innovation`.
    fn correct(&mut self, regressor: &[S], innovation: S) -> Innovation<S> {
        let known = regressor.iter().zip(self.theta());
        let known = known.fold(S::zero(), |sum, (phi, theta)| sum + *phi * *theta);
        self.update(regressor, known + innovation)
    }
    /// The estimate.
    fn theta(&self) -> &[S];
    /// The covariance of two of its entries relative to the variance of the measurement noise; NaN where the method
    /// has none. It is computed on request, and costs a tick nothing.
    fn covariance(&self, row: usize, column: usize) -> S;
    /// All of it, column by column; `into` has the square of the estimate's length.
    fn covariance_into(&self, into: &mut [S]) {
        let n = self.theta().len();
        for (k, entry) in into.iter_mut().enumerate() {
            *entry = self.covariance(k % n, k / n);
        }
    }
    /// Moves the estimate and leaves the covariance as it is. A guard uses it to keep the estimate in range. Ignored
    /// unless `theta` has the right length and is finite.
    fn set_theta(&mut self, theta: &[S]);
    /// Starts over from `theta` with the initial covariance.
    fn reset(&mut self, theta: &[S]);
}

#[cfg(feature = "std")]
impl<S: Real, E: Estimator<S> + ?Sized> Estimator<S> for Box<E> {
    fn update(&mut self, regressor: &[S], measurement: S) -> Innovation<S> {
        (**self).update(regressor, measurement)
    }
    fn correct(&mut self, regressor: &[S], innovation: S) -> Innovation<S> {
        (**self).correct(regressor, innovation)
    }
    fn theta(&self) -> &[S] {
        (**self).theta()
    }
    fn covariance(&self, row: usize, column: usize) -> S {
        (**self).covariance(row, column)
    }
    fn set_theta(&mut self, theta: &[S]) {
        (**self).set_theta(theta);
    }
    fn reset(&mut self, theta: &[S]) {
        (**self).reset(theta);
    }
}
