//! A folder for a robot: model, experiment and loop, made from what a plant declares.

use std::path::Path;

use loopsight_core::{PlantMeta, Signal};
use loopsight_model::config::nearest;
use loopsight_model::model::Model;
use loopsight_model::registry;
use loopsight_model::run::Run;
use loopsight_recordings::output::NewFolder;

use super::Made;
use super::model_text::model_text;
use super::texts::{DRIVE, commands, experiment_text, loop_text, readme_text};
use crate::error::{Error, Result};
use crate::files::Reads;
use crate::pace::{Pace, rounded_down};
use crate::run::Loop;
use crate::simulate::Experiment;

/// Noise of a sensor, over the change of its signal while the inputs stay constant once.
const NOISE: f64 = 0.01;

/// Makes the folder `target` for a robot of this plant.
pub(crate) fn robot(target: &Path, plant: &str) -> Result<Made> {
    let meta = find(plant)?;
    let mut folder = NewFolder::create(target)?;
    let (model, measured) = example(meta)?;
    let drive: Vec<f64> = meta.inputs.iter().map(|i| DRIVE * i.size).collect();
    let pace = Pace::of(&model, &drive);
    let text = model_text(folder.name(), meta, &model, &measured, pace);
    let path = folder.write("model.toml", &text)?;
    let (model, _) = Model::load(&path)?;

    let trial = simulate(&model, &experiment_text(meta, &[], pace), meta)?;
    let noise: Vec<(&str, f64)> = measured
        .iter()
        .zip(deviations(&trial, pace))
        .map(|(signal, deviation)| (signal.id, rounded_down(NOISE * deviation)))
        .filter(|(_, noise)| *noise > 0.0 && noise.is_finite())
        .collect();
    let text = experiment_text(meta, &noise, pace);
    simulate(&model, &text, meta)?;
    folder.write("experiment.toml", &text)?;

    let looped = with_loop(&mut folder, meta, &trial, pace)?;
    let text = readme_text(folder.name(), meta, looped);
    folder.write("README.md", &text)?;
    Ok(Made {
        written: folder.finish()?,
        note: None,
        next: commands().to_vec(),
    })
}

fn find(id: &str) -> Result<&'static PlantMeta> {
    let plants = registry::plants();
    if let Some(meta) = plants.iter().find(|m| m.id == id) {
        return Ok(meta);
    }
    let ids: Vec<&str> = plants.iter().map(|m| m.id).collect();
    let mut message = format!("there is no plant `{id}`");
    if let Some(near) = nearest(id, ids.iter().copied()) {
        message.push_str(&format!("; did you mean `{near}`?"));
    }
    message.push_str(&format!(" Known are {}.", ids.join(", ")));
    message.push_str(" A plant of your own: `loopsight new FOLDER --rust`");
    Err(Error::request(message))
}

/// The plant with the values of its own example, and what is measured on it: what a velocity controller acts on,
/// and the states that move it, such as the angle at which gravity pulls; or else all states.
fn example(meta: &'static PlantMeta) -> Result<(Model, Vec<&'static Signal>)> {
    let (model, _) = Model::from_toml(&format!("the example of `{}`", meta.id), meta.example)?;
    let missing = model.missing_values();
    if !missing.is_empty() {
        return Err(Error::work(format!(
            "the example of the plant `{}` gives no value for {}: without them nothing can run",
            meta.id,
            missing.join(", ")
        )));
    }
    let measured = if meta.controlled.is_empty() {
        meta.states.iter().collect()
    } else {
        let moves = |i: usize| meta.controlled.contains(&i) || moves_controlled(&model, i);
        let states = meta.states.iter().enumerate();
        states.filter(|(i, _)| moves(*i)).map(|(_, s)| s).collect()
    };
    Ok((model, measured))
}

/// Whether the rate of a controlled state depends on the state `i`, away from rest, where products count as well.
fn moves_controlled(model: &Model, i: usize) -> bool {
    let meta = model.plant;
    let sizes = |signals: &[Signal]| signals.iter().map(|s| s.size).collect::<Vec<f64>>();
    let (values, efforts) = (model.values(), vec![0.0; model.n_efforts()]);
    let (mut x, u) = (sizes(meta.states), sizes(meta.inputs));
    let rates = |x: &[f64]| model.rates_at(&values, x, &u, &efforts);
    let before = rates(&x);
    x[i] *= 0.5;
    let after = rates(&x);
    meta.controlled.iter().any(|c| before[*c] != after[*c])
}

fn simulate(model: &Model, text: &str, meta: &PlantMeta) -> Result<Run> {
    let file = format!("the experiment for `{}`", meta.id);
    Experiment::from_toml(&file, text)?.simulate(model, &Reads::default())
}

/// The change of each measured signal while the inputs stay constant once: its rms over √2. For a signal that comes
/// to rest this is the standard deviation. For one that drifts it is less than the whole range.
fn deviations(run: &Run, pace: Pace) -> Vec<f64> {
    let apart = ((pace.hold() / pace.period()) as usize).clamp(1, run.len().max(2) - 1);
    (0..run.n_measured())
        .map(|i| {
            let squares = (apart..run.len()).map(|k| {
                let change = run.sample(k)[i] - run.sample(k - apart)[i];
                change * change
            });
            let mean = squares.sum::<f64>() / run.len().saturating_sub(apart).max(1) as f64;
            (0.5 * mean).sqrt()
        })
        .collect()
}

/// Writes the first loop that can be composed: one that learns, or one that does not. A plant
/// without controlled states has none.
fn with_loop(folder: &mut NewFolder, meta: &PlantMeta, trial: &Run, pace: Pace) -> Result<bool> {
    for learns in [true, false] {
        let text = loop_text(folder.name(), meta, &deviations(trial, pace), pace, learns);
        let path = folder.inside().join("loop.toml");
        let control = Loop::from_toml(&path.display().to_string(), &text);
        let composed =
            control.and_then(|c| c.compose(&c.model()?.composed, &Reads::default()).map(drop));
        if composed.is_ok() {
            folder.write("loop.toml", &text)?;
            return Ok(true);
        }
    }
    Ok(false)
}
