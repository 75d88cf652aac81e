//! How large a change of a parameter has to be to be noticed in a recording.

use loopsight_core::{Channel, Role};
use loopsight_model::model::Model;
use loopsight_model::run::Run;

use crate::commands::{largest_at, largest_inputs};

/// Share of the largest command that a change of a coefficient moves at least: far above rounding, and far below what an effect
/// would be found by.
const FAINT: f64 = 1e-4;

/// The size of each parameter of `model` for a fit to `runs`, whose measured signals have these `deviations`.
///
/// A declaration gives it, for machines that move by a radian or a metre. A coefficient of a power of a position or a speed is
/// larger for a machine that moves by a millimetre: by 10⁹ with the cube. There it is what moves a noticeable share of the
/// largest command in the unit of the channel, or of the channel's size where there is none, if the signal is measured.
pub(crate) fn sizes(model: &Model, runs: &[Run], deviations: &[f64]) -> Vec<f64> {
    let mut sizes: Vec<f64> = model.parameters.iter().map(|p| p.scale()).collect();
    let mut largest = None;
    for effect in &model.effects {
        let Some(channel) = effect.at.first() else {
            continue;
        };
        for (own, declared) in effect.meta.parameters.iter().enumerate() {
            let Some(way) = way(model, channel, declared.unit, deviations) else {
                continue;
            };
            let largest = largest.get_or_insert_with(|| largest_inputs(model, runs));
            let size = &mut sizes[effect.first_parameter + own];
            let moves = *size * way;
            let command = largest_at(model, channel, largest).filter(|command| *command > 0.0);
            let faint = FAINT * command.unwrap_or(channel.size);
            if moves > 0.0 && moves < faint {
                *size *= faint / moves;
            }
        }
    }
    sizes
}

/// What a coefficient of `unit` is multiplied with: powers of the position and the speed at a channel, as far as they move in the
/// recording. None where it is no such coefficient, or the signal is not measured.
fn way(model: &Model, channel: &Channel, unit: &str, deviations: &[f64]) -> Option<f64> {
    let mut ways = powers(unit)?.flatten();
    let of = |(role, power): (Role, i32)| {
        let id = channel.read(role)?;
        let signal = model.measured.iter().position(|m| m.signal.id == id)?;
        Some(deviations.get(signal)?.powi(power))
    };
    let first = of(ways.next()?)?;
    ways.try_fold(first, |product, next| Some(product * of(next)?))
}

/// The powers of positions and speeds that a coefficient of `unit` is multiplied with, and nothing for each other factor; none
/// where it is no coefficient.
pub(crate) fn powers(unit: &str) -> Option<impl Iterator<Item = Option<(Role, i32)>>> {
    let factors = unit.strip_prefix("channel/")?.split('/');
    Some(factors.map(|factor| {
        let (name, power) = factor.split_once('^').unwrap_or((factor, "1"));
        let role = match name {
            "position" => Role::Position,
            "flow" => Role::Flow,
            _ => return None,
        };
        Some((role, power.parse().ok()?))
    }))
}

#[cfg(test)]
mod tests {
    use loopsight_plants as _;

    use super::*;

    #[test]
    fn a_cube_of_millimetres_has_a_large_coefficient() {
        let text = "[plant.oscillator]\nstiffness_per_mass = 1000.0\ndamping_per_mass = 1.0\ninverse_mass = 1.0\n\
                    [log.measured.position]\n[[effect]]\n[effect.cubic_stiffness]\nat = [\"mass\"]\n\
                    [[effect]]\n[effect.quadratic_drag]\nat = [\"mass\"]\n";
        let (model, _) = Model::from_toml("m.toml", text).unwrap();
        let mut run = Run::empty(1, 1);
        for k in 0..10 {
            run.push(0.1 * f64::from(k), &[20.0], &[1e-3]).unwrap();
        }
        let of = |deviation: f64, id: &str| {
            let sizes = sizes(&model, std::slice::from_ref(&run), &[deviation]);
            let at = model.parameters.iter().position(|p| p.name == id).unwrap();
            (sizes[at], model.parameters[at].scale())
        };
        let (size, _) = of(1e-3, "cubic_stiffness.stiffness");
        assert!((size / (1e-4 * 20.0 / 1e-9) - 1.0).abs() < 1e-9, "{size}");
        // A machine that moves by a metre has what is declared, and so has what follows a signal that is not measured.
        let (size, declared) = of(1.0, "cubic_stiffness.stiffness");
        assert_eq!(size, declared);
        let (size, declared) = of(1e-3, "quadratic_drag.coefficient");
        assert_eq!(size, declared);
    }
}
