//! Friction that holds a machine.

use loopsight_model::model::Model;

use super::{AXIS, derivatives, difference, model, simulate};

/// How far the derivatives of `axis` by a parameter are from differences of its simulations.
fn off(axis: &Model, parameter: &str) -> f64 {
    let values = axis.values();
    let named = axis.parameters.iter().position(|p| p.name == parameter);
    let named = named.unwrap();
    let moved = |change: f64| {
        let mut values = values.clone();
        values[named] += change;
        simulate(axis, &values)
    };
    let change = 1e-5;
    let (more, less) = (moved(change), moved(-change));
    let of = |(a, b): (&f64, &f64)| (a - b) / (2.0 * change);
    let by_difference: Vec<Vec<f64>> = (more.iter().zip(&less))
        .map(|(a, b)| a.iter().zip(b).map(of).collect())
        .collect();
    difference(&derivatives(axis, &values, named), &by_difference)
}

/// A shaft that sticks is the fastest that a model knows. A step that is too long for it would make the derivatives grow
/// without end. Friction may hold it in one direction only.
#[test]
fn derivatives_are_exact_where_friction_is_sharp() {
    for (effect, sizes) in [
        ("coulomb_friction", "level = 6.0"),
        (
            "directional_friction",
            "level_forward = 6.0\nlevel_backward = 0.0",
        ),
        (
            "directional_friction",
            "level_backward = 6.0\nlevel_forward = 0.0",
        ),
    ] {
        let text = format!(
            "{AXIS}[log.measured]\nspeed = \"speed\"\n[[effect]]\n[effect.{effect}]\nat = [\"shaft\"]\n{sizes}\nwidth = 0.003\n"
        );
        let level = format!("{effect}.{}", sizes.split(' ').next().unwrap());
        let off = off(&model(&text), &level);
        assert!(off < 1e-3, "{effect}, {sizes}: off {off}");
    }
}

/// Nor do they grow with the long steps of a first look, four times the usual ones: as many as it takes are made while it sticks.
#[test]
fn derivatives_do_not_grow_with_long_steps() {
    let text = format!(
        "{AXIS}[log.measured]\nspeed = \"speed\"\n[[effect]]\n[effect.coulomb_friction]\nat = [\"shaft\"]\nlevel = 6.0\nwidth = 0.003\n"
    );
    let usual = model(&text);
    let mut long = usual.clone().with_steps_by_motion();
    long.max_step = 4.0 * usual.usual_step();
    let values = usual.values();
    let largest = |axis, parameter| {
        let all = derivatives(axis, &values, parameter);
        all.iter()
            .flatten()
            .fold(0.0f64, |most, d| most.max(d.abs()))
    };
    for (index, parameter) in usual.parameters.iter().enumerate() {
        let [long, usual] = [&long, &usual].map(|axis| largest(axis, index));
        assert!(
            long <= 10.0 * usual,
            "{}: {long}, not {usual}",
            parameter.name
        );
    }
}
