//! What is said of a force that no effect of the library is.

#![allow(
    clippy::unwrap_used,
    reason = "helpers of tests: a failure is the test's failure"
)]

use std::f64::consts::{PI, TAU};

use loopsight_diagnosis::{
    Conclusion, Diagnosis, FitSettings, Measurements, ResidualForce, Work, diagnose, fit,
    residual_force,
};
use loopsight_hidden::Driven as Robot;
use loopsight_model::excitation::{Excitation, Sequence};
use loopsight_model::model::Model;
use loopsight_model::run::Run;
use loopsight_plants as _;

const PERIOD: f64 = 0.01;
const STEPS: usize = 50;
const RESOLUTION: f64 = TAU / 8192.0;

/// A force in volts by speed (rad/s), angle (rad) and drive (V) of a shaft, and time (s).
type Force = fn(f64, f64, f64, f64) -> f64;

/// Angles of the shafts of a robot with the lumped parameters of `model_toml`, rounded to counts.
///
/// Semi-implicit Euler at 0.2 ms: an integrator that no model uses.
fn record(robot: Robot, force: Force, excitation: impl Fn(u64) -> Excitation, seed: u64) -> Run {
    let k = robot.lumped();
    let wheels = match robot {
        Robot::Twil => 2,
        Robot::Axis => 1,
    };
    let (r, b) = (0.05, 0.131);
    let names = ["voltage_right", "voltage_left"];
    let commands: Vec<Sequence> = names[..wheels]
        .iter()
        .map(|name| excitation(seed).build(name).unwrap())
        .collect();
    let h = PERIOD / STEPS as f64;
    let (mut speed, mut angle) = ([0.0; 2], [0.0; 2]);
    let mut before = [0.0; 2];
    let mut run = Run::empty(wheels, wheels);
    for k_sample in 0..2501 {
        let time = PERIOD * k_sample as f64;
        let mut volts = [0.0; 2];
        for (v, c) in volts.iter_mut().zip(&commands) {
            *v = c.sample(time);
        }
        let counts = angle.map(|a: f64| (a / RESOLUTION).floor() * RESOLUTION);
        let difference = [0, 1].map(|i| (counts[i] - before[i]) / PERIOD);
        before = counts;
        let measured = match robot {
            Robot::Twil => [
                r / 2.0 * (difference[0] + difference[1]),
                r / (2.0 * b) * (difference[0] - difference[1]),
            ],
            Robot::Axis => [difference[0], 0.0],
        };
        run.push(time, &volts[..wheels], &measured[..wheels])
            .unwrap();
        for _ in 0..STEPS {
            let with = [0, 1].map(|i| volts[i] + force(speed[i], angle[i], volts[i], time));
            match robot {
                Robot::Twil => {
                    let v = r / 2.0 * (speed[0] + speed[1]);
                    let w = r / (2.0 * b) * (speed[0] - speed[1]);
                    let dv = k.k_a * v + k.k_c * (with[0] + with[1]);
                    let dw = k.k_d * w + k.k_f * (with[0] - with[1]);
                    speed[0] += h * (dv + b * dw) / r;
                    speed[1] += h * (dv - b * dw) / r;
                }
                Robot::Axis => speed[0] += h * (k.k_a * speed[0] + k.k_c * with[0]),
            }
            for i in 0..wheels {
                angle[i] += h * speed[i];
            }
        }
    }
    run
}

fn levels(seed: u64) -> Excitation {
    Excitation::MultiLevel {
        amplitude: 9.0,
        hold_s: 0.5,
        levels: 7,
        seed,
        common: false,
    }
}

fn judge(robot: Robot, run: &Run) -> Diagnosis {
    let model = Model::from_toml("hidden", &robot.model_toml()).unwrap().0;
    diagnose(
        &model,
        &Measurements::new(std::slice::from_ref(run)),
        &Work::quiet(),
    )
    .unwrap()
}

fn force(diagnosis: &Diagnosis) -> &ResidualForce {
    assert_eq!(diagnosis.verdict, Conclusion::UnknownEffect);
    diagnosis.residual_force.as_ref().unwrap()
}

/// Viscous friction of a shaft that is out of round: `-c v |sin φ|`. What does not change with the
/// angle is a part of `K_A`; the rest is `c 4/π (cos 2φ/3 + cos 4φ/15 + …) v`.
#[test]
fn friction_that_depends_on_the_angle_is_described() {
    for (robot, level, force_of) in [
        (
            Robot::Axis,
            0.6,
            (|v, a, _, _| -0.6 * v * a.sin().abs()) as Force,
        ),
        (Robot::Twil, 0.9, |v, a, _, _| -0.9 * v * a.sin().abs()),
    ] {
        let diagnosis = judge(robot, &record(robot, force_of, levels, 3));
        let force = force(&diagnosis);
        let expected: &[&str] = match robot {
            Robot::Axis => &["shaft"],
            Robot::Twil => &["wheel.right", "wheel.left"],
        };
        assert_eq!(force.at, expected);
        assert_eq!(force.unit, "V");
        let first = &force.depends_on[0];
        assert_eq!(first.quantity, "position");
        assert_eq!(first.period, Some(TAU));
        assert!((0.4..0.9).contains(&first.share_of_variance), "{first:?}");
        assert!(force.statement.contains("depends on position: "));
        let expression = force.expression.as_ref().unwrap();
        assert!(expression.share_of_variance > 0.9, "{expression:?}");
        let amplitude = parameter(&expression.toml, "c1");
        let truth = level * 4.0 / (3.0 * PI);
        assert!(
            (amplitude / truth - 1.0).abs() < 0.05,
            "{}",
            expression.toml
        );
        assert!(expression.toml.contains("flow * cos(2 * position)"));

        // The mean forces are those of the truth, within what they are said to be uncertain by.
        let mut off = Vec::new();
        for curve in &first.curves {
            let sign = if curve.direction == "forwards" {
                1.0
            } else {
                -1.0
            };
            for bin in &curve.bins {
                let shown = bin.expression.unwrap();
                off.push((bin.mean - shown) / bin.std_error);
                let wave = sign * (2.0 * bin.center).cos();
                assert!(wave.abs() < 0.6 || wave * bin.mean > 0.0, "{bin:?}");
            }
        }
        let rms = (off.iter().map(|e| e * e).sum::<f64>() / off.len() as f64).sqrt();
        assert!(off.len() > 20 && rms < 2.0, "{rms} of {}", off.len());
    }
}

/// The value of a parameter in the printed TOML.
fn parameter(text: &str, id: &str) -> f64 {
    let document: toml::Table = text.parse().unwrap();
    let expression = &document["effect"][0]["expression"];
    expression["parameters"][id]["value"].as_float().unwrap()
}

/// No term is made of noise, and no quantity has a share in it: neither that of the encoders nor that
/// of a torque without a law.
#[test]
fn noise_has_no_shape() {
    let gusts: Force = |_, _, _, t| {
        let mut state = ((t * 20.0) as u64 + 77).wrapping_mul(0x9E37_79B9_7F4A_7C15);
        state ^= state >> 29;
        state = state.wrapping_mul(0xBF58_476D_1CE4_E5B9);
        8.0 * ((state >> 40) as f64 / f64::from(1 << 24) - 0.5)
    };
    for seed in 1..=3 {
        let quiet = record(Robot::Twil, |_, _, _, _| 0.0, levels, seed);
        assert_eq!(described(Robot::Twil, &quiet), None);
        let found = described(Robot::Axis, &record(Robot::Axis, gusts, levels, seed)).unwrap();
        assert_eq!(found.expression, None, "{}", found.statement);
        assert!(
            found
                .statement
                .ends_with("no expression stands out from the noise")
        );
        for of in &found.depends_on {
            assert!(of.share_of_variance < 0.1, "{of:?}");
        }
    }
}

fn described(robot: Robot, run: &Run) -> Option<ResidualForce> {
    let model = Model::from_toml("hidden", &robot.model_toml()).unwrap().0;
    let runs = std::slice::from_ref(run);
    let fitted = fit(
        &model,
        &Measurements::new(runs),
        &FitSettings::default(),
        &Work::quiet(),
    )
    .unwrap();
    residual_force(&fitted.model, runs, &Work::quiet()).unwrap()
}

/// What is printed can be pasted: the file is read, fitted, and the error falls to the noise.
#[test]
fn the_printed_expression_makes_the_error_fall() {
    let out_of_round: Force = |v, a, _, _| -0.9 * v * a.sin().abs();
    let one_way: Force = |v, _, _, _| -0.15 * v.max(0.0).powi(2) - 0.05 * v.max(0.0).powi(3);
    for (robot, law, variables) in [
        (Robot::Twil, out_of_round, &["flow", "position"][..]),
        (Robot::Axis, one_way, &["flow"]),
    ] {
        let run = record(robot, law, levels, 3);
        let runs = std::slice::from_ref(&run);
        let fitted = |text: &str| {
            let model = Model::from_toml("hidden", text).unwrap().0;
            fit(
                &model,
                &Measurements::new(runs),
                &FitSettings::default(),
                &Work::quiet(),
            )
            .unwrap()
        };
        let plain = fitted(&robot.model_toml());
        let found = residual_force(&plain.model, runs, &Work::quiet());
        let found = found.unwrap().unwrap();
        let expression = found.expression.unwrap();
        for variable in variables {
            assert!(expression.force.contains(variable), "{}", expression.force);
        }
        let pasted = fitted(&format!("{}\n{}", robot.model_toml(), expression.toml));
        assert!(
            pasted.comparison.nrmse < 0.4 * plain.comparison.nrmse,
            "{} of {}: {}",
            pasted.comparison.nrmse,
            plain.comparison.nrmse,
            expression.toml
        );
    }
}
