//! Three ways to find the six parameters of the Twil, compared where the truth is known:
//!
//! ```text
//! cargo run --release -p loopsight-tests --example twil_methods            # prints the tables
//! cargo run --release -p loopsight-tests --example twil_methods -- --write # … into the README
//! ```
//!
//! `--runs N` makes N runs of each instead of 100 (recursive) and 400 (output error).

use std::collections::BTreeMap;
use std::error::Error;
use std::fmt::Write as _;
use std::path::Path;

use loopsight_diagnosis::fit;
use loopsight_diagnosis::{FitSettings, Measurements, Method, Scheme, Work};
use loopsight_drivers::{Simulated, simulate_inputs};
use loopsight_estimators as _;
use loopsight_model::excitation::{Excitation, build, sample_rows};
use loopsight_model::model::Model;
use loopsight_model::run::Run;
use loopsight_model::sensor::Sensor;
use loopsight_plants as _;
use rayon::prelude::*;
use serde::Deserialize;

type Outcome<T> = Result<T, Box<dyn Error + Send + Sync>>;

const BEGIN: &str = "<!-- twil_methods -->";
const END: &str = "<!-- /twil_methods -->";

/// What an experiment file says.
#[derive(Deserialize)]
struct Experiment {
    duration_s: f64,
    period_s: f64,
    inputs: BTreeMap<String, Excitation>,
    robot: Simulated,
}

struct Way {
    name: &'static str,
    settings: FitSettings,
    runs: u64,
}

/// One parameter in one fit: value and interval.
type Found = (f64, [f64; 2]);

fn main() -> Outcome<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let runs: Option<u64> = arguments
        .iter()
        .position(|a| a == "--runs")
        .and_then(|at| arguments.get(at + 1))
        .map(|n| n.parse())
        .transpose()?;
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/twil");
    let (model, _) = Model::load(&folder.join("model.toml"))?;
    let experiment: Experiment =
        toml::from_str(&std::fs::read_to_string(folder.join("prbs.toml"))?)?;
    let way = |name, method, scheme, usual: u64| Way {
        name,
        settings: FitSettings {
            method,
            scheme,
            ..FitSettings::default()
        },
        runs: runs.unwrap_or(usual).max(2),
    };
    let ways = [
        way("RLS, Euler (40)(41)", Method::Rls, Scheme::Euler, 100),
        way("RLS, integrated", Method::Rls, Scheme::Integrated, 100),
        way("output error", Method::OutputError, Scheme::Integrated, 400),
    ];
    let text = noiseless(&model, &experiment, &ways)? + &counted(&model, &experiment, &ways)?;
    print!("{text}");
    if arguments.iter().any(|a| a == "--write") {
        let path = folder.join("README.md");
        let old = std::fs::read_to_string(&path)?;
        let (before, rest) = old.split_once(BEGIN).ok_or("the README has no marker")?;
        let (_, after) = rest.split_once(END).ok_or("the README has no end marker")?;
        std::fs::write(&path, format!("{before}{BEGIN}\n{text}{END}{after}"))?;
        eprintln!("wrote {}", path.display());
    }
    Ok(())
}

/// The robot on the experiment; `seed` draws excitation and encoders anew.
fn simulate(model: &Model, experiment: &Experiment, seed: Option<u64>) -> Outcome<Run> {
    let steps = (experiment.duration_s / experiment.period_s).round() as usize;
    let time: Vec<f64> = (0..=steps)
        .map(|k| k as f64 * experiment.period_s)
        .collect();
    let mut inputs = experiment.inputs.clone();
    let mut robot = experiment.robot.clone();
    if let Some(new) = seed {
        robot.seed = new;
        for excitation in inputs.values_mut() {
            if let Excitation::Prbs { seed, .. } = excitation {
                *seed = new;
            }
        }
    }
    let rows = sample_rows(&build(&inputs, model.plant.inputs)?, &time);
    Ok(simulate_inputs(model, &robot, &time, &rows)?)
}

/// What a fit from nothing finds for the free parameters.
fn find(model: &Model, run: &Run, settings: &FitSettings) -> Outcome<Vec<Found>> {
    let mut start = model.clone();
    for parameter in start.parameters.iter_mut().filter(|p| p.free) {
        parameter.value = None;
    }
    let fit = fit(
        &start,
        &Measurements::new(std::slice::from_ref(run)),
        settings,
        &Work::quiet(),
    )?;
    free(model)
        .map(|(name, _)| {
            let found = &fit.parameters[name];
            let nothing = [f64::NAN; 2];
            Ok((found.value, found.interval95.unwrap_or(nothing)))
        })
        .collect()
}

/// Names and true values of what is estimated.
fn free(model: &Model) -> impl Iterator<Item = (&str, f64)> {
    model
        .parameters
        .iter()
        .filter(|p| p.free)
        .map(|p| (p.name.as_str(), p.value.unwrap_or(f64::NAN)))
}

/// Without noise: what a method gets wrong by itself.
fn noiseless(model: &Model, experiment: &Experiment, ways: &[Way]) -> Outcome<String> {
    let mut ideal = model.clone();
    let sensors: Vec<(String, Sensor)> = model
        .measured
        .iter()
        .map(|m| (m.signal.id.to_owned(), Sensor::Instantaneous))
        .collect();
    ideal.measure(&sensors).map_err(|(_, message, _)| message)?;
    let run = simulate(&ideal, experiment, None)?;
    let found: Vec<Vec<Found>> = ways
        .iter()
        .map(|way| find(&ideal, &run, &way.settings))
        .collect::<Outcome<_>>()?;
    let mut text = String::from(
        "Without noise, from the velocities themselves (one run of `prbs.toml`):\n\n\
         | parameter | true |",
    );
    for way in ways {
        write!(text, " {} |", way.name)?;
    }
    text.push_str(" (e^(a T) − 1)/(a T) |\n|---|---:|");
    text.push_str(&"---:|".repeat(ways.len() + 1));
    text.push('\n');
    let rates: BTreeMap<&str, f64> = free(model).collect();
    for (i, (name, truth)) in free(model).enumerate() {
        write!(text, "| {name} | {} |", minus(&truth.to_string()))?;
        for values in &found {
            let value = values[i].0;
            let off = 100.0 * (value - truth) / truth;
            write!(
                text,
                " {} ({} %) |",
                minus(&significant(value, 5)),
                signed(off)
            )?;
        }
        // The terms of the first equation decay with K_A, those of the second with K_D.
        let rate = rates[if i < 3 { "K_A" } else { "K_D" }] * experiment.period_s;
        writeln!(
            text,
            " {} % |",
            signed(100.0 * (rate.exp_m1() / rate - 1.0))
        )?;
    }
    Ok(text + "\n")
}

/// With encoders: what is left of it over many runs, and whether the intervals know.
fn counted(model: &Model, experiment: &Experiment, ways: &[Way]) -> Outcome<String> {
    let truth: Vec<(&str, f64)> = free(model).collect();
    let mut columns = Vec::new();
    for way in ways {
        eprintln!("{}: {} runs", way.name, way.runs);
        let found: Vec<Vec<Found>> = (0..way.runs)
            .into_par_iter()
            .map(|k| {
                let run = simulate(model, experiment, Some(1000 + k))?;
                find(model, &run, &way.settings)
            })
            .collect::<Outcome<_>>()?;
        columns.push(found);
    }
    let (slow, fast) = (ways[0].runs, ways[2].runs);
    let mut text = format!(
        "With 8192-count encoders, over seeded runs ({slow} for each RLS, {fast} for output error), \
         in per cent of the true value: bias ± standard deviation, and how often the 95 % interval \
         holds the truth:\n\n| parameter |"
    );
    for way in ways {
        write!(text, " {} | holds |", way.name)?;
    }
    text.push_str("\n|---|");
    text.push_str(&"---:|---:|".repeat(ways.len()));
    text.push('\n');
    for (i, (name, truth)) in truth.iter().enumerate() {
        write!(text, "| {name} |")?;
        for found in &columns {
            let n = found.len() as f64;
            let off = |f: &Vec<Found>| 100.0 * (f[i].0 - truth) / truth;
            let mean = found.iter().map(off).sum::<f64>() / n;
            let squares: f64 = found.iter().map(|f| (off(f) - mean).powi(2)).sum();
            let holds = found
                .iter()
                .filter(|f| f[i].1[0] <= *truth && *truth <= f[i].1[1])
                .count();
            // More digits of the bias than its own uncertainty has mean nothing.
            let spread = (squares / (n - 1.0)).sqrt();
            let decimals = (1.0 - (spread / n.sqrt()).log10().floor()).clamp(0.0, 6.0) as usize;
            write!(
                text,
                " {} ± {} | {:.0} % |",
                minus(&format!("{mean:+.decimals$}")),
                significant(spread, 2),
                100.0 * holds as f64 / n
            )?;
        }
        text.push('\n');
    }
    Ok(text)
}

fn significant(value: f64, digits: i32) -> String {
    let decimals = (digits - 1 - value.abs().log10().floor() as i32).clamp(0, 12) as usize;
    format!("{value:.decimals$}")
}

/// A percentage with sign; what depends on when a solver stops is 0.
fn signed(value: f64) -> String {
    if value.abs() < 5e-5 {
        return "0".to_owned();
    }
    let text = significant(value, 2);
    minus(&if value > 0.0 {
        format!("+{text}")
    } else {
        text
    })
}

fn minus(text: &str) -> String {
    text.replace('-', "−")
}
