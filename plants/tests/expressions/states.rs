//! Effects of one's own with states, beside those of the library and beside what can be said without
//! a simulation.

use loopsight_core::Real;
use loopsight_model::affine::Treatment;
use loopsight_model::model::Model;
use loopsight_model::registry::HostReal;
use loopsight_model::run::Run;
use loopsight_model::simulate::{Simulator, free_run};
use loopsight_model::{Dual, derivative, variable};

use super::{LIBRARY_AXIS, TWIL, measuring, model, same, simulate};

/// A lag of the commands, as `actuator_lag` has it.
const OWN_LAG: &str = "
[[effect]]
[effect.expression]
name = \"lag\"
at = [\"input.right\", \"input.left\"]
force = \"(z - nominal) * T / max(T, 0.004)\"
[effect.expression.states]
z = { unit = \"channel\", rate = \"(nominal - z) / max(T, 0.004)\", start = \"nominal\", doc = \"what arrives\" }
[effect.expression.parameters]
T = { value = 0.03, unit = \"s\", range = [0.0, 2.0] }
";

const LAG: &str = "
[[effect]]
[effect.actuator_lag]
at = [\"input.right\", \"input.left\"]
lag = 0.03
";

const SPEEDS: [&str; 2] = ["linear_velocity", "angular_velocity"];

#[test]
fn a_lag_as_an_expression_is_actuator_lag() {
    for lag in ["0.03", "0.001"] {
        let with =
            |effect: &str| measuring(&format!("{TWIL}{}", effect.replace("0.03", lag)), &SPEEDS);
        let parameters = [("lag.T", "actuator_lag.lag"), ("K_A", "K_A")];
        same("the lag", &with(OWN_LAG), &with(LAG), &parameters);
    }
}

/// A state that another effect's signal moves, at an input of a plant with roles.
#[test]
fn a_winding_that_warms_up_is_that_of_the_library() {
    let own = "
[[effect]]
[effect.expression]
name = \"heat\"
at = [\"input\"]
force = \"-(nominal + armature - drive) * z / (1 + z)\"
[effect.expression.states]
z = { unit = \"1\", rate = \"h * (nominal + armature - drive)^2 / (1 + z) - c * z\" }
[effect.expression.parameters]
h = { value = 0.0003, unit = \"1/V^2/s\" }
c = { value = 0.03, unit = \"1/s\" }
";
    let library = "\n[[effect]]\n[effect.winding_heating]\nat = [\"input\"]\nheating = 0.0003\ncooling = 0.03\n";
    let with = |effect: &str| measuring(&format!("{LIBRARY_AXIS}{effect}"), &["speed"]);
    let parameters = [
        ("heat.h", "winding_heating.heating"),
        ("heat.c", "winding_heating.cooling"),
    ];
    same("the winding", &with(own), &with(library), &parameters);
}

/// A tank on the sensor: the sensor reads its level, and nothing else.
fn tank(state: &str, parameters: &str) -> Model {
    let text = format!(
        "{LIBRARY_AXIS}\n[[effect]]\n[effect.expression]\nname = \"tank\"\nat = [\"sensor.speed\"]\n\
         force = \"z - nominal\"\n[effect.expression.states]\nz = {{ unit = \"rad/s\", {state} }}\n{parameters}"
    );
    measuring(&text, &["speed"])
}

/// The level at each sample of a run whose input is held.
fn level<S: HostReal>(model: &Model, values: &[S], inputs: &[f64]) -> Vec<S> {
    let mut run = Run::empty(1, 0);
    for (k, u) in inputs.iter().enumerate() {
        run.push(0.01 * k as f64, &[*u], &[]).unwrap();
    }
    let mut simulator = Simulator::new(model, values);
    let mut all = Vec::new();
    free_run(&mut simulator, &[S::zero(); 2], &run, |_, y| all.push(y[0]));
    all
}

/// What flows in for a while, then out, then in again.
fn inflow() -> Vec<f64> {
    (0..600).map(|k| [7.0, -3.0, 5.0][k / 200]).collect()
}

#[test]
fn what_exceeds_a_limit_is_lost() {
    let model = tank("rate = \"voltage\", start = 2.0, limits = [-1.0, 4.5]", "");
    let inputs = inflow();
    let found = level(&model, &model.values(), &inputs);
    let mut expected = 2.0;
    for (k, found) in found.iter().enumerate() {
        if k > 0 {
            expected = f64::clamp(expected + 0.01 * inputs[k - 1], -1.0, 4.5);
        }
        assert!((found - expected).abs() < 1e-12, "{k}: {found} {expected}");
    }
    let at = |limit: f64| found.iter().filter(|v| **v == limit).count();
    assert!(at(4.5) > 100 && at(-1.0) > 10, "{} {}", at(4.5), at(-1.0));
    // It is the same in `f32`, but for its digits.
    let values: Vec<f32> = model.values().iter().map(|v| *v as f32).collect();
    let single = level(&model, &values, &inputs);
    let off = single
        .iter()
        .zip(&found)
        .map(|(a, b)| (f64::from(*a) - b).abs());
    assert!(off.fold(0.0, f64::max) < 1e-4);
}

/// A limit may be a parameter: where the tank is full the level has its derivative.
#[test]
fn limits_and_starts_have_derivatives() {
    let model = tank(
        "rate = \"voltage\", start = \"z0\", limits = [-inf, \"2 * full\"]",
        "[effect.expression.parameters]\nz0 = { value = 1.0, unit = \"rad/s\" }\nfull = { value = 1.7, unit = \"rad/s\" }\n",
    );
    let mut values: Vec<Dual> = model.values().into_iter().map(Dual::of).collect();
    for (index, name) in ["tank.z0", "tank.full"].into_iter().enumerate() {
        let at = model
            .parameters
            .iter()
            .position(|p| p.name == name)
            .unwrap();
        values[at] = variable(values[at].value(), index);
    }
    let found = level(&model, &values, &inflow());
    let slopes = |k: usize| [0, 1].map(|i| derivative(&found[k], i));
    assert_eq!((found[0].value(), slopes(0)), (1.0, [1.0, 0.0]));
    assert_eq!((found[199].value(), slopes(199)), (3.4, [0.0, 2.0]));
    // What flowed out since: the limit still shows.
    assert!((found[300].value() - 0.4).abs() < 1e-12);
    assert_eq!(slopes(300), [0.0, 2.0]);
}

/// Bristles that settle within 20 us beside samples of 1 ms: long steps come to where short ones do, and so do the
/// derivatives, whose errors no step is chosen by.
#[test]
fn a_stiff_state_is_followed_with_its_derivatives() {
    let text = "[plant.oscillator.physical]\nmass = 1.0\nstiffness = 500.0\ndamping = 0.0\n
[[effect]]
[effect.expression]
name = \"lugre\"
at = [\"mass\"]
force = \"-s0 * z - s1 * (flow - s0 * abs(flow) * z / (Fc + (Fs - Fc) * exp(-(flow / vs)^2)))\"
max_step_s = 5e-6
[effect.expression.states]
z = { unit = \"m\", rate = \"flow - s0 * abs(flow) * z / (Fc + (Fs - Fc) * exp(-(flow / vs)^2))\" }
[effect.expression.parameters]
s0 = { value = 6e4, unit = \"N/m\", above = 0.0 }
s1 = { value = 200.0, unit = \"N s/m\" }
Fc = { value = 0.8, unit = \"N\", above = 0.0 }
Fs = { value = 1.3, unit = \"N\", above = 0.0 }
vs = { value = 0.001, unit = \"m/s\", above = 0.0 }
";
    let chosen = measuring(text, &["position"]);
    let mut short = chosen.clone();
    short.step_given = true;
    let values: Vec<Dual> = (chosen.values().into_iter().enumerate())
        .map(|(i, v)| variable(v, i))
        .collect();
    let mut run = Run::empty(1, 0);
    for k in 0..400 {
        let time = 0.001 * f64::from(k);
        let force = (40.0 * time - 4.0).min(17.0 - 60.0 * time);
        run.push(time, &[force], &[]).unwrap();
    }
    let follow = |model: &Model| {
        let mut simulator = Simulator::new(model, &values);
        let mut all = Vec::new();
        free_run(&mut simulator, &[Dual::of(0.0); 2], &run, |_, y| {
            all.push(y[0])
        });
        all
    };
    let (long, short) = (follow(&chosen), follow(&short));
    let off = |of: &dyn Fn(&Dual) -> f64| {
        let size = short.iter().fold(0.0f64, |m, y| m.max(of(y).abs()));
        let pairs = long.iter().zip(&short);
        pairs.fold(0.0f64, |m, (a, b)| m.max((of(a) - of(b)).abs())) / size
    };
    assert!(
        off(&|y: &Dual| y.value()) < 1e-3,
        "{}",
        off(&|y: &Dual| y.value())
    );
    for (i, parameter) in chosen.parameters.iter().enumerate() {
        let off = off(&|y: &Dual| derivative(y, i));
        assert!(off < 0.02, "{}: {off}", parameter.name);
    }
}

/// A loop predicts over a lag of one's own, and follows what it cannot compensate.
#[test]
fn a_loop_treats_states_of_ones_own_as_those_of_the_library() {
    let lag = model(&format!("{TWIL}{OWN_LAG}"));
    let affine = lag.affine().unwrap();
    assert!(
        matches!(affine.treatments(), [Treatment::Predicted(which)] if which.starts_with("lag at"))
    );
    let spring = "\n[[effect]]\n[effect.expression]\nname = \"stuck\"\nat = [\"shaft\"]\nforce = \"-z\"\n\
                  [effect.expression.states]\nz = { unit = \"V\", rate = \"5 * flow - abs(flow) * z\" }\n";
    let stuck = measuring(&format!("{LIBRARY_AXIS}{spring}"), &["speed", "angle"]);
    let affine = stuck.affine().unwrap();
    assert!(
        matches!(affine.treatments(), [Treatment::Simulated(which, why)]
            if which == "stuck at shaft" && why.contains("a state of its own"))
    );
}

/// At each channel the states are its own, and two states may read each other.
#[test]
fn states_read_each_other_and_are_each_channels_own() {
    let chain = OWN_LAG
        .replace("(z - nominal) * T / max(T, 0.004)", "b - nominal")
        .replace(
            "z = {",
            "b = { unit = \"V\", rate = \"(z - b) / T\", start = \"nominal\" }\nz = {",
        );
    let two = measuring(&format!("{TWIL}{chain}"), &SPEEDS);
    assert_eq!(two.effects[0].meta.states, 2);
    let equation = two.effects[0].meta.equation;
    assert_eq!(
        equation,
        "b' = (z - b) / T;  z' = (nominal - z) / max(T, 0.004);  w = b - nominal"
    );
    // One lag behind the other, as two effects of the library are.
    let twice = measuring(
        &format!(
            "{TWIL}{LAG}{}",
            LAG.replace("input.right\", \"input.left", "input.left\", \"input.right")
        ),
        &SPEEDS,
    );
    let (a, b) = (
        simulate(&two, &two.values()),
        simulate(&twice, &twice.values()),
    );
    let far = a
        .iter()
        .flatten()
        .zip(b.iter().flatten())
        .map(|(a, b)| (a - b).abs());
    assert!(far.fold(0.0, f64::max) < 1e-9);
}
