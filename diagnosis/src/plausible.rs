//! Whether the size of an effect is possible for what it is said to be.

use loopsight_model::run::Run;

use crate::candidates::Candidate;
use crate::commands::{largest_at, largest_inputs};
use crate::figure::figure;
use crate::positions::Positions;

/// Why, at these `values`, an effect cannot be what it says; none where it can.
///
/// An amplifier's offset or dead zone is a small part of what it is commanded. Friction above every command would have held
/// the machine, and a force above every command that is always the same would have carried it away. Such an effect stands in for
/// a force of the machine's own, which is as large as its position makes it; so nothing is said of what depends on a position,
/// as gravity does. It says nothing either of a machine that was never commanded: what was let go moves by itself.
pub(crate) fn implausible(candidate: &Candidate, values: &[f64], runs: &[Run]) -> Option<String> {
    let is_size = |i: &usize| {
        let parameter = &candidate.model.parameters[*i];
        let declared = parameter.declaration;
        parameter.free && declared.unit == "channel" && declared.default == Some(0.0)
    };
    let sizes: Vec<usize> = candidate.own().filter(is_size).collect();
    if sizes.is_empty() || Positions::matter_to(candidate.meta) {
        return None;
    }
    let model = &candidate.model;
    let commands = largest_inputs(model, runs);
    let channels = model.plant.channels.iter();
    let largest = channels
        .filter(|channel| candidate.at.contains(&channel.id))
        .filter_map(|channel| largest_at(model, channel, &commands))
        .fold(f64::INFINITY, f64::min);
    sizes.into_iter().find_map(|i| {
        let parameter = &candidate.model.parameters[i];
        let value = values.get(i)?.abs();
        (largest > 0.0 && value > largest).then(|| {
            let (name, unit) = (&parameter.name, &parameter.unit);
            let [value, largest] = [value, largest].map(|size| figure(size, 3));
            format!("{name}: {value} {unit} is beyond the largest command, {largest} {unit}")
        })
    })
}

#[cfg(test)]
mod tests {
    use loopsight_model::model::Model;
    use loopsight_plants as _;

    use super::*;
    use crate::moves::Moves;

    fn candidate(effect: &str, at: &'static str) -> Candidate {
        let text = "[plant.arm]\nK_A = -2.0\nK_C = 6.0\nK_G = 40.0\n[log.measured.angle]\n";
        let model = Model::from_toml("arm.toml", text).unwrap().0;
        let model = model.with_effect(effect, &[at]).unwrap();
        Candidate {
            meta: model.effects[0].meta,
            at: vec![at],
            separate: false,
            further: false,
            replaces: None,
            moves: Moves {
                flow: 1.0,
                reach: 1.0,
                command: None,
            },
            ends: [None; 2],
            by_position: false,
            widths: Vec::new(),
            entries: None,
            model,
        }
    }

    fn run(commands: &[f64]) -> Run {
        let mut run = Run::empty(1, 1);
        for (k, u) in commands.iter().enumerate() {
            run.push(0.01 * k as f64, &[*u], &[0.0]).unwrap();
        }
        run
    }

    #[test]
    fn what_is_beyond_every_command_is_said_to_be() {
        let commanded = [run(&[0.0, 3.0, -2.0])];
        let said = |effect: &str, at: &'static str, size: f64, runs: &[Run]| {
            let candidate = candidate(effect, at);
            let mut values = candidate.model.values();
            values[candidate.own().start] = size;
            implausible(&candidate, &values, runs)
        };
        let offset = said("input_offset", "input", -40.0, &commanded).unwrap();
        assert_eq!(
            offset,
            "input_offset.offset: 40.000 V is beyond the largest command, 3.000 V"
        );
        assert!(said("input_offset", "input", 2.9, &commanded).is_none());
        assert!(said("coulomb_friction", "joint", 18.0, &commanded).is_some());
        assert!(said("coulomb_friction", "joint", 1.0, &commanded).is_none());
        // Its position may carry it, it is an acceleration, or nothing was commanded.
        assert!(said("torque_ripple", "joint", 40.0, &commanded).is_none());
        assert!(said("coulomb_friction", "load", 18.0, &commanded).is_none());
        assert!(said("coulomb_friction", "joint", 18.0, &[run(&[0.0; 3])]).is_none());
    }
}
