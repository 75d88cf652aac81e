//! Recursive least squares with forgetting.

use loopsight_core::{Estimator, Innovation, Real};
use nalgebra::allocator::Allocator;
use nalgebra::{DefaultAllocator, Dim, OMatrix, OVector};

use crate::estimate::{Estimate, is_start};

mod forgetting;
mod settings;
use forgetting::Memory;
pub use settings::{Forgetting, RlsError, RlsSettings};

/// Recursive least squares (RLS) with forgetting and a bounded covariance.
///
/// ```text
/// e = y - φᵀθ        K = P φ/(λ + φᵀP φ)                        (44)(46)(47)
/// θ <- θ + K e       P <- (P - K φᵀP)/λ                         (45)(44)
/// then, for each i with P_ii > p_max:   P⁻¹ <- P⁻¹ + (1/p_max - 1/P_ii) e_i e_iᵀ
/// ```
///
/// | symbol | what | unit |
/// |---|---|---|
/// | `y`, `φ` | measurement, regressor | unit of `y`; of `y/θ_i` |
/// | `θ`, `K` | estimate, gain | unit of `θ_i`; of `θ_i/y` |
/// | `P` | covariance of `θ` over the variance of the noise in `y` | of `θ_i θ_j/y²` |
/// | `λ` | forgetting, in (0, 1]; the memory is about `1/(1 - λ)` samples | 1 |
/// | `p_max` | greatest diagonal entry of `P` | of `θ_i²/y²` |
///
/// **Rules of forgetting** ([`Forgetting`]).
///
/// * `constant`: `λ` as it is set.
/// * `variable`: the memory keeps the same sum of squared errors. A surprising sample makes it forget more, an
///   expected one less. A parameter that jumps is found at once. With `N = 1/(1 - λ)`, `q = e²/(1 + φᵀPφ)` and the mean `σ²` of `q` over `10 N` samples,
///   of which none counts for more than `9 σ²`:
///   ```text
///   λ_k = 1 - q/(N σ²), not below λ_min
///   ```
/// * `directional`: only what is known along the present regressor is forgotten; what is not excited
///   stays known. Then, with `λ = 1` in the update above,
///   ```text
///   P <- P + (1 - λ)/λ · φ φᵀ/(φᵀP⁻¹φ)
///   ```
///
/// **Windup.** Where the regressor does not excite a parameter, forgetting alone lets `P` grow as
/// `λ^-k` until the next real sample throws the estimate far off. The bound stops that. It counts the present estimate
/// of the `i`-th parameter as one more measurement of it, just good enough to keep its variance at
/// `p_max`. `θ` does not move by it, `P` only shrinks, and the other parameters go on forgetting at the
/// full rate. Suspending all forgetting would be worse: a robot that drives straight ahead learns nothing
/// about turning, and would lose track of the rest as well. The estimate is the exact minimum of the
/// exponentially weighted squares plus these terms.
///
/// **Round-off.** `P` is kept as `U D Uᵀ` (`U` unit upper triangular, `D` diagonal). Each entry of `D` is
/// multiplied by positive numbers, or has positive ones added. So `P` stays positive definite however many
/// updates there are, in `f32` as in `f64`; the textbook difference `P - K φᵀP` does not. (1e-30 keeps an
/// entry of `D` from underflow.) The matrix that [`Estimator::covariance`] shows is rounded once more. Its
/// diagonal is enlarged by `4 n²` rounding units, more than those roundings and a Cholesky factorisation
/// can take away (Higham 2002, theorem 10.7). So it is positive definite, too, and exactly symmetric.
///
/// Assumptions: `y = φᵀθ + noise`, noise white and independent of `φ`; `θ` constant or slow against
/// `1/(1 - λ)` samples.
///
/// Reference: K. J. Åström, B. Wittenmark (2008), "Adaptive Control", ch. 2 (RLS, forgetting) and
/// ch. 11 (estimator windup, factored updates); G. J. Bierman (1977), "Factorization Methods for
/// Discrete Sequential Estimation", ch. V (the `U D Uᵀ` update); S. Gunnarsson (1996), "Combining
/// tracking and regularization in recursive least squares identification", CDC, 2551–2552 (the
/// bound as regularisation); T. R. Fortescue, L. S. Kershenbaum, B. E. Ydstie (1981), "Implementation
/// of self-tuning regulators with variable forgetting factors", Automatica 17(6), 831–835; L. Cao,
/// H. Schwartz (2000), "A directional forgetting algorithm based on the decomposition of the
/// information matrix", Automatica 36(11), 1725–1731. Numbers (44)–(47): Alves, Lages, Henriques
/// (2018).
///
/// ```
/// use loopsight_core::Estimator;
/// use loopsight_estimators::{Rls, RlsSettings};
/// use nalgebra::SVector;
///
/// let mut rls = Rls::new(SVector::<f64, 2>::zeros(), &RlsSettings::default()).unwrap();
/// for k in 0..100 {
///     let x = f64::from(k % 7);
///     rls.update(&[1.0, x], 3.0 - 0.5 * x);
/// }
/// assert!((rls.theta()[0] - 3.0).abs() < 1e-4 && (rls.theta()[1] + 0.5).abs() < 1e-4);
/// ```
#[derive(Clone, Debug)]
pub struct Rls<S: Real, D: Dim>
where
    DefaultAllocator: Allocator<D> + Allocator<D, D>,
{
    estimate: Estimate<S, D>,
    rule: Forgetting,
    memory: Memory<S>,
}

impl<S: Real, D: Dim> Rls<S, D>
where
    DefaultAllocator: Allocator<D> + Allocator<D, D>,
{
    /// An estimator that starts from `theta`.
    ///
    /// # Errors
    ///
    /// `theta` is empty or not finite, or a setting is out of its range: see [`RlsError`].
    pub fn new(theta: OVector<S, D>, settings: &RlsSettings) -> Result<Self, RlsError> {
        if !is_start(theta.as_slice()) {
            return Err(RlsError::Theta);
        }
        let (limit, least) = settings.check::<S>(theta.len())?;
        Ok(Self {
            estimate: Estimate::new(theta, settings.initial_covariance, limit),
            rule: settings.rule,
            memory: Memory::new(settings.forgetting, least),
        })
    }

    /// Takes in the sample whose `φᵀPφ` was `predicted`, and is `spread` now, with the forgetting `lambda`.
    #[inline(always)]
    fn take(&mut self, innovation: S, predicted: S, lambda: S, spread: S) -> Innovation<S> {
        if !self.estimate.advance(innovation, lambda, spread) {
            return Innovation::refused();
        }
        self.estimate.factor.absorb(lambda, S::one() / lambda);
        self.estimate.bound();
        Innovation {
            innovation,
            relative_variance: S::one() + predicted,
            accepted: true,
        }
    }

    /// The same by a rule that looks at the sample before it forgets.
    #[cold]
    fn take_by(
        &mut self,
        rule: Forgetting,
        regressor: &[S],
        innovation: S,
        predicted: S,
    ) -> Innovation<S> {
        // NaN and infinity anywhere in the sample end up in one of these two.
        if !(innovation.is_finite() && predicted.is_finite()) {
            return Innovation::refused();
        }
        let (lambda, spread) = match rule {
            Forgetting::Constant => (self.memory.constant(), predicted),
            Forgetting::Variable => {
                let square = innovation * innovation / (S::one() + predicted);
                let lambda = self.memory.variable(square);
                self.memory.remember(square);
                (lambda, predicted)
            }
            Forgetting::Directional => (S::one(), self.forget_along(regressor, predicted)),
        };
        self.take(innovation, predicted, lambda, spread)
    }

    /// Forgets along `regressor`, and returns `φᵀPφ` after that.
    fn forget_along(&mut self, regressor: &[S], spread: S) -> S {
        let lambda = self.memory.constant();
        let known = self.estimate.factor.known(regressor);
        let growth = (S::one() - lambda) / (lambda * known);
        if !(spread > S::zero() && growth.is_finite()) {
            return spread;
        }
        self.estimate.factor.add(growth, |i| regressor[i]);
        self.estimate.bound();
        self.estimate.factor.spread(regressor)
    }
}

impl<S: Real, D: Dim> Estimator<S> for Rls<S, D>
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
        if regressor.len() != self.theta().len() {
            return Innovation::refused();
        }
        let predicted = self.estimate.factor.spread(regressor);
        match self.rule {
            Forgetting::Constant => {
                self.take(innovation, predicted, self.memory.constant(), predicted)
            }
            rule => self.take_by(rule, regressor, innovation, predicted),
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
            self.memory.clear();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimate::covariance;
    use nalgebra::{Const, DVector, Dyn, SMatrix, SVector};

    /// Regressors without structure, the same on every machine.
    fn samples(count: usize) -> impl Iterator<Item = ([f64; 3], f64)> {
        let mut state = 1u64;
        let mut next = move || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            (state >> 33) as f64 / f64::from(1u32 << 31) - 0.5
        };
        (0..count).map(move |_| {
            let phi = [0.2 * next(), next(), 18.0 * next()];
            let y = -15.0 * phi[0] + 0.3 * phi[1] + 0.136 * phi[2] + 0.01 * next();
            (phi, y)
        })
    }

    fn settings(forgetting: f64, initial: f64, limit: Option<f64>) -> RlsSettings {
        RlsSettings {
            forgetting,
            initial_covariance: initial,
            covariance_limit: limit,
            ..RlsSettings::default()
        }
    }

    /// Against (44)-(47) written down as they stand in the paper.
    #[test]
    fn the_factored_update_is_the_textbook_update() {
        let lambda = 0.98;
        let mut rls = Rls::new(
            SVector::<f64, 3>::zeros(),
            &settings(lambda, 100.0, Some(1e12)),
        )
        .unwrap();
        let mut theta = SVector::<f64, 3>::zeros();
        let mut p = SMatrix::<f64, 3, 3>::identity() * 100.0;
        for (phi, y) in samples(300) {
            let phi_vector = SVector::from(phi);
            let spread = phi_vector.dot(&(p * phi_vector));
            let gain = p * phi_vector / (lambda + spread);
            let innovation = y - phi_vector.dot(&theta);
            theta += gain * innovation;
            p = (p - gain * (p * phi_vector).transpose()) / lambda;
            let told = rls.update(&phi, y);
            assert!(told.accepted);
            assert!((told.innovation - innovation).abs() < 1e-9);
            assert!((told.relative_variance - 1.0 - spread).abs() < 1e-9 * (1.0 + spread));
            for i in 0..3 {
                assert!((rls.theta()[i] - theta[i]).abs() < 1e-8);
            }
            for i in 0..9 {
                let scale = (p[(i % 3, i % 3)] * p[(i / 3, i / 3)]).sqrt();
                assert!((rls.covariance(i % 3, i / 3) - p[i]).abs() < 1e-9 * scale);
            }
        }
    }

    #[test]
    fn fixed_and_run_time_sizes_give_the_same_digits() {
        let settings = settings(0.97, 1e4, Some(1e4));
        let mut fixed: Rls<f64, Const<3>> = Rls::new(SVector::zeros(), &settings).unwrap();
        let mut dynamic: Rls<f64, Dyn> = Rls::new(DVector::zeros(3), &settings).unwrap();
        for (k, (mut phi, y)) in samples(2000).enumerate() {
            if (500..900).contains(&k) {
                phi[1] = 0.0;
            }
            assert_eq!(fixed.update(&phi, y), dynamic.update(&phi, y));
            assert_eq!(fixed.theta(), dynamic.theta());
            assert_eq!(covariance(&fixed), covariance(&dynamic));
        }
    }

    #[test]
    fn a_sample_that_is_no_number_changes_nothing() {
        let mut rls = Rls::new(SVector::<f64, 3>::zeros(), &RlsSettings::default()).unwrap();
        for (phi, y) in samples(50) {
            rls.update(&phi, y);
        }
        let before = (rls.theta().to_vec(), covariance(&rls));
        let refused: [(&[f64], f64); 7] = [
            (&[1.0, f64::NAN, 0.0], 1.0),
            (&[1.0, f64::INFINITY, 0.0], 1.0),
            (&[1.0, 1.0, 0.0], f64::NAN),
            (&[1.0, 1.0, 0.0], f64::NEG_INFINITY),
            (&[1.0, 1.0], 1.0),
            (&[1.0, 1.0, 0.0, 0.0], 1.0),
            (&[1e200, 0.0, 0.0], 1.0),
        ];
        for (phi, y) in refused {
            assert!(!rls.update(phi, y).accepted);
        }
        rls.reset(&[1.0]);
        rls.reset(&[1.0, f64::NAN, 0.0]);
        assert_eq!(
            before,
            (rls.theta().to_vec(), covariance(&rls)),
            "something changed"
        );
        rls.reset(&[1.0, 2.0, 3.0]);
        assert_eq!(rls.theta(), [1.0, 2.0, 3.0]);
        assert!((rls.covariance(1, 1) - 1e6).abs() < 1.0);
    }

    /// Straight ahead, the second regressor is zero for long: its variance stays at the limit, its
    /// estimate where it was, and the others are still tracked.
    #[test]
    fn without_excitation_a_parameter_waits_and_the_others_go_on() {
        let mut rls =
            Rls::new(SVector::<f64, 3>::zeros(), &settings(0.95, 1e3, Some(1e3))).unwrap();
        for (phi, y) in samples(500) {
            rls.update(&phi, y);
        }
        let learned = rls.theta()[1];
        for (k, (mut phi, y)) in samples(5000).enumerate() {
            let y = if k < 1000 {
                y - 0.3 * phi[1]
            } else {
                // The world changes meanwhile.
                -10.0 * phi[0] + 0.2 * phi[2]
            };
            phi[1] = 0.0;
            rls.update(&phi, y);
        }
        assert!((rls.theta()[0] + 10.0).abs() < 1e-6, "{:?}", rls.theta());
        assert!((rls.theta()[2] - 0.2).abs() < 1e-8);
        assert!((rls.theta()[1] - learned).abs() < 1e-2);
        assert!(rls.covariance(1, 1) <= 1e3 && rls.covariance(1, 1) > 0.999e3);
        assert!(rls.covariance(0, 0) < 1e2);
    }

    #[test]
    fn impossible_settings_are_refused_by_name() {
        let zero = SVector::<f64, 2>::zeros();
        for (settings, key) in [
            (settings(0.0, 1.0, None), "forgetting"),
            (settings(1.01, 1.0, None), "forgetting"),
            (settings(f64::NAN, 1.0, None), "forgetting"),
            (settings(1.0, 0.0, None), "initial_covariance"),
            (settings(1.0, f64::INFINITY, None), "initial_covariance"),
            (settings(1.0, 10.0, Some(1.0)), "covariance_limit"),
            (settings(1.0, 10.0, Some(f64::NAN)), "covariance_limit"),
        ] {
            let error = Rls::new(zero, &settings).unwrap_err();
            assert_eq!(error.key(), key);
            assert!(error.to_string().contains("expected"), "{error}");
        }
        for (rule, least, key) in [
            (Forgetting::Variable, None, "forgetting"),
            (Forgetting::Directional, None, "forgetting"),
            (Forgetting::Variable, Some(0.995), "least_forgetting"),
            (Forgetting::Variable, Some(0.0), "least_forgetting"),
        ] {
            let settings = RlsSettings {
                rule,
                least_forgetting: least,
                forgetting: if key == "forgetting" { 1.0 } else { 0.99 },
                ..RlsSettings::default()
            };
            let error = Rls::new(zero, &settings).unwrap_err();
            assert_eq!(error.key(), key, "{error}");
            assert!(error.to_string().contains("expected"), "{error}");
        }
        let nothing: Result<Rls<f64, Dyn>, _> =
            Rls::new(DVector::zeros(0), &RlsSettings::default());
        assert_eq!(nothing.unwrap_err(), RlsError::Theta);
        let single: Result<Rls<f32, _>, _> =
            Rls::new(SVector::<f32, 2>::zeros(), &settings(1.0, 1e3, Some(1e39)));
        assert_eq!(single.unwrap_err().key(), "covariance_limit");
    }
}
