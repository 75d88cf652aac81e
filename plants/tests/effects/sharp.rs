//! Friction that holds a machine.

use super::{AXIS, derivatives, difference, model, simulate};

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
        let axis = model(&text);
        let values = axis.values();
        let level = format!("{effect}.{}", sizes.split(' ').next().unwrap());
        let level = axis
            .parameters
            .iter()
            .position(|p| p.name == level)
            .unwrap();
        let found = derivatives(&axis, &values, level);
        let moved = |change: f64| {
            let mut values = values.clone();
            values[level] += change;
            simulate(&axis, &values)
        };
        let change = 1e-5;
        let (more, less) = (moved(change), moved(-change));
        let by_difference: Vec<Vec<f64>> = (more.iter().zip(&less))
            .map(|(a, b)| {
                a.iter()
                    .zip(b)
                    .map(|(a, b)| (a - b) / (2.0 * change))
                    .collect()
            })
            .collect();
        let off = difference(&found, &by_difference);
        assert!(off < 1e-3, "{effect}, {sizes}: off {off}");
    }
}
