//! The field table: what a diagnosis finds in recordings that were made as in the field.
//!
//! `cargo run --release -p loopsight-tests --example field_conditions -- --help`
//!
//! Nine ways in which real logs are worse than those of the blind table, eight effects and none in each.
//! There is one log, and nothing else to judge on.

use std::f64::consts::TAU;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use clap::Parser;
use loopsight_diagnosis::{Diagnosis, Measurements, Work, diagnose};
use loopsight_hidden::{Driven, Experiment, Hidden, Live, PERIOD, Recording, Robot, record_along};
use loopsight_model::excitation::Excitation;
use loopsight_model::model::Model;
use loopsight_model::run::Run;
use loopsight_plants as _;
use loopsight_tests::WINDINGS;
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

#[path = "blind/mod.rs"]
#[expect(
    dead_code,
    reason = "the blind table judges on a second recording, too"
)]
mod blind;

use blind::Case;

/// What a diagnosis finds in recordings that were made as in the field
#[derive(Parser)]
struct Arguments {
    /// The first seed
    #[arg(long, default_value_t = 8001)]
    first: u64,
    /// Only these conditions: "closed loop,spikes"
    #[arg(long, value_delimiter = ',')]
    only: Vec<String>,
    /// Only these effects
    #[arg(long, value_delimiter = ',')]
    effects: Vec<String>,
    /// Write model files and logs into this folder
    #[arg(long)]
    keep: Option<PathBuf>,
    /// Write the table here
    #[arg(long)]
    write: Option<PathBuf>,
}

/// What stands above the table in a file.
const HEADER: &str = "\
# The field table

What `loopsight diagnose` concludes from one log that hides an effect of noticeable size, where the log is as bad
as those of the field often are, and nothing else is there to judge on. The rules were tried on other seeds (701, 4001).
Remade by

    cargo run --release -p loopsight-tests --example field_conditions -- --write examples/hidden-effect/FIELD.md

* closed loop: a PI controller of the speeds makes the commands, from what it measures.
* jitter: each row is logged up to 0.3 periods late, at the time that it says.
* dropped rows: one row in twenty is missing, and once 0.3 s of them.
* coarse: encoders of 512 counts per revolution, commands and differences every 20 ms.
* white noise: of 2 % of each signal's standard deviation.
* spikes: one reading in a hundred is off by ten standard deviations.
* moving start: the log begins 3.3 s after the machine.
* short: 10 s.
* rounded commands: to 0.1 V.

`right`: the effect itself, or one in a class with it that the diagnosis says it cannot tell from it, comes first;
or it is said that the log shows none, where a refit of the plain model leaves less than 1.15 times what counts and
noise alone leave (the readings against the exact ones).

";

/// What is hidden: of each kind one, each where it is shown.
const EFFECTS: [Hidden; 8] = [
    Hidden::CoulombFriction,
    Hidden::QuadraticDrag,
    Hidden::GravityPendulum,
    Hidden::CentrifugalOffset,
    Hidden::DeadZone,
    Hidden::InputDelay,
    Hidden::BatterySag,
    Hidden::SensorLag,
];

/// How a log is worse than it could be.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Condition {
    ClosedLoop,
    Jitter,
    DroppedRows,
    Coarse,
    WhiteNoise,
    Spikes,
    MovingStart,
    Short,
    RoundedCommands,
}

impl Condition {
    const ALL: [(Self, &'static str); 9] = [
        (Self::ClosedLoop, "closed loop"),
        (Self::Jitter, "jitter"),
        (Self::DroppedRows, "dropped rows"),
        (Self::Coarse, "coarse"),
        (Self::WhiteNoise, "white noise"),
        (Self::Spikes, "spikes"),
        (Self::MovingStart, "moving start"),
        (Self::Short, "short"),
        (Self::RoundedCommands, "rounded commands"),
    ];

    /// The log as it is under this condition.
    fn of(self, log: &Recording, case: Case) -> Option<Vec<Row>> {
        let mut random = ChaCha8Rng::seed_from_u64(case.seed);
        let rows = (0..log.run.len()).map(|k| Row {
            time: log.run.time()[k],
            input: log.run.input(k).to_vec(),
            measured: log.run.sample(k).to_vec(),
            clean: log.exact.sample(k).to_vec(),
        });
        let mut rows: Vec<Row> = rows.collect();
        let deviations = deviations(&rows);
        match self {
            Self::ClosedLoop => rows = closed_loop(case)?,
            Self::Jitter => rows = late_rows(log, &mut random),
            Self::DroppedRows => rows.retain(|row| {
                random.random_range(0.0..1.0) >= 0.05 && !(12.0..12.3).contains(&row.time)
            }),
            Self::Coarse => rows = coarse(case, &rows)?,
            Self::WhiteNoise => {
                for (y, deviation) in readings(&mut rows, &deviations) {
                    *y += 0.02 * deviation * normal(&mut random);
                }
            }
            Self::Spikes => {
                for row in &mut rows {
                    for (j, deviation) in deviations.iter().enumerate() {
                        if random.random_range(0.0..1.0) < 0.01 {
                            let off = 10.0 * deviation * if random.random() { 1.0 } else { -1.0 };
                            row.measured[j] += off;
                            // What is to be left out is no part of the floor.
                            row.clean[j] += off;
                        }
                    }
                }
            }
            Self::MovingStart => {
                rows.retain(|row| row.time >= 3.3);
                rows.iter_mut().for_each(|row| row.time -= 3.3);
            }
            Self::Short => rows.truncate((10.0 / PERIOD) as usize),
            Self::RoundedCommands => {
                for input in rows.iter_mut().flat_map(|row| &mut row.input) {
                    *input = (10.0 * *input).round() / 10.0;
                }
            }
        }
        Some(rows)
    }
}

/// The rows as a CSV of six digits.
fn csv(rows: &[Row], columns: &[String]) -> String {
    let mut text = columns.join(",");
    text.push('\n');
    for row in rows {
        let _ = write!(text, "{:.4}", row.time);
        for value in row.input.iter().chain(&row.measured) {
            let _ = write!(text, ",{value:.6}");
        }
        text.push('\n');
    }
    text
}

/// The diagnosis of a log as it would be read from a file.
fn diagnosed(toml: &str, text: &str) -> Option<Diagnosis> {
    let (model, _) = Model::from_toml("hidden", toml).ok()?;
    let log = blind::read(&model, text)?;
    let measurements = Measurements::new(&log.runs).with_faults(&log.faults);
    diagnose(&model, &measurements, &Work::quiet()).ok()
}

/// One row of a log.
struct Row {
    time: f64,
    input: Vec<f64>,
    measured: Vec<f64>,
    /// The readings without the noise and the counts of the condition.
    clean: Vec<f64>,
}

/// What noise and counts alone leave, as a share of the standard deviation of the signals.
fn floor(rows: &[Row]) -> f64 {
    let deviations = deviations(rows);
    let shares = deviations.iter().enumerate().map(|(j, deviation)| {
        let off = rows.iter().map(|r| (r.measured[j] - r.clean[j]).powi(2));
        off.sum::<f64>() / rows.len() as f64 / deviation.powi(2)
    });
    (shares.sum::<f64>() / deviations.len() as f64).sqrt()
}

/// Standard deviation of each signal.
fn deviations(rows: &[Row]) -> Vec<f64> {
    let n = rows.len() as f64;
    let signals = rows.first().map_or(0, |row| row.measured.len());
    (0..signals)
        .map(|j| {
            let mean = rows.iter().map(|r| r.measured[j]).sum::<f64>() / n;
            let squares = rows.iter().map(|r| (r.measured[j] - mean).powi(2));
            (squares.sum::<f64>() / n).sqrt()
        })
        .collect()
}

/// Every reading, with the standard deviation of its signal.
fn readings<'r>(
    rows: &'r mut [Row],
    deviations: &'r [f64],
) -> impl Iterator<Item = (&'r mut f64, f64)> {
    rows.iter_mut()
        .flat_map(|row| row.measured.iter_mut().zip(deviations.iter().copied()))
}

/// A standard normal number, by G. E. P. Box and M. E. Muller (1958).
fn normal(random: &mut ChaCha8Rng) -> f64 {
    let (radius, angle): (f64, f64) =
        (random.random_range(0.0..1.0), random.random_range(0.0..TAU));
    (-2.0 * (1.0 - radius).ln()).sqrt() * angle.cos()
}

/// Rows whose readings were taken up to 0.3 periods late, between those of the recording. Commands hold their
/// value, so that those of the log are right to the sample.
fn late_rows(log: &Recording, random: &mut ChaCha8Rng) -> Vec<Row> {
    let run = &log.run;
    (0..run.len() - 1)
        .map(|k| {
            let late = random.random_range(0.0..0.3);
            let read =
                |run: &Run, j: usize| (1.0 - late) * run.sample(k)[j] + late * run.sample(k + 1)[j];
            let between = |j: usize| read(run, j);
            let clean = |j: usize| read(&log.exact, j);
            Row {
                time: run.time()[k] + late * PERIOD,
                input: run.input(k).to_vec(),
                measured: (0..run.n_measured()).map(between).collect(),
                clean: (0..run.n_measured()).map(clean).collect(),
            }
        })
        .collect()
}

/// The machine with commands that change every 20 ms, logged then, with speeds from encoders of 512 counts.
fn coarse(case: Case, rows: &[Row]) -> Option<Vec<Row>> {
    const COUNT: f64 = TAU / 512.0;
    let robot = case.robot;
    let held = |k: usize| {
        let input = &rows[k - k % 2].input;
        [input[0], input.get(1).copied().unwrap_or(0.0)]
    };
    let commands: Vec<[f64; 2]> = (0..rows.len()).map(held).collect();
    let hidden: Vec<(Hidden, f64)> = case.effect.map(|e| (e, case.size)).into_iter().collect();
    let log = record_along(robot, &hidden, &commands, case.seed, WINDINGS).ok()?;
    let (exact, period) = (&log.exact, 2.0 * PERIOD);
    // Wheel speeds are (v ± b ω)/r.
    let (radius, half_track) = match robot {
        Robot::Twil => {
            let (_, body) = Driven::Twil.parts();
            (body.wheel_radius, body.half_track)
        }
        _ => (1.0, 0.0),
    };
    let counted = |angle: f64| (angle / COUNT).floor() * COUNT;
    let mut angles = [0.0; 2];
    let mut last = [[0.0; 2]; 2];
    let mut rows = Vec::new();
    for k in 0..exact.len() {
        let y = exact.sample(k);
        let turning = half_track * y.get(1).copied().unwrap_or(0.0);
        angles[0] += (y[0] + turning) / radius * PERIOD;
        angles[1] += (y[0] - turning) / radius * PERIOD;
        if k % 2 == 0 {
            // As counted, and as they are.
            let now = [angles.map(counted), angles];
            let [measured, clean] = [0, 1].map(|how| {
                let [right, left] = [0, 1].map(|i| (now[how][i] - last[how][i]) * radius / period);
                if y.len() == 2 {
                    vec![0.5 * (right + left), 0.5 * (right - left) / half_track]
                } else {
                    vec![right]
                }
            });
            last = now;
            rows.push(Row {
                time: exact.time()[k],
                input: log.run.input(k).to_vec(),
                measured,
                clean,
            });
        }
    }
    Some(rows)
}

/// The machine with a controller that makes its speeds follow random levels: of each speed a PI controller that
/// doubles the speed of the lumped model.
fn closed_loop(case: Case) -> Option<Vec<Row>> {
    let driven = match case.robot {
        Robot::Twil => Driven::Twil,
        _ => Driven::Axis,
    };
    let lumped = driven.lumped();
    let axes: Vec<[f64; 2]> = match driven {
        Driven::Twil => vec![[-lumped.k_a, lumped.k_c], [-lumped.k_d, lumped.k_f]],
        Driven::Axis => vec![[-lumped.k_a, lumped.k_c]],
    };
    let levels = |signal: usize| {
        let levels = Excitation::MultiLevel {
            amplitude: 6.0,
            hold_s: 0.8,
            levels: 7,
            seed: case.seed,
            common: false,
        };
        levels.build(["forward", "turning"][signal]).ok()
    };
    let references: Vec<_> = (0..axes.len()).map(levels).collect::<Option<_>>()?;
    let hidden: Vec<(Hidden, f64)> = case.effect.map(|e| (e, case.size)).into_iter().collect();
    let mut machine = Live::new(case.robot, &hidden, case.seed).ok()?;
    let mut sums = vec![0.0; axes.len()];
    let mut told = Vec::new();
    for k in 0..2501 {
        let time = k as f64 * PERIOD;
        let measured = machine.sample();
        let mut asked = [0.0; 2];
        for (j, [damping, gain]) in axes.iter().enumerate() {
            let reference = references[j].sample(time) * gain / damping;
            let error = reference - measured[j];
            sums[j] += error * PERIOD;
            asked[j] = damping / gain * (error + damping * sums[j]);
        }
        let commands = match driven {
            Driven::Twil => [0.5 * (asked[0] + asked[1]), 0.5 * (asked[0] - asked[1])],
            Driven::Axis => asked,
        };
        let commands = commands.map(|v| v.clamp(-9.0, 9.0));
        told.push(commands);
        machine.drive(commands);
    }
    // The same machine along the same commands.
    let log = record_along(case.robot, &hidden, &told, case.seed, WINDINGS).ok()?;
    let rows = (0..log.run.len()).map(|k| Row {
        time: log.run.time()[k],
        input: log.run.input(k).to_vec(),
        measured: log.run.sample(k).to_vec(),
        clean: log.exact.sample(k).to_vec(),
    });
    Some(rows.collect())
}

struct Found {
    condition: &'static str,
    hidden: String,
    right: bool,
    said: String,
}

fn main() {
    let Arguments {
        first,
        only,
        effects,
        keep,
        write,
    } = Arguments::parse();
    let mut jobs = Vec::new();
    for (i, (condition, name)) in Condition::ALL.into_iter().enumerate() {
        if !only.is_empty() && !only.iter().any(|o| o == name) {
            continue;
        }
        let hidden = EFFECTS.into_iter().map(Some).chain([None]);
        for (k, effect) in hidden.enumerate() {
            let id = effect.map_or("nothing", Hidden::id);
            if !effects.is_empty() && !effects.iter().any(|name| name == id) {
                continue;
            }
            let case = Case {
                robot: effect.map_or(Robot::Twil, Hidden::home),
                effect,
                experiment: Experiment::Mixed,
                size: 1.0,
                seed: first + (10 * i + k) as u64,
            };
            jobs.push((condition, name, case));
        }
    }
    let found: Vec<Found> = jobs
        .into_par_iter()
        .filter_map(|(condition, name, case)| try_one(condition, name, case, keep.as_deref()))
        .inspect(|f| {
            let mark = if f.right { "ok   " } else { "WRONG" };
            eprintln!("{mark} {:17} {:20} {}", f.condition, f.hidden, f.said);
        })
        .collect();
    let table = render(&found);
    println!("{table}");
    if let Some(file) = write {
        blind::write(&file, &format!("{HEADER}{table}"));
    }
}

fn try_one(
    condition: Condition,
    name: &'static str,
    case: Case,
    keep: Option<&Path>,
) -> Option<Found> {
    let mut recorded = case.record(WINDINGS)?;
    let rows = condition.of(&recorded.log, recorded.case)?;
    let toml = match condition {
        // One knows the encoder one has.
        Condition::Coarse => recorded.log.model_toml.replace("8192", "512"),
        _ => recorded.log.model_toml.clone(),
    };
    let text = csv(&rows, &recorded.log.columns());
    if let Some(folder) = keep {
        let stem =
            format!("{name} {}", case.effect.map_or("nothing", Hidden::id)).replace(' ', "-");
        blind::write(&folder.join(format!("{stem}.toml")), &toml);
        blind::write(&folder.join(format!("{stem}.csv")), &text);
    }
    let diagnosis = diagnosed(&toml, &text)?;
    // What is seen with fine counts and a rich input may be nothing in this log.
    recorded.hidden_well |= diagnosis.nominal.nrmse < blind::INVISIBLE * floor(&rows);
    let said = match (&diagnosis.missing, diagnosis.candidates.first()) {
        (Some(place), Some(best)) => {
            let class = best.indistinguishable_from.len() + 1;
            format!("{} of a class of {class}", place.effect)
        }
        _ => format!("{:?}", diagnosis.verdict),
    };
    Some(Found {
        condition: name,
        hidden: case.effect.map_or("nothing", Hidden::id).to_owned(),
        right: recorded.right(&diagnosis),
        said,
    })
}

fn render(found: &[Found]) -> String {
    let mut text = String::from("| condition | right | false alarm | wrong |\n|---|---|---|---|\n");
    let count = |hidden: bool, of: &dyn Fn(&&Found) -> bool| {
        let all = found.iter().filter(|f| (f.hidden != "nothing") == hidden);
        let all: Vec<&Found> = all.filter(of).collect();
        (all.iter().filter(|f| f.right).count(), all.len())
    };
    for (_, name) in Condition::ALL {
        let (right, of) = count(true, &|f| f.condition == name);
        let (quiet, clean) = count(false, &|f| f.condition == name);
        let wrong = found.iter().filter(|f| f.condition == name && !f.right);
        let wrong: Vec<String> = wrong.map(|f| format!("{}: {}", f.hidden, f.said)).collect();
        let _ = writeln!(
            text,
            "| {name} | {right}/{of} | {}/{clean} | {} |",
            clean - quiet,
            wrong.join("; ")
        );
    }
    let (right, of) = count(true, &|_| true);
    let (quiet, clean) = count(false, &|_| true);
    let alarms = clean - quiet;
    let _ = writeln!(
        text,
        "\nRight effect or class: {right} of {of}. False alarms on logs that hide nothing: {alarms} of {clean}."
    );
    text
}
