//! Effects and plants as expressions beside those of the library: the same numbers, the same
//! derivatives, the same file after a fit; and mistakes shown where they stand.

#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a model that is built here is right, and a panic is how a test fails"
)]

mod mistakes;
mod state_mistakes;
mod states;

use loopsight_core::{AffineModel, Place, Plant, Real, Role};
use loopsight_model::expression::{EffectDraft, ParameterDraft};
use loopsight_model::model::Model;
use loopsight_model::registry::{HostReal, effects};
use loopsight_model::run::Run;
use loopsight_model::sensor::Sensor;
use loopsight_model::simulate::{Simulator, free_run};
use loopsight_model::{Dual, derivative, variable};
use loopsight_plants::Ddmr;

const TWIL: &str = <Ddmr as Plant>::META.example;

const FRICTION: &str = "
[[effect]]
[effect.coulomb_friction]
at = [\"wheel.right\", \"wheel.left\"]
level = 0.9
width = 0.2
";

/// The issue's own spelling: `on`, and `speed` for the flow.
const OWN_FRICTION: &str = "
[[effect]]
[effect.expression]
on = [\"wheel.right\", \"wheel.left\"]
force = \"-c * tanh(speed / s)\"
[effect.expression.parameters]
c = { value = 0.9, unit = \"V\", range = [0.0, 12.0], doc = \"size of the friction\" } # volts
s = { value = 0.2, unit = \"rad/s\", above = 0.0, held = true }
";

const AXIS: &str = "[plant.expression.states]
speed = { unit = \"rad/s\", rate = \"K_A * speed + K_C * (voltage + shaft) + load\" }
angle = { unit = \"rad\", rate = \"speed\" }
[plant.expression.inputs]
voltage = { unit = \"V\" }
[plant.expression.outputs]
supply_load = { unit = \"V^2\", value = \"voltage * armature\" }
stall_load = { unit = \"V^2\", value = \"voltage^2\" }
armature = { unit = \"V\", value = \"voltage + K_A / K_C * speed\" }
[plant.expression.channels]
shaft = { unit = \"V\", flow = \"speed\", position = \"angle\", drive = \"voltage\", load = \"supply_load\", stall = \"stall_load\", armature = \"armature\", shaft = \"angle\" }
load = { unit = \"rad/s^2\", flow = \"speed\", position = \"angle\", shaft = \"angle\" }
[plant.expression.parameters]
K_A = { value = -4.0, unit = \"1/s\" }
K_C = { value = 3.0, unit = \"rad/s^2/V\" }
";

const LIBRARY_AXIS: &str = "[plant.dc_axis]\nK_A = -4.0\nK_C = 3.0\n";

fn robot() -> String {
    let path = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../examples/expressions/robot.toml"
    );
    std::fs::read_to_string(path).unwrap()
}

fn model(text: &str) -> Model {
    match Model::from_toml("model.toml", text) {
        Ok((model, _)) => model,
        Err(error) => panic!("{error}\n{text}"),
    }
}

/// The model with these signals measured.
fn measuring(text: &str, signals: &[&str]) -> Model {
    let mut model = model(text);
    let list: Vec<(String, Sensor)> = signals
        .iter()
        .map(|s| ((*s).to_owned(), Sensor::Instantaneous))
        .collect();
    model.measure(&list).unwrap();
    model
}

/// Levels that change every 0.25 s, among them pauses, for 10 s.
fn run(n_inputs: usize) -> Run {
    let mut state = 2_018u32;
    let mut level = vec![0.0; n_inputs];
    let mut run = Run::empty(n_inputs, 0);
    for k in 0..1000 {
        if k % 25 == 0 {
            for u in &mut level {
                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                *u = f64::from((state >> 24) % 9) * 2.31 - 9.24;
            }
        }
        run.push(0.01 * f64::from(k), &level, &[]).unwrap();
    }
    run
}

fn simulate<S: HostReal>(model: &Model, values: &[S]) -> Vec<Vec<S>> {
    let mut simulator = Simulator::new(model, values);
    let mut all = Vec::new();
    let x0 = vec![S::zero(); model.n_states()];
    let run = run(model.plant.inputs.len());
    free_run(&mut simulator, &x0, &run, |_, y| all.push(y.to_vec()));
    all
}

/// Both models, by values and by derivatives in their first parameters, which must be the same.
fn same(of: &str, ours: &Model, library: &Model, of_parameters: &[(&str, &str)]) {
    let largest = |rows: &[Vec<f64>]| rows.iter().flatten().fold(0.0f64, |a, v| a.max(v.abs()));
    let (a, b) = (
        simulate(ours, &ours.values()),
        simulate(library, &library.values()),
    );
    let difference: Vec<Vec<f64>> = a
        .iter()
        .zip(&b)
        .map(|(a, b)| a.iter().zip(b).map(|(a, b)| a - b).collect())
        .collect();
    assert!(largest(&b) > 0.1, "{of}: nothing moves");
    assert!(
        largest(&difference) < 1e-12,
        "{of}: {:e}",
        largest(&difference)
    );

    let seeded = |model: &Model, names: Vec<&str>| -> Vec<Dual> {
        let index = |name: &str| names.iter().position(|n| *n == name);
        let seed = |p: &loopsight_model::model::ModelParameter| {
            let value = p.value.unwrap();
            index(&p.name).map_or_else(|| Dual::of(value), |i| variable(value, i))
        };
        model.parameters.iter().map(seed).collect()
    };
    let ours_in = seeded(ours, of_parameters.iter().map(|p| p.0).collect());
    let library_in = seeded(library, of_parameters.iter().map(|p| p.1).collect());
    let (a, b) = (simulate(ours, &ours_in), simulate(library, &library_in));
    for (i, (name, _)) in of_parameters.iter().enumerate() {
        let slopes = |rows: &[Vec<Dual>]| -> Vec<f64> {
            rows.iter().flatten().map(|v| derivative(v, i)).collect()
        };
        let (a, b) = (slopes(&a), slopes(&b));
        let size = b.iter().fold(0.0f64, |m, v| m.max(v.abs()));
        assert!(size > 0.0, "{of}: `{name}` changes nothing");
        let off = a
            .iter()
            .zip(&b)
            .fold(0.0f64, |m, (a, b)| m.max((a - b).abs()));
        assert!(
            off < 1e-10 * size.max(1.0),
            "{of}, by `{name}`: {off:e} of {size:e}"
        );
    }
}

#[test]
fn a_friction_as_an_expression_is_coulomb_friction() {
    let signals = [
        "linear_velocity",
        "angular_velocity",
        "heading",
        "shaft_angle_left",
    ];
    let ours = measuring(&format!("{TWIL}{OWN_FRICTION}"), &signals);
    let library = measuring(&format!("{TWIL}{FRICTION}"), &signals);
    let parameters = [
        ("expression.c", "coulomb_friction.level"),
        ("expression.s", "coulomb_friction.width"),
        ("K_A", "K_A"),
    ];
    same("friction", &ours, &library, &parameters);
    // In single precision it runs too.
    let values: Vec<f32> = ours.values().iter().map(|v| *v as f32).collect();
    let single = simulate(&ours, &values);
    assert!(single.iter().flatten().all(|v| v.is_finite()));

    let declared: Vec<_> = ours.parameters.iter().rev().take(2).collect();
    assert_eq!((declared[1].free, declared[0].free), (true, false));
    assert_eq!(declared[1].unit, "V");
    assert!(declared[1].declaration.linear && !declared[0].declaration.linear);
    assert_eq!(declared[1].declaration.bounds(), (0.0, 12.0));
}

#[test]
fn plants_as_expressions_are_those_of_the_library() {
    let signals = ["speed", "angle", "armature", "supply_load"];
    let own: Vec<_> = ["K_A", "K_C"].map(|p| (p, p)).to_vec();
    same(
        "axis",
        &measuring(AXIS, &signals),
        &measuring(LIBRARY_AXIS, &signals),
        &own,
    );
    let with = |plant: &str| {
        format!(
            "{plant}\n[[effect]]\n[effect.coulomb_friction]\nat = [\"shaft\"]\nlevel = 0.7\n\
             [[effect]]\n[effect.battery_sag]\nat = [\"input\"]\nresistance = 0.02\n\
             [[effect]]\n[effect.input_delay]\nat = [\"input\"]\ndelay = 0.013\n\
             [[effect]]\n[effect.constant_force]\nat = [\"load\"]\nforce = 0.4\n\
             [[effect]]\n[effect.sensor_lag]\nat = [\"sensor.speed\"]\nlag = 0.02\n"
        )
    };
    let mut parameters = own;
    parameters.push(("coulomb_friction.level", "coulomb_friction.level"));
    parameters.push(("input_delay.delay", "input_delay.delay"));
    let (ours, library) = (with(AXIS), with(LIBRARY_AXIS));
    same(
        "axis with effects",
        &measuring(&ours, &signals),
        &measuring(&library, &signals),
        &parameters,
    );

    let signals = [
        "linear_velocity",
        "angular_velocity",
        "position_x",
        "position_y",
        "shaft_angle_right",
    ];
    let parameters = ["K_A", "K_B", "K_C", "K_D", "K_E", "K_F", "half_track"].map(|p| (p, p));
    let ours = measuring(&robot(), &signals);
    let library = measuring(TWIL, &signals);
    same("robot", &ours, &library, &parameters[..6]);
    let ours = measuring(&format!("{}{FRICTION}", robot()), &signals);
    let library = measuring(&format!("{TWIL}{FRICTION}"), &signals);
    same("robot with friction", &ours, &library, &parameters);

    // Controllers see the same robot.
    let evaluate = |model: &Model| {
        let (mut drift, mut matrix) = ([0.0; 2], [0.0; 4]);
        model
            .affine()
            .unwrap()
            .evaluate(&[0.2, -0.7], &mut drift, &mut matrix);
        [drift.as_slice(), &matrix].concat()
    };
    for (a, b) in evaluate(&ours).iter().zip(evaluate(&library)) {
        assert!((a - b).abs() < 1e-13);
    }
}

#[test]
fn what_a_plant_does_not_say_follows_from_its_signals() {
    let model = model(
        "[plant.expression.states]
level = { unit = \"m\", rate = \"(pump * voltage - sqrt(max(level, 0))) / area\" }
[plant.expression.inputs]
voltage = { unit = \"V\" }
[plant.expression.parameters]
pump = 0.01
area = { value = 0.3, unit = \"m^2\", held = true }
",
    );
    let plant = model.plant;
    let channels: Vec<(&str, Place, &str)> = plant
        .channels
        .iter()
        .map(|c| (c.id, c.place, c.unit))
        .collect();
    assert_eq!(
        channels,
        [
            ("effort.level", Place::Effort(0), "m/s"),
            ("body.level", Place::Rate(0), "m/s"),
            ("input", Place::Input(0), "V"),
            ("sensor.level", Place::Output(0), "m"),
        ]
    );
    assert_eq!(plant.channels[0].read(Role::Drive), Some("voltage"));
    let axis = self::model(AXIS).plant;
    assert_eq!(axis.integrals, [("speed", "angle")]);
    let input = axis.channels.iter().find(|c| c.id == "input").unwrap();
    assert_eq!(input.read(Role::Load), Some("supply_load"));
    let speed = axis
        .channels
        .iter()
        .find(|c| c.id == "sensor.speed")
        .unwrap();
    assert_eq!(speed.read(Role::Position), Some("angle"));

    // The effort acts, and effects of the library attach wherever they fit.
    let mut pushed = measuring_model(&model, "level");
    let still = simulate(&pushed, &pushed.values());
    pushed = pushed
        .with_effect("constant_force", &["effort.level"])
        .unwrap();
    let last = pushed.parameters.len() - 1;
    pushed.parameters[last].value = Some(0.05);
    let moved = simulate(&pushed, &pushed.values());
    assert!((moved[999][0] - still[999][0]).abs() > 1e-3);
    let fitting = |plant: &'static loopsight_core::PlantMeta| {
        let fits = |e: &&loopsight_core::EffectMeta| {
            let fits = |c| loopsight_model::model::misfit(c, e).is_none();
            plant.channels.iter().any(fits)
        };
        effects().into_iter().filter(fits).count()
    };
    let library = fitting(self::model(LIBRARY_AXIS).plant);
    assert_eq!(fitting(axis), library);
    assert!(fitting(plant) >= 8, "{}", fitting(plant));
}

fn measuring_model(model: &Model, signal: &str) -> Model {
    let mut model = model.clone();
    let list = [(signal.to_owned(), Sensor::Instantaneous)];
    model.measure(&list).unwrap();
    model
}

/// Names by which an expression reads: roles, the plant's signals, what it sees of its channel.
#[test]
fn an_expression_reads_what_stands_in_it() {
    let at = |channel: &str, force: &str| {
        let text = format!(
            "{AXIS}\n[[effect]]\n[effect.expression]\nat = [\"{channel}\"]\nforce = \"{force}\"\n"
        );
        let model = measuring(&text, &["speed"]);
        simulate(&model, &model.values())
    };
    let far = |a: &[Vec<f64>], b: &[Vec<f64>]| {
        a.iter()
            .zip(b)
            .fold(0.0f64, |m, (a, b)| m.max((a[0] - b[0]).abs()))
    };
    let by_role = at("shaft", "-0.1 * flow + 0.2 * drive");
    assert_eq!(
        far(&by_role, &at("shaft", "-0.1 * speed + 0.2 * voltage")),
        0.0
    );
    assert_eq!(
        far(&at("input", "0.2 * nominal"), &at("input", "0.2 * voltage")),
        0.0
    );
    let push = at("shaft", "0.2 * voltage");
    assert!(far(&at("input", "0.2 * nominal"), &push) < 1e-12);
    assert!(far(&at("shaft", "0"), &push) > 0.1);
    assert!(far(&at("load", "max(0, time - 5)"), &at("load", "0")) > 0.1);
    // What a sensor adds does not move the plant.
    let offset = at("sensor.speed", "0.3 + 0.1 * nominal");
    let still = at("sensor.speed", "0");
    let expected: Vec<Vec<f64>> = still.iter().map(|r| vec![1.1 * r[0] + 0.3]).collect();
    assert!(far(&offset, &expected) < 1e-12);
    // An output that only the expression needs is up to date.
    let written_out = at("load", "0.1 * (voltage - 4 / 3 * speed)");
    assert!(far(&at("load", "0.1 * armature"), &written_out) < 1e-12);
}

#[test]
fn a_division_by_zero_is_no_panic() {
    let text = format!(
        "{AXIS}\n[[effect]]\n[effect.expression]\nat = [\"shaft\"]\nforce = \"1 / flow + ln(angle)\"\n"
    );
    let model = measuring(&text, &["speed"]);
    let all = simulate(&model, &model.values());
    assert!(all.iter().skip(1).all(|row| !row[0].is_finite()));
}

#[test]
fn two_expressions_have_names_of_their_own() {
    let named = |name: &str, force: &str| {
        format!(
            "\n[[effect]]\n[effect.expression]\nname = \"{name}\"\nat = [\"shaft\"]\nforce = \"{force}\"\n\
             [effect.expression.parameters]\nc = 0.5\n"
        )
    };
    let text = format!(
        "{AXIS}{}{}",
        named("drag", "-c * flow"),
        named("stick", "-c * sign(flow)")
    );
    let both = model(&text);
    let names: Vec<&str> = both.parameters.iter().map(|p| p.name.as_str()).collect();
    assert_eq!(names, ["K_A", "K_C", "drag.c", "stick.c"]);
    // An effect of the library beside them is replaced, and they stay.
    let with = both.with_effect("coulomb_friction", &["shaft"]).unwrap();
    let replaced = with
        .with_effect_replaced(2, "stribeck_friction", &["shaft"])
        .unwrap();
    let ids: Vec<&str> = replaced.effects.iter().map(|e| e.meta.id).collect();
    assert_eq!(ids, ["drag", "stick", "stribeck_friction"]);
    assert_eq!(replaced.parameters[2], both.parameters[2]);
    assert!(
        replaced
            .parameters
            .iter()
            .any(|p| p.name == "stribeck_friction.level")
    );
}

#[test]
fn the_same_text_is_the_same_declaration() {
    let text = format!(
        "{AXIS}{}",
        OWN_FRICTION.replace("\"wheel.right\", \"wheel.left\"", "\"shaft\"")
    );
    let (a, b) = (model(&text), model(&text));
    let fitted = model(&text.replace("-4.0", "-5.0").replace("0.9", "1.1"));
    for other in [&b, &fitted] {
        assert!(std::ptr::eq(a.plant, other.plant));
        assert!(std::ptr::eq(a.effects[0].meta, other.effects[0].meta));
    }
    assert_eq!(fitted.values(), [-5.0, 3.0, 1.1, 0.2]);
    let other = model(&text.replace("K_A * speed", "K_A * 2 * speed"));
    assert!(!std::ptr::eq(a.plant, other.plant));
}

#[test]
fn fitted_values_go_back_into_the_file() {
    let text = format!(
        "{}\n[[effect]] # own\n[effect.expression]\nat = [\"shaft\"]\nforce = \"-a * flow - b * flow^3 - c\"\n\
         [effect.expression.parameters]\na = 0.5 # plain\nb = {{ unit = \"V/(rad/s)^3\" }} # no value yet\n\
         c = {{ value = 1, unit = \"V\" }}\n",
        AXIS.replace("\nK_C", " # damping\nK_C")
    );
    let (mut model, source) = Model::from_toml("model.toml", &text).unwrap();
    assert_eq!(model.missing_values(), ["expression.b"]);
    model.set_values(&[-3.5, 2.5, 0.25, 0.125, 2.0]);
    let values: Vec<_> = model
        .parameters
        .iter()
        .map(|p| (p.path.clone(), p.value.unwrap()))
        .collect();
    let written = source.with_values(&values);
    let expected = text
        .replace("value = -4.0", "value = -3.5")
        .replace("value = 3.0", "value = 2.5")
        .replace("a = 0.5", "a = 0.25")
        .replace(
            "{ unit = \"V/(rad/s)^3\" }",
            "{ unit = \"V/(rad/s)^3\", value = 0.125 }",
        )
        .replace("value = 1,", "value = 2.0,");
    assert_eq!(written, expected);
    assert_eq!(self::model(&written).values(), model.values());
}

#[test]
fn a_draft_is_a_model_file() {
    let parameter = |id: &str, value, unit: &str, held: bool| ParameterDraft {
        id: id.to_owned(),
        value,
        unit: unit.to_owned(),
        range: (!held).then_some([f64::NEG_INFINITY, 4.0]),
        held,
        doc: "with \"quotes\" and a \\".to_owned(),
    };
    let draft = EffectDraft {
        name: "fading".to_owned(),
        at: vec!["wheel.right".to_owned(), "wheel.left".to_owned()],
        force: "-a * flow - b".to_owned(),
        summary: String::new(),
        parameters: vec![
            parameter("a", None, "channel/flow", false),
            parameter("b", Some(0.25), "V", true),
        ],
    };
    let model = model(&format!("{TWIL}\n{}", draft.to_toml()));
    assert_eq!(model.missing_values(), ["fading.a"]);
    let [.., a, b] = model.parameters.as_slice() else {
        panic!()
    };
    assert_eq!(
        (a.unit.as_str(), a.declaration.max, b.value),
        ("V/(rad/s)", 4.0, Some(0.25))
    );
}
