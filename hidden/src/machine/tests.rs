//! The machine against its laws.

use super::*;
use crate::Hidden;
use crate::driven::Driven;
use crate::hide::hide;

/// Inductance gone: `L/R` of ten nanoseconds.
fn stiff(mut physics: Physics) -> Physics {
    physics.motor.inductance = 1e-8 * physics.motor.resistance;
    physics
}

fn with(robot: Driven, effect: Hidden, size: f64) -> Physics {
    let mut physics = Physics::clean(robot);
    hide(&mut physics, effect, size).unwrap();
    physics
}

/// Commands that drive forwards, turn and reverse.
fn commands(t: f64) -> [f64; 2] {
    [
        9.0 * (1.3 * t).sin().signum(),
        7.0 * (2.1 * t).cos().signum(),
    ]
}

fn run(physics: Physics, seconds: f64, mut look: impl FnMut(f64, &Machine)) -> Machine {
    let mut machine = Machine::new(physics);
    for k in 0..(seconds / STEP).round() as usize {
        machine.step(commands(k as f64 * STEP));
        look((k + 1) as f64 * STEP, &machine);
    }
    machine
}

/// The exact solution of the lumped equations between two changes of the command.
fn lumped_step(robot: Driven, u: [f64; 2], volts: [f64; 2], h: f64) -> [f64; 2] {
    let k = robot.lumped();
    let go = |u: f64, damping: f64, push: f64| {
        let settled = -push / damping;
        settled + (u - settled) * (damping * h).exp()
    };
    match robot {
        Driven::Twil => [
            go(u[0], k.k_a, k.k_c * (volts[0] + volts[1])),
            go(u[1], k.k_d, k.k_f * (volts[0] - volts[1])),
        ],
        Driven::Axis => [go(u[0], k.k_a, k.k_c * volts[0]), 0.0],
    }
}

#[test]
fn without_effect_and_inductance_the_lumped_equations_hold() {
    for robot in [Driven::Twil, Driven::Axis] {
        let mut u = [0.0; 2];
        let mut worst = 0.0f64;
        run(stiff(Physics::clean(robot)), 5.0, |t, machine| {
            u = lumped_step(robot, u, commands(t - STEP), STEP);
            for (now, expected) in machine.body().iter().zip(u) {
                worst = worst.max((now - expected).abs());
            }
        });
        // The motion itself is 0.16 m/s, 1.2 rad/s, 3 rad/s.
        assert!(worst < 2e-6, "{robot:?}: {worst}");
    }
}

#[test]
fn an_offset_centre_of_mass_obeys_newton_and_euler() {
    let mut physics = with(Driven::Twil, Hidden::CentrifugalOffset, 1.0);
    physics.motor.inductance *= 1e-3;
    let k = Driven::Twil.lumped();
    let concealed = hide(
        &mut Physics::clean(Driven::Twil),
        Hidden::CentrifugalOffset,
        1.0,
    )
    .unwrap();
    let (k_b, k_e) = (
        concealed.value("forward").unwrap(),
        -concealed.value("yaw").unwrap(),
    );
    assert!(k_b > 0.0 && k_e < 0.0);
    let mut before = [0.0; 2];
    let mut worst = 0.0f64;
    run(physics, 5.0, |t, machine| {
        let now = machine.body();
        let [v, w] = [0, 1].map(|i| 0.5 * (before[i] + now[i]));
        let volts = commands(t - STEP);
        let rate = [
            k.k_a * v + k_b * w * w + k.k_c * (volts[0] + volts[1]),
            k.k_d * w + k_e * v * w + k.k_f * (volts[0] - volts[1]),
        ];
        let steady = (t - STEP) > 1e-3 && commands(t - STEP) == commands(t - 2.0 * STEP);
        for i in 0..2 {
            if steady {
                worst = worst.max(((now[i] - before[i]) / STEP - rate[i]).abs());
            }
        }
        before = now;
    });
    assert!(worst < 0.02, "{worst} m/s²");
}

#[test]
fn friction_holds_what_it_can_hold() {
    // 0.9 V of friction against 0.8 V: no motion at all; against 1 V: motion.
    for (volts, moves) in [(0.8, false), (1.0, true)] {
        let mut machine = Machine::new(with(Driven::Twil, Hidden::CoulombFriction, 1.0));
        for _ in 0..10_000 {
            machine.step([volts, -volts]);
        }
        assert_eq!(machine.angles()[0].abs() > 1e-3, moves, "{volts} V");
        if !moves {
            assert!(machine.angles()[0].abs() < 1e-12);
        }
    }
}

/// In the steady state friction of `level` V is that much voltage less.
#[test]
fn friction_costs_its_voltage() {
    let k = Driven::Twil.lumped();
    let mut machine = Machine::new(with(Driven::Twil, Hidden::CoulombFriction, 1.0));
    for _ in 0..20_000 {
        machine.step([9.0, 9.0]);
    }
    let expected = -k.k_c * 2.0 * (9.0 - 0.9) / k.k_a;
    assert!((machine.body()[0] - expected).abs() < 1e-6);
    let mut machine = Machine::new(with(Driven::Twil, Hidden::DirectionalFriction, 1.0));
    for _ in 0..20_000 {
        machine.step([-9.0, -9.0]);
    }
    let v = machine.body()[0];
    let speed = v / 0.05;
    let balance = -9.0 + 1.2 - 0.4 * speed + k.k_a * v / (2.0 * k.k_c);
    assert!(balance.abs() < 1e-6, "{balance} V");
}

#[test]
fn scrub_friction_keeps_the_heading() {
    let mut machine = Machine::new(with(Driven::Twil, Hidden::ScrubFriction, 1.0));
    // 1.2 rad/s² is 1.83 V of difference.
    for _ in 0..10_000 {
        machine.step([6.0, 4.4]);
    }
    assert!(machine.pose()[2].abs() < 1e-9 && machine.pose()[0] > 0.05);
    for _ in 0..10_000 {
        machine.step([6.0, 4.0]);
    }
    assert!(machine.pose()[2] > 1e-3);
}

#[test]
fn play_is_the_gap_and_the_load_lags_by_it() {
    let mut machine = Machine::new(with(Driven::Axis, Hidden::Backlash, 1.0));
    for _ in 0..10_000 {
        machine.step([5.0, 0.0]);
    }
    let ahead = machine.rotor_angles[0] - machine.angles[0];
    assert!((ahead - 0.025).abs() < 5e-4, "{ahead} rad");
    for _ in 0..10_000 {
        machine.step([-5.0, 0.0]);
    }
    let behind = machine.rotor_angles[0] - machine.angles[0];
    assert!((behind + 0.025).abs() < 5e-4, "{behind} rad");
}

#[test]
fn tyres_limit_the_traction() {
    let mut before = 0.0;
    let limit = 0.2 * 9.81;
    run(
        with(Driven::Twil, Hidden::WheelSlip, 1.0),
        4.0,
        |_, machine| {
            let v = machine.body()[0];
            assert!((v - before).abs() / STEP < 1.0001 * limit);
            before = v;
        },
    );
}

#[test]
fn a_pendulum_keeps_its_energy_but_for_friction() {
    // No motor: coils cut, no friction. Energy of the arm is kept to the integrator's accuracy.
    let mut physics = with(Driven::Axis, Hidden::GravityPendulum, 1.0);
    physics.motor.torque_constant = 0.0;
    physics.motor.back_emf_constant = 0.0;
    physics.motor.rotor_friction = 0.0;
    let inertia = physics.body.mass + physics.motor.reflected_inertia + physics.body.wheel_inertia;
    let weight = physics.load.gravity;
    let mut worst = 0.0f64;
    run(physics, 20.0, |_, machine| {
        let [speed, _] = machine.body();
        let energy = 0.5 * inertia * speed * speed + weight * machine.angles()[0].sin();
        worst = worst.max(energy.abs());
    });
    assert!(worst < 1e-3 * weight, "{worst} J of {weight} J");
}

/// Coils cut and nothing damped, the two halves swing with `√(k/J_m + k/J_l)`, and keep energy and momentum.
#[test]
fn a_shaft_that_twists_swings_between_its_ends() {
    let mut physics = with(Driven::Axis, Hidden::ElasticCoupling, 1.0);
    physics.motor.torque_constant = 0.0;
    physics.motor.back_emf_constant = 0.0;
    physics.motor.rotor_friction = 0.0;
    let near = physics.body.mass + physics.motor.reflected_inertia + physics.body.wheel_inertia;
    let shaft = physics.twisting.as_mut().unwrap();
    shaft.damping = 0.0;
    let (far, stiffness) = (shaft.inertia, shaft.stiffness);
    assert!((far / near - 0.5).abs() < 1e-9);
    let swing = (stiffness / near + stiffness / far).sqrt();
    assert!((swing - 40.0 * f64::sqrt(1.5)).abs() < 1e-9);
    let mut machine = Machine::new(physics);
    machine.twist = 0.1;
    let whole = 0.5 * stiffness * 0.01;
    for k in 1..=20_000 {
        machine.step([0.0; 2]);
        let (speed, behind) = (machine.velocities.body[0], machine.velocities.far);
        let moving = 0.5 * (near * speed * speed + far * behind * behind);
        let energy = moving + 0.5 * stiffness * machine.twist * machine.twist;
        assert!(
            (energy / whole - 1.0).abs() < 2e-3,
            "{energy} J of {whole} J"
        );
        assert!((near * speed + far * behind).abs() < 1e-12);
        let expected = 0.1 * (swing * f64::from(k) * STEP).cos();
        assert!((machine.twist - expected).abs() < 5e-4, "{k}");
    }
}

#[test]
fn a_payload_keeps_the_momentum() {
    let mut physics = with(Driven::Twil, Hidden::PayloadChange, 1.0);
    physics.payload = physics
        .payload
        .map(|p| crate::physics::Payload { time: 1.0, ..p });
    let mut machine = Machine::new(physics);
    for _ in 0..10_000 {
        machine.step([9.0, 9.0]);
    }
    let before = machine.body()[0];
    machine.step([9.0, 9.0]);
    let ratio = machine.body()[0] / before;
    assert!((ratio - 1.0 / 1.24).abs() < 1e-3, "{ratio}");
}

#[test]
fn a_slope_pulls_downhill() {
    let machine = run(
        with(Driven::Twil, Hidden::GravitySlope, 1.0),
        0.0,
        |_, _| {},
    );
    let mut machine = machine;
    for _ in 0..5_000 {
        machine.step([0.0; 2]);
    }
    assert!(machine.pose()[0] < -1e-3, "rolls back: it stands uphill");
}

#[test]
fn a_shaft_stops_when_it_should_and_stands() {
    let k = Driven::Twil.lumped();
    let mut machine = Machine::new(stiff(with(Driven::Twil, Hidden::CoulombFriction, 1.0)));
    for _ in 0..20_000 {
        machine.step([9.0, 9.0]);
    }
    let v0 = machine.body()[0];
    let mut steps = 0;
    while machine.body()[0] > 0.0 && steps < 20_000 {
        machine.step([0.0; 2]);
        steps += 1;
    }
    // v' = K_A v - 2 K_C level from v0 on reaches 0 after this time.
    let exact = (1.0 - v0 * k.k_a / (2.0 * k.k_c * 0.9)).ln() / -k.k_a;
    let late = f64::from(steps) * STEP - exact;
    assert!((0.0..1.1 * STEP).contains(&late), "{late} s");
    assert!(machine.body()[0].abs() < 1e-15, "it stands");
}

/// The log of a machine without effect is the lumped model's own, but for the inductance, which is
/// a delay of its time constant and no more.
#[test]
fn the_windings_time_constant_is_a_small_delay() {
    for robot in [Driven::Twil, Driven::Axis] {
        let mut u = [0.0; 2];
        let mut squares = [0.0; 2];
        run(Physics::clean(robot), 5.0, |t, machine| {
            u = lumped_step(robot, u, commands(t - STEP), STEP);
            squares[0] += (machine.body()[0] - u[0]).powi(2);
            squares[1] += u[0].powi(2);
        });
        let share = (squares[0] / squares[1]).sqrt();
        assert!((1e-4..1e-3).contains(&share), "{robot:?}: {share}");
    }
}

/// A free shaft that comes to a stop with 3 rad/s leaves it as Hunt and Crossley's law says: from `ω dω = -k/I δ (1 + λ/k ω) dδ`
/// the speeds before and after follow, whatever inertia and stiffness are. Between the stops it keeps its speed.
#[test]
fn a_shaft_is_thrown_back_by_its_stops() {
    let mut physics = with(Driven::Axis, Hidden::EndStop, 1.0);
    physics.motor.torque_constant = 0.0;
    physics.motor.back_emf_constant = 0.0;
    physics.motor.rotor_friction = 0.0;
    let loss = physics.stops.unwrap().loss();
    let [_, upper] = physics.stops.unwrap().at;
    let mut machine = Machine::new(physics);
    machine.velocities.body[0] = 3.0;
    let (mut before, mut highest) = (3.0, 0.0f64);
    for _ in 0..3 {
        let deep = |machine: &Machine| machine.wheel_angles[0].clamp(-1.5, upper);
        while deep(&machine) == machine.wheel_angles[0] {
            machine.step([0.0; 2]);
        }
        assert!((machine.body()[0].abs() - before).abs() < 2e-3 * before);
        while deep(&machine) != machine.wheel_angles[0] {
            machine.step([0.0; 2]);
            highest = highest.max(machine.wheel_angles[0]);
        }
        let after = machine.body()[0].abs();
        let of = |v: f64| v / loss - (loss * v).ln_1p() / (loss * loss);
        assert!((of(before) - of(-after)).abs() < 2e-3 * of(before));
        assert!(after < 0.8 * before, "{before} {after}");
        before = after;
    }
    assert!(highest > upper + 0.05 && highest < upper + 0.5, "{highest}");
}
