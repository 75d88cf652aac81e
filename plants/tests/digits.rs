//! Short cuts of a simulation change no digit of what is measured.

#![allow(clippy::unwrap_used, reason = "helpers of tests")]

use loopsight_core::Real;
use loopsight_model::model::Model;
use loopsight_model::registry::{self, HostReal};
use loopsight_model::run::{Rows, Run};
use loopsight_model::simulate::{Simulator, free_run};
use loopsight_model::{Dual, derivative, variable};
use loopsight_plants as _;

const DDMR: &str = "[plant.ddmr]\nK_A = -15.146\nK_B = 0.005\nK_C = 0.136\nK_D = -9.573\n\
                    K_E = -3.945\nK_F = 0.656\nhalf_track = 0.131\nwheel_radius = 0.05\n";
const AXIS: &str = "[plant.dc_axis]\nK_A = -4.0\nK_C = 3.0\n";

fn model(text: &str) -> Model {
    Model::from_toml("test.toml", text).unwrap().0
}

/// What is measured while both inputs take turns at several levels.
fn simulate<S: HostReal>(model: &Model, values: &[S]) -> Vec<Vec<S>> {
    let time: Vec<f64> = (0..400).map(|k| 0.01 * f64::from(k)).collect();
    let levels = [6.0, -2.5, 0.4, 0.0, -7.0, 3.0, -0.2];
    let volts = (0..400).flat_map(|k| [levels[k / 40 % 7], levels[k / 25 % 7]]);
    let inputs = Rows::new(2, volts.collect());
    let measured = Rows::new(2, vec![f64::NAN; 800]);
    let run = Run::new("levels", time, inputs, measured).unwrap();
    let mut all = Vec::new();
    let x0 = vec![S::of(0.0); model.n_states()];
    let mut simulator = Simulator::new(model, values);
    free_run(&mut simulator, &x0, &run, |_, y| all.push(y.to_vec()));
    all
}

/// A static map reads nothing but its channel. Evaluated once per sample it has the digits that it has at every stage,
/// where an effect beside it that reads a speed, and adds nothing, asks for that.
#[test]
fn a_static_map_is_evaluated_once_with_the_same_digits() {
    let beside = "[[effect]]\n[effect.expression]\nat = [\"input.right\", \"input.left\"]\n\
                  force = \"nothing*angular_velocity\"\n[effect.expression.parameters]\n\
                  nothing = { value = 0.0, unit = \"V s/rad\", doc = \"none\" }\n";
    let seen = "[log.measured]\nlinear_velocity = { sensor = \"instantaneous\" }\n\
                angular_velocity = { sensor = \"instantaneous\" }\n";
    let at = "at = [\"input.right\", \"input.left\"]\n";
    let bare = model(&format!("{DDMR}{seen}"));
    let plain = simulate(&bare, &bare.values());
    let mut names = Vec::new();
    for meta in registry::effects() {
        if !meta.is_static {
            continue;
        }
        names.push(meta.id);
        assert!(meta.reads.is_empty() && !meta.is_dynamic());
        let effect = format!("[[effect]]\n[effect.{}]\n{at}", meta.id);
        let once = model(&format!("{DDMR}{effect}{seen}"));
        let always = model(&format!("{DDMR}{effect}{beside}{seen}"));
        let with = |model: &Model| {
            let mut values = model.values();
            for (value, p) in values.iter_mut().zip(&model.parameters) {
                if p.name.starts_with(meta.id) {
                    // A saturation begins without a bound.
                    *value = value.min(5.0) + 0.3 * p.declaration.scale;
                }
            }
            simulate(model, &values)
        };
        let (a, b) = (with(&once), with(&always));
        assert!(a == b, "{}", meta.id);
        assert!(a != plain, "{}", meta.id);
    }
    let all = "dead_zone gain_asymmetry input_offset input_power input_saturation";
    names.sort_unstable();
    assert_eq!(names.join(" "), all);
}

/// An axis with a rate of 960 1/s is stable with steps of 2.5 ms, and not with one of 3.1 ms: samples so far apart take two.
#[test]
fn no_step_is_stretched_until_it_is_unstable() {
    let model = model("[plant.dc_axis]\nK_A = -960.0\nK_C = 960.0\n");
    let mut simulator = Simulator::new(&model, &model.values());
    for k in 1..=400 {
        simulator.advance(0.0031 * f64::from(k), &[1.0]);
    }
    let speed = simulator.state()[0];
    assert!((speed - 1.0).abs() < 1e-9, "{speed}");
}

/// Steps by the motion are chosen by values alone, so a simulation and its derivatives take the same ones. A step more would
/// show in the seventh digit.
#[test]
fn derivatives_take_the_steps_of_the_values() {
    let friction = "[[effect]]\n[effect.coulomb_friction]\nat = [\"wheel.right\"]\nlevel = 0.7\n";
    let seen = "[log.measured.linear_velocity]\nsensor = \"instantaneous\"\n\
                [log.measured.angular_velocity]\nsensor = \"interval_mean\"\n";
    let usual = model(&format!("{DDMR}{friction}{seen}"));
    let by_motion = usual.clone().with_steps_by_motion();
    let mut values: Vec<Dual> = usual.values().into_iter().map(Dual::of).collect();
    values[0] = variable(values[0].value(), 0);
    let found = simulate(&by_motion, &by_motion.values());
    let with_derivatives = simulate(&by_motion, &values);
    let off = |a: &[f64], b: &[Dual]| {
        let off = a.iter().zip(b).map(|(a, b)| (a - b.value()).abs());
        off.fold(0.0, f64::max)
    };
    let most = |rows: &[Vec<f64>]| {
        let off = rows.iter().zip(&with_derivatives).map(|(a, b)| off(a, b));
        off.fold(0.0, f64::max)
    };
    assert!(most(&found) < 1e-12, "{}", most(&found));
    assert!(most(&simulate(&usual, &usual.values())) > 1e-8);
}

/// A machine that sharp friction holds at rest has no motion to choose steps by, and one that is too long for the friction would
/// not show in its values: the derivative by an offset of the input is that of the usual steps. So it is where one wheel sticks
/// while the other one turns.
#[test]
fn derivatives_do_not_grow_at_rest() {
    let at_rest = "[[effect]]\n[effect.coulomb_friction]\nat = [\"wheel.right\", \"wheel.left\"]\n\
                   level = 1.5\nwidth = 0.03\n[[effect]]\n[effect.input_offset]\nat = [\"input.right\"]\n\
                   [log.measured.linear_velocity]\nsensor = \"instantaneous\"\n";
    let usual = model(&format!("{DDMR}{at_rest}"));
    let mut values: Vec<Dual> = usual.values().into_iter().map(Dual::of).collect();
    let offset = usual
        .parameters
        .iter()
        .position(|p| p.name.ends_with("offset"));
    values[offset.unwrap()] = variable(0.0, 0);
    let slope = |model: &Model, volts: [f64; 2]| {
        let mut simulator = Simulator::new(model, &values);
        for k in 1..=200 {
            simulator.advance(0.01 * f64::from(k), &volts);
        }
        derivative(&simulator.state()[0], 0)
    };
    let by_motion = usual.clone().with_steps_by_motion();
    for volts in [[0.0, 0.0], [0.5, 6.0]] {
        let (by_motion, usual) = (slope(&by_motion, volts), slope(&usual, volts));
        assert!(usual != 0.0);
        let off = (by_motion / usual - 1.0).abs();
        assert!(off < 1e-6, "{volts:?}: {by_motion} {usual}");
    }
}

/// A speed at rest under friction, and its derivative by the speed at the start, die out, and do not go on to numbers with
/// which a processor computes slowly.
#[test]
fn what_dies_out_is_zero() {
    let friction =
        "[[effect]]\n[effect.coulomb_friction]\nat = [\"shaft\"]\nlevel = 1.0\nwidth = 0.02\n";
    let model = model(&format!("{AXIS}{friction}"));
    let values: Vec<Dual> = model.values().into_iter().map(Dual::of).collect();
    let mut simulator = Simulator::new(&model, &values);
    simulator.reset(&[variable(1.0, 0), Dual::of(0.0)], &[0.0]);
    let mut zero = 0;
    for k in 1..=1000 {
        simulator.advance(0.01 * f64::from(k), &[0.0]);
        let speed = simulator.state()[0];
        for x in [speed.value(), derivative(&speed, 0)] {
            assert!(x == 0.0 || x.abs() > 1e-154, "{k}: {x}");
            zero += usize::from(x == 0.0);
        }
    }
    assert!(zero > 1000, "{zero}");
}
