//! A Kalman filter for parameters that walk at random.

use loopsight_core::{Estimator, Innovation, Real};
use nalgebra::allocator::Allocator;
use nalgebra::{DefaultAllocator, Dim, OMatrix, OVector};

use crate::estimate::{Estimate, is_start};

mod settings;
pub use settings::{KalmanError, KalmanSettings};

/// A Kalman filter whose state are the parameters, as a random walk.
///
/// ```text
/// θ_k = θ_{k-1} + w,  cov w = q I σ²        y_k = φ_kᵀθ_k + v,  var v = σ²
/// P <- P + q I, then P_ii <= p_max          K = P φ/(1 + φᵀP φ)
/// θ <- θ + K (y - φᵀθ)                      P <- P - K φᵀP
/// ```
///
/// | symbol | what | unit |
/// |---|---|---|
/// | `y`, `φ` | measurement, regressor | unit of `y`; of `y/θ_i` |
/// | `θ`, `K` | estimate, gain | unit of `θ_i`; of `θ_i/y` |
/// | `P` | covariance of `θ` over the variance of the noise in `y` | of `θ_i θ_j/y²` |
/// | `q` | growth of the covariance in a sample | of `θ_i²/y²` |
/// | `p_max` | greatest diagonal entry of `P` | of `θ_i²/y²` |
///
/// Against forgetting: the covariance grows by the same amount in a sample whether the sample excites
/// or not, linearly and not exponentially, and each parameter on its own. A parameter that is not
/// excited reaches `p_max` late and stays there. With `q = 0` it is least squares.
///
/// **Round-off.** `P` is kept as `U D Uᵀ` as in [`crate::Rls`]; `q` is added by rank-one sums, which
/// only add positive numbers to `D`.
///
/// Assumptions: white noise, independent of `φ`; the random walk's steps are alike in the parameters'
/// scales.
///
/// Reference: L. Ljung (1999), "System Identification: Theory for the User", 2nd edition, section
/// 11.3, the Kalman filter as a recursive estimator; K. J. Åström, B. Wittenmark (2008), "Adaptive
/// Control", section 2.2; G. J. Bierman (1977), "Factorization Methods for Discrete Sequential
/// Estimation", ch. V and appendix III.C.
///
/// ```
/// use loopsight_core::Estimator;
/// use loopsight_estimators::{Kalman, KalmanSettings};
/// use nalgebra::SVector;
///
/// let mut kalman = Kalman::new(SVector::<f64, 2>::zeros(), &KalmanSettings::default()).unwrap();
/// for k in 0..200 {
///     let x = f64::from(k % 7);
///     // The slope changes half way.
///     let slope = if k < 100 { -0.5 } else { 0.5 };
///     kalman.update(&[1.0, x], 3.0 + slope * x);
/// }
/// assert!((kalman.theta()[0] - 3.0).abs() < 0.1 && (kalman.theta()[1] - 0.5).abs() < 0.05);
/// ```
#[derive(Clone, Debug)]
pub struct Kalman<S: Real, D: Dim>
where
    DefaultAllocator: Allocator<D> + Allocator<D, D>,
{
    estimate: Estimate<S, D>,
    drift: S,
}

impl<S: Real, D: Dim> Kalman<S, D>
where
    DefaultAllocator: Allocator<D> + Allocator<D, D>,
{
    /// An estimator that starts from `theta`.
    ///
    /// # Errors
    ///
    /// `theta` is empty or not finite, or a setting is out of its range: see [`KalmanError`].
    pub fn new(theta: OVector<S, D>, settings: &KalmanSettings) -> Result<Self, KalmanError> {
        if !is_start(theta.as_slice()) {
            return Err(KalmanError::Theta);
        }
        let limit = settings.check::<S>(theta.len())?;
        Ok(Self {
            estimate: Estimate::new(theta, settings.initial_covariance, limit),
            drift: S::of(settings.drift),
        })
    }
}

impl<S: Real, D: Dim> Estimator<S> for Kalman<S, D>
where
    DefaultAllocator: Allocator<D> + Allocator<D, D>,
    OVector<S, D>: Send,
    OMatrix<S, D, D>: Send,
{
    fn update(&mut self, regressor: &[S], measurement: S) -> Innovation<S> {
        let innovation = self.estimate.error(regressor, measurement);
        self.correct(regressor, innovation)
    }

    fn correct(&mut self, regressor: &[S], innovation: S) -> Innovation<S> {
        let n = self.theta().len();
        let estimate = &mut self.estimate;
        // Before anything grows: NaN and infinity anywhere in the sample end up in one of these.
        if regressor.len() != n {
            return Innovation::refused();
        }
        let mut spread = estimate.factor.spread(regressor);
        if !(spread.is_finite() && innovation.is_finite()) {
            return Innovation::refused();
        }
        if self.drift > S::zero() {
            for i in 0..n {
                let unit = |k| if k == i { S::one() } else { S::zero() };
                estimate.factor.add(self.drift, unit);
            }
            estimate.bound();
            spread = estimate.factor.spread(regressor);
        }
        if !estimate.advance(innovation, S::one(), spread) {
            return Innovation::refused();
        }
        estimate.factor.absorb(S::one(), S::one());
        Innovation {
            innovation,
            relative_variance: S::one() + spread,
            accepted: true,
        }
    }

    fn theta(&self) -> &[S] {
        self.estimate.theta()
    }

    fn covariance(&self, row: usize, column: usize) -> S {
        self.estimate.covariance(row, column)
    }

    fn set_theta(&mut self, theta: &[S]) {
        self.estimate.set_theta(theta);
    }

    /// Nothing changes when `theta` has another length or is not finite.
    fn reset(&mut self, theta: &[S]) {
        if self.estimate.set_theta(theta) {
            self.estimate.restart();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimate::covariance;
    use nalgebra::{SMatrix, SVector};

    fn settings(initial_covariance: f64, drift: f64) -> KalmanSettings {
        KalmanSettings {
            initial_covariance,
            drift,
            covariance_limit: Some(1e12),
        }
    }

    fn regressor(k: i32) -> [f64; 3] {
        let k = f64::from(k);
        [
            (0.3 * k).sin(),
            (1.1 * k).cos(),
            1.0 + 0.5 * (2.3 * k).sin(),
        ]
    }

    /// Against the equations written down as they stand.
    #[test]
    fn the_factored_filter_is_the_textbook_filter() {
        let mut kalman = Kalman::new(SVector::<f64, 3>::zeros(), &settings(100.0, 0.01)).unwrap();
        let mut theta = SVector::<f64, 3>::zeros();
        let mut p = SMatrix::<f64, 3, 3>::identity() * 100.0;
        for k in 0..500 {
            let phi = SVector::from(regressor(k));
            let y = 2.0 * phi[0] - phi[1] + 0.3 * f64::from(k % 5);
            p += SMatrix::identity() * 0.01;
            let spread = phi.dot(&(p * phi));
            let gain = p * phi / (1.0 + spread);
            theta += gain * (y - phi.dot(&theta));
            p -= gain * (p * phi).transpose();
            let told = kalman.update(phi.as_slice(), y);
            assert!((told.relative_variance - 1.0 - spread).abs() < 1e-9 * (1.0 + spread));
            for i in 0..3 {
                assert!((kalman.theta()[i] - theta[i]).abs() < 1e-9);
                assert!((kalman.covariance(i, i) - p[(i, i)]).abs() < 1e-9);
            }
        }
    }

    /// What is not excited grows linearly and stops at the limit; the rest is known as before.
    #[test]
    fn a_million_samples_along_one_direction_leave_a_covariance_in_single_precision() {
        let settings = KalmanSettings {
            initial_covariance: 10.0,
            drift: 1e-3,
            covariance_limit: Some(100.0),
        };
        let mut kalman = Kalman::new(SVector::<f32, 3>::zeros(), &settings).unwrap();
        for k in 0..1_000_000 {
            let x = if k % 2 == 0 { 1.0 } else { -1.0 };
            assert!(kalman.update(&[x, 0.0, x], 2.0 * x).accepted);
        }
        let p = covariance(&kalman);
        assert!(p.iter().all(|v| v.is_finite()));
        assert!(p[4] <= 100.0 && p[4] > 99.0, "{p:?}");
        assert!(p[0] <= 100.0 && p[8] <= 100.0, "{p:?}");
        let sum = kalman.theta()[0] + kalman.theta()[2];
        assert!((sum - 2.0).abs() < 1e-4, "{:?}", kalman.theta());
        assert_eq!(kalman.theta()[1], 0.0);
    }

    #[test]
    fn a_sample_that_is_no_number_changes_nothing() {
        let mut kalman =
            Kalman::new(SVector::<f64, 3>::zeros(), &KalmanSettings::default()).unwrap();
        for k in 0..20 {
            kalman.update(&regressor(k), 1.0);
        }
        let before = (kalman.theta().to_vec(), covariance(&kalman));
        for (phi, y) in [
            (&[1.0, f64::NAN, 0.0][..], 1.0),
            (&[1.0, 1.0, 1.0], f64::INFINITY),
            (&[1e200, 0.0, 0.0], 1.0),
            (&[1.0, 1.0], 1.0),
        ] {
            assert!(!kalman.update(phi, y).accepted);
        }
        kalman.reset(&[f64::NAN, 0.0, 0.0]);
        assert_eq!(before, (kalman.theta().to_vec(), covariance(&kalman)));
    }

    #[test]
    fn impossible_settings_are_refused_by_name() {
        let start = SVector::<f32, 2>::zeros();
        for (settings, key) in [
            (settings(0.0, 0.0), "initial_covariance"),
            (settings(1.0, -1.0), "drift"),
            (settings(1.0, f64::NAN), "drift"),
            (settings(1e13, 0.0), "covariance_limit"),
        ] {
            let error = Kalman::new(start, &settings).unwrap_err();
            assert_eq!(error.key(), key);
            assert!(error.to_string().contains("expected"), "{error}");
        }
    }
}
