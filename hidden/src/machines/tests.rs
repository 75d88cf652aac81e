//! The machines against their laws.

use super::arm::Arm;
use super::cart_pole::CartPole;
use super::oscillator::Oscillator;
use super::servo_axis::ServoAxis;
use super::tank_pair::TankPair;
use super::*;
use crate::{Experiment, Robot, record};

const PHASE: [f64; 2] = [0.3, 0.7];

fn with(rig: &mut impl Rig, effect: Hidden) -> Concealed {
    rig.hide(Concealed::new(effect, 1.0, &[])).unwrap()
}

/// Under one command for so many samples.
fn hold(rig: &mut impl Rig, command: f64, samples: usize) -> Row {
    for _ in 0..samples {
        rig.sample(command);
        rig.advance();
    }
    rig.sample(command)
}

#[test]
fn marks_are_where_the_phase_has_them() {
    for phase in [0.0, 0.3, 0.9] {
        let scale = Scale::new(0.01, phase);
        let mut sum = 0.0;
        for k in 0..1000 {
            let x = 1e-4 * f64::from(k);
            let off = scale.read(x) - x;
            assert!(off.abs() <= 0.005 + 1e-12);
            sum += off;
        }
        assert!((sum / 1000.0).abs() < 1e-4, "{phase}");
    }
}

#[test]
fn without_damper_the_oscillator_keeps_its_energy() {
    let mut rig = Oscillator::new(PHASE);
    with(&mut rig, Hidden::CubicStiffness);
    *rig.parts()[2] = 0.0;
    rig.state = [0.15, 0.0];
    let before = rig.energy();
    for _ in 0..500 {
        rig.advance();
        assert!((rig.energy() / before - 1.0).abs() < 1e-4);
    }
    assert!(rig.state[0].abs() < 0.1501);
}

#[test]
fn a_force_deflects_the_spring_to_its_balance() {
    let mut rig = Oscillator::new(PHASE);
    let stiffness = with(&mut rig, Hidden::CubicStiffness).value("stiffness");
    // 60 s: a damping of 0.6 1/s leaves nothing of the swing.
    let row = hold(&mut rig, 4.0, 6000);
    let x = row.exact[0];
    let tension = 200.0 * x + stiffness.unwrap() * x.powi(3);
    assert!((tension - 4.0).abs() < 1e-6, "{tension} N");
    // Dry friction holds the carriage where it stops, within its band.
    let mut rig = Oscillator::new(PHASE);
    with(&mut rig, Hidden::CoulombFriction);
    assert!(hold(&mut rig, 0.2, 100).exact[0].abs() < 1e-12);
    hold(&mut rig, 4.0, 2000);
    let rest = hold(&mut rig, 0.0, 2000).exact[0];
    assert!(200.0 * rest.abs() < 0.25 && rest != 0.0, "{rest}");
}

#[test]
fn the_tanks_come_to_rest_and_lose_no_water() {
    let mut rig = TankPair::new(PHASE);
    let (volts, mut moved) = (5.0, 0.0);
    let filled: f64 = rig.volume.iter().sum();
    for _ in 0..100 {
        rig.sample(volts);
        let before = rig.volume;
        rig.advance();
        // What left, by the mean of before and after: within the curvature of a second.
        let out = 0.5 * (rig.outflow(1, before[1]) + rig.outflow(1, rig.volume[1]));
        moved += 1.2e-5 * volts - out;
    }
    let now: f64 = rig.volume.iter().sum();
    assert!((now - filled - moved).abs() < 1e-3 * now, "{now} {moved}");
    hold(&mut rig, volts, 3000);
    for tank in 0..2 {
        let out = rig.outflow(tank, rig.volume[tank]);
        assert!((out / (1.2e-5 * volts) - 1.0).abs() < 1e-6, "{tank}: {out}");
    }
    // Below its threshold the pump stands, and a tank cannot be emptier than empty.
    with(&mut rig, Hidden::DeadZone);
    with(&mut rig, Hidden::ConstantForce);
    hold(&mut rig, 0.7, 3000);
    assert!(rig.volume.iter().all(|v| (0.0..1e-9).contains(v)));
}

#[test]
fn the_arm_hangs_where_the_motor_holds_it() {
    let mut rig = Arm::new(PHASE, 1e-4);
    let row = hold(&mut rig, 8.0, 1500);
    let lifted = rig.weight * row.exact[1].sin();
    let held = 8.0 * 0.0265 / (13.0 * 0.01);
    assert!((lifted - held).abs() < 1e-6, "{lifted} N m");
    // Friction of 0.8 V: 0.7 V do not move it.
    let mut rig = Arm::new(PHASE, 1e-4);
    with(&mut rig, Hidden::CoulombFriction);
    assert!(hold(&mut rig, 0.7, 100).exact[1].abs() < 1e-12);
    assert!(hold(&mut rig, 0.9, 100).exact[1] > 1e-3);
}

/// Coils cut and rotor free, it swings with `√(m g l/I)` and keeps its energy.
#[test]
fn a_free_arm_keeps_its_energy() {
    let mut rig = Arm::new(PHASE, 1e-4);
    rig.state = [0.0, 0.9];
    rig.cut();
    let energy = |rig: &Arm| {
        let [speed, angle] = rig.state;
        0.5 * (rig.inertia + 0.0065) * speed * speed - rig.weight * angle.cos()
    };
    let before = energy(&rig);
    for _ in 0..500 {
        rig.advance();
        assert!((energy(&rig) - before).abs() < 1e-3 * rig.weight);
    }
}

#[test]
fn the_slide_takes_the_force_of_its_friction() {
    for (direction, level) in [(1.0, 12.0), (-1.0, 24.0)] {
        let mut rig = ServoAxis::new(PHASE);
        with(&mut rig, Hidden::DirectionalFriction);
        let speed = 0.1 * direction;
        let mut voltage = 0.0;
        for k in 0..400 {
            let row = rig.sample(speed);
            if k >= 200 {
                voltage += row.exact[0] / 200.0;
            }
            rig.advance();
        }
        let expected = (rig.viscous * speed + level * direction) / rig.force_gain();
        assert!((voltage / expected - 1.0).abs() < 1e-3, "{voltage} V");
        // Behind by what the velocity asks for.
        let behind = rig.reference - rig.state[0];
        let wanted = (speed + expected / 120.0) / 30.0;
        assert!((behind / wanted - 1.0).abs() < 0.01, "{behind} {wanted}");
    }
}

#[test]
fn the_voltage_of_the_slide_has_a_limit() {
    let mut rig = ServoAxis::new(PHASE);
    rig.limit = 2.0;
    let mut most = 0.0f64;
    for _ in 0..30 {
        most = most.max(rig.sample(0.2).measured[0].abs());
        rig.advance();
    }
    assert_eq!(most, 2.0);
}

#[test]
fn a_falling_pole_keeps_its_energy() {
    let mut rig = CartPole::new(PHASE);
    rig.state[1] = 0.3;
    let before = rig.energy();
    let mut lowest = 0.3f64.cos();
    for _ in 0..30_000 {
        rig.step();
        lowest = lowest.min(rig.state[1].cos());
        assert!((rig.energy() - before).abs() < 1e-4 * before);
    }
    assert!(lowest < -0.9, "it fell");
}

/// The cart's momentum is what the force made it; friction is against the motion of the cart.
#[test]
fn a_push_and_friction_change_the_momentum() {
    let mut rig = CartPole::new(PHASE);
    rig.force = 2.0;
    for _ in 0..2000 {
        rig.step();
    }
    assert!((rig.state[2] - 0.4).abs() < 1e-9);
    let mut rig = CartPole::new(PHASE);
    with(&mut rig, Hidden::CoulombFriction);
    rig.force = 2.0;
    for _ in 0..2000 {
        rig.step();
    }
    assert!((rig.state[2] - 0.32).abs() < 1e-3, "{}", rig.state[2]);
}

/// Each machine stays where it belongs, under every experiment.
#[test]
fn nothing_runs_away() {
    for robot in [
        Robot::Oscillator,
        Robot::TankPair,
        Robot::Arm,
        Robot::ServoAxis,
        Robot::CartPole,
    ] {
        for experiment in Experiment::ALL {
            let log = record(robot, &[], experiment, 3).unwrap();
            let n = log.exact.n_measured();
            for (j, name) in robot.columns().iter().rev().take(n).rev().enumerate() {
                let values: Vec<f64> = log
                    .exact
                    .measured()
                    .iter()
                    .skip(j)
                    .step_by(n)
                    .copied()
                    .collect();
                let least = values.iter().copied().fold(f64::INFINITY, f64::min);
                let most = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
                println!(
                    "{} {} {name}: {least:.4} to {most:.4}",
                    robot.name(),
                    experiment.name()
                );
                let range = match *name {
                    "position_m" => [-0.5, 0.5],
                    "level_upper_m" | "level_lower_m" => [0.0, 1.0],
                    "angle_rad" => [-1.5, 1.5],
                    "control_voltage_V" => [-9.9, 9.9],
                    _ => [-20.0, 20.0],
                };
                assert!(
                    least >= range[0] && most <= range[1],
                    "{} {name}: {least} {most}",
                    robot.name()
                );
            }
            println!("floor {:.3} %", 100.0 * log.floor());
        }
    }
}
