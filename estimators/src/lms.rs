//! Least mean squares, normalised.

use loopsight_core::{Estimator, Innovation, Real};
use nalgebra::allocator::Allocator;
use nalgebra::{DefaultAllocator, Dim, OVector};

use crate::estimate::{error, is_start, set};

mod settings;
pub use settings::{LmsError, LmsSettings};

/// Samples over which the mean power is taken.
const WINDOW: f64 = 100.0;

/// Normalised least mean squares (LMS) with leakage: the gradient step of one sample.
///
/// ```text
/// p <- p + (φᵀφ - p)/min(k, 100)
/// e = y - φᵀθ        θ <- θ + μ φ e/(ε + max(φᵀφ, p)) + γ (θ₀ - θ)
/// ```
///
/// | symbol | what | unit |
/// |---|---|---|
/// | `y`, `φ` | measurement, regressor | unit of `y`; of `y/θ_i` |
/// | `θ`, `θ₀` | estimate, where it started | of the parameters |
/// | `μ` | step, in (0, 2): the share of the error that one sample takes away | 1 |
/// | `p` | mean of `φᵀφ` over about a hundred samples | of `φᵀφ` |
/// | `ε` | keeps the step small where every regressor is | of `φᵀφ` |
/// | `γ` | leakage per sample, in [0, 1): pulls back to the start what nothing excites | 1 |
///
/// A sample with less than the mean power counts less by that ratio. Errors of the model (friction, a count of an
/// encoder) do not shrink with the regressor. Divided by the sample's own power, they would count most where there is
/// least to learn.
///
/// The cheapest estimator there is: `2n` multiplications, no matrix. It converges slowly where the
/// regressors are of different sizes or alike; the loop's scaling of parameters helps with the first
/// only. Without leakage each step takes the error of the parameters down, never up, as long as
/// there is no noise and `0 < μ < 2`. It has no covariance: [`Estimator::covariance`] is NaN, and
/// the relative variance of an innovation is said to be 1.
///
/// Assumptions: `y = φᵀθ + noise`, `θ` constant or slow against `1/μ` samples.
///
/// Reference: S. Haykin (2002), "Adaptive Filter Theory", 4th edition, ch. 6 (normalised) and section
/// 5.10 (leaky); G. C. Goodwin, K. S. Sin (1984), "Adaptive Filtering, Prediction and Control", section
/// 3.3 (the projection algorithm, its convergence).
///
/// ```
/// use loopsight_core::Estimator;
/// use loopsight_estimators::{Lms, LmsSettings};
/// use nalgebra::SVector;
///
/// let mut lms = Lms::new(SVector::<f32, 2>::zeros(), &LmsSettings::default()).unwrap();
/// for k in 0..2000 {
///     let x = (0.7 * k as f32).sin();
///     lms.update(&[1.0, x], 3.0 - 0.5 * x);
/// }
/// assert!((lms.theta()[0] - 3.0).abs() < 1e-4 && (lms.theta()[1] + 0.5).abs() < 1e-4);
/// ```
#[derive(Clone, Debug)]
pub struct Lms<S: Real, D: Dim>
where
    DefaultAllocator: Allocator<D>,
{
    theta: OVector<S, D>,
    start: OVector<S, D>,
    next: OVector<S, D>,
    step: S,
    leakage: S,
    regularization: S,
    power: S,
    samples: S,
}

impl<S: Real, D: Dim> Lms<S, D>
where
    DefaultAllocator: Allocator<D>,
{
    /// An estimator that starts from `theta`.
    ///
    /// # Errors
    ///
    /// `theta` is empty or not finite, or a setting is out of its range: see [`LmsError`].
    pub fn new(theta: OVector<S, D>, settings: &LmsSettings) -> Result<Self, LmsError> {
        settings.check()?;
        if !is_start(theta.as_slice()) {
            return Err(LmsError::Theta);
        }
        Ok(Self {
            start: theta.clone(),
            next: theta.clone(),
            theta,
            step: S::of(settings.step),
            leakage: S::of(settings.leakage),
            regularization: S::of(settings.regularization),
            power: S::zero(),
            samples: S::zero(),
        })
    }
}

impl<S: Real, D: Dim> Estimator<S> for Lms<S, D>
where
    DefaultAllocator: Allocator<D>,
    OVector<S, D>: Send,
{
    fn update(&mut self, regressor: &[S], measurement: S) -> Innovation<S> {
        let innovation = error(self.theta.as_slice(), regressor, measurement);
        self.correct(regressor, innovation)
    }

    fn correct(&mut self, regressor: &[S], innovation: S) -> Innovation<S> {
        if regressor.len() != self.theta.len() {
            return Innovation::refused();
        }
        let power = (regressor.iter()).fold(S::zero(), |sum, phi| sum + *phi * *phi);
        let samples = (self.samples + S::one()).min(S::of(WINDOW));
        let mean = self.power + (power - self.power) / samples;
        let gain = self.step * innovation / (self.regularization + power.max(mean));
        for (i, next) in self.next.iter_mut().enumerate() {
            let theta = self.theta[i];
            *next = theta + gain * regressor[i] + self.leakage * (self.start[i] - theta);
        }
        if !(power.is_finite() && self.next.iter().all(|v| v.is_finite())) {
            return Innovation::refused();
        }
        self.theta.copy_from(&self.next);
        (self.power, self.samples) = (mean, samples);
        Innovation {
            innovation,
            relative_variance: S::one(),
            accepted: true,
        }
    }

    fn theta(&self) -> &[S] {
        self.theta.as_slice()
    }

    fn covariance(&self, _row: usize, _column: usize) -> S {
        S::of(f64::NAN)
    }

    fn set_theta(&mut self, theta: &[S]) {
        set(self.theta.as_mut_slice(), theta);
    }

    fn reset(&mut self, theta: &[S]) {
        self.set_theta(theta);
        self.start.copy_from(&self.theta);
        (self.power, self.samples) = (S::zero(), S::zero());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::SVector;

    fn settings(step: f64, leakage: f64) -> LmsSettings {
        LmsSettings {
            step,
            leakage,
            regularization: 1e-9,
        }
    }

    /// Goodwin and Sin 1984, lemma 3.3.1.
    #[test]
    fn without_noise_the_error_of_the_parameters_never_grows() {
        let truth = [1.0, -2.0, 0.5];
        for step in [0.1, 1.0, 1.9] {
            let mut lms = Lms::new(SVector::<f64, 3>::zeros(), &settings(step, 0.0)).unwrap();
            let mut before = f64::INFINITY;
            for k in 0..3000 {
                let k = f64::from(k);
                let phi = [(0.3 * k).sin(), (1.1 * k).cos(), 1.0];
                let y: f64 = (0..3).map(|i| truth[i] * phi[i]).sum();
                assert!(lms.update(&phi, y).accepted);
                let error: f64 = (0..3).map(|i| (lms.theta()[i] - truth[i]).powi(2)).sum();
                assert!(error <= before * (1.0 + 1e-12), "step {step}, sample {k}");
                before = error + 1e-24;
            }
            // The start is wrong by 5.25.
            assert!(before < 1e-5, "step {step}: {before:e}");
        }
    }

    /// A step of 1 makes the prediction of the last sample right.
    #[test]
    fn a_full_step_explains_the_sample() {
        let mut lms = Lms::new(SVector::<f64, 2>::zeros(), &settings(1.0, 0.0)).unwrap();
        let told = lms.update(&[3.0, 4.0], 10.0);
        assert_eq!(told.innovation, 10.0);
        let found = 3.0 * lms.theta()[0] + 4.0 * lms.theta()[1];
        assert!((found - 10.0).abs() < 1e-8);
        assert!((lms.theta()[0] - 1.2).abs() < 1e-8);
    }

    #[test]
    fn leakage_brings_back_what_nothing_excites() {
        let mut lms = Lms::new(SVector::from([1.0f64, 1.0]), &settings(0.5, 0.01)).unwrap();
        lms.set_theta(&[5.0, 5.0]);
        for _ in 0..2000 {
            lms.update(&[1.0, 0.0], 5.0);
        }
        assert!((lms.theta()[0] - 5.0).abs() < 0.1, "{:?}", lms.theta());
        assert!((lms.theta()[1] - 1.0).abs() < 1e-6);
    }

    #[test]
    fn a_sample_that_is_no_number_changes_nothing() {
        let mut lms = Lms::new(SVector::<f32, 2>::zeros(), &LmsSettings::default()).unwrap();
        lms.update(&[1.0, 2.0], 3.0);
        let before = lms.theta().to_vec();
        for (phi, y) in [
            (&[f32::NAN, 0.0][..], 1.0),
            (&[1.0, f32::INFINITY], 1.0),
            (&[1.0, 0.0], f32::NAN),
            (&[1.0], 1.0),
            (&[1e30, 1e30], 1.0),
        ] {
            assert!(!lms.update(phi, y).accepted);
        }
        lms.set_theta(&[f32::NAN, 0.0]);
        lms.reset(&[1.0]);
        assert_eq!(lms.theta(), before);
        assert!(lms.covariance(0, 0).is_nan());
    }

    #[test]
    fn impossible_settings_are_refused_by_name() {
        let start = SVector::<f64, 2>::zeros();
        for (settings, key) in [
            (settings(0.0, 0.0), "step"),
            (settings(2.0, 0.0), "step"),
            (settings(1.0, 1.0), "leakage"),
            (settings(1.0, f64::NAN), "leakage"),
            (
                LmsSettings {
                    regularization: 0.0,
                    ..LmsSettings::default()
                },
                "regularization",
            ),
        ] {
            let error = Lms::new(start, &settings).unwrap_err();
            assert_eq!(error.key(), key);
            assert!(error.to_string().contains("expected"), "{error}");
        }
    }
}
