//! Writes the recordings of `examples/hidden-effect`, and says how visible each effect is.

use std::path::PathBuf;
use std::process::ExitCode;

use loopsight_hidden::{
    Experiment, Hidden, HiddenError, Robot, catalogue, hysteretic_benchmark, record, record_with,
    refit, visibility, write_library,
};

const USAGE: &str = "usage:
  loopsight-hidden all -o FOLDER      write every effect's recordings and the index
  loopsight-hidden table              print how much each effect changes the signals
  loopsight-hidden one [ROBOT:]EFFECT[=SIZE][+EFFECT[=SIZE]] prbs|multi_level|mixed SEED -o FILE.csv
                                      nothing in place of effects: the clean machine
  loopsight-hidden benchmark SEED NOISE -o FILE.csv
                                      the hysteretic oscillator of Noël and Schoukens (2016), noise in m";

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let done = match words.as_slice() {
        ["all", "-o", folder] => write_library(&PathBuf::from(folder)),
        ["table"] => table(),
        ["one", effects, experiment, seed, "-o", file] => {
            let experiment = Experiment::ALL
                .into_iter()
                .find(|e| e.name() == *experiment);
            match (experiment, seed.parse()) {
                (Some(experiment), Ok(seed)) => one(effects, experiment, seed, file),
                _ => return misused(),
            }
        }
        ["benchmark", seed, noise, "-o", file] => match (seed.parse(), noise.parse()) {
            (Ok(seed), Ok(noise)) => benchmark(seed, noise, file),
            _ => return misused(),
        },
        _ => return misused(),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

fn misused() -> ExitCode {
    eprintln!("{USAGE}");
    ExitCode::from(2)
}

fn one(effects: &str, experiment: Experiment, seed: u64, file: &str) -> Result<(), HiddenError> {
    let mut hidden = Vec::new();
    let (name, effects) = effects.split_once(':').unwrap_or(("", effects));
    for entry in effects.split('+').filter(|entry| *entry != "nothing") {
        let (id, size) = entry.split_once('=').unwrap_or((entry, "1"));
        hidden.push((id.parse::<Hidden>()?, size.parse().unwrap_or(f64::NAN)));
    }
    let named = Robot::ALL.into_iter().find(|r| r.name() == name);
    let home = hidden
        .first()
        .map_or(Robot::Twil, |(effect, _)| effect.home());
    let robot = named.unwrap_or(home);
    let recording = record(robot, &hidden, experiment, seed)?;
    print!("{}", recording.truth.to_toml());
    recording.write_csv(&PathBuf::from(file))
}

/// A period of the multisine of the benchmark.
fn benchmark(seed: u64, noise: f64, file: &str) -> Result<(), HiddenError> {
    let recording = hysteretic_benchmark(seed, 8192, noise)?;
    print!("{}", recording.truth.to_toml());
    recording.write_csv(&PathBuf::from(file))
}

/// Effects by size and experiment: the change, and what is left of it after a refit to PRBS.
fn table() -> Result<(), HiddenError> {
    println!(
        "in % of the signals' standard deviation; the refit is to the log of the first column, of the \
         last one where the robot is part of the name"
    );
    for robot in [Robot::Twil, Robot::Axis] {
        for winding in [1e-3, 1e-4] {
            let log = record_with(robot, &[], Experiment::Prbs, 1, winding)?;
            println!(
                "nothing in the {}, windings of {} ms: {:.3} left after refit, floor {:.3}",
                robot.name(),
                1e3 * winding,
                100.0 * refit(&log).left(&log),
                100.0 * log.floor()
            );
        }
    }
    println!(
        "{:32} {:>5} | {:^23} | {:^23} | {:>5}",
        "", "", "change", "left after refit", ""
    );
    let head = ["prbs", "levels", "mixed"]
        .map(|h| format!("{h:>7}"))
        .join(" ");
    println!(
        "{:32} {:>5} | {head} | {head} | {:>5}",
        "effect", "size", "floor"
    );
    for (robot, effect) in catalogue() {
        for size in effect.sizes() {
            let mut change = String::new();
            let mut left = String::new();
            let log = record(robot, &[(effect, size)], robot.lesson(Some(effect)), 1)?;
            let fit = refit(&log);
            for experiment in Experiment::ALL {
                let share = visibility(robot, effect, size, experiment, 1)?;
                change.push_str(&format!(" {:7.2}", 100.0 * share));
                let test = record(robot, &[(effect, size)], experiment, 1)?;
                left.push_str(&format!(" {:7.2}", 100.0 * fit.left(&test)));
            }
            println!(
                "{:32} {size:5} |{change} |{left} | {:5.2}",
                robot.case(Some(effect)),
                100.0 * log.floor()
            );
        }
    }
    Ok(())
}
