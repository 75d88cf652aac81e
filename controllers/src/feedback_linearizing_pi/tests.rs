//! The law, step by step.

use super::*;
use nalgebra::{Const, DVector, Dyn, Vector2};

/// The paper's robot; `gain` scales its input matrix.
struct Robot {
    gain: f64,
}

impl AffineModel<f64> for Robot {
    fn size(&self) -> usize {
        2
    }
    fn evaluate(&mut self, y: &[f64], drift: &mut [f64], input_matrix: &mut [f64]) {
        drift[0] = -15.146 * y[0] + 0.005 * y[1] * y[1];
        drift[1] = -9.573 * y[1] - 3.945 * y[0] * y[1];
        let (k_c, k_f) = (0.136 * self.gain, 0.656 * self.gain);
        input_matrix.copy_from_slice(&[k_c, k_c, k_f, -k_f]);
    }
}

const TICK: Tick<f64> = Tick {
    index: 0,
    time: 0.0,
    period: 0.01,
};

fn velocity_loop(limit: f64) -> FeedbackLinearizingPi<f64, Const<2>> {
    FeedbackLinearizingPi::new(
        &Vector2::repeat(17.78),
        &Vector2::repeat(79.01),
        &Vector2::repeat(limit),
        0.01,
    )
    .unwrap()
}

#[test]
fn fixed_and_run_time_sizes_give_the_same_digits() {
    let mut fixed = velocity_loop(6.0);
    let mut dynamic: FeedbackLinearizingPi<f64, Dyn> = FeedbackLinearizingPi::new(
        &DVector::repeat(2, 17.78),
        &DVector::repeat(2, 79.01),
        &DVector::repeat(2, 6.0),
        0.01,
    )
    .unwrap();
    let mut robot = Robot { gain: 1.0 };
    for k in 0..200 {
        let measured = [0.01 * f64::from(k % 17), -0.1 * f64::from(k % 5)];
        let (mut a, mut b) = ([0.0; 2], [0.0; 2]);
        let said = fixed.step(&TICK, &[0.1, 0.5], &measured, &mut robot, &mut a);
        let also = dynamic.step(&TICK, &[0.1, 0.5], &measured, &mut robot, &mut b);
        assert_eq!((said, a), (also, b));
    }
}

#[test]
fn the_inverse_gives_the_acceleration_asked_for() {
    let mut controller = FeedbackLinearizingPi::<f64, _>::open_loop(
        &Vector2::new(0.6, -1.6),
        &Vector2::repeat(f64::INFINITY),
        0.01,
    )
    .unwrap();
    let (measured, mut volts) = ([0.1, 0.3], [0.0; 2]);
    let mut robot = Robot { gain: 1.0 };
    controller
        .step(&TICK, &[0.0; 2], &measured, &mut robot, &mut volts)
        .unwrap();
    let (mut f, mut g) = ([0.0; 2], [0.0; 4]);
    robot.evaluate(&[0.1 + 0.003, 0.3 - 0.008], &mut f, &mut g);
    assert!((f[0] + g[0] * volts[0] + g[1] * volts[1] - 0.6).abs() < 1e-12);
    assert!((f[1] + g[2] * volts[0] + g[3] * volts[1] + 1.6).abs() < 1e-12);
}

#[test]
fn what_cannot_be_computed_holds_the_last_command() {
    let mut controller = velocity_loop(12.0);
    let mut command = [f64::NAN; 2];
    let nan = [f64::NAN, 0.0];
    let mut step = |measured: [f64; 2], gain: f64, reference: [f64; 2]| {
        let said = controller
            .step(
                &TICK,
                &reference,
                &measured,
                &mut Robot { gain },
                &mut command,
            )
            .unwrap();
        (said, command)
    };
    let held = Command {
        saturated: false,
        held: true,
    };
    assert_eq!(step(nan, 1.0, [0.1, 0.0]), (held, [0.0; 2]));
    let (said, good) = step([0.05, 0.0], 1.0, [0.1, 0.0]);
    assert_eq!(said, Command::default());
    assert_eq!(step(nan, 1.0, [0.1, 0.0]), (held, good));
    assert_eq!(step([0.05, 0.0], 0.0, [0.1, 0.0]), (held, good));
    assert_eq!(step([0.05, 0.0], f64::NAN, [0.1, 0.0]), (held, good));
    assert_eq!(step([0.05, 0.0], 1.0, [0.1, f64::INFINITY]), (held, good));
    // The integral waited: the next good step is the second one.
    let mut untouched = velocity_loop(12.0);
    let mut expected = [0.0; 2];
    for _ in 0..2 {
        untouched
            .step(
                &TICK,
                &[0.1, 0.0],
                &[0.05, 0.0],
                &mut Robot { gain: 1.0 },
                &mut expected,
            )
            .unwrap();
    }
    assert_eq!(step([0.05, 0.0], 1.0, [0.1, 0.0]).1, expected);
}

#[test]
fn slices_of_other_lengths_are_refused() {
    let mut controller = velocity_loop(12.0);
    let mut robot = Robot { gain: 1.0 };
    let said = controller.step(&TICK, &[0.1], &[0.0; 2], &mut robot, &mut [0.0; 2]);
    assert_eq!(said, Err(ControlError::Sizes));
    let said = controller.step(&TICK, &[0.1; 2], &[0.0; 2], &mut robot, &mut [0.0; 3]);
    assert_eq!(said, Err(ControlError::Sizes));
}

#[test]
fn impossible_designs_are_refused() {
    let two = Vector2::repeat;
    let build = |kp, ki, limit, period| {
        FeedbackLinearizingPi::<f64, _>::new(&two(kp), &two(ki), &two(limit), period).err()
    };
    assert_eq!(
        build(0.0, 1.0, 1.0, 0.01),
        Some(DesignError::Proportional(0, 0.0))
    );
    assert_eq!(
        build(1.0, -1.0, 1.0, 0.01),
        Some(DesignError::Integral(0, -1.0))
    );
    assert_eq!(build(1.0, 1.0, 0.0, 0.01), Some(DesignError::Limit(0, 0.0)));
    assert_eq!(build(1.0, 1.0, 1.0, 0.0), Some(DesignError::Period(0.0)));
    assert_eq!(build(1.0, 0.0, f64::INFINITY, 0.01), None);
}

/// `y' = ν` after the linearisation: a ramp is followed one period late from the start on, where without
/// feedforward the integral has to find its rate first.
#[test]
fn a_rate_is_fed_forward() {
    let worst = |mut controller: FeedbackLinearizingPi<f64, Const<2>>| {
        let mut robot = Robot { gain: 1.0 };
        let (mut y, mut volts, mut worst) = ([0.0; 2], [0.0; 2], 0.0f64);
        for k in 0..300 {
            let r = [0.003 * f64::from(k), 0.01 * f64::from(k)];
            controller
                .step(&TICK, &r, &y, &mut robot, &mut volts)
                .unwrap();
            for (y, rate) in y.iter_mut().zip(controller.acceleration()) {
                *y += 0.01 * rate;
            }
            if k > 5 {
                worst = worst.max((r[1] - y[1]).abs());
            }
        }
        worst
    };
    let plain = worst(velocity_loop(f64::INFINITY));
    let fed = worst(velocity_loop(f64::INFINITY).feeding_forward());
    assert!(fed < 0.0101 && plain > 0.03, "{fed} {plain}");
}
