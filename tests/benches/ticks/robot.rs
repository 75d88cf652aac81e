//! The robot that is composed from TOML beside the same equations by hand.

use std::hint::black_box;

use criterion::Criterion;
use loopsight_core::Real;
use loopsight_model::model::Model;
use loopsight_model::simulate::Simulator;

use super::{PAPER, in_turns};

/// The robot's six equations, by hand.
#[derive(Clone, Copy)]
struct Robot {
    k: [f64; 6],
}

impl Robot {
    #[inline]
    fn rate(
        &self,
        x: &[f64; 6],
        volts: impl Fn(&[f64; 6]) -> [f64; 2],
        sin_cos: impl Fn(f64) -> (f64, f64),
    ) -> [f64; 6] {
        let [v, omega, heading, ..] = *x;
        let (sin, cos) = sin_cos(heading);
        let volts = volts(x);
        [
            self.k[0] * v + self.k[1] * omega * omega + self.k[2] * (volts[0] + volts[1]),
            self.k[3] * omega + self.k[4] * v * omega + self.k[5] * (volts[0] - volts[1]),
            omega,
            v,
            v * cos,
            v * sin,
        ]
    }

    /// One step of the classical Runge-Kutta method.
    #[inline]
    fn step(
        &self,
        x: &mut [f64; 6],
        h: f64,
        volts: impl Fn(&[f64; 6]) -> [f64; 2] + Copy,
        sin_cos: impl Fn(f64) -> (f64, f64) + Copy,
    ) {
        let along = |x: &[f64; 6], k: &[f64; 6], h: f64| -> [f64; 6] {
            std::array::from_fn(|i| x[i] + h * k[i])
        };
        let k1 = self.rate(x, volts, sin_cos);
        let k2 = self.rate(&along(x, &k1, 0.5 * h), volts, sin_cos);
        let k3 = self.rate(&along(x, &k2, 0.5 * h), volts, sin_cos);
        let k4 = self.rate(&along(x, &k3, h), volts, sin_cos);
        for i in 0..6 {
            x[i] += h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]);
        }
    }
}

/// Dry friction at both wheels, by hand.
#[derive(Clone, Copy, Debug)]
struct Dry {
    level: f64,
    width: f64,
    half_track: f64,
    wheel_radius: f64,
}

impl Dry {
    /// What it leaves of the `volts`.
    #[inline]
    fn volts(&self, x: &[f64; 6], volts: [f64; 2]) -> [f64; 2] {
        let [v, omega, ..] = *x;
        let (across, radius) = (self.half_track * omega, self.wheel_radius);
        let flows = [(v + across) / radius, (v - across) / radius];
        std::array::from_fn(|i| volts[i] - self.level * Real::tanh(flows[i] / self.width))
    }
}

/// The functions the composed model uses, which give the same digits on every machine.
fn portable(angle: f64) -> (f64, f64) {
    (Real::sin(angle), Real::cos(angle))
}

/// Steps of 2.5 ms in an interval of 10 ms, as a loop at 100 Hz has them.
pub(crate) const STEPS: usize = 4;

/// The volts of the inputs in the `k`-th interval.
fn volts(k: usize) -> [f64; 2] {
    if (k / 50).is_multiple_of(2) {
        [9.0, -5.0]
    } else {
        [-9.0, 5.0]
    }
}

/// `calls` steps of the robot by hand, with what `left` leaves of the volts.
fn by_hand(
    robot: &Robot,
    calls: usize,
    left: impl Fn(&[f64; 6], [f64; 2]) -> [f64; 2] + Copy,
    sin_cos: impl Fn(f64) -> (f64, f64) + Copy,
) -> [f64; 6] {
    let mut x = [0.0; 6];
    for k in 0..calls / STEPS {
        let volts = black_box(volts(k));
        for _ in 0..STEPS {
            robot.step(&mut x, black_box(0.0025), |x| left(x, volts), sin_cos);
        }
    }
    black_box(x)
}

/// The same steps of a composed model.
fn composed(simulator: &mut Simulator<'_, f64>, calls: usize) {
    simulator.reset(&[0.0; 6], &[0.0; 2]);
    for k in 0..calls / STEPS {
        simulator.advance(black_box((k + 1) as f64 * 0.01), black_box(&volts(k)));
    }
    black_box(simulator.state());
}

/// The composed robot of a model file. It must be the one `by_hand`.
fn checked(text: &str, by_hand: impl Fn(usize) -> [f64; 6]) -> Simulator<'static, f64> {
    let (model, _) = Model::from_toml("model.toml", text).expect("the model is right");
    let values = model.values();
    let mut simulator = Simulator::owning(model, &values);
    composed(&mut simulator, 1024);
    for (a, b) in simulator.state().iter().zip(by_hand(1024)) {
        assert!((a - b).abs() < 1e-9, "{a} {b}");
    }
    simulator
}

pub(crate) fn plant(criterion: &mut Criterion, ratios: bool) {
    let robot = black_box(Robot {
        k: [-15.146, 0.005, 0.136, -9.573, -3.945, 0.656],
    });
    let frictionless = |_: &[f64; 6], volts: [f64; 2]| volts;
    let alone = |calls: usize| by_hand(&robot, calls, frictionless, portable);
    let mut simulator = checked(PAPER, alone);
    if ratios {
        println!("one RK4 step of the robot, six states (ratio to the last line)");
        in_turns(
            4_096,
            &mut [
                ("by hand, with the platform's sin and cos", &mut |calls| {
                    by_hand(&robot, calls, frictionless, f64::sin_cos);
                }),
                ("composed from TOML  (target: 1.1)", &mut |calls| {
                    composed(&mut simulator, calls);
                }),
                ("by hand", &mut |calls| {
                    alone(calls);
                }),
            ],
        );
    }
    with_friction(&robot, ratios);
    let mut group = criterion.benchmark_group("rk4_step_x4");
    let mut time = 0.0;
    simulator.reset(&[0.1, 0.5, 0.3, 0.0, 0.0, 0.0], &[0.0; 2]);
    group.bench_function("composed", |b| {
        b.iter(|| {
            time += 0.01;
            simulator.advance(black_box(time), black_box(&[3.0, 4.0]));
        });
    });
    let mut x = [0.1, 0.5, 0.3, 0.0, 0.0, 0.0];
    group.bench_function("by_hand", |b| {
        b.iter(|| {
            for _ in 0..STEPS {
                let volts = black_box([3.0, 4.0]);
                robot.step(&mut x, black_box(0.0025), |_| volts, portable);
            }
        });
    });
    group.finish();
}

/// The same with dry friction at both wheels.
fn with_friction(robot: &Robot, ratios: bool) {
    const FRICTION: &str = "\n[[effect]]\n[effect.coulomb_friction]\nat = [\"wheel.right\", \"wheel.left\"]\nlevel = 0.8\nwidth = 0.1\n";
    let dry = black_box(Dry {
        level: 0.8,
        width: 0.1,
        half_track: 0.131,
        wheel_radius: 0.05,
    });
    let left = |x: &[f64; 6], volts: [f64; 2]| dry.volts(x, volts);
    let rubbing = |calls: usize| by_hand(robot, calls, left, portable);
    let mut simulator = checked(&format!("{PAPER}{FRICTION}"), rubbing);
    if !ratios {
        return;
    }
    println!("the same with dry friction at both wheels (ratio to the last line)");
    in_turns(
        4_096,
        &mut [
            ("composed from TOML  (target: 1.3)", &mut |calls| {
                composed(&mut simulator, calls);
            }),
            ("by hand", &mut |calls| {
                rubbing(calls);
            }),
        ],
    );
}
