//! What a reader of the recordings may rely on.

#![allow(
    clippy::unwrap_used,
    reason = "a recording that cannot be made is a failed test"
)]

use std::path::Path;

use loopsight_core::Plant;
use loopsight_hidden::{
    Driven, Experiment, Hidden, Recording, Robot, catalogue, nrmse, overall, record, visibility,
};
use loopsight_model::model::Model;
use loopsight_plants::Ddmr;

fn make(effects: &[(Hidden, f64)], experiment: Experiment, seed: u64) -> Recording {
    let robot = effects.first().map_or(Robot::Twil, |e| e.0.home());
    record(robot, effects, experiment, seed).unwrap()
}

/// The parts give the paper's parameters by the paper's formulas, too.
#[test]
fn the_parts_are_those_of_the_paper() {
    let (motor, body) = Driven::Twil.parts();
    let n = motor.gear_ratio;
    let rolling = body.wheel_inertia / body.wheel_radius.powi(2);
    // Wheels that roll are mass to the body, and inertia at their distance from its middle.
    let physical = [
        body.mass + 2.0 * rolling,
        body.inertia + 2.0 * rolling * body.half_track.powi(2),
        0.0,
        body.wheel_radius,
        body.half_track,
        motor.torque_constant,
        motor.back_emf_constant,
        motor.resistance,
        n,
        motor.reflected_inertia * n * n,
        motor.rotor_friction,
    ];
    let k: [f64; 8] = Ddmr::lower(0, &physical).unwrap();
    let expected = [-15.146, 0.0, 0.136, -9.573, 0.0, 0.656];
    for (k, e) in k.iter().zip(expected) {
        assert!((k - e).abs() < 1e-9, "{k} {e}");
    }
}

#[test]
fn equal_seeds_give_equal_recordings() {
    for experiment in Experiment::ALL {
        let effects = [(Hidden::StribeckFriction, 1.0), (Hidden::BatterySag, 0.5)];
        let a = make(&effects, experiment, 5);
        let b = make(&effects, experiment, 5);
        let c = make(&effects, experiment, 6);
        assert_eq!(a.run, b.run);
        assert_ne!(a.run, c.run);
        assert_eq!(a.run.inputs(), make(&[], experiment, 5).run.inputs());
    }
    for (robot, effect) in catalogue().split_off(Hidden::ALL.len()) {
        let log = |seed| record(robot, &[(effect, 1.0)], robot.lesson(Some(effect)), seed).unwrap();
        assert_eq!(log(5).run, log(5).run);
        assert_ne!(log(5).run, log(6).run);
    }
}

/// Every shipped plant has a machine, and every machine hides something.
#[test]
fn no_plant_is_left_out() {
    let plants = loopsight_model::registry::plants();
    let text: String = Robot::ALL.map(Robot::model_toml).concat();
    for plant in plants {
        let section = format!("[plant.{}", plant.id);
        assert!(text.contains(&section), "{} has no machine", plant.id);
    }
    for robot in Robot::ALL {
        let shown = catalogue().iter().filter(|(r, _)| *r == robot).count();
        assert!(shown > 0, "{}", robot.name());
    }
}

#[test]
fn counting_is_the_only_noise() {
    for robot in [Robot::Twil, Robot::Axis] {
        let log = record(robot, &[], Experiment::Prbs, 1).unwrap();
        let floor = log.floor();
        println!("{} floor {:.2} %", robot.name(), 100.0 * floor);
        assert!((0.002..0.05).contains(&floor), "{floor}");
        assert!(log.run.measured().iter().all(|y| y.is_finite()));
    }
}

#[test]
fn every_effect_shows_more_the_larger_it_is() {
    for (robot, effect) in catalogue() {
        let lesson = robot.lesson(Some(effect));
        let change = |size| visibility(robot, effect, size, lesson, 3).unwrap();
        let changes = effect.sizes().map(change);
        println!("{effect}: {changes:.4?}");
        assert!(changes[1] > 0.01, "{effect} is invisible: {changes:?}");
        // A sensor has a direction or none: that has no size.
        assert!(
            changes[0] < changes[1] && changes[1] < changes[2] || effect == Hidden::SensorMagnitude,
            "{effect}"
        );
        assert!(changes[0] > 0.003, "{effect}: {changes:?}");
    }
}

/// What takes energy or voltage makes the machine slower, whatever it is commanded.
#[test]
fn losses_slow_down() {
    let losses = [
        Hidden::CoulombFriction,
        Hidden::StribeckFriction,
        Hidden::ViscousFriction,
        Hidden::DirectionalFriction,
        Hidden::QuadraticDrag,
        Hidden::DeadZone,
        Hidden::InputSaturation,
        Hidden::BatterySag,
        Hidden::GainDrift,
        Hidden::FrictionDrift,
        Hidden::WindingHeating,
        Hidden::WheelSlip,
    ];
    for effect in losses {
        for experiment in [Experiment::Prbs, Experiment::MultiLevel] {
            let energy = |effects: &[(Hidden, f64)]| {
                let log = make(effects, experiment, 2);
                log.exact.measured().iter().map(|y| y * y).sum::<f64>()
            };
            let (clean, lossy) = (energy(&[]), energy(&[(effect, 1.0)]));
            assert!(lossy < clean, "{effect}: {lossy} of {clean}");
        }
    }
}

/// Under two levels a dead zone is a smaller gain, to the last digit; under seven it is not.
#[test]
fn a_dead_zone_hides_behind_a_gain_under_two_levels() {
    let scaled = |experiment| {
        let clean = make(&[], experiment, 1);
        let dead = make(&[(Hidden::DeadZone, 1.0)], experiment, 1);
        let product = |a: &Recording, b: &Recording| {
            let pairs = a.exact.measured().iter().zip(b.exact.measured());
            pairs.map(|(x, y)| x * y).sum::<f64>()
        };
        let gain = product(&clean, &dead) / product(&clean, &clean);
        let mut best = clean.clone();
        let scaled = best.exact.measured().iter().map(|y| y * gain).collect();
        best.exact = best.exact.with_measured(scaled).unwrap();
        overall(&nrmse(&dead.exact, &best.exact))
    };
    assert!(scaled(Experiment::Prbs) < 1e-9);
    assert!(scaled(Experiment::MultiLevel) > 0.02);
}

#[test]
fn effects_combine() {
    let both = [(Hidden::CoulombFriction, 1.0), (Hidden::InputDelay, 1.0)];
    let log = make(&both, Experiment::Prbs, 1);
    assert_eq!(log.truth.hidden.len(), 2);
    for effect in both {
        let alone = make(&[effect], Experiment::Prbs, 1);
        assert!(overall(&nrmse(&alone.exact, &log.exact)) > 0.05);
    }
    // Everything at once still moves and stays finite.
    for robot in [Robot::Twil, Robot::Axis] {
        let all: Vec<(Hidden, f64)> = Hidden::ALL
            .iter()
            .filter(|e| record(robot, &[(**e, 0.5)], Experiment::Prbs, 1).is_ok())
            .map(|e| (*e, 0.5))
            .collect();
        assert!(all.len() > 15);
        for experiment in Experiment::ALL {
            let log = record(robot, &all, experiment, 1).unwrap();
            assert!(log.run.measured().iter().all(|y| y.abs() < 20.0));
        }
    }
}

#[test]
fn what_makes_no_sense_is_refused() {
    assert!(
        record(
            Robot::Axis,
            &[(Hidden::ScrubFriction, 1.0)],
            Experiment::Prbs,
            1
        )
        .is_err()
    );
    assert!(
        record(
            Robot::Twil,
            &[(Hidden::ConstantForce, 1.0)],
            Experiment::Prbs,
            1
        )
        .is_err()
    );
    for size in [0.0, -1.0, f64::NAN, 11.0] {
        assert!(
            record(
                Robot::Twil,
                &[(Hidden::DeadZone, size)],
                Experiment::Prbs,
                1
            )
            .is_err()
        );
    }
}

/// The model files load, and every channel the truth names is one of the plant's.
#[test]
fn model_files_load_and_channels_exist() {
    for robot in Robot::ALL {
        let log = record(robot, &[], Experiment::Prbs, 1).unwrap();
        let (model, _) = Model::from_toml("model.toml", &log.model_toml).unwrap();
        assert_eq!(model.measured.len(), log.run.n_measured());
        let effects = loopsight_model::registry::effects();
        let channels: Vec<&str> = model.plant.channels.iter().map(|c| c.id).collect();
        for effect in Hidden::ALL {
            let Ok(log) = record(robot, &[(*effect, 1.0)], Experiment::Prbs, 1) else {
                continue;
            };
            let hidden = &log.truth.hidden[0];
            for at in &hidden.at {
                assert!(channels.contains(at), "{effect} at {at}");
            }
            let Some(known) = effects.iter().find(|e| e.id == effect.id()) else {
                panic!("{effect} is not in the library");
            };
            for quantity in &hidden.fitted {
                assert!(
                    known.parameters.iter().any(|p| p.id == quantity.name),
                    "{effect} has no parameter {}",
                    quantity.name
                );
            }
        }
    }
}

/// What is committed is what the program writes; another libm may move a count here and there.
#[test]
fn the_committed_recordings_are_these() {
    let examples = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/hidden-effect");
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.csv");
    for (robot, effect) in [
        (Robot::Twil, Hidden::StribeckFriction),
        (Robot::Axis, Hidden::Backlash),
        (Robot::Twil, Hidden::WheelSlip),
        (Robot::Arm, Hidden::CoulombFriction),
        (Robot::TankPair, Hidden::DeadZone),
        (Robot::Twil, Hidden::BridgeCoast),
        (Robot::Axis, Hidden::Hysteresis),
        (Robot::Oscillator, Hidden::Hysteresis),
        (Robot::Axis, Hidden::ElasticCoupling),
        (Robot::TankPair, Hidden::Overflow),
        (Robot::Axis, Hidden::EndStop),
        (Robot::Arm, Hidden::EndStop),
        (Robot::Twil, Hidden::SensorWindow),
    ] {
        let lesson = robot.lesson(Some(effect));
        record(robot, &[(effect, 1.0)], lesson, 1)
            .unwrap()
            .write_csv(&path)
            .unwrap();
        let made = std::fs::read_to_string(&path).unwrap();
        let folder = examples.join(robot.case(Some(effect)));
        let kept = folder.join(format!("{}.csv", lesson.name()));
        let kept = std::fs::read_to_string(kept).unwrap();
        assert_eq!(made.lines().count(), kept.lines().count());
        let same = made
            .lines()
            .zip(kept.lines())
            .filter(|(a, b)| a == b)
            .count();
        assert!(same > 2475, "{effect}: {same} lines of 2502 are the same");
    }
}
