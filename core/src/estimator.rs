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
    /// The estimate.
    fn theta(&self) -> &[S];
    /// Its covariance relative to the variance of the measurement noise, column by column; NaN where
    /// the method has none.
    fn covariance(&self) -> &[S];
    /// Moves the estimate and leaves the covariance as it is: who guards the estimator holds it in
    /// range by this. Ignored unless `theta` has the right length and is finite.
    fn set_theta(&mut self, theta: &[S]);
    /// Starts over from `theta` with the initial covariance.
    fn reset(&mut self, theta: &[S]);
}

#[cfg(feature = "std")]
impl<S: Real, E: Estimator<S> + ?Sized> Estimator<S> for Box<E> {
    fn update(&mut self, regressor: &[S], measurement: S) -> Innovation<S> {
        (**self).update(regressor, measurement)
    }
    fn theta(&self) -> &[S] {
        (**self).theta()
    }
    fn covariance(&self) -> &[S] {
        (**self).covariance()
    }
    fn set_theta(&mut self, theta: &[S]) {
        (**self).set_theta(theta);
    }
    fn reset(&mut self, theta: &[S]) {
        (**self).reset(theta);
    }
}
