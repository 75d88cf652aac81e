//! Short cuts of a simulation change no digit of what is measured.

#![allow(clippy::unwrap_used, reason = "helpers of tests")]

use loopsight_core::Real;
use loopsight_model::model::Model;
use loopsight_model::registry;
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
fn simulate(model: &Model, values: &[f64]) -> Vec<Vec<f64>> {
    let time: Vec<f64> = (0..400).map(|k| 0.01 * f64::from(k)).collect();
    let levels = [6.0, -2.5, 0.4, 0.0, -7.0, 3.0, -0.2];
    let volts = (0..400).flat_map(|k| [levels[k / 40 % 7], levels[k / 25 % 7]]);
    let inputs = Rows::new(2, volts.collect());
    let measured = Rows::new(2, vec![f64::NAN; 800]);
    let run = Run::new("levels", time, inputs, measured).unwrap();
    let mut all = Vec::new();
    let x0 = vec![0.0; model.n_states()];
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
        assert!(meta.reads.is_empty() && meta.states == 0 && !meta.memory);
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
