//! The estimators that a robot can learn with.

use loopsight_core::learning::{Guarded, Guards, Lesson, Range, Withheld};
use loopsight_core::{Array, Estimator, Real};
use loopsight_estimators::{Rls, RlsSettings};
use loopsight_link::Learning;
use nalgebra::{Const, SVector};

/// An estimator that can be compiled into a firmware. [`aboard!`](crate::aboard) names it.
///
/// There is one per controlled state. Each works on scaled parameters, and [`Guarded`] does projection, dead zone
/// and excitation for it.
pub trait OnboardEstimator<S: Real>: Estimator<S> + Sized {
    /// How many parameters it estimates: those of one controlled state.
    const PARAMETERS: usize;

    /// An estimator as the host's message says. It starts from zero; [`Guarded`] sets the estimate.
    ///
    /// `None` where the settings cannot be used: the robot then refuses the configuration.
    fn new(settings: &Learning) -> Option<Self>;
}

impl<S: Real, const N: usize> OnboardEstimator<S> for Rls<S, Const<N>> {
    const PARAMETERS: usize = N;

    fn new(settings: &Learning) -> Option<Self> {
        let settings = RlsSettings {
            forgetting: settings.forgetting,
            initial_covariance: settings.initial_covariance,
            covariance_limit: Some(settings.covariance_limit),
            ..RlsSettings::default()
        };
        Rls::new(SVector::zeros(), &settings).ok()
    }
}

/// The parameters of one controlled state, estimated under guard.
///
/// Every [`OnboardEstimator`] is one, as [`Guarded`]; [`aboard!`](crate::aboard) makes it so.
pub trait RowEstimator<S: Real>: Sized {
    /// One element per parameter of the row.
    type Row<T: Copy + Send>: Array<T> + Copy + Send;

    /// Starts from `theta`. `None` where settings, ranges or guards cannot be used.
    fn new(
        settings: &Learning,
        theta: Self::Row<S>,
        ranges: &Self::Row<Range<S>>,
        guards: Guards,
    ) -> Option<Self>;

    /// See [`Guarded::update`].
    fn update(&mut self, regressor: &[S], measurement: S, withheld: Option<Withheld>) -> Lesson<S>;

    /// See [`Guarded::theta`].
    fn theta(&self) -> &[S];

    /// See [`Guarded::reset`].
    fn reset(&mut self, theta: &[S]);
}

impl<S, E, const N: usize> RowEstimator<S> for Guarded<S, E, Const<N>>
where
    S: Real,
    E: OnboardEstimator<S>,
{
    type Row<T: Copy + Send> = [T; N];

    fn new(
        settings: &Learning,
        theta: [S; N],
        ranges: &[Range<S>; N],
        guards: Guards,
    ) -> Option<Self> {
        Guarded::new(E::new(settings)?, SVector::from(theta), ranges, guards)
    }

    #[inline(always)]
    fn update(&mut self, regressor: &[S], measurement: S, withheld: Option<Withheld>) -> Lesson<S> {
        Guarded::update(self, regressor, measurement, withheld)
    }

    #[inline(always)]
    fn theta(&self) -> &[S] {
        Guarded::theta(self)
    }

    fn reset(&mut self, theta: &[S]) {
        Guarded::reset(self, theta);
    }
}
