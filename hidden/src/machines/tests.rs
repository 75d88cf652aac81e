//! The machines against their laws.

use super::arm::Arm;
use super::cart_pole::CartPole;
use super::flexible_joint::FlexibleJoint;
use super::oscillator::Oscillator;
use super::propeller_pendulum::PropellerPendulum;
use super::rotary_pendulum::RotaryPendulum;
use super::servo_axis::ServoAxis;
use super::tank_pair::TankPair;
use super::thermal::Thermal;
use super::torque_axis::TorqueAxis;
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

/// What does not run out below runs over the edge, which is 28 cm high, and is lost.
#[test]
fn a_full_tank_runs_over() {
    let mut rig = TankPair::new(PHASE);
    with(&mut rig, Hidden::Overflow);
    let volts = 8.0;
    let row = hold(&mut rig, volts, 3000);
    let over = rig.over(rig.volume[0]);
    let out = rig.outflow(0, rig.volume[0]);
    assert!(
        over > 2e-5 && (0.28..0.284).contains(&row.exact[0]),
        "{over} {row:?}"
    );
    assert!(((out + over) / (1.2e-5 * volts) - 1.0).abs() < 1e-6);
    // The lower one has what the outlet leaves.
    assert!((rig.outflow(1, rig.volume[1]) / out - 1.0).abs() < 1e-6);
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

/// Against a stop, motor and stop hold what gravity pulls at.
#[test]
fn the_arm_rests_on_its_stops() {
    let mut rig = Arm::new(PHASE, 1e-4);
    let told = with(&mut rig, Hidden::EndStop);
    let row = hold(&mut rig, 12.0, 1500);
    let depth = row.exact[1] - told.value("upper").unwrap();
    let pushed = told.value("torque_per_angle").unwrap() * depth;
    let driven = 12.0 * 0.0265 / (13.0 * 0.01);
    let balance = driven - pushed - rig.weight * row.exact[1].sin();
    assert!(
        depth > 0.0 && balance.abs() < 1e-6,
        "{depth} rad, {balance} N m"
    );
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

/// Without losses the shaft gives back what it takes, and both sides keep their impulse.
#[test]
fn a_shaft_that_twists_keeps_energy_and_impulse() {
    let mut rig = FlexibleJoint::new(PHASE);
    with(&mut rig, Hidden::CubicStiffness);
    // Damping of the shaft and both bearings.
    for loss in [1, 4, 5] {
        *rig.parts()[loss] = 0.0;
    }
    rig.state = [0.02, -0.03, 0.2, -0.1];
    let (energy, impulse) = (rig.energy(), rig.state[0] + rig.state[1]);
    for _ in 0..200 {
        rig.advance();
        assert!((rig.energy() / energy - 1.0).abs() < 1e-3);
        assert!((rig.state[0] + rig.state[1] - impulse).abs() < 1e-12);
    }
}

/// Driven to a steady speed both sides turn alike, and the torque is what bearings and seals take.
#[test]
fn friction_of_both_sides_takes_the_torque() {
    let mut rig = FlexibleJoint::new(PHASE);
    with(&mut rig, Hidden::CoulombFriction);
    with(&mut rig, Hidden::DirectionalFriction);
    for (torque, dry) in [(0.8, 0.12 + 0.06), (-0.8, -0.12 - 0.14)] {
        let row = hold(&mut rig, torque, 3000);
        let speed = (torque - dry) / 0.03;
        for j in 0..2 {
            // Friction acts at the ends of the steps: half a step of it is what may be missing.
            assert!(
                (row.exact[j] - speed).abs() < 1e-4 * dry.abs() / 0.01,
                "{row:?}"
            );
        }
    }
    // Below what sticks nothing moves.
    let mut rig = FlexibleJoint::new(PHASE);
    with(&mut rig, Hidden::CoulombFriction);
    let still = hold(&mut rig, 0.11, 100).exact;
    assert!(still.iter().all(|speed| speed.abs() < 1e-4), "{still:?}");
}

#[test]
fn a_current_turns_the_joint_against_its_friction() {
    let mut rig = TorqueAxis::new(PHASE);
    with(&mut rig, Hidden::CoulombFriction);
    let speed = hold(&mut rig, 2.0, 2000).exact[0];
    // Friction acts at the ends of the steps: half a step of it is what may be missing.
    let off = speed - (rig.gain() * 2.0 - 0.25) / rig.oil;
    assert!(off.abs() < 1.01e-4 * 0.25 / rig.inertia(), "{off}");
    // 30 ms after a command of 20 ms delay it has had 10 ms of it.
    let mut rig = TorqueAxis::new(PHASE);
    with(&mut rig, Hidden::InputDelay);
    hold(&mut rig, 1.0, 3);
    let impulse = rig.state[0];
    let full = rig.gain() * 0.01;
    assert!((impulse / full - 1.0).abs() < 0.02, "{impulse} {full}");
}

/// With a flexible spline the motor's side starts alone, and in the end both turn as one.
#[test]
fn a_flexible_spline_carries_the_load_along() {
    let mut rig = TorqueAxis::new(PHASE);
    let told = with(&mut rig, Hidden::ElasticCoupling);
    assert!((told.value("ratio").unwrap() - 1.5).abs() < 1e-12);
    let (load, near) = (0.03, 0.02);
    rig.sample(1.0);
    rig.advance();
    let [impulse, angle, behind, _] = rig.state;
    let free = rig.gain() / near * 0.5 * 1e-4;
    assert!((angle / free - 1.0).abs() < 0.1, "{angle} {free}");
    assert!((impulse + behind + rig.oil * angle - rig.gain() * 0.01).abs() < 1e-9);
    hold(&mut rig, 1.0, 3000);
    let [impulse, _, behind, _] = rig.state;
    assert!((impulse / near - behind / load).abs() < 1e-6);
    assert!((rig.oil * impulse / near - rig.gain()).abs() < 1e-5);
}

/// What is put in is in the bodies or in the room; at rest what goes in goes out.
#[test]
fn the_heater_loses_no_heat_but_to_the_room() {
    let mut rig = Thermal::new(PHASE);
    with(&mut rig, Hidden::QuadraticDrag);
    let (power, mut gone) = (30.0, 0.0);
    for _ in 0..400 {
        rig.sample(power);
        let out = |rig: &Thermal| rig.out(rig.warmer(rig.heat)[1]);
        let before = out(&rig);
        rig.advance();
        gone += 0.5 * (before + out(&rig));
    }
    let kept: f64 = rig.heat.iter().sum();
    assert!(
        (kept + gone - 400.0 * power).abs() < 1e-4 * kept,
        "{kept} {gone}"
    );
    hold(&mut rig, power, 4000);
    let [element, block] = rig.warmer(rig.heat);
    assert!((rig.out(block) / power - 1.0).abs() < 1e-6);
    assert!((1.5 * (element - block) / power - 1.0).abs() < 1e-6);
    assert!(block < power / rig.skin, "air carries more off");
}

/// Without oil and air, let go far from where it hangs, arm and rod keep their energy; and a torque's impulse
/// about the axis is all that is there.
#[test]
fn arm_and_rod_keep_energy_and_impulse() {
    let mut rig = RotaryPendulum::new(PHASE);
    (rig.oil, rig.air) = (0.0, 0.0);
    rig.state = [2e-3, 0.0, 0.0, 2.5];
    let before = rig.energy();
    for _ in 0..200 {
        rig.advance();
        assert!((rig.energy() - before).abs() < 1e-4, "{}", rig.energy());
        assert!((rig.state[0] - 2e-3).abs() < 1e-12);
    }
    assert!(rig.state[3].abs() < 2.5 + 1e-6);
    // Dry friction holds the arm against what is below it.
    let mut rig = RotaryPendulum::new(PHASE);
    with(&mut rig, Hidden::CoulombFriction);
    assert!(hold(&mut rig, 4e-3, 100).exact[1].abs() < 1e-4);
    assert!(hold(&mut rig, 8e-3, 100).exact[0] > 0.1);
}

#[test]
fn a_fan_holds_the_rod_where_it_balances_its_weight() {
    let mut rig = PropellerPendulum::new(PHASE);
    with(&mut rig, Hidden::InputPower);
    with(&mut rig, Hidden::ActuatorLag);
    let row = hold(&mut rig, -3.0, 4000);
    // 4 V · (3/4)^1.5 of 0.08 N/V at 0.4 m.
    let lift = -0.4 * 0.08 * 4.0 * 0.75f64.powf(1.5);
    assert!((rig.lift() / lift - 1.0).abs() < 1e-9);
    assert!((rig.weight() * row.exact[0].sin() / lift - 1.0).abs() < 1e-6);
    // Let go without fan and air it keeps its energy.
    let mut rig = PropellerPendulum::new(PHASE);
    *rig.parts()[2] = 0.0;
    rig.state = [0.0, 1.5];
    let before = rig.energy();
    for _ in 0..200 {
        rig.advance();
        assert!((rig.energy() - before).abs() < 1e-4);
    }
}

/// Each machine stays where it belongs, under every experiment.
#[test]
fn nothing_runs_away() {
    let rigs = Robot::ALL.into_iter();
    for robot in rigs.filter(|robot| !robot.rig_effects().is_empty()) {
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
                    "angle_rad" => [-1.57, 1.57],
                    "pendulum_angle_rad" => [-3.0, 3.0],
                    "control_voltage_V" => [-9.9, 9.9],
                    "motor_speed_rad_per_s" | "load_speed_rad_per_s" => [-35.0, 35.0],
                    "heater_K" | "body_K" => [294.9, 420.0],
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
