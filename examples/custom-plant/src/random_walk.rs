//! Parameters that may change while they are learned.

use loopsight_core::{Estimator, Innovation};
use loopsight_model::declare_part;
use loopsight_model::registry::{BuildError, EstimatorPart, PartMeta, Setting};
use serde::{Deserialize, Serialize};

/// A Kalman filter for parameters that walk at random.
///
/// ```text
/// θ_k = θ_{k-1} + drift        y_k = φ_kᵀ θ_k + noise
/// P ← P + q I                  K = P φ/(1 + φᵀ P φ)
/// θ ← θ + K (y - φᵀ θ)         P ← P - K φᵀ P
/// ```
///
/// | symbol | what | unit |
/// |---|---|---|
/// | `φ`, `y` | regressor and measurement | of the regression |
/// | `θ`, `P` | parameters; their covariance over the variance of the noise | of the parameters |
/// | `q` | growth of the covariance in a sample | of `P` |
///
/// Against recursive least squares with forgetting: what is not excited is not forgotten faster and
/// faster. `P` stops growing at its start value.
///
/// Reference: L. Ljung (1999), "System Identification: Theory for the User", 2nd edition, section
/// 11.3, the Kalman filter as a recursive estimator.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RandomWalk {
    #[serde(default = "initial_covariance")]
    initial_covariance: f64,
    drift: f64,
}

fn initial_covariance() -> f64 {
    1e6
}

const META: PartMeta = PartMeta {
    id: "random_walk",
    role: "estimator",
    summary: "a Kalman filter for parameters that change at random",
    equation: "P <- P + q I; K = P φ/(1 + φ' P φ); θ <- θ + K (y - φ' θ); P <- P - K φ' P",
    reference: "Ljung (1999), System Identification: Theory for the User, 2nd ed., section 11.3",
    example: "[estimator.random_walk]\ndrift = 1e-3\n",
    settings: &[
        Setting::new(
            "initial_covariance",
            "1",
            "the covariance starts as this multiple of the identity; default: 1e6",
        ),
        Setting::new(
            "drift",
            "1",
            "q: growth of the covariance in a sample, at least 0; no default",
        ),
    ],
};

#[typetag::serde(name = "random_walk")]
impl EstimatorPart for RandomWalk {
    fn meta(&self) -> &'static PartMeta {
        &META
    }

    fn build(&self, theta: &[f64]) -> Result<Box<dyn Estimator<f64>>, BuildError> {
        if !(self.initial_covariance > 0.0 && self.initial_covariance.is_finite()) {
            let found = self.initial_covariance;
            let message = format!("`initial_covariance` is {found}, expected a number above 0");
            return Err(BuildError::at("initial_covariance", message));
        }
        if !(self.drift >= 0.0 && self.drift.is_finite()) {
            let message = format!(
                "`drift` is {}, expected a number from 0 upwards",
                self.drift
            );
            return Err(BuildError::at("drift", message));
        }
        let n = theta.len();
        let mut filter = Filter {
            start: self.initial_covariance,
            drift: self.drift,
            theta: vec![0.0; n],
            covariance: vec![0.0; n * n],
            spread: vec![0.0; n],
        };
        filter.reset(theta);
        Ok(Box::new(filter))
    }
}

declare_part!(&META);

/// The estimator at work. What it needs lies here, so that an update allocates nothing.
struct Filter {
    start: f64,
    drift: f64,
    theta: Vec<f64>,
    /// `P`, column by column.
    covariance: Vec<f64>,
    /// `P φ`.
    spread: Vec<f64>,
}

impl Estimator<f64> for Filter {
    fn update(&mut self, regressor: &[f64], measurement: f64) -> Innovation<f64> {
        let n = self.theta.len();
        let finite = measurement.is_finite() && regressor.iter().all(|r| r.is_finite());
        if regressor.len() != n || !finite {
            return Innovation::refused();
        }
        for i in 0..n {
            let own = &mut self.covariance[i * n + i];
            *own = (*own + self.drift).min(self.start.max(*own));
        }
        let (mut innovation, mut variance) = (measurement, 1.0);
        for i in 0..n {
            let column = &self.covariance[i * n..(i + 1) * n];
            self.spread[i] = column.iter().zip(regressor).map(|(p, r)| p * r).sum();
            innovation -= regressor[i] * self.theta[i];
            variance += regressor[i] * self.spread[i];
        }
        for i in 0..n {
            let gain = self.spread[i] / variance;
            self.theta[i] += gain * innovation;
            for j in 0..n {
                self.covariance[i * n + j] -= gain * self.spread[j];
            }
        }
        Innovation {
            innovation,
            relative_variance: variance,
            accepted: true,
        }
    }

    fn theta(&self) -> &[f64] {
        &self.theta
    }

    fn covariance(&self, row: usize, column: usize) -> f64 {
        self.covariance[column * self.theta.len() + row]
    }

    fn set_theta(&mut self, theta: &[f64]) {
        for (to, from) in self.theta.iter_mut().zip(theta) {
            *to = *from;
        }
    }

    fn reset(&mut self, theta: &[f64]) {
        let n = self.theta.len();
        self.set_theta(theta);
        self.covariance.fill(0.0);
        for i in 0..n {
            self.covariance[i * n + i] = self.start;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn follows_a_parameter_that_jumps() {
        let part = RandomWalk {
            initial_covariance: 1e6,
            drift: 0.01,
        };
        let mut filter = part.build(&[0.0, 0.0]).unwrap();
        for (slope, offset) in [(2.0, -1.0), (3.0, -1.0)] {
            for k in 0..200 {
                let x = (0.7 * f64::from(k)).sin();
                filter.update(&[x, 1.0], slope * x + offset);
            }
            assert!((filter.theta()[0] - slope).abs() < 1e-3);
            assert!((filter.theta()[1] - offset).abs() < 1e-3);
        }
        let before = filter.theta().to_vec();
        assert!(!filter.update(&[f64::NAN, 1.0], 1.0).accepted);
        assert!(!filter.update(&[1.0], 1.0).accepted);
        assert_eq!(filter.theta(), before);
    }

    #[test]
    fn without_drift_it_is_least_squares() {
        let part = RandomWalk {
            initial_covariance: 1e12,
            drift: 0.0,
        };
        let mut filter = part.build(&[0.0]).unwrap();
        let rows = [(1.0, 2.1), (2.0, 3.9), (4.0, 8.3)];
        for (x, y) in rows {
            filter.update(&[x], y);
        }
        let (xy, xx) = rows
            .iter()
            .fold((0.0, 0.0), |s, (x, y)| (s.0 + x * y, s.1 + x * x));
        assert!((filter.theta()[0] - xy / xx).abs() < 1e-9);
        assert!((filter.covariance(0, 0) * xx - 1.0).abs() < 1e-9);
    }
}
