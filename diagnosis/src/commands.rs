//! How large the commands of a recording are.

use loopsight_core::{Channel, Place};
use loopsight_model::model::Model;
use loopsight_model::run::Run;

/// The largest value of each input of the plant, either way.
pub(crate) fn largest_inputs(model: &Model, runs: &[Run]) -> Vec<f64> {
    let of = |i: usize| {
        let samples = runs
            .iter()
            .flat_map(|run| (0..run.len()).map(move |k| run.input(k)[i]));
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
