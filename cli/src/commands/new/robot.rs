//! A folder for a robot: model, experiment and loop, made from what a plant declares.

use std::path::Path;

use loopsight_core::config::{Source, Step, nearest};
use loopsight_core::loop_file::LoopFile;
use loopsight_core::model::{Model, misfit};
use loopsight_core::registry::{self, range_text};
use loopsight_core::run::Run;
use loopsight_core::{Parameter, PlaceKind, PlantMeta, Signal};

use super::folder::Folder;
use super::pace::{Pace, rounded_down};
use crate::commands::run::compose;
use crate::commands::simulate::Experiment;
use crate::failure::Failure;
use crate::output;

/// Of an input that is driven, in sizes of its signal: 9 V at a motor.
const DRIVE: f64 = 9.0;
/// Of an input at its limit, in sizes of its signal: 12 V at a motor.
const LIMIT: f64 = 12.0;
/// Noise of a sensor over what its signal does while the inputs are held once.
const NOISE: f64 = 0.01;

pub(super) fn write(target: &Path, plant: &str) -> Result<(), Failure> {
    let meta = find(plant)?;
    let mut folder = Folder::new(target)?;
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
    folder.finish()?;
    output::result(&format!(
        "next:\n  cd {}\n  {}",
        target.display(),
        commands().join("\n  ")
    ));
    Ok(())
}

fn find(id: &str) -> Result<&'static PlantMeta, Failure> {
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
    Err(Failure::request(message))
}

/// The plant with the values of its own example, and what is measured on it: what a velocity
/// controller acts on, or else all states.
fn example(meta: &'static PlantMeta) -> Result<(Model, Vec<&'static Signal>), Failure> {
    let (model, _) = Model::from_toml(&format!("the example of `{}`", meta.id), meta.example)?;
    let missing = model.missing_values();
    if !missing.is_empty() {
        return Err(Failure::work(format!(
            "the example of the plant `{}` gives no value for {}: without them nothing can run",
            meta.id,
            missing.join(", ")
        )));
    }
    let measured = if meta.controlled.is_empty() {
        meta.states.iter().collect()
    } else {
        meta.controlled.iter().map(|i| &meta.states[*i]).collect()
    };
    Ok((model, measured))
}

/// A text in lines that begin with `# `.
fn comment(text: &str) -> String {
    text.lines().map(|l| format!("# {l}\n")).collect()
}

fn quoted(text: &str) -> String {
    // A JSON string is a TOML string.
    serde_json::Value::from(text).to_string()
}

fn described(parameter: &Parameter) -> String {
    let fitted = if parameter.estimated {
        "a fit finds it"
    } else {
        "held in a fit"
    };
    format!(
        "# {}, {}: {}; {}; {fitted}\n",
        parameter.symbol,
        parameter.unit,
        parameter.doc,
        range_text(parameter).trim_end()
    )
}

fn model_text(
    name: &str,
    meta: &PlantMeta,
    model: &Model,
    measured: &[&Signal],
    pace: Pace,
) -> String {
    let mut text = format!(
        "# {}, a `{}`: {}.\n# `{} explain {}` tells more: signals, channels, effects that fit.\nname = {}\n\n",
        name,
        meta.id,
        meta.summary,
        program(),
        meta.id,
        quoted(name)
    );
    text.push_str(&comment(&meta.equation.replace(";  ", "\n")));
    text.push_str(&comment(&format!("Assumed: {}.", meta.assumptions)));
    text.push_str("# The values are those of an example: put your own in their place.\n");
    let path = model.parameters.first().map_or(&[][..], |p| &p.path[..]);
    let table: Vec<&str> = path
        .split_last()
        .map_or(&[][..], |(_, table)| table)
        .iter()
        .filter_map(|step| match step {
            Step::Key(key) => Some(key.as_str()),
            Step::Index(_) => None,
        })
        .collect();
    let table = if table.is_empty() {
        format!("plant.{}", meta.id)
    } else {
        table.join(".")
    };
    text.push_str(&format!("[{table}]\n"));
    for parameter in &model.parameters {
        text.push_str(&described(parameter.declaration));
        if let Some(value) = parameter.value {
            text.push_str(&format!("{} = {value:?}\n", parameter.declaration.id));
        }
    }
    let own = format!("plant.{}", meta.id);
    let sets = std::iter::once((
        own.clone(),
        "the equations' own parameters",
        meta.parameters,
    ));
    let sets = sets.chain(
        meta.parameterizations
            .iter()
            .map(|set| (format!("{own}.{}", set.id), set.summary, set.parameters)),
    );
    for (other, summary, parameters) in sets.filter(|s| s.0 != table) {
        text.push_str(&format!(
            "\n# Or in another way, instead of [{table}]: {summary}.\n# [{other}]\n"
        ));
        for parameter in parameters {
            text.push_str(&described(parameter));
            let default = parameter.default.map(|d| format!("{d:?}"));
            let value = default.unwrap_or_default();
            text.push_str(format!("# {} = {value}", parameter.id).trim_end());
            text.push('\n');
        }
    }
    text.push_str(&effect_hint(meta));
    text.push_str(
        "\n# What is measured; a column of the log is found by the signal's name and unit.\n",
    );
    for signal in measured {
        let column = loopsight_recordings::header(signal);
        text.push_str(&format!("[log.measured.{}]   # `{column}`\n", signal.id));
    }
    let others: Vec<&str> = meta
        .states
        .iter()
        .chain(meta.outputs)
        .map(|s| s.id)
        .filter(|id| measured.iter().all(|m| m.id != *id))
        .collect();
    if !others.is_empty() {
        text.push_str(&format!(
            "# A sensor could read as well: {}.\n",
            others.join(", ")
        ));
    }
    text.push_str(&format!(
        "\n[simulation]\nmax_step_s = {:?}   # longest integration step\n",
        pace.model_step()
    ));
    text
}

/// How an effect would be added: the commonest that fits, as a comment.
fn effect_hint(meta: &PlantMeta) -> String {
    let mut effects = registry::effects();
    effects.sort_by_key(|e| e.rarity);
    let places = [PlaceKind::Effort, PlaceKind::Input];
    let places = places.iter().flat_map(|kind| {
        meta.channels
            .iter()
            .filter(move |c| c.place.kind() == *kind)
    });
    let mut found = places.filter_map(|channel| {
        let effect = effects.iter().find(|e| misfit(channel, e).is_none())?;
        Some((channel, effect))
    });
    found.next().map_or_else(String::new, |(channel, effect)| {
        let family = |id: &'static str| id.split('.').next();
        let at: Vec<String> = meta
            .channels
            .iter()
            .filter(|c| family(c.id) == family(channel.id) && misfit(c, effect).is_none())
            .map(|c| quoted(c.id))
            .collect();
        format!(
            "\n# Physics that the plain model lacks; `loopsight diagnose` says which.\n\
             # [[effect]]\n# [effect.{}]\n# at = [{}]\n",
            effect.id,
            at.join(", ")
        )
    })
}

fn experiment_text(meta: &PlantMeta, noise: &[(&str, f64)], pace: Pace) -> String {
    let mut text = format!(
        "# What the robot is driven with, and how it is measured.\nduration_s = {:?}\nperiod_s = {:?}\n\n\
         # Pseudo-random: plus or minus the amplitude, drawn anew every hold_s.\n[inputs]\n",
        pace.duration(),
        pace.period()
    );
    for input in meta.inputs {
        text.push_str(&format!(
            "{} = {{ prbs = {{ amplitude = {:?}, hold_s = {:?}, seed = 1 }} }}   # {}\n",
            input.id,
            tidy(DRIVE * input.size),
            pace.hold(),
            input.unit
        ));
    }
    text.push_str(&format!(
        "\n# The simulated robot: its integration step, and the white noise of its sensors.\n\
         [robot]\nstep_s = {:?}\nseed = 1\n",
        tidy(pace.robot_step())
    ));
    if !noise.is_empty() {
        let noise: Vec<String> = noise
            .iter()
            .map(|(id, s)| format!("{id} = {s:?}"))
            .collect();
        text.push_str(&format!("noise = {{ {} }}\n", noise.join(", ")));
    }
    text
}

/// Without the digits that are rounding errors of a product.
fn tidy(value: f64) -> f64 {
    format!("{value:.6e}").parse().unwrap_or(value)
}

fn simulate(model: &Model, text: &str, meta: &PlantMeta) -> Result<Run, Failure> {
    let file = format!("the experiment for `{}`", meta.id);
    let source = Source::parse(&file, text)?;
    Ok(Experiment::parse(&source)?.simulate(&source, model)?)
}

/// What each measured signal does while the inputs are held once: the rms of its change over that
/// time, over √2. Of a signal that comes to rest it is the standard deviation; of one that drifts
/// away it is not the whole way.
fn deviations(run: &Run, pace: Pace) -> Vec<f64> {
    let apart = ((pace.hold() / pace.period()) as usize).clamp(1, run.len().max(2) - 1);
    (0..run.n_measured)
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
fn with_loop(
    folder: &mut Folder,
    meta: &PlantMeta,
    trial: &Run,
    pace: Pace,
) -> Result<bool, Failure> {
    for learns in [true, false] {
        let text = loop_text(folder.name(), meta, &deviations(trial, pace), pace, learns);
        let path = folder.inside().join("loop.toml");
        let source = Source::parse(&path.display().to_string(), &text)?;
        let composed = LoopFile::parse(&source)
            .map_err(Failure::from)
            .and_then(|file| compose(&path, &source, &file));
        if composed.is_ok() {
            folder.write("loop.toml", &text)?;
            return Ok(true);
        }
    }
    Ok(false)
}

fn loop_text(name: &str, meta: &PlantMeta, deviations: &[f64], pace: Pace, learns: bool) -> String {
    let limits: Vec<f64> = meta.inputs.iter().map(|i| tidy(LIMIT * i.size)).collect();
    let alike = limits.windows(2).all(|w| w[0] == w[1]);
    let (driver, controller) = match limits.first() {
        Some(limit) if alike => (format!("{limit:?}"), format!("{limit:?}")),
        _ => {
            let named: Vec<String> = meta
                .inputs
                .iter()
                .zip(&limits)
                .map(|(input, limit)| format!("{} = {limit:?}", input.id))
                .collect();
            (format!("{{ {} }}", named.join(", ")), format!("{limits:?}"))
        }
    };
    let (hold, n) = (pace.hold(), meta.controlled.len() as f64);
    let mut text = format!(
        "# A loop: the controller knows model.toml, the robot is simulated from it.\n\
         name = {}\nmodel = \"model.toml\"\nperiod_s = {:?}\nduration_s = {:?}\nlog = \"loop.csv\"\n\n\
         # In the place of the robot; a `model` of its own could hide what the controller's lacks.\n\
         [driver.simulated]\nstep_s = {:?}\nlimit = {driver}\nseed = 1\n\n\
         # `loopsight explain feedback_linearizing_pi` has all settings.\n\
         [controller.feedback_linearizing_pi]\nsettling_time_s = {:?}\nrule = \"exact\"\nlimit = {controller}\n",
        quoted(&format!("{name} follows its references")),
        pace.period(),
        tidy((6.0 * n + 2.0) * hold),
        tidy(pace.robot_step()),
        tidy(0.8 * hold),
    );
    if learns {
        text.push_str(
            "\n# Watches and learns the parameters; the controller does not use them.\n[estimator.rls]\n",
        );
    }
    text.push_str(
        "\n# What the controlled signals should do: `at` holds [time, value].\n[reference]\n",
    );
    for (i, state) in meta.controlled.iter().enumerate() {
        let signal = &meta.states[*state];
        let height = rounded_down(deviations.get(i).copied().unwrap_or(signal.size));
        let first = 2.0 * i as f64 + 1.0;
        let at = |step: f64| tidy((first + 2.0 * n * step) * hold);
        text.push_str(&format!(
            "{} = {{ steps = {{ at = [[{:?}, {height:?}], [{:?}, {:?}], [{:?}, 0.0]] }} }}   # {}\n",
            signal.id,
            at(0.0),
            at(1.0),
            -height,
            at(2.0),
            signal.unit
        ));
    }
    text
}

/// The name of this program: that of a crate with parts of its own is not `loopsight`.
fn program() -> String {
    let path = std::env::args_os().next().map(std::path::PathBuf::from);
    let name = path.and_then(|p| Some(p.file_stem()?.to_string_lossy().into_owned()));
    name.unwrap_or_else(|| "loopsight".to_owned())
}

/// What to type next.
fn commands() -> [String; 3] {
    [
        "check model.toml experiment.toml",
        "simulate model.toml experiment.toml -o log.csv",
        "fit model.toml log.csv -o fitted.toml --html fit.html",
    ]
    .map(|rest| format!("{} {rest}", program()))
}

fn readme_text(name: &str, meta: &PlantMeta, looped: bool) -> String {
    let mut text = format!(
        "# {name}\n\nA `{}`: {}.\n\n| file | what |\n|---|---|\n\
         | `model.toml` | the robot as one believes it to be: every parameter with unit and range |\n\
         | `experiment.toml` | what a simulated robot is driven with |\n",
        meta.id, meta.summary
    );
    if looped {
        text.push_str("| `loop.toml` | a velocity loop with a controller |\n");
    }
    text.push_str(&format!(
        "\nThe next three commands, in this folder:\n\n```sh\n{}\n```\n\n\
         They look the files over, make the log of a simulated robot, and fit the model to it;\n\
         `fit.html` opens in any browser.\n\nThen take a log of your own robot in the place of `log.csv`:\n\n```sh\n\
         {program} compare model.toml log.csv --html compare.html\n\
         {program} diagnose model.toml log.csv --html why.html\n\
         {program} improve model.toml log.csv -o better.toml\n",
        commands().join("\n"),
        program = program()
    ));
    if looped {
        text.push_str(&format!("{} run loop.toml --html run.html\n", program()));
    }
    text.push_str(&format!(
        "```\n\n`{} explain {}` tells what the robot is made of and which effects fit where.\n",
        program(),
        meta.id
    ));
    text
}
