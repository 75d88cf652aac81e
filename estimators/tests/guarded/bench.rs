//! Robots, guesses and guarded estimators of every kind.

use loopsight_core::learning::{Guarded, Guards, Range};
use loopsight_core::{Estimator, Innovation, Parameter, Real};
use loopsight_estimators::{
    Forgetting, Kalman, KalmanSettings, Lms, LmsSettings, Rls, RlsSettings,
};
use nalgebra::{Const, SVector};

pub(crate) const PERIOD: f64 = 0.01;

/// The forward and the turning row of a differential drive, as its plant declares them.
pub(crate) const ROWS: [[Parameter; 3]; 2] = [
    [
        Parameter::new("K_A", "K_A", "1/s", "damping").within(f64::NEG_INFINITY, 0.0),
        Parameter::new("K_B", "K_B", "m/rad^2", "turning").scaled(0.1),
        Parameter::new("K_C", "K_C", "m/s^2/V", "gain")
            .scaled(0.1)
            .nonzero(),
    ],
    [
        Parameter::new("K_D", "K_D", "1/s", "damping").within(f64::NEG_INFINITY, 0.0),
        Parameter::new("K_E", "K_E", "1/m", "turning"),
        Parameter::new("K_F", "K_F", "rad/s^2/V", "gain")
            .scaled(0.1)
            .nonzero(),
    ],
];

/// A twentieth of what matters of a speed and of a yaw rate, per second.
pub(crate) const FLOOR: [f64; 2] = [0.0025, 0.02];

/// Numbers without structure, the same on every machine.
pub(crate) struct Random(pub(crate) u64);

impl Random {
    /// From -1 to 1.
    pub(crate) fn next(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as f64 / f64::from(1u32 << 30) - 1.0
    }

    pub(crate) fn between(&mut self, low: f64, high: f64) -> f64 {
        low + 0.5 * (high - low) * (1.0 + self.next())
    }
}

/// Every estimator of the crate behind one type.
#[derive(Clone)]
pub(crate) enum Any<S: Real> {
    Rls(Rls<S, Const<3>>),
    Kalman(Kalman<S, Const<3>>),
    Lms(Lms<S, Const<3>>),
}

impl<S: Real> Any<S> {
    pub(crate) const KINDS: usize = 5;

    /// With a covariance that says: wrong by about three scales.
    pub(crate) fn new(kind: usize) -> Self {
        let zero = SVector::zeros();
        let rls = |rule| {
            let settings = RlsSettings {
                forgetting: 0.998,
                rule,
                initial_covariance: 1e4,
                ..RlsSettings::default()
            };
            Any::Rls(Rls::new(zero, &settings).unwrap())
        };
        match kind {
            0 => rls(Forgetting::Constant),
            1 => rls(Forgetting::Variable),
            2 => rls(Forgetting::Directional),
            3 => {
                let settings = KalmanSettings {
                    initial_covariance: 1e4,
                    drift: 1e-3,
                    covariance_limit: None,
                };
                Any::Kalman(Kalman::new(zero, &settings).unwrap())
            }
            _ => Any::Lms(Lms::new(zero, &LmsSettings::default()).unwrap()),
        }
    }

    fn inner(&self) -> &dyn Estimator<S> {
        match self {
            Any::Rls(e) => e,
            Any::Kalman(e) => e,
            Any::Lms(e) => e,
        }
    }

    fn inner_mut(&mut self) -> &mut dyn Estimator<S> {
        match self {
            Any::Rls(e) => e,
            Any::Kalman(e) => e,
            Any::Lms(e) => e,
        }
    }
}

impl<S: Real> Estimator<S> for Any<S> {
    fn update(&mut self, regressor: &[S], measurement: S) -> Innovation<S> {
        self.inner_mut().update(regressor, measurement)
    }
    fn correct(&mut self, regressor: &[S], innovation: S) -> Innovation<S> {
        self.inner_mut().correct(regressor, innovation)
    }
    fn theta(&self) -> &[S] {
        self.inner().theta()
    }
    fn covariance(&self, row: usize, column: usize) -> S {
        self.inner().covariance(row, column)
    }
    fn set_theta(&mut self, theta: &[S]) {
        self.inner_mut().set_theta(theta);
    }
    fn reset(&mut self, theta: &[S]) {
        self.inner_mut().reset(theta);
    }
}

pub(crate) type Guard<S> = Guarded<S, Any<S>, Const<3>>;

pub(crate) fn ranges<S: Real>(row: usize, guess: [f64; 3]) -> [Range<S>; 3] {
    [0, 1, 2].map(|i| Range::of(&ROWS[row][i], 1.0, guess[i], 0.1))
}

pub(crate) fn guard<S: Real>(kind: usize, row: usize, guess: [f64; 3], dead_zone: f64) -> Guard<S> {
    let guards = Guards {
        dead_zone,
        least_excitation: FLOOR[row],
        window: 200.0,
    };
    let start = SVector::from(guess.map(S::of));
    Guarded::new(Any::new(kind), start, &ranges(row, guess), guards).unwrap()
}

/// A differential drive in the regression's own (Euler's) time.
pub(crate) struct Robot {
    pub(crate) k: [f64; 6],
    speed: [f64; 2],
}

impl Robot {
    pub(crate) fn random(random: &mut Random) -> Self {
        let range = [
            (-30.0, -5.0),
            (-0.05, 0.05),
            (0.08, 0.3),
            (-30.0, -5.0),
            (-4.0, 0.0),
            (0.3, 0.8),
        ];
        Self {
            k: range.map(|(low, high)| random.between(low, high)),
            speed: [0.0; 2],
        }
    }

    pub(crate) fn truth(&self, row: usize) -> [f64; 3] {
        [0, 1, 2].map(|i| self.k[3 * row + i])
    }

    /// Regressors and left-hand sides of a period with these volts.
    pub(crate) fn step(&mut self, volts: [f64; 2]) -> [([f64; 3], f64); 2] {
        let [v, omega] = self.speed;
        let phi = [
            [v, omega * omega, volts[0] + volts[1]],
            [omega, v * omega, volts[0] - volts[1]],
        ];
        let y = [0, 1].map(|row| {
            let truth = self.truth(row);
            (0..3).map(|i| truth[i] * phi[row][i]).sum::<f64>()
        });
        self.speed[0] += PERIOD * y[0];
        self.speed[1] += PERIOD * y[1];
        [(phi[0], y[0]), (phi[1], y[1])]
    }
}

/// All entries of a covariance, column by column.
pub(crate) fn covariance<S: Real>(of: impl Fn(usize, usize) -> S) -> [S; 9] {
    core::array::from_fn(|k| of(k % 3, k / 3))
}

/// Symmetric, and positive definite by a Cholesky factorisation in the scalar itself.
pub(crate) fn is_covariance<S: Real>(estimator: &impl Estimator<S>) -> bool {
    let p = covariance(|i, j| estimator.covariance(i, j));
    let mut l = [[S::zero(); 3]; 3];
    for i in 0..3 {
        for j in 0..=i {
            let mut sum = p[3 * i + j];
            if !(sum.is_finite() && sum == p[3 * j + i]) {
                return false;
            }
            for k in 0..j {
                sum -= l[i][k] * l[j][k];
            }
            if i == j {
                if sum <= S::zero() {
                    return false;
                }
                l[i][i] = sum.sqrt();
            } else {
                l[i][j] = sum / l[j][j];
            }
        }
    }
    true
}

/// Error in scales.
pub(crate) fn distance(row: usize, theta: &[f32], truth: [f64; 3]) -> f64 {
    let off = |i: usize| (f64::from(theta[i]) - truth[i]) / ROWS[row][i].scale;
    (0..3).map(|i| off(i) * off(i)).sum::<f64>().sqrt()
}
