//! What generality costs: one estimator update and one integration step of a composed plant,
//! beside the same arithmetic written by hand.
//!
//! `cargo bench -p loopsight-tests` prints the ratios, measured in turns within one run so that a
//! slow moment of the machine hits both sides alike, and then criterion's own figures.

#![allow(
    clippy::needless_range_loop,
    reason = "matrix arithmetic reads best with its indices"
)]
#![allow(
    clippy::expect_used,
    reason = "what is built here is right, and a panic is how this program fails"
)]

mod expressions;
mod robot;

use std::hint::black_box;
use std::time::Instant;

use criterion::Criterion;
use loopsight_core::{Estimator, Plant};
use loopsight_estimators::{Rls, RlsSettings};
use loopsight_plants::Ddmr;
use nalgebra::{DVector, SVector};

const PAPER: &str = <Ddmr as Plant>::META.example;

const FORGETTING: f64 = 0.99;
const LIMIT: f64 = 1e6;

/// The update of `Rls` by hand, for three parameters: the same factored covariance, checks and bound, on
/// plain arrays.
struct ByHand {
    theta: [f64; 3],
    u: [[f64; 3]; 3],
    d: [f64; 3],
    cap: f64,
    enlargement: f64,
}

impl ByHand {
    fn new() -> Self {
        let slack = 36.0 * f64::EPSILON / 2.0;
        Self {
            theta: [0.0; 3],
            u: [[0.0; 3]; 3],
            d: [LIMIT / (1.0 + 2.0 * slack); 3],
            cap: LIMIT / (1.0 + 2.0 * slack),
            enlargement: 1.0 + slack,
        }
    }

    fn absorb(&mut self, f: &[f64; 3], v: &[f64; 3], noise: f64, growth: f64) {
        let mut b = [0.0; 3];
        let mut alpha = noise;
        let mut inverse = 1.0 / alpha;
        for j in 0..3 {
            let p = f[j] * inverse;
            let before = alpha;
            alpha += v[j] * f[j];
            inverse = 1.0 / alpha;
            self.d[j] = (self.d[j] * (before * inverse) * growth).max(1e-30);
            for i in 0..j {
                let old = self.u[i][j];
                self.u[i][j] = old - b[i] * p;
                b[i] += old * v[j];
            }
            b[j] = v[j];
        }
    }

    fn update(&mut self, phi: &[f64; 3], y: f64) -> (f64, f64, bool) {
        let (mut f, mut v) = ([0.0; 3], [0.0; 3]);
        let (mut spread, mut innovation) = (0.0, y);
        for j in 0..3 {
            f[j] = phi[j];
            for i in 0..j {
                f[j] += self.u[i][j] * phi[i];
            }
            v[j] = self.d[j] * f[j];
            spread += v[j] * f[j];
            innovation -= phi[j] * self.theta[j];
        }
        if !(innovation.is_finite() && spread.is_finite()) {
            return (f64::NAN, f64::NAN, false);
        }
        let step = innovation / (FORGETTING + spread);
        let mut theta = [0.0; 3];
        for i in 0..3 {
            let mut gain = v[i];
            for j in i + 1..3 {
                gain += self.u[i][j] * v[j];
            }
            theta[i] = self.theta[i] + gain * step;
        }
        if theta.iter().any(|t| !t.is_finite()) {
            return (f64::NAN, f64::NAN, false);
        }
        self.theta = theta;
        self.absorb(&f, &v, FORGETTING, 1.0 / FORGETTING);
        for i in 0..3 {
            let mut variance = self.d[i];
            for k in i + 1..3 {
                variance += self.u[i][k] * self.u[i][k] * self.d[k];
            }
            if variance > self.cap {
                let (mut f, mut v) = ([0.0; 3], [0.0; 3]);
                f[i] = 1.0;
                v[i] = self.d[i];
                for j in i + 1..3 {
                    f[j] = self.u[i][j];
                    v[j] = self.d[j] * f[j];
                }
                self.absorb(&f, &v, self.cap * (variance / (variance - self.cap)), 1.0);
            }
        }
        (innovation, 1.0 + spread, true)
    }

    /// The covariance, column by column.
    fn covariance(&self) -> [f64; 9] {
        let mut p = [0.0; 9];
        for j in 0..3 {
            for i in 0..=j {
                let mut sum = if i == j {
                    self.d[j]
                } else {
                    self.u[i][j] * self.d[j]
                };
                for k in j + 1..3 {
                    sum += self.u[i][k] * self.d[k] * self.u[j][k];
                }
                if i == j {
                    sum *= self.enlargement;
                }
                p[3 * i + j] = sum;
                p[3 * j + i] = sum;
            }
        }
        p
    }
}

/// (44)-(47) as they stand, one triangle mirrored: faster, and indefinite sooner or later.
struct Textbook {
    theta: [f64; 3],
    p: [[f64; 3]; 3],
}

impl Textbook {
    fn update(&mut self, phi: &[f64; 3], y: f64) -> (f64, f64, bool) {
        let (mut g, mut spread, mut innovation) = ([0.0; 3], 0.0, y);
        for i in 0..3 {
            for j in 0..3 {
                g[i] += self.p[i][j] * phi[j];
            }
            spread += g[i] * phi[i];
            innovation -= phi[i] * self.theta[i];
        }
        if !(innovation.is_finite() && spread.is_finite()) {
            return (f64::NAN, f64::NAN, false);
        }
        let inverse = 1.0 / (FORGETTING + spread);
        for i in 0..3 {
            self.theta[i] += g[i] * inverse * innovation;
            for j in i..3 {
                let value = (self.p[i][j] - g[i] * inverse * g[j]) * (1.0 / FORGETTING);
                self.p[i][j] = value;
                self.p[j][i] = value;
            }
        }
        (innovation, 1.0 + spread, true)
    }
}

/// Regressors of the robot under a pseudo-random binary excitation.
fn samples() -> Vec<([f64; 3], f64)> {
    let (mut u, mut volts, mut state) = ([0.0f64; 2], [9.0, -9.0], 7u64);
    (0..1024)
        .map(|k| {
            if k % 50 == 0 {
                state = state
                    .wrapping_mul(6_364_136_223_846_793_005)
                    .wrapping_add(1);
                volts = [33, 34].map(|bit| if state >> bit & 1 == 0 { 9.0 } else { -9.0 });
            }
            let phi = [u[0], u[1] * u[1], volts[0] + volts[1]];
            let y = -15.146 * phi[0] + 0.005 * phi[1] + 0.136 * phi[2];
            u[0] += 0.01 * y;
            u[1] += 0.01 * (-9.573 * u[1] - 3.945 * u[0] * u[1] + 0.656 * (volts[0] - volts[1]));
            (phi, y)
        })
        .collect()
}

fn settings() -> RlsSettings {
    RlsSettings {
        forgetting: FORGETTING,
        initial_covariance: LIMIT,
        covariance_limit: None,
        ..RlsSettings::default()
    }
}

/// Nanoseconds per call of each of `sides`, in turns; medians of many rounds, and the median over
/// the rounds of the ratio of each to the last.
fn in_turns(calls: usize, sides: &mut [(&str, &mut dyn FnMut(usize))]) {
    const ROUNDS: usize = 301;
    let mut times = vec![vec![0.0; ROUNDS]; sides.len()];
    for round in 0..ROUNDS {
        for (side, (_, run)) in sides.iter_mut().enumerate() {
            let start = Instant::now();
            run(calls);
            times[side][round] = start.elapsed().as_secs_f64() * 1e9 / calls as f64;
        }
    }
    let median = |mut values: Vec<f64>| {
        values.sort_by(f64::total_cmp);
        values[values.len() / 2]
    };
    let last = times[sides.len() - 1].clone();
    for ((name, _), time) in sides.iter().zip(&times) {
        let ratio = median(time.iter().zip(&last).map(|(a, b)| a / b).collect());
        println!(
            "  {name:<46} {:>8.2} ns  ratio {ratio:.2}",
            median(time.clone())
        );
    }
}

fn estimator(criterion: &mut Criterion, ratios: bool) {
    let samples = samples();
    let mut fixed = Rls::new(SVector::<f64, 3>::zeros(), &settings()).expect("settings are right");
    let mut dynamic = Rls::new(DVector::<f64>::zeros(3), &settings()).expect("settings are right");
    let mut boxed: Box<dyn Estimator<f64>> = Box::new(fixed.clone());
    let mut by_hand = ByHand::new();
    let mut textbook = Textbook {
        theta: [0.0; 3],
        p: [[LIMIT, 0.0, 0.0], [0.0, LIMIT, 0.0], [0.0, 0.0, LIMIT]],
    };
    // The same arithmetic: the same digits.
    for (phi, y) in &samples {
        fixed.update(phi, *y);
        by_hand.update(phi, *y);
    }
    assert_eq!(fixed.theta(), by_hand.theta);
    let mut covariance = [0.0; 9];
    fixed.covariance_into(&mut covariance);
    assert_eq!(covariance, by_hand.covariance());

    if ratios {
        println!("one RLS update, three parameters (ratio to the last line)");
        in_turns(
            20_480,
            &mut [
                ("textbook P - K φᵀP, by hand", &mut |calls| {
                    for (phi, y) in samples.iter().cycle().take(calls) {
                        black_box(textbook.update(black_box(phi), black_box(*y)));
                    }
                }),
                ("Rls<f64, Dyn>", &mut |calls| {
                    for (phi, y) in samples.iter().cycle().take(calls) {
                        black_box(dynamic.update(black_box(phi), black_box(*y)));
                    }
                }),
                ("Box<dyn Estimator>", &mut |calls| {
                    for (phi, y) in samples.iter().cycle().take(calls) {
                        black_box(boxed.update(black_box(phi), black_box(*y)));
                    }
                }),
                ("Rls<f64, Const<3>>  (target: 1.3)", &mut |calls| {
                    for (phi, y) in samples.iter().cycle().take(calls) {
                        black_box(fixed.update(black_box(phi), black_box(*y)));
                    }
                }),
                (
                    "the same by hand on [f64; 3], [[f64; 3]; 3]",
                    &mut |calls| {
                        for (phi, y) in samples.iter().cycle().take(calls) {
                            black_box(by_hand.update(black_box(phi), black_box(*y)));
                        }
                    },
                ),
            ],
        );
    }
    let mut group = criterion.benchmark_group("rls_update");
    // One after another: the same sample for ever would leave two directions without excitation.
    let mut next = samples.iter().cycle();
    group.bench_function("generic", |b| {
        b.iter(|| {
            if let Some((phi, y)) = next.next() {
                black_box(fixed.update(black_box(phi), black_box(*y)));
            }
        });
    });
    group.bench_function("by_hand", |b| {
        b.iter(|| {
            if let Some((phi, y)) = next.next() {
                black_box(by_hand.update(black_box(phi), black_box(*y)));
            }
        });
    });
    group.finish();
}

fn main() {
    // `cargo test --benches` only wants to know that it runs.
    let ratios = std::env::args().any(|a| a == "--bench");
    let mut criterion = Criterion::default().configure_from_args();
    estimator(&mut criterion, ratios);
    robot::plant(&mut criterion, ratios);
    expressions::expressions(ratios);
    criterion.final_summary();
}
