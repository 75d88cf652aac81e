//! Inputs that run on straight lines between samples.

#![allow(clippy::unwrap_used, reason = "helpers of tests")]

use loopsight_model::model::Model;
use loopsight_model::run::{Rows, Run};
use loopsight_model::simulate::{Simulator, free_run};
use loopsight_plants as _;

const PERIOD: f64 = 0.1;

/// An axis that is sampled coarsely, with what else the file says.
fn axis(more: &str) -> Model {
    let text = format!(
        "[plant.dc_axis]\nK_A = -4.0\nK_C = 3.0\n{more}\n\
         [log.measured.speed]\nsensor = \"instantaneous\"\n"
    );
    Model::from_toml("axis.toml", &text).unwrap().0
}

const FIRST_ORDER: &str =
    "[log.inputs.voltage]\ncolumn = \"voltage\"\nunit = \"V\"\nhold = \"first_order\"";

/// The speed from rest, driven by `2 t` volts.
fn ramp(model: &Model) -> Vec<f64> {
    let time: Vec<f64> = (0..=20).map(|k| PERIOD * f64::from(k)).collect();
    let inputs = Rows::new(1, time.iter().map(|t| 2.0 * t).collect());
    let measured = Rows::new(1, vec![f64::NAN; time.len()]);
    let run = Run::new("ramp", time, inputs, measured).unwrap();
    let mut simulator = Simulator::new(model, &model.values());
    let mut speeds = Vec::new();
    free_run(&mut simulator, &[0.0, 0.0], &run, |_, y| speeds.push(y[0]));
    speeds
}

/// `ω' = -a ω + b t`: `ω = b/a² (a t - 1 + e^{-a t})`.
fn exact(a: f64, b: f64, t: f64) -> f64 {
    b / (a * a) * (a * t - 1.0 + (-a * t).exp())
}

#[test]
fn a_measured_ramp_is_followed_exactly() {
    for (k, speed) in ramp(&axis(FIRST_ORDER)).into_iter().enumerate() {
        let expected = exact(4.0, 6.0, PERIOD * k as f64);
        assert!((speed - expected).abs() < 1e-9, "{k}: {speed} {expected}");
    }
    // A staircase lags behind it: ω(k+1) = e^{-a T} ω(k) + (1 - e^{-a T})/a b t(k).
    let decay = (-4.0 * PERIOD).exp();
    let mut expected = 0.0;
    for (k, speed) in ramp(&axis("")).into_iter().enumerate() {
        assert!((speed - expected).abs() < 1e-9, "{k}: {speed} {expected}");
        expected = decay * expected + (1.0 - decay) / 4.0 * 6.0 * PERIOD * k as f64;
    }
}

/// With effects within the step, and with one that looks back.
#[test]
fn effects_see_the_ramp() {
    let doubled = format!(
        "{FIRST_ORDER}\n[[effect]]\n[effect.viscous_friction]\nat = [\"shaft\"]\ncoefficient = 2.0\n"
    );
    let speed = ramp(&axis(&doubled))[20];
    let expected = exact(4.0 + 3.0 * 2.0, 6.0, 2.0);
    assert!((speed - expected).abs() < 1e-9, "{speed} {expected}");

    let delay = 0.37;
    let delayed = format!(
        "{FIRST_ORDER}\n[[effect]]\n[effect.input_delay]\nat = [\"input\"]\ndelay = {delay}\n"
    );
    let speed = ramp(&axis(&delayed))[20];
    let expected = exact(4.0, 6.0, 2.0 - delay);
    assert!((speed - expected).abs() < 1e-5, "{speed} {expected}");

    // It starts `lead` up the ramp: the ramp of before, and a constant for as long.
    let lead = 0.13;
    let ahead = format!(
        "{FIRST_ORDER}\n[[effect]]\n[effect.input_lead]\nat = [\"input\"]\nlead = {lead}\n"
    );
    let speed = ramp(&axis(&ahead))[10];
    let constant = 6.0 * lead / 4.0 * (1.0 - (-4.0f64).exp());
    let expected = exact(4.0, 6.0, 1.0) + constant;
    assert!((speed - expected).abs() < 1e-5, "{speed} {expected}");
}

/// A recording is known to its end; where commands come one by one, they act as they come.
#[test]
fn a_lead_needs_a_recording() {
    let at = |lead: f64| {
        let effect = format!("[[effect]]\n[effect.input_lead]\nat = [\"input\"]\nlead = {lead}\n");
        axis(&effect)
    };
    let (early, prompt) = (at(0.1), at(0.0));
    let (known, plain) = (ramp(&early), ramp(&prompt));
    let ahead = |k: usize| 2.0 * PERIOD * (k + 1) as f64;
    let mut simulator = Simulator::new(&prompt, &prompt.values());
    simulator.reset(&[0.0, 0.0], &[0.0]);
    let mut live = Simulator::new(&early, &early.values());
    let mut speed = [0.0];
    for k in 0..20 {
        simulator.measure(&mut speed);
        assert!((speed[0] - known[k]).abs() < 1e-9, "{k}");
        simulator.advance(PERIOD * (k + 1) as f64, &[ahead(k)]);
        live.measure(&mut speed);
        assert!((speed[0] - plain[k]).abs() < 1e-9, "{k}");
        live.advance(PERIOD * (k + 1) as f64, &[2.0 * PERIOD * k as f64]);
    }
    assert!((known[10] - plain[10]).abs() > 0.1);
}

/// Both shift the command as it was logged, so one of them would be without effect.
#[test]
fn an_input_is_shifted_once() {
    let one = |id: &str| format!("[[effect]]\n[effect.{id}]\nat = [\"input\"]\n");
    let plant = "[plant.dc_axis]\nK_A = -4.0\nK_C = 3.0\n";
    let two = format!("{plant}{}{}", one("input_delay"), one("input_lead"));
    let error = Model::from_toml("axis.toml", &two).unwrap_err().to_string();
    let expected = "`input_delay` shifts that input in time already";
    assert!(error.contains(expected), "{error}");
    let delayed = axis(&one("input_delay"));
    assert!(delayed.with_effect("input_lead", &["input"]).is_none());
}
