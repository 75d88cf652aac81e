//! Laws of estimators under guard, in single precision, as they run on a robot.

#![allow(
    clippy::needless_range_loop,
    reason = "matrix arithmetic reads best with its indices"
)]
#![allow(
    clippy::unwrap_used,
    reason = "what is built here is right, and a panic is how this program fails"
)]

mod bench;
mod law;

use bench::{Any, FLOOR, ROWS, Random, Robot, covariance, distance, guard, is_covariance, ranges};
use loopsight_core::learning::{Guarded, Guards, Range, Withheld};
use loopsight_core::{Command, Sample};
use loopsight_estimators::{Rls, RlsSettings};
use nalgebra::{DVector, Dyn, SVector};

/// Two thousand robots, guesses up to 60 % off, references of several kinds, noise of several sizes.
#[test]
fn whatever_the_robot_estimates_stay_in_range_and_converge_where_it_is_excited() {
    const ROBOTS: usize = 2000;
    let mut random = Random(20_261_120);
    let mut worst = [0.0f64; Any::<f32>::KINDS];
    let mut sum = 0.0;
    let mut projected = 0u32;
    let mut excited = 0;
    for index in 0..ROBOTS {
        let kind = index % Any::<f32>::KINDS;
        let mut robot = Robot::random(&mut random);
        let noise = [0.0, 0.01, 0.1][index % 3];
        let hold = [10, 25, 60][index / 3 % 3];
        let amplitude = random.between(5.0, 12.0);
        let mut rows = [0, 1].map(|row| {
            let guess = robot.truth(row).map(|k| k * (1.0 + 0.6 * random.next()));
            let start = distance(row, &guess.map(|g| g as f32), robot.truth(row));
            (
                guard::<f32>(kind, row, guess, 0.0),
                ranges::<f32>(row, guess),
                start,
            )
        });
        let mut volts = [0.0; 2];
        for k in 0..1500 {
            if k % hold == 0 {
                volts = [0, 1].map(|_| amplitude * random.next());
            }
            let samples = robot.step(volts);
            for (row, (guard, ranges, _)) in rows.iter_mut().enumerate() {
                let (phi, y) = samples[row];
                let y = y + noise * random.next();
                let lesson = guard.update(&phi.map(|p| p as f32), y as f32, None);
                projected += u32::from(lesson.projected);
                for (theta, range) in guard.theta().iter().zip(ranges) {
                    assert!(
                        (range.low..=range.high).contains(theta),
                        "robot {index}, sample {k}: {theta} outside {range:?}"
                    );
                }
            }
        }
        for (row, (guard, _, start)) in rows.iter().enumerate() {
            let what = format!("robot {index}, kind {kind}, row {row}, noise {noise}");
            let truth = robot.truth(row);
            let left = distance(row, guard.theta(), truth) / start.max(1.0);
            if kind < 4 {
                assert!(is_covariance(guard.estimator()), "{what}");
            }
            if f64::from(guard.excitation()) < 2.0 * FLOOR[row] {
                // Some direction was not learned: it may stay as wrong as it was.
                let deviation = |i: usize| f64::from(guard.deviation(i)) / ROWS[row][i].scale;
                let spread = (0..3).map(|i| deviation(i).powi(2)).sum::<f64>().sqrt();
                let may = 1.5 + if kind < 4 { 6.0 * spread } else { 0.0 };
                assert!(left < may, "{what}: {left}, {may}");
                continue;
            }
            excited += 1;
            worst[kind] = worst[kind].max(left);
            sum += if kind < 4 { left } else { 0.0 };
            for i in 0..3 {
                // What noise may leave, and as much as single precision may.
                let off = (f64::from(guard.theta()[i]) - truth[i]).abs();
                let may = 6.0 * f64::from(guard.deviation(i)) + 0.05 * ROWS[row][i].scale;
                let may = may + 2e-3 * truth[i].abs();
                assert!(kind == 4 || off < may, "{what}: {i} off by {off}, {may}");
            }
        }
    }
    println!(
        "error left of that at the start, worst of {excited} rows: {worst:.3?}; {projected} projections"
    );
    let mean = sum / excited as f64;
    println!("mean without the gradient step: {mean:.4}");
    assert!(mean < 0.05, "{mean}");
    // A gradient step goes the slower the more alike the regressors are; it never diverges.
    assert!(worst[4] < 1.2, "{worst:?}");
    assert!(projected > 0 && excited > ROBOTS / 2, "{excited}");
}

/// Encoders that chatter around zero, no voltage: a robot that stands. Nothing is learned, and the
/// covariance is as healthy after a million ticks as before.
#[test]
fn a_million_ticks_at_rest_change_nothing() {
    for kind in 0..Any::<f32>::KINDS {
        let mut random = Random(kind as u64);
        let mut robot = Robot::random(&mut random);
        let truth = robot.truth(1);
        let mut guard = guard::<f32>(kind, 1, truth.map(|k| 1.3 * k), 0.0);
        let mut volts = [0.0; 2];
        for k in 0..2000 {
            if k % 20 == 0 {
                volts = [0, 1].map(|_| 9.0 * random.next());
            }
            let (phi, y) = robot.step(volts)[1];
            guard.update(&phi.map(|p| p as f32), y as f32, None);
        }
        // The window still holds motion for a while; then it is over.
        let mut settled = None;
        for k in 0..1_000_000 {
            let omega = 0.01 * random.next();
            let phi = [omega, 0.003 * random.next() * omega, 0.0].map(|p| p as f32);
            let lesson = guard.update(&phi, (2.0 * random.next()) as f32, None);
            match &settled {
                None if lesson.withheld == Some(Withheld::Unexcited) => {
                    assert!(k < 4000, "kind {kind}: still learning at {k}");
                    settled = Some((
                        guard.theta().to_vec(),
                        covariance(|i, j| guard.covariance(i, j)),
                    ));
                }
                None => {}
                Some(_) => assert_eq!(lesson.withheld, Some(Withheld::Unexcited)),
            }
        }
        let (theta, p) = settled.unwrap();
        assert_eq!(theta, guard.theta(), "kind {kind}");
        if kind < 4 {
            assert_eq!(p, covariance(|i, j| guard.covariance(i, j)), "kind {kind}");
            assert!(is_covariance(guard.estimator()), "kind {kind}");
        }
        let left = distance(1, &theta, truth);
        let start = distance(1, &truth.map(|k| (1.3 * k) as f32), truth);
        println!(
            "kind {kind}: {left:.3} scales off, {start:.3} at the start; excitation {:e}",
            guard.excitation()
        );
        assert!(left < start);
        assert!(f64::from(guard.excitation()) < FLOOR[1]);
    }
}

/// Straight ahead the yaw rate is noise: what was learned of turning does not drift, while the
/// forward gain goes on being followed.
#[test]
fn what_is_not_excited_does_not_drift_and_the_rest_is_followed() {
    for kind in 0..4 {
        let mut random = Random(77 + kind as u64);
        let mut robot = Robot::random(&mut random);
        robot.k[1] = 0.04;
        let mut rows = [0, 1].map(|row| guard::<f32>(kind, row, robot.truth(row), 0.0));
        let mut turning = Vec::new();
        let mut volts = [0.0; 2];
        for k in 0..30_000 {
            if k == 15_000 {
                // The battery is changed: a tenth more of everything.
                robot.k[2] *= 1.1;
            }
            if k % 20 == 0 {
                let common = 9.0 * random.next();
                let other = 9.0 * random.next();
                volts = if k < 3000 {
                    [common, other]
                } else {
                    [common; 2]
                };
            }
            let samples = robot.step(volts);
            for (row, guard) in rows.iter_mut().enumerate() {
                let (mut phi, y) = samples[row];
                let chatter = 0.01 * random.next();
                phi[[1, 0][row]] += if row == 0 { chatter * chatter } else { chatter };
                let y = y + 0.02 * random.next();
                guard.update(&phi.map(|p| p as f32), y as f32, None);
            }
            // The window has forgotten the turns.
            if k == 7000 {
                turning = [rows[0].theta()[1], rows[1].theta()[0], rows[1].theta()[2]].to_vec();
            }
        }
        let now = [rows[0].theta()[1], rows[1].theta()[0], rows[1].theta()[2]];
        let forward = f64::from(rows[0].theta()[2]);
        println!(
            "kind {kind}: {turning:?} {now:?}; K_C {forward:.4} of {:.4}",
            robot.k[2]
        );
        assert_eq!(
            turning[1..],
            now[1..],
            "kind {kind}: a row without excitation"
        );
        assert!((now[0] - turning[0]).abs() < 1e-3, "kind {kind}: {now:?}");
        assert!(
            (forward / robot.k[2] - 1.0).abs() < 0.02,
            "kind {kind}: {forward}"
        );
    }
}

/// Data that say the gain is negative: it stays a tenth of its start away from zero, and the others
/// move to where they explain the most.
#[test]
fn a_gain_keeps_away_from_zero() {
    for kind in 0..Any::<f32>::KINDS {
        let mut guard = guard::<f32>(kind, 0, [-10.0, 0.0, 0.2], 0.0);
        let mut random = Random(5);
        let mut seen = false;
        for _ in 0..5000 {
            let phi = [0.2 * random.next(), random.next(), 10.0 * random.next()];
            let y = -12.0 * phi[0] - 0.1 * phi[2];
            seen |= guard
                .update(&phi.map(|p| p as f32), y as f32, None)
                .projected;
        }
        assert!(seen);
        let gain = guard.theta()[2];
        assert!((0.02..0.02001).contains(&gain), "kind {kind}: {gain}");
        assert!(
            (-14.0..-10.0).contains(&guard.theta()[0]),
            "{:?}",
            guard.theta()
        );
    }
}

#[test]
fn what_must_not_teach_does_not_and_says_why() {
    let sample = |fresh| Sample {
        time: 0.0f64,
        fresh,
    };
    let said = |saturated, held| Command { saturated, held };
    assert_eq!(Withheld::by(&sample(true), said(false, false), false), None);
    for (fresh, saturated, held, why) in [
        (false, true, true, Withheld::Stale),
        (true, true, true, Withheld::HeldCommand),
        (true, true, false, Withheld::Saturated),
    ] {
        assert_eq!(
            Withheld::by(&sample(fresh), said(saturated, held), false),
            Some(why)
        );
    }
    assert_eq!(Withheld::by(&sample(true), said(true, false), true), None);

    for kind in 0..Any::<f64>::KINDS {
        let mut guard = guard::<f64>(kind, 0, [-10.0, 0.0, 0.2], 0.05);
        let mut random = Random(8);
        let mut phi = || [0.2 * random.next(), random.next(), 10.0 * random.next()];
        for _ in 0..50 {
            let phi = phi();
            guard.update(&phi, -11.0 * phi[0] + 0.2 * phi[2], None);
        }
        let before = (
            guard.theta().to_vec(),
            covariance(|i, j| guard.covariance(i, j)),
        );
        for why in [Withheld::Saturated, Withheld::HeldCommand, Withheld::Stale] {
            let lesson = guard.update(&phi(), 3.0, Some(why));
            assert_eq!(lesson.withheld, Some(why));
            assert!(lesson.innovation.is_finite() && lesson.relative_variance.is_nan());
        }
        for (phi, y) in [
            (&[f64::NAN, 0.0, 1.0][..], 1.0),
            (&[0.0, 1.0], 1.0),
            (&[0.0, 1.0, 1.0], f64::INFINITY),
            (&[0.0, 1e200, 1.0], 1.0),
        ] {
            let lesson = guard.update(phi, y, None);
            assert_eq!(lesson.withheld, Some(Withheld::NotFinite));
        }
        let phi = phi();
        let predicted: f64 = (0..3).map(|i| phi[i] * guard.theta()[i]).sum();
        let lesson = guard.update(&phi, predicted + 0.04, None);
        assert_eq!(lesson.withheld, Some(Withheld::DeadZone));
        let untouched = (
            guard.theta().to_vec(),
            covariance(|i, j| guard.covariance(i, j)),
        );
        // NaN, the covariance of the gradient step, is not equal to itself.
        assert_eq!(
            format!("{before:?}"),
            format!("{untouched:?}"),
            "kind {kind}"
        );
        assert_eq!(guard.update(&phi, predicted + 0.06, None).withheld, None);
        assert_ne!(before.0, guard.theta());
    }
}

/// With a dead zone as wide as the disturbance, a robot that is well known is left alone: the
/// estimates do not wander, however long it drives.
#[test]
fn within_the_dead_zone_nothing_wanders() {
    for kind in 0..Any::<f32>::KINDS {
        let mut random = Random(31);
        let mut robot = Robot::random(&mut random);
        let truth = robot.truth(0);
        let mut guard = guard::<f32>(kind, 0, truth, 0.021);
        for k in 0..100_000 {
            let volts = [9.0 * (0.01 * f64::from(k)).sin(), 9.0 * random.next()];
            let (phi, y) = robot.step(volts)[0];
            let lesson = guard.update(
                &phi.map(|p| p as f32),
                (y + 0.02 * random.next()) as f32,
                None,
            );
            let quiet = [Withheld::DeadZone, Withheld::Unexcited].map(Some);
            assert!(
                quiet.contains(&lesson.withheld),
                "kind {kind}, {k}: {lesson:?}"
            );
        }
        for i in 0..3 {
            assert!((f64::from(guard.theta()[i]) - truth[i]).abs() < 1e-5);
        }
    }
}

#[test]
fn excitation_tells_directions_apart() {
    let mut guard = guard::<f64>(0, 0, [-10.0, 0.0, 0.2], 0.0);
    for k in 0..1000 {
        // Regressors over scales: (0.2 sin, 0.1 · 1, 0.1 · 10 cos), and no cross terms over a turn.
        let angle = std::f64::consts::TAU * f64::from(k) / 50.0;
        let turn = if k / 50 % 2 == 0 { 1.0 } else { -1.0 };
        guard.update(&[0.2 * angle.sin(), turn, 10.0 * angle.cos()], 0.0, None);
    }
    // rms: 0.2/√2, 0.1 and 1/√2; the window of 200 samples forgets exponentially.
    assert!(
        (guard.excitation() - 0.1).abs() < 0.02,
        "{}",
        guard.excitation()
    );
    let balance = guard.balance();
    assert!((balance - 0.1 * 2f64.sqrt()).abs() < 0.03, "{balance}");
    for _ in 0..2000 {
        guard.update(&[0.2, 1.0, 10.0], 0.0, None);
    }
    assert!(guard.excitation() < 0.01 && guard.balance() < 0.01);
}

#[test]
fn fixed_and_run_time_sizes_give_the_same_digits() {
    let guess = [-10.0, 0.01, 0.2];
    let mut fixed = guard::<f64>(0, 0, guess, 0.01);
    let Any::Rls(_) = fixed.estimator() else {
        unreachable!()
    };
    let settings = RlsSettings {
        forgetting: 0.998,
        initial_covariance: 1e4,
        ..RlsSettings::default()
    };
    let rls: Rls<f64, Dyn> = Rls::new(DVector::zeros(3), &settings).unwrap();
    let guards = Guards {
        dead_zone: 0.01,
        least_excitation: FLOOR[0],
        window: 200.0,
    };
    let start = DVector::from_column_slice(&guess);
    let mut dynamic = Guarded::new(rls, start, &ranges(0, guess), guards).unwrap();
    let mut random = Random(2);
    let mut robot = Robot::random(&mut random);
    for k in 0..3000 {
        let volts = [0, 1].map(|_| if k < 1500 { 9.0 * random.next() } else { 0.0 });
        let (phi, y) = robot.step(volts)[0];
        let (a, b) = (fixed.update(&phi, y, None), dynamic.update(&phi, y, None));
        assert_eq!(format!("{a:?}"), format!("{b:?}"));
        assert_eq!(fixed.theta(), dynamic.theta());
        assert_eq!(
            covariance(|i, j| fixed.covariance(i, j)),
            covariance(|i, j| dynamic.covariance(i, j))
        );
    }
}

#[test]
fn guards_that_make_no_sense_are_refused() {
    let guess = [-10.0, 0.0, 0.2];
    let make = |guards: Guards, ranges: &[Range<f64>]| {
        Guarded::new(Any::new(0), SVector::from(guess), ranges, guards).is_some()
    };
    let good = ranges(0, guess);
    assert!(make(Guards::default(), &good));
    assert!(!make(Guards::default(), &good[..2]));
    for bad in [
        Guards {
            dead_zone: -1.0,
            ..Guards::default()
        },
        Guards {
            least_excitation: f64::NAN,
            ..Guards::default()
        },
        Guards {
            window: 0.5,
            ..Guards::default()
        },
    ] {
        assert!(!make(bad, &good));
    }
    let mut empty = good;
    empty[1].high = -1.0;
    empty[1].low = 1.0;
    assert!(!make(Guards::default(), &empty));
    let mut flat = good;
    flat[0].scale = 0.0;
    assert!(!make(Guards::default(), &flat));
}
