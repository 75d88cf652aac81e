//! How large the commands of a recording are.

use loopsight_core::{Channel, Place, Role};
use loopsight_model::model::Model;
use loopsight_model::run::{Run, shortest_period};
use loopsight_model::simulate::Simulator;

/// Samples over which an effort is compared with a command.
const SAMPLES: usize = 100;

/// The largest commands of a recording, and what they are worth at channels of another unit.
pub(crate) struct Commands {
    /// Of each input of the plant.
    pub(crate) largest: Vec<f64>,
    /// By effort of the plant: what moves the machine as the largest command does. None where nothing tells.
    efforts: Vec<(usize, f64)>,
}

impl Commands {
    /// Those in `runs` of a `model`.
    pub(crate) fn of(model: &Model, runs: &[Run]) -> Self {
        let largest = largest_inputs(model, runs);
        let period = shortest_period(runs);
        let efforts = if period.is_normal() {
            efforts(model, &largest, period)
        } else {
            Vec::new()
        };
        Self { largest, efforts }
    }

    /// Those of a plant whose inputs are `largest`, where they count only at channels of their unit.
    pub(crate) fn within(largest: Vec<f64>) -> Self {
        let efforts = Vec::new();
        Self { largest, efforts }
    }

    /// The largest command at a channel, in its unit; none where nothing tells.
    pub(crate) fn at(&self, model: &Model, channel: &Channel) -> Option<f64> {
        let worth = || {
            let Place::Effort(at) = channel.place else {
                return None;
            };
            let known = self.efforts.iter().find(|(effort, _)| *effort == at);
            known.map(|(_, worth)| *worth)
        };
        largest_at(model, channel, &self.largest).or_else(worth)
    }
}

/// What the `largest` commands are worth as efforts, by effort of the plant, where no input has their unit.
///
/// The plant, without effects, is simulated from zero for some samples, once with each command and once with an effort of 1. The flow `v_u`
/// under the command and `v_e` under the effort tell what the command is worth:
///
/// ```text
/// e = |Σ v_u v_e| / Σ v_e²
/// ```
///
/// Channels without a flow, and plants that do not move so, tell nothing.
fn efforts(model: &Model, largest: &[f64], period: f64) -> Vec<(usize, f64)> {
    let mut bare = model.clone();
    while let Some(without) =
        (bare.effects.len().checked_sub(1)).and_then(|i| bare.without_effect(i))
    {
        bare = without;
    }
    let values = bare.declared_values();
    let worth = |channel: &Channel| {
        let Place::Effort(at) = channel.place else {
            return None;
        };
        if largest_at(model, channel, largest).is_some() {
            return None;
        }
        let flow = bare.find_signal(channel.read(Role::Flow)?).ok()?;
        let moves = |input: &[f64], effort: f64| -> Vec<f64> {
            let mut simulator = Simulator::<f64>::new(&bare, &values);
            simulator.push(channel.place, effort);
            simulator.reset(&vec![0.0; bare.n_starts()], input);
            let sample = |k: usize| {
                simulator.advance(k as f64 * period, input);
                simulator.signals()[flow]
            };
            (1..=SAMPLES).map(sample).collect()
        };
        let nothing = vec![0.0; largest.len()];
        let still = moves(&nothing, 0.0);
        let product = |a: &[f64], b: &[f64]| -> f64 {
            let off = a.iter().zip(b).zip(&still);
            off.map(|((a, b), still)| (a - still) * (b - still)).sum()
        };
        let pushed = moves(&nothing, 1.0);
        let commanded = (0..largest.len()).map(|i| {
            let mut input = nothing.clone();
            input[i] = largest[i];
            product(&moves(&input, 0.0), &pushed).abs() / product(&pushed, &pushed)
        });
        let most = commanded.filter(|worth| worth.is_normal()).reduce(f64::max);
        Some((at, most?))
    };
    model.plant.channels.iter().filter_map(worth).collect()
}

/// The largest value of each input of the plant, either way.
pub(crate) fn largest_inputs(model: &Model, runs: &[Run]) -> Vec<f64> {
    let of = |i: usize| {
        let samples = runs
            .iter()
            .flat_map(|run| (0..run.len()).filter_map(move |k| run.input(k).get(i).copied()));
        samples.fold(0.0, |largest: f64, u| largest.max(u.abs()))
    };
    (0..model.plant.inputs.len()).map(of).collect()
}

/// The largest command of the input that a channel is of, or of those in its unit where it is an effort; none of any other.
pub(crate) fn largest_at(model: &Model, channel: &Channel, largest: &[f64]) -> Option<f64> {
    let acts = |i: &usize| match channel.place {
        Place::Input(of) => of == *i,
        Place::Effort(_) => model.plant.inputs[*i].unit == channel.unit,
        _ => false,
    };
    let of_channel = (0..largest.len()).filter(acts).map(|i| largest[i]);
    of_channel.reduce(f64::max)
}

#[cfg(test)]
pub(crate) mod tests {
    use loopsight_plants as _;

    use super::*;

    /// A mirror that a coil turns with 4 mN m/A; effects may follow.
    pub(crate) const MIRROR: &str = "[plant.expression.states]\nspeed = { unit = \"rad/s\", rate = \"(0.004 * current - 1e-5 * speed + axle) / 2e-8\" }\n\
        [plant.expression.inputs]\ncurrent = { unit = \"A\" }\n\
        [plant.expression.channels]\naxle = { unit = \"N m\", flow = \"speed\" }\n\
        [log.measured.speed]\n";

    /// A friction that no coil overcomes is not asked.
    #[test]
    fn a_current_is_worth_the_torque_that_it_makes() {
        let text = format!(
            "{MIRROR}[[effect]]\n[effect.coulomb_friction]\nat = [\"axle\"]\nlevel = 5.0\n"
        );
        let (model, _) = Model::from_toml("mirror.toml", &text).unwrap();
        let mut run = Run::empty(1, 1);
        for k in 0..10 {
            let current = if k < 5 { 1.5 } else { -2.0 };
            run.push(1e-4 * f64::from(k), &[current], &[0.0]).unwrap();
        }
        let runs = [run];
        let at = |channel: &str| {
            let channel = model.plant.channels.iter().find(|c| c.id == channel);
            Commands::of(&model, &runs).at(&model, channel.unwrap())
        };
        assert!((at("axle").unwrap() - 0.008).abs() < 1e-12);
        assert_eq!(at("input"), Some(2.0));
        assert_eq!(at("sensor.speed"), None);
    }
}
