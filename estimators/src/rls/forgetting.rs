//! The forgetting factor of a sample.

use loopsight_core::Real;

/// Samples that count as the first ones: no error among them is called an outlier.
const FIRST: f64 = 20.0;

/// Forgetting factors, constant or after Fortescue, Kershenbaum and Ydstie; see [`crate::Rls`].
#[derive(Clone, Debug)]
pub(super) struct Memory<S> {
    forgetting: S,
    least: S,
    /// `N`.
    length: S,
    /// `σ²`, and the number of samples it is the mean of, up to `10 N`.
    square: S,
    samples: S,
}

impl<S: Real> Memory<S> {
    pub(super) fn new(forgetting: f64, least: f64) -> Self {
        Self {
            forgetting: S::of(forgetting),
            least: S::of(least),
            length: S::of(1.0 / (1.0 - forgetting)),
            square: S::zero(),
            samples: S::zero(),
        }
    }

    pub(super) fn clear(&mut self) {
        (self.square, self.samples) = (S::zero(), S::zero());
    }

    /// `λ` as it is set.
    pub(super) fn constant(&self) -> S {
        self.forgetting
    }

    /// `λ_k` for a sample whose squared error over its relative variance is `square`.
    pub(super) fn variable(&self, square: S) -> S {
        if self.samples < S::of(FIRST) {
            return self.forgetting;
        }
        let share = square / (self.length * self.square);
        // Without any noise the share is not a number: then there is nothing new either.
        if share.is_finite() {
            (S::one() - share).max(self.least)
        } else {
            S::one()
        }
    }

    /// Takes `square` into the mean.
    pub(super) fn remember(&mut self, square: S) {
        let ten = S::of(10.0);
        let limit = if self.samples < S::of(FIRST) {
            square
        } else {
            S::of(9.0) * self.square
        };
        self.samples = (self.samples + S::one()).min(ten * self.length);
        self.square += (square.min(limit) - self.square) / self.samples;
    }
}

#[cfg(test)]
mod tests {
    use crate::{Forgetting, Rls, RlsSettings};
    use loopsight_core::Estimator;
    use nalgebra::SVector;

    /// Numbers from -0.5 to 0.5 without structure.
    fn noise(state: &mut u64) -> f64 {
        *state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        (*state >> 33) as f64 / f64::from(1u32 << 31) - 0.5
    }

    /// A parameter that jumps after 1000 of 1200 samples: squared errors of the estimate before and
    /// in the thirty samples from the tenth after the jump.
    fn jump(rule: Forgetting) -> (f64, f64) {
        let settings = RlsSettings {
            forgetting: 0.99,
            rule,
            initial_covariance: 1e3,
            ..RlsSettings::default()
        };
        let mut rls = Rls::new(SVector::<f64, 2>::zeros(), &settings).unwrap();
        let mut state = 3;
        let (mut before, mut after) = (0.0, 0.0);
        for k in 0..1200 {
            let phi = [noise(&mut state), noise(&mut state)];
            let truth = [if k < 1000 { 1.0 } else { 3.0 }, -2.0];
            let y = truth[0] * phi[0] + truth[1] * phi[1] + 0.05 * noise(&mut state);
            rls.update(&phi, y);
            let error: f64 = (0..2).map(|i| (rls.theta()[i] - truth[i]).powi(2)).sum();
            if (800..1000).contains(&k) {
                before += error;
            } else if (1010..1040).contains(&k) {
                after += error;
            }
        }
        (before, after)
    }

    #[test]
    fn variable_forgetting_follows_a_jump_and_is_as_quiet_before_it() {
        let (quiet, slow) = jump(Forgetting::Constant);
        let (before, after) = jump(Forgetting::Variable);
        println!(
            "before: {quiet:.2e} constant, {before:.2e} variable; after: {slow:.2e}, {after:.2e}"
        );
        assert!(after < 0.6 * slow, "{after:e} against {slow:e}");
        assert!(before < 2.0 * quiet, "{before:e} against {quiet:e}");
    }

    /// Only the first regressor moves for long: what was known of the second stays known, where
    /// constant forgetting lets its variance grow to the bound.
    #[test]
    fn directional_forgetting_keeps_what_is_not_excited() {
        let run = |rule| {
            let settings = RlsSettings {
                forgetting: 0.98,
                rule,
                initial_covariance: 1e4,
                ..RlsSettings::default()
            };
            let mut rls = Rls::new(SVector::<f64, 2>::zeros(), &settings).unwrap();
            let mut state = 5;
            for k in 0..5000 {
                let mut phi = [noise(&mut state), noise(&mut state)];
                let slope = if k < 2500 { 1.0 } else { 2.0 };
                if k >= 500 {
                    phi[1] = 0.0;
                }
                rls.update(&phi, slope * phi[0] - 2.0 * phi[1]);
            }
            (rls.theta().to_vec(), rls.covariance(1, 1))
        };
        let (theta, kept) = run(Forgetting::Directional);
        assert!(
            (theta[0] - 2.0).abs() < 1e-9 && (theta[1] + 2.0).abs() < 1e-3,
            "{theta:?}"
        );
        let (_, lost) = run(Forgetting::Constant);
        println!(
            "variance of what is not excited: {:.1e}, {:.1e}",
            kept, lost
        );
        assert!(kept < 10.0 && lost > 9e3);
    }

    /// With one regressor, directional forgetting is constant forgetting.
    #[test]
    fn along_one_direction_the_rules_agree() {
        let settings = |rule| RlsSettings {
            forgetting: 0.95,
            rule,
            initial_covariance: 1e4,
            covariance_limit: Some(1e9),
            ..RlsSettings::default()
        };
        let zero = SVector::<f64, 1>::zeros();
        let mut constant = Rls::new(zero, &settings(Forgetting::Constant)).unwrap();
        let mut directional = Rls::new(zero, &settings(Forgetting::Directional)).unwrap();
        let mut state = 9;
        for _ in 0..300 {
            let (phi, y) = ([0.2 + noise(&mut state)], noise(&mut state));
            constant.update(&phi, y);
            directional.update(&phi, y);
            assert!((constant.theta()[0] - directional.theta()[0]).abs() < 1e-9);
            let (a, b) = (constant.covariance(0, 0), directional.covariance(0, 0));
            assert!((a - b).abs() < 1e-9 * a);
        }
    }

    /// A million samples, most of them along one direction only.
    #[test]
    fn every_rule_keeps_a_covariance_in_single_precision() {
        for rule in [Forgetting::Variable, Forgetting::Directional] {
            let settings = RlsSettings {
                forgetting: 0.98,
                rule,
                initial_covariance: 1e3,
                covariance_limit: Some(1e4),
                ..RlsSettings::default()
            };
            let mut rls = Rls::new(SVector::<f32, 2>::zeros(), &settings).unwrap();
            let mut state = 11;
            for k in 0..1_000_000 {
                let mut phi = [noise(&mut state) as f32, noise(&mut state) as f32];
                if k % 10_000 > 100 {
                    phi[1] = phi[0];
                }
                let y = 2.0 * phi[0] - phi[1] + 0.01 * noise(&mut state) as f32;
                assert!(rls.update(&phi, y).accepted, "{rule:?} {k}");
            }
            let mut p = [0.0; 4];
            rls.covariance_into(&mut p);
            assert!(p[0] <= 1e4 && p[3] <= 1e4 && p[0] > 0.0, "{rule:?}: {p:?}");
            assert!(p[0] * p[3] > p[1] * p[2] && p[1] == p[2], "{rule:?}: {p:?}");
            let sum = rls.theta()[0] + rls.theta()[1];
            assert!((sum - 1.0).abs() < 0.01, "{rule:?}: {:?}", rls.theta());
        }
    }
}
