//! Recursive least squares with exponential forgetting.

use loopsight_core::{Estimator, Innovation, Real};
use nalgebra::allocator::Allocator;
use nalgebra::{DefaultAllocator, Dim, OMatrix, OVector};

mod settings;
pub use settings::{RlsError, RlsSettings};

/// Recursive least squares (RLS) with exponential forgetting and a bounded covariance.
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
/// **Windup.** Where the regressor does not excite a parameter, forgetting alone lets `P` grow as
/// `λ^-k` until the next real sample throws the estimate far off. The last line stops that: it
/// counts the present estimate of the `i`-th parameter as one more measurement of it, just good
/// enough to hold its variance at `p_max`. `θ` does not move by it, `P` only shrinks, and the
/// other parameters go on forgetting at the full rate; suspending the forgetting altogether would
/// make a robot that drives straight ahead, and so learns nothing about turning, lose track of the
/// rest as well. The estimate is the exact minimum of the exponentially weighted squares plus
/// these terms.
///
/// **Round-off.** `P` is kept as `U D Uᵀ` (`U` unit upper triangular, `D` diagonal). Each entry of
/// `D` is multiplied by positive numbers only, so `P` cannot become indefinite however many updates
/// there are, in `f32` as in `f64`, where the textbook difference `P - K φᵀP` does (an entry of `D`
/// that would underflow is held at 1e-30). The matrix that [`Estimator::covariance`] shows is
/// rounded once more; its diagonal is enlarged by `4 n²` rounding units, more than those roundings
/// and a Cholesky factorisation can take away (Higham 2002, theorem 10.7), so that it, too, is
/// positive definite, and exactly symmetric. The enlargement is not fed back.
///
/// Assumptions: `y = φᵀθ + noise`, noise white and independent of `φ`; `θ` constant or slow against
/// `1/(1 - λ)` samples.
///
/// Reference: K. J. Åström, B. Wittenmark (2008), "Adaptive Control", ch. 2 (RLS, forgetting) and
/// ch. 11 (estimator windup, factored updates); G. J. Bierman (1977), "Factorization Methods for
/// Discrete Sequential Estimation", ch. V (the `U D Uᵀ` update); S. Gunnarsson (1996), "Combining
/// tracking and regularization in recursive least squares identification", CDC, 2551–2552 (the
/// bound as regularisation). Numbers (44)–(47): Alves, Lages, Henriques (2018).
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
    theta: OVector<S, D>,
    /// What [`Estimator::covariance`] shows.
    p: OMatrix<S, D, D>,
    /// Strictly upper triangle of `U`; the rest is not used.
    u: OMatrix<S, D, D>,
    d: OVector<S, D>,
    /// `Uᵀφ`, `D Uᵀφ` and `P φ` of the present update.
    work: [OVector<S, D>; 3],
    forgetting: S,
    initial: S,
    /// `p_max`, less what rounding may add to a diagonal entry.
    cap: S,
    /// `1 + 4 n²` rounding units.
    enlargement: S,
}

/// No entry of `D` falls below this.
const LEAST: f64 = 1e-30;

impl<S: Real, D: Dim> Rls<S, D>
where
    DefaultAllocator: Allocator<D> + Allocator<D, D>,
{
    /// An estimator that starts from `theta`.
    pub fn new(theta: OVector<S, D>, settings: &RlsSettings) -> Result<Self, RlsError> {
        let RlsSettings {
            forgetting,
            initial_covariance,
            covariance_limit,
        } = *settings;
        let limit = covariance_limit.unwrap_or(initial_covariance);
        let (dim, one) = theta.shape_generic();
        if theta.is_empty() || theta.iter().any(|v| !v.is_finite()) {
            return Err(RlsError::Theta);
        }
        if !(forgetting > 0.0 && forgetting <= 1.0) {
            return Err(RlsError::Forgetting(forgetting));
        }
        let initial = S::of(initial_covariance);
        if !(initial_covariance >= LEAST && initial.is_finite()) {
            return Err(RlsError::InitialCovariance(initial_covariance));
        }
        // The greatest number that can turn up is a variance that was just forgotten, times n².
        let n = S::of(theta.len() as f64);
        let greatest = S::of(limit) / S::of(forgetting) * n * n;
        if !(limit >= initial_covariance && greatest.is_finite()) {
            return Err(RlsError::CovarianceLimit(limit));
        }
        let slack = S::of(4.0) * n * n * rounding_unit();
        let zero = OVector::zeros_generic(dim, one);
        let start = theta.clone();
        let mut rls = Self {
            theta,
            p: OMatrix::zeros_generic(dim, dim),
            u: OMatrix::zeros_generic(dim, dim),
            d: zero.clone(),
            work: [zero.clone(), zero.clone(), zero],
            forgetting: S::of(forgetting),
            initial,
            cap: S::of(limit) / (S::one() + slack + slack),
            enlargement: S::one() + slack,
        };
        rls.restart(start.as_slice());
        Ok(rls)
    }

    fn restart(&mut self, theta: &[S]) {
        self.theta.as_mut_slice().copy_from_slice(theta);
        self.u.fill(S::zero());
        self.d.fill(self.initial.smaller(self.cap));
        self.show();
    }

    /// Takes a measurement of `Uᵀφ = f` (with `v = D f`) whose noise has the variance `noise` into
    /// `U` and `D`, and multiplies `D` by `growth`.
    fn absorb(&mut self, noise: S, growth: S) {
        let [f, v, b] = &mut self.work;
        let (f, v, b) = (f.as_slice(), v.as_slice(), b.as_mut_slice());
        let (u, d) = (self.u.as_mut_slice(), self.d.as_mut_slice());
        let n = d.len();
        let least = S::of(LEAST);
        let mut alpha = noise;
        let mut inverse = S::one() / alpha;
        for j in 0..n {
            let p = f[j] * inverse;
            let before = alpha;
            alpha += v[j] * f[j];
            inverse = S::one() / alpha;
            d[j] = (d[j] * (before * inverse) * growth).larger(least);
            for i in 0..j {
                let old = u[j * n + i];
                u[j * n + i] = old - b[i] * p;
                b[i] += old * v[j];
            }
            b[j] = v[j];
        }
    }

    /// The `i`-th diagonal entry of `P`.
    fn variance(&self, i: usize) -> S {
        let (u, d) = (self.u.as_slice(), self.d.as_slice());
        let n = d.len();
        let mut sum = d[i];
        for k in i + 1..n {
            sum += u[k * n + i] * u[k * n + i] * d[k];
        }
        sum
    }

    /// Holds the variance of each parameter at `p_max`.
    fn bound(&mut self) {
        let n = self.d.len();
        for i in 0..n {
            let variance = self.variance(i);
            if variance > self.cap {
                let [f, v, _] = &mut self.work;
                for j in 0..n {
                    f[j] = match j.cmp(&i) {
                        core::cmp::Ordering::Less => S::zero(),
                        core::cmp::Ordering::Equal => S::one(),
                        core::cmp::Ordering::Greater => self.u[(i, j)],
                    };
                    v[j] = self.d[j] * f[j];
                }
                self.absorb(self.cap * (variance / (variance - self.cap)), S::one());
            }
        }
    }

    /// `P = U D Uᵀ` for [`Estimator::covariance`].
    fn show(&mut self) {
        let (u, d, p) = (self.u.as_slice(), self.d.as_slice(), self.p.as_mut_slice());
        let n = d.len();
        for j in 0..n {
            for i in 0..=j {
                let mut sum = if i == j { d[j] } else { u[j * n + i] * d[j] };
                for k in j + 1..n {
                    sum += u[k * n + i] * d[k] * u[k * n + j];
                }
                p[j * n + i] = sum;
                p[i * n + j] = sum;
            }
            p[j * n + j] *= self.enlargement;
        }
    }
}

impl<S: Real, D: Dim> Estimator<S> for Rls<S, D>
where
    DefaultAllocator: Allocator<D> + Allocator<D, D>,
    OVector<S, D>: Send,
    OMatrix<S, D, D>: Send,
{
    fn update(&mut self, regressor: &[S], measurement: S) -> Innovation<S> {
        let n = self.theta.len();
        let refused = Innovation {
            innovation: S::of(f64::NAN),
            relative_variance: S::of(f64::NAN),
            accepted: false,
        };
        if regressor.len() != n {
            return refused;
        }
        let [f, v, b] = &mut self.work;
        let (f, v, b) = (f.as_mut_slice(), v.as_mut_slice(), b.as_mut_slice());
        let (theta, u, d) = (
            self.theta.as_mut_slice(),
            self.u.as_slice(),
            self.d.as_slice(),
        );
        let mut innovation = measurement;
        let mut spread = S::zero();
        for j in 0..n {
            let mut sum = regressor[j];
            for i in 0..j {
                sum += u[j * n + i] * regressor[i];
            }
            f[j] = sum;
            v[j] = d[j] * sum;
            spread += v[j] * sum;
            innovation -= regressor[j] * theta[j];
        }
        // NaN and infinity anywhere in the sample end up in one of these two.
        if !(innovation.is_finite() && spread.is_finite()) {
            return refused;
        }
        let step = innovation / (self.forgetting + spread);
        for i in 0..n {
            let mut sum = v[i];
            for j in i + 1..n {
                sum += u[j * n + i] * v[j];
            }
            b[i] = theta[i] + sum * step;
        }
        if b.iter().any(|v| !v.is_finite()) {
            return refused;
        }
        theta.copy_from_slice(b);
        self.absorb(self.forgetting, S::one() / self.forgetting);
        if self.forgetting < S::one() {
            self.bound();
        }
        self.show();
        Innovation {
            innovation,
            relative_variance: S::one() + spread,
            accepted: true,
        }
    }

    fn theta(&self) -> &[S] {
        self.theta.as_slice()
    }

    fn covariance(&self) -> &[S] {
        self.p.as_slice()
    }

    /// Nothing changes when `theta` has another length or is not finite.
    fn reset(&mut self, theta: &[S]) {
        if theta.len() == self.theta.len() && theta.iter().all(|v| v.is_finite()) {
            self.restart(theta);
        }
    }
}

/// Half the distance from 1 to the next number.
fn rounding_unit<S: Real>() -> S {
    let mut unit = S::one();
    while S::one() + unit > S::one() {
        unit *= S::of(0.5);
    }
    unit
}

#[cfg(test)]
mod tests {
    use super::*;
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
                assert!((rls.covariance()[i] - p[i]).abs() < 1e-9 * scale);
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
            assert_eq!(fixed.covariance(), dynamic.covariance());
        }
    }

    #[test]
    fn a_sample_that_is_no_number_changes_nothing() {
        let mut rls = Rls::new(SVector::<f64, 3>::zeros(), &RlsSettings::default()).unwrap();
        for (phi, y) in samples(50) {
            rls.update(&phi, y);
        }
        let before = (rls.theta().to_vec(), rls.covariance().to_vec());
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
            (rls.theta().to_vec(), rls.covariance().to_vec()),
            "something changed"
        );
        rls.reset(&[1.0, 2.0, 3.0]);
        assert_eq!(rls.theta(), [1.0, 2.0, 3.0]);
        assert!((rls.covariance()[4] - 1e6).abs() < 1.0);
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
        assert!(rls.covariance()[4] <= 1e3 && rls.covariance()[4] > 0.999e3);
        assert!(rls.covariance()[0] < 1e2);
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
        let nothing: Result<Rls<f64, Dyn>, _> =
            Rls::new(DVector::zeros(0), &RlsSettings::default());
        assert_eq!(nothing.unwrap_err(), RlsError::Theta);
        let single: Result<Rls<f32, _>, _> =
            Rls::new(SVector::<f32, 2>::zeros(), &settings(1.0, 1e3, Some(1e39)));
        assert_eq!(single.unwrap_err().key(), "covariance_limit");
    }
}
