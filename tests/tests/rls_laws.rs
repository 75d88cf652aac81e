//! Laws of recursive least squares: what must hold for any plant, any excitation and any number
//! of updates.

#![allow(
    clippy::needless_range_loop,
    reason = "matrix arithmetic reads best with its indices"
)]
#![allow(
    clippy::unwrap_used,
    reason = "what is built here is right, and a panic is how this program fails"
)]

use loopsight_core::{Estimator, Real};
use loopsight_estimators::{Rls, RlsSettings};
use loopsight_model::config::TomlSource;
use loopsight_model::registry::{ControllerPart, EstimatorPart};
use nalgebra::{DVector, SVector};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

// The registry is empty unless the crates are linked.
use loopsight_controllers as _;

const PERIOD: f64 = 0.01;

fn config(cases: u32) -> ProptestConfig {
    ProptestConfig {
        cases,
        rng_seed: RngSeed::Fixed(20180705),
        failure_persistence: None,
        ..ProptestConfig::default()
    }
}

/// A pseudo-random binary sequence: each input is `±amplitude` for `hold` samples at a time.
struct Prbs {
    random: ChaCha8Rng,
    hold: usize,
    amplitude: f64,
    k: usize,
    value: [f64; 2],
}

impl Prbs {
    fn new(seed: u64, hold: usize, amplitude: f64) -> Self {
        Self {
            random: ChaCha8Rng::seed_from_u64(seed),
            hold,
            amplitude,
            k: 0,
            value: [0.0; 2],
        }
    }

    fn next(&mut self) -> [f64; 2] {
        if self.k.is_multiple_of(self.hold) {
            let bits = self.random.next_u32();
            for (i, value) in self.value.iter_mut().enumerate() {
                *value = if bits >> i & 1 == 0 {
                    self.amplitude
                } else {
                    -self.amplitude
                };
            }
        }
        self.k += 1;
        self.value
    }
}

/// One sample of the regression (40)-(43): both regressors, both measurements.
type Sample = [([f64; 3], f64); 2];

/// The robot of the paper in the regression's own (Euler's) time: 25 s of it.
fn robot(k: [f64; 6], prbs: &mut Prbs) -> Vec<Sample> {
    let mut u = [0.0f64; 2];
    (0..2500)
        .map(|_| {
            let [right, left] = prbs.next();
            let phi1 = [u[0], u[1] * u[1], right + left];
            let phi2 = [u[1], u[0] * u[1], right - left];
            let y1: f64 = (0..3).map(|i| k[i] * phi1[i]).sum();
            let y2: f64 = (0..3).map(|i| k[3 + i] * phi2[i]).sum();
            u[0] += PERIOD * y1;
            u[1] += PERIOD * y2;
            [(phi1, y1), (phi2, y2)]
        })
        .collect()
}

/// Robots like the paper's, stable as long as turning does not destabilise them.
fn robots() -> impl Strategy<Value = [f64; 6]> {
    (
        -30.0..-5.0f64,
        0.0..0.05f64,
        0.08..0.3f64,
        -30.0..-5.0f64,
        -4.0..0.0f64,
        0.3..0.8f64,
    )
        .prop_map(|(a, b, c, d, e, f)| [a, b, c, d, e, f])
}

proptest! {
    #![proptest_config(config(64))]

    #[test]
    fn the_robots_parameters_are_found(k in robots(), seed in any::<u64>(), forgetting in 0.99..=1.0f64) {
        let settings = RlsSettings { forgetting, ..RlsSettings::default() };
        let samples = robot(k, &mut Prbs::new(seed, 50, 9.0));
        for (row, truth) in [&k[..3], &k[3..]].into_iter().enumerate() {
            let mut rls = Rls::new(SVector::<f64, 3>::zeros(), &settings).unwrap();
            for sample in &samples {
                let (phi, y) = &sample[row];
                prop_assert!(rls.update(phi, *y).accepted);
            }
            for i in 0..3 {
                let off = (rls.theta()[i] - truth[i]).abs();
                prop_assert!(off < 1e-3 * truth[i].abs().max(1.0), "{:?} {truth:?}", rls.theta());
            }
        }
    }

    /// With noise the error stays within what the covariance says of it.
    #[test]
    fn the_covariance_tells_the_error(k in robots(), seed in any::<u64>()) {
        let sigma = 0.3;
        let mut random = ChaCha8Rng::seed_from_u64(!seed);
        let samples = robot(k, &mut Prbs::new(seed, 50, 9.0));
        for (row, truth) in [&k[..3], &k[3..]].into_iter().enumerate() {
            let mut rls = Rls::new(SVector::<f64, 3>::zeros(), &RlsSettings::default()).unwrap();
            for sample in &samples {
                let (phi, y) = &sample[row];
                // Uniform with standard deviation sigma.
                let noise = sigma * 12f64.sqrt() * (random.random::<f64>() - 0.5);
                rls.update(phi, y + noise);
            }
            for i in 0..3 {
                let deviation = sigma * rls.covariance(i, i).sqrt();
                prop_assert!((rls.theta()[i] - truth[i]).abs() < 6.0 * deviation + 1e-3);
            }
        }
    }

    /// First order, `x' = a x + b u` sampled exactly: the regression finds its sampled form.
    #[test]
    fn a_first_order_plant_is_found(a in -50.0..-0.5f64, b in 0.1..10.0f64, seed in any::<u64>()) {
        let pole = (a * PERIOD).exp();
        let truth = [pole, (pole - 1.0) / a * b];
        let mut prbs = Prbs::new(seed, 20, 1.0);
        let mut rls = Rls::new(SVector::<f64, 2>::zeros(), &RlsSettings::default()).unwrap();
        let mut x = 0.0;
        for _ in 0..3000 {
            let [u, _] = prbs.next();
            let next = truth[0] * x + truth[1] * u;
            rls.update(&[x, u], next);
            x = next;
        }
        for i in 0..2 {
            prop_assert!((rls.theta()[i] - truth[i]).abs() < 1e-3, "{:?} {truth:?}", rls.theta());
        }
    }

    /// Second order: poles anywhere in the unit disk, oscillating ones included.
    #[test]
    fn a_second_order_plant_is_found(
        radius in 0.1..0.97f64,
        angle in 0.1..3.0f64,
        real in prop::option::of(-0.95..0.95f64),
        b in 0.2..2.0f64,
        seed in any::<u64>(),
    ) {
        let (a1, a2) = match real {
            Some(other) => (radius + other, -radius * other),
            None => (2.0 * radius * angle.cos(), -radius * radius),
        };
        let truth = [a1, a2, b];
        let mut prbs = Prbs::new(seed, 3, 1.0);
        let mut rls = Rls::new(DVector::<f64>::zeros(3), &RlsSettings::default()).unwrap();
        let (mut y1, mut y2) = (0.0, 0.0);
        for _ in 0..3000 {
            let [u, _] = prbs.next();
            let y = a1 * y1 + a2 * y2 + b * u;
            rls.update(&[y1, y2, u], y);
            (y1, y2) = (y, y1);
        }
        for i in 0..3 {
            prop_assert!((rls.theta()[i] - truth[i]).abs() < 1e-4, "{:?} {truth:?}", rls.theta());
        }
    }

    #[test]
    fn fixed_and_run_time_sizes_give_the_same_digits(
        k in robots(), seed in any::<u64>(), forgetting in 0.9..=1.0f64,
    ) {
        let settings = RlsSettings { forgetting, initial_covariance: 1e3, covariance_limit: None, ..RlsSettings::default() };
        let samples = robot(k, &mut Prbs::new(seed, 50, 9.0));
        same_digits::<f32>(&samples, &settings);
        same_digits::<f64>(&samples, &settings);
    }
}

fn covariance<S: Real>(of: &impl Estimator<S>) -> [S; 9] {
    let mut p = [S::zero(); 9];
    of.covariance_into(&mut p);
    p
}

fn same_digits<S: Real>(samples: &[Sample], settings: &RlsSettings) {
    let mut fixed = Rls::new(SVector::<S, 3>::zeros(), settings).unwrap();
    let mut dynamic = Rls::new(DVector::<S>::zeros(3), settings).unwrap();
    for [(phi, y), _] in samples {
        let phi = phi.map(S::of);
        assert_eq!(
            fixed.update(&phi, S::of(*y)),
            dynamic.update(&phi, S::of(*y))
        );
    }
    assert_eq!(fixed.theta(), dynamic.theta());
    assert_eq!(covariance(&fixed), covariance(&dynamic));
}

/// What the regressor does over a million updates.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Excitation {
    Prbs,
    Zero,
    Constant,
    /// Turning is not excited: the robot drives straight ahead.
    StraightAhead,
    /// A thousand updates of noise, a thousand of standstill.
    Alternating,
}

/// Symmetric to the last digit, bounded, and positive definite: as it stands, by a Cholesky
/// factorisation in the scalar itself.
fn check_covariance<S: Real>(p: &[S], limit: f64, what: &str) {
    let n = 3;
    for i in 0..n {
        assert!(p[i * n + i].value() <= limit, "{what}: {p:?}");
        for j in 0..n {
            assert!(p[i * n + j].is_finite(), "{what}: {p:?}");
            assert_eq!(p[i * n + j], p[j * n + i], "{what}");
        }
    }
    let mut l = [[S::zero(); 3]; 3];
    for i in 0..n {
        for j in 0..=i {
            let mut sum = p[i * n + j];
            for k in 0..j {
                sum -= l[i][k] * l[j][k];
            }
            if i == j {
                assert!(sum > S::zero(), "{what}: not positive definite, {p:?}");
                l[i][i] = sum.sqrt();
            } else {
                l[i][j] = sum / l[j][j];
            }
        }
    }
}

fn a_million_updates<S: Real>(forgetting: f64, excitation: Excitation) {
    let limit = 1e6;
    let settings = RlsSettings {
        forgetting,
        initial_covariance: 1e4,
        covariance_limit: Some(limit),
        ..RlsSettings::default()
    };
    let what = format!("{} λ {forgetting} {excitation:?}", size_of::<S>() * 8);
    let mut rls = Rls::new(SVector::<S, 3>::zeros(), &settings).unwrap();
    let truth = [-15.146, 0.005, 0.136];
    let samples = robot(
        [-15.146, 0.005, 0.136, -9.573, -3.945, 0.656],
        &mut Prbs::new(7, 50, 9.0),
    );
    for k in 0..1_000_000 {
        let [(mut phi, _), _] = samples[k % samples.len()];
        match excitation {
            Excitation::Prbs => {}
            Excitation::Zero => phi = [0.0; 3],
            Excitation::Constant => phi = [0.2, 0.7, 18.0],
            Excitation::StraightAhead => phi[1] = 0.0,
            Excitation::Alternating => {
                if k / 1000 % 2 == 1 {
                    phi = [0.0; 3];
                }
            }
        }
        let y: f64 = (0..3).map(|i| truth[i] * phi[i]).sum();
        let told = rls.update(&phi.map(S::of), S::of(y));
        assert!(told.accepted, "{what}: {k}");
        if k % 1000 == 999 || k < 100 {
            check_covariance(&covariance(&rls), limit, &what);
        }
    }
    if excitation == Excitation::Prbs {
        for (found, truth) in rls.theta().iter().zip(truth) {
            let tolerance = if size_of::<S>() == 4 { 2e-3 } else { 1e-6 };
            assert!(
                (found.value() - truth).abs() < tolerance * truth.abs().max(1.0),
                "{what}: {:?}",
                rls.theta()
            );
        }
    }
}

#[test]
fn the_covariance_stays_a_covariance_through_a_million_updates() {
    let excitations = [
        Excitation::Prbs,
        Excitation::Zero,
        Excitation::Constant,
        Excitation::StraightAhead,
        Excitation::Alternating,
    ];
    std::thread::scope(|scope| {
        for single in [true, false] {
            scope.spawn(move || {
                for forgetting in [1.0, 0.99, 0.95] {
                    for excitation in excitations {
                        if single {
                            a_million_updates::<f32>(forgetting, excitation);
                        } else {
                            a_million_updates::<f64>(forgetting, excitation);
                        }
                    }
                }
            });
        }
    });
}

#[derive(Debug, serde::Serialize, serde::Deserialize)]
struct File {
    estimator: Box<dyn EstimatorPart>,
    controller: Box<dyn ControllerPart>,
}

#[test]
fn parts_survive_a_round_trip_through_toml() {
    let every_key = [
        (
            "[estimator.rls]\nforgetting = 0.995\ninitial_covariance = 1000.0\ncovariance_limit = 2000.0\n",
            "[controller.feedback_linearizing_pi]\nproportional = 17.78\nintegral = [79.01, 60.0]\nlimit = 12.0\n",
        ),
        (
            "[estimator.rls]\nforgetting = 1\n",
            "[controller.feedback_linearizing_pi]\nsettling_time_s = [0.45, 1]\ndamping = 0.8\nrule = \"exact\"\n",
        ),
        (
            "[estimator.rls]\n",
            "[controller.feedback_linearizing_pi]\nopen_loop_acceleration = [0.6, 0.0]\nlimit = [12.0, 11.0]\n",
        ),
    ];
    for (estimator, controller) in every_key {
        let read = |text: &str| {
            TomlSource::parse("loop.toml", text)
                .unwrap()
                .read::<File>()
                .unwrap()
        };
        let first = read(&format!("{estimator}\n{controller}"));
        let written = toml::to_string(&first).unwrap();
        let second = read(&written);
        assert_eq!(format!("{first:?}"), format!("{second:?}"), "{written}");
        assert_eq!(written, toml::to_string(&second).unwrap());
        first.estimator.build(&[0.0; 3]).unwrap();
    }
}

#[test]
fn the_examples_of_the_declarations_build() {
    let estimator = "[estimator.rls]\nforgetting = 0.0\n";
    let text = format!("{estimator}\n[controller.feedback_linearizing_pi]\nsettling_time_s = 1\n");
    let file: File = TomlSource::parse("loop.toml", &text)
        .unwrap()
        .read()
        .unwrap();
    let text = format!(
        "{}\n{}",
        file.estimator.meta().example,
        file.controller.meta().example
    );
    let example: File = TomlSource::parse("loop.toml", &text)
        .unwrap()
        .read()
        .unwrap();
    assert!(example.estimator.build(&[0.0; 3]).is_ok());
    let refused = file.estimator.build(&[0.0; 3]).err().unwrap();
    assert_eq!(refused.key, "forgetting");
    assert!(
        refused.message.contains("is 0, expected"),
        "{}",
        refused.message
    );
    let empty = example.estimator.build(&[]).err().unwrap();
    assert!(empty.message.contains("expected"), "{}", empty.message);
}

#[test]
fn a_misspelt_key_is_pointed_at() {
    let text = "[controller.feedback_linearizing_pi]\nsettling_time_s = 1\n\n[estimator.rls]\nforgeting = 0.99\n";
    let error = TomlSource::parse("loop.toml", text)
        .unwrap()
        .read::<File>()
        .unwrap_err();
    assert_eq!(error.line, 5, "{error}");
    assert_eq!(error.help.as_deref(), Some("did you mean `forgetting`?"));
    let text = "[estimator.rls]\n\n[controller.feedback_linearizing_pi]\nlimit = \"12 V\"\n";
    let error = TomlSource::parse("loop.toml", text)
        .unwrap()
        .read::<File>()
        .unwrap_err();
    assert_eq!(error.line, 4, "{error}");
    assert!(error.message.contains("expected a number"), "{error}");
}
