//! The control laws that a robot can run.

use loopsight_controllers::FeedbackLinearizingPi;
use loopsight_core::{Controller, Real};
use loopsight_link::ControllerGains;
use nalgebra::{Const, SVector};

/// A control law that can be compiled into a firmware. [`aboard!`](crate::aboard) names it.
pub trait OnboardLaw<S: Real>: Controller<S> + Sized {
    /// A law with the gains and limits of the host's message; `period` in s.
    ///
    /// `None` where they cannot be used: the robot then refuses the configuration.
    fn new(gains: &ControllerGains, period: f64) -> Option<Self>;
}

impl<S: Real, const N: usize> OnboardLaw<S> for FeedbackLinearizingPi<S, Const<N>> {
    fn new(gains: &ControllerGains, period: f64) -> Option<Self> {
        let vector = |list: &[f64]| <[f64; N]>::try_from(list).ok().map(SVector::from);
        FeedbackLinearizingPi::new(
            &vector(&gains.proportional)?,
            &vector(&gains.integral)?,
            &vector(&gains.limit)?,
            period,
        )
        .ok()
    }
}
