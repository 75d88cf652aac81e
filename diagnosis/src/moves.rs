//! How a machine moves at the channels of an effect, and what its parameters begin with there.

use loopsight_core::Role;
use loopsight_model::model::{Model, ModelParameter};

use crate::commands::Commands;
use crate::sizes::powers;
use crate::suited::last_rms;

/// Share of the largest command that a coefficient moves at most where a candidate begins: beyond it the start is another machine,
/// whose free run says nothing of this one.
const START: f64 = 0.1;

/// How a machine moves at the channels of an effect in a recording.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Moves {
    /// Root mean square of the flow; 0 where there is none.
    pub(crate) flow: f64,
    /// The same of the position.
    pub(crate) reach: f64,
    /// The largest command, in the unit of the channels; none where no input has that.
    pub(crate) command: Option<f64>,
}

impl Moves {
    /// How it moves at those of the last effect of `model`, by the root mean squares of its signals.
    pub(crate) fn of_last(model: &Model, rms: &[f64], commands: &Commands) -> Self {
        let channel = model.effects.last().and_then(|last| last.at.first());
        Self {
            flow: last_rms(model, Role::Flow, rms),
            reach: last_rms(model, Role::Position, rms),
            command: channel.and_then(|channel| commands.at(model, channel)),
        }
    }

    /// How far from neutral a parameter begins. That is the size of the declaration, for machines that move by a radian or
    /// a metre in a second. A coefficient of a power of a speed or a way moves a tenth of the largest command at most: at a
    /// wheel that turns with 600 rad/s the declared size of a drag is 8000 V.
    pub(crate) fn first_step(&self, parameter: &ModelParameter) -> f64 {
        let declared = parameter.scale();
        let moves = self
            .way(parameter.declaration.unit)
            .map(|way| declared * way);
        match (moves, self.command) {
            (Some(moves), Some(command)) if moves > START * command && command > 0.0 => {
                declared * START * command / moves
            }
            _ => declared,
        }
    }

    /// What a coefficient of `unit` is multiplied with in the recording; none where it is no coefficient of speeds and ways.
    fn way(&self, unit: &str) -> Option<f64> {
        let moved = |(role, power)| match role {
            Role::Flow => self.flow.powi(power),
            _ => self.reach.powi(power),
        };
        powers(unit)?.map(|way| way.map(moved)).product()
    }
}

#[cfg(test)]
mod tests {
    use loopsight_plants as _;

    use super::*;

    /// A wheel that turns with 600 rad/s under 12 V, and one that turns with 0.1 rad/s.
    #[test]
    fn a_drag_begins_with_what_a_machine_can_have() {
        let text = "[plant.dc_axis]\nK_A = -1.0\nK_C = 8.0\n[log.measured.speed]\n";
        let (axis, _) = Model::from_toml("axis.toml", text).unwrap();
        let model = axis.with_effect("quadratic_drag", &["shaft"]).unwrap();
        let step = |flow: f64| {
            let rms = vec![flow; model.n_signals()];
            let moves = Moves::of_last(&model, &rms, &Commands::within(vec![12.0]));
            moves.first_step(&model.parameters[model.effects[0].first_parameter])
        };
        let declared = 0.02;
        assert!((step(600.0) * 600.0 * 600.0 / 1.2 - 1.0).abs() < 1e-12);
        assert_eq!(step(0.1), declared);
    }
}
