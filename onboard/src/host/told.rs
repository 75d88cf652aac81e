//! What a robot reports beside its commands.

use loopsight_core::{Command, Quantity};
use loopsight_link::Act;
use loopsight_model::model::Model;

/// The parameters that the robot learned and, if it has sensors of its own, its supply.
#[derive(Debug)]
pub(super) struct Told {
    quantities: Vec<Quantity<f64>>,
    values: Vec<f64>,
    /// Parameters of the plant that the robot learns, by index.
    learned: Vec<usize>,
}

impl Told {
    /// Of these parameters of the model's plant.
    pub(super) fn new(model: &Model, learned: Vec<usize>) -> Self {
        let values = model.lower::<f64>(&model.values());
        let of = |i: &usize| Quantity {
            name: model.plant.parameters[*i].id,
            unit: model.plant.parameters[*i].unit,
            start: Some(values[*i]),
        };
        Self {
            quantities: learned.iter().map(of).collect(),
            values: vec![f64::NAN; learned.len()],
            learned,
        }
    }

    /// The same of a robot that measures its supply.
    pub(super) fn with_supply(mut self) -> Self {
        self.quantities.push(Quantity {
            name: "supply",
            unit: "V",
            start: None,
        });
        self.values.push(f64::NAN);
        self
    }

    /// Takes a robot's report of a tick: its command, and the values beside it.
    pub(super) fn take(&mut self, act: &Act, command: &mut [f64]) -> Command {
        widen(command, &act.command);
        let learned = self.learned.iter().map(|i| act.parameters.get(*i));
        let supply = act.sensed.as_ref().map(|s| &s.supply);
        for (to, from) in self.values.iter_mut().zip(learned.chain([supply])) {
            *to = from.map_or(f64::NAN, |v| f64::from(*v));
        }
        Command {
            saturated: act.saturated,
            held: act.held,
        }
    }

    pub(super) fn quantities(&self) -> &[Quantity<f64>] {
        &self.quantities
    }

    pub(super) fn values(&self) -> &[f64] {
        &self.values
    }
}

/// Copies a robot's `f32` values into the host's `f64`.
pub(super) fn widen(to: &mut [f64], from: &[f32]) {
    for (to, from) in to.iter_mut().zip(from) {
        *to = f64::from(*from);
    }
}
