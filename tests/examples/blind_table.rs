//! The blind table: recordings that hide an effect, and what a diagnosis finds in them.
//!
//! `cargo run --release -p loopsight-tests --example blind_table -- --help`
//!
//! Judged on a multi-level recording of the same machine with other seeds. The machine's windings
//! have a time constant of 0.1 ms, far below what can be seen; everything else about it is
//! independent of the models that are fitted. The seeds follow from the version number.

use std::fmt::Write as _;
use std::path::PathBuf;

use clap::Parser;
use loopsight_diagnosis::Criteria;
use loopsight_hidden::{Experiment, Robot, catalogue};
use loopsight_plants as _;
use loopsight_tests::WINDINGS;
use rayon::prelude::*;

#[path = "blind/mod.rs"]
mod blind;

use blind::{Case, Recorded};

/// What a diagnosis finds in recordings that hide an effect
#[derive(Parser)]
struct Arguments {
    /// Sizes of the effects, in noticeable ones
    #[arg(long, value_delimiter = ',', default_values_t = [0.5, 1.0, 2.0])]
    sizes: Vec<f64>,
    /// Kinds of input
    #[arg(long, value_delimiter = ',', default_values_t = ["prbs".to_owned(), "mixed".to_owned()])]
    experiments: Vec<String>,
    /// Recordings of each kind
    #[arg(long, default_value_t = 2)]
    seeds: u64,
    /// The first seed
    #[arg(long, default_value_t = fresh())]
    first: u64,
    /// Recordings that hide nothing
    #[arg(long, default_value_t = 60)]
    clean: u64,
    /// Only these effects, machines, or recordings by the name of their folder in examples/hidden-effect
    #[arg(long, value_delimiter = ',')]
    only: Vec<String>,
    /// Time constant of the motors' windings, s: those of an ironless rotor
    #[arg(long, default_value_t = WINDINGS)]
    windings: f64,
    /// Write the table here
    #[arg(long)]
    write: Option<PathBuf>,
}

/// What stands above the table in a file.
const HEADER: &str = "\
# The blind table

What `loopsight diagnose` concludes from recordings that hide an effect, fitted to one recording and
judged on a multi-level one with other seeds, and recordings of every machine that hide nothing. A size of 1 is what
is noticeable; inputs are pseudo-random binary, or mixed. Without `--first` the seeds follow from the version
number. This table has {what}. Remade by

    cargo run --release -p loopsight-tests --example blind_table -- {arguments}

`right`: the effect itself, or one in a class with it that the diagnosis says it cannot tell from it,
comes first, or the log cannot show it and is said to show none, or not what it is. `first`: the effect itself
comes first; `class`: the mean number of explanations that the named one cannot be told from, itself among them. `seen in the log`: a refit of the
plain model leaves at least 1.15 times the floor. Errors are those on the multi-level recording, means
over the row; `floor` is what the resolution of the encoders alone leaves there. `parameter error` is
the median over the effect's parameters that have an interval, where the truth has the form of the effect;
`in the interval` counts those whose 95 % interval holds the truth. The windings of these machines have a
time constant of 0.1 ms that no model knows of: it is too little to be seen, but delays and lags take it for
their own, and friction under pseudo-random voltages that reverse at once. `--windings 1e-6` is without.

Two levels say less than seven: after a pseudo-random binary log the exponent of a power law (thermal, tank) and the edge
of a vessel are known as closely as the log tells, and the multi-level recording asks for more. The error after is then
up to 1.8 times the floor. With the true value held a fit to the same log leaves the same error: to four digits for the
exponent, to two per cent for the edge.

";

/// An error of ten times the signal's own deviation: a model that runs away.
const ASTRAY: f64 = 10.0;

struct Row {
    what: String,
    experiment: Experiment,
    size: f64,
    seed: u64,
    right: bool,
    /// What is named first is the effect itself.
    first: bool,
    /// How many explanations the named one cannot be told from, itself among them; 0 where none is named.
    class: usize,
    /// A refit of the plain model leaves what cannot be told from the floor: nothing to be found.
    hidden_well: bool,
    found: String,
    before: f64,
    after: f64,
    floor: f64,
    estimates: Vec<Held>,
}

/// An estimate held against the truth.
struct Held {
    name: &'static str,
    found: f64,
    truth: f64,
    /// Half the 95 % interval; none without one.
    half: Option<f64>,
    /// That interval holds the truth.
    covered: Option<bool>,
}

impl Held {
    fn relative_error(&self) -> f64 {
        (self.found - self.truth).abs() / self.truth.abs()
    }
}

fn main() {
    let Arguments {
        sizes,
        experiments,
        seeds,
        first,
        clean,
        only,
        windings,
        write,
    } = Arguments::parse();
    let experiments: Vec<Experiment> = Experiment::ALL
        .into_iter()
        .filter(|e| experiments.iter().any(|n| n == e.name()))
        .collect();

    let mut jobs: Vec<Case> = Vec::new();
    for (robot, effect) in catalogue() {
        let case = robot.case(Some(effect));
        let meant = |name: &str| name == case || name == effect.id() || name == robot.name();
        if !only.is_empty() && !only.iter().any(|name| meant(name)) {
            continue;
        }
        for experiment in &experiments {
            for size in &sizes {
                for seed in first..first + seeds {
                    jobs.push(Case {
                        robot,
                        effect: Some(effect),
                        experiment: *experiment,
                        size: *size,
                        seed,
                    });
                }
            }
        }
    }
    if only.is_empty() {
        for seed in 0..clean {
            let k = seed as usize;
            let robot = Robot::ALL[k % Robot::ALL.len()];
            let experiment = experiments[k / Robot::ALL.len() % experiments.len()];
            jobs.push(Case {
                robot,
                effect: None,
                experiment,
                size: 0.0,
                seed: 100 * first + seed,
            });
        }
    }
    let rows: Vec<Row> = jobs
        .par_iter()
        .filter_map(|case| {
            let row = try_one(*case, windings)?;
            eprintln!(
                "{} {:30} {:6} size {:3} seed {:3}: {:60} {:6.2} -> {:6.2} floor {:5.2} {}",
                if row.right { "ok   " } else { "WRONG" },
                row.what,
                row.experiment.name(),
                row.size,
                row.seed,
                row.found,
                100.0 * row.before,
                100.0 * row.after,
                100.0 * row.floor,
                row.estimates
                    .iter()
                    .map(|h| format!(
                        "{} {:.4} ± {:.4} (true {:.4})",
                        h.name,
                        h.found,
                        h.half.unwrap_or(f64::NAN),
                        h.truth
                    ))
                    .collect::<Vec<_>>()
                    .join(", ")
            );
            Some(row)
        })
        .collect();
    let table = render(&rows);
    println!("{table}");
    let Some(file) = write else { return };
    let words: Vec<String> = std::env::args().skip(1).collect();
    let header = HEADER
        .replace("{arguments}", &words.join(" "))
        .replace("{what}", &extent(&sizes, experiments.len(), seeds, clean));
    blind::write(&file, &format!("{header}{table}"));
}

/// What a table covers, in words.
fn extent(sizes: &[f64], experiments: usize, seeds: u64, clean: u64) -> String {
    let sizes: Vec<String> = sizes.iter().map(f64::to_string).collect();
    format!(
        "effects of size {}, {experiments} kinds of input, {seeds} seed(s) of each, and {clean} clean recordings",
        sizes.join(", ")
    )
}

/// The first seed: drawn from the version number, by the FNV-1a hash of its digits.
fn fresh() -> u64 {
    let hash = env!("CARGO_PKG_VERSION")
        .bytes()
        .fold(0xcbf2_9ce4_8422_2325_u64, |hash, byte| {
            (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
        });
    1_000 + hash % 100_000
}

fn try_one(case: Case, windings: f64) -> Option<Row> {
    let recorded = case.record(windings)?;
    let diagnosis = recorded.diagnose(&Criteria::DEFAULT)?;
    let right = recorded.right(&diagnosis);
    let Recorded {
        case,
        log,
        test,
        hidden_well,
        ..
    } = recorded;
    let Case {
        robot,
        effect,
        experiment,
        size,
        seed,
    } = case;
    let what = effect.map_or_else(|| "clean".to_owned(), |e| robot.case(Some(e)));
    let truth = log.truth.hidden.first();
    let is_true = |place| truth.is_some_and(|t| blind::is(place, t.effect.id(), &t.at));
    let first = diagnosis.missing.as_ref().is_some_and(is_true);
    let best = diagnosis.candidates.first();
    let found = match (&diagnosis.missing, best) {
        (Some(place), Some(best)) => format!(
            "{}@{}{}",
            place.effect,
            place.at.join("+"),
            if best.indistinguishable_from.is_empty() {
                String::new()
            } else {
                format!(" (class of {})", best.indistinguishable_from.len() + 1)
            }
        ),
        _ => format!("{:?}", diagnosis.verdict),
    };
    // Where the truth has the form of the effect, at the channels at which it was found.
    let estimates = match (truth, best) {
        (Some(truth), Some(best))
            if !truth.approximate
                && best.place.effect == truth.effect.id()
                && truth
                    .at
                    .iter()
                    .all(|c| best.place.at.iter().any(|x| x == c)) =>
        {
            truth
                .fitted
                .iter()
                .filter_map(|q| {
                    let estimate = best.parameters.get(q.name)?;
                    Some(Held {
                        name: q.name,
                        found: estimate.value,
                        truth: q.value,
                        half: estimate.interval95.map(|[low, high]| 0.5 * (high - low)),
                        covered: estimate
                            .interval95
                            .map(|[low, high]| (low..=high).contains(&q.value)),
                    })
                })
                .collect()
        }
        _ => Vec::new(),
    };
    Some(Row {
        what,
        experiment,
        size,
        seed,
        right,
        first,
        class: match (&diagnosis.missing, best) {
            (Some(_), Some(best)) => best.indistinguishable_from.len() + 1,
            _ => 0,
        },
        hidden_well,
        found,
        before: diagnosis.nominal.nrmse,
        after: if diagnosis.missing.is_some() {
            best.map_or(f64::NAN, |b| b.nrmse)
        } else {
            diagnosis.nominal.nrmse
        },
        floor: test.floor(),
        estimates,
    })
}

/// Median relative error of the parameters, and how many intervals hold the truth.
fn estimates(rows: &[&Row]) -> String {
    let held: Vec<&Held> = rows
        .iter()
        .filter(|r| r.right)
        .flat_map(|r| &r.estimates)
        .collect();
    let mut errors: Vec<f64> = held
        .iter()
        .filter(|h| h.covered.is_some())
        .map(|h| h.relative_error())
        .filter(|e| e.is_finite())
        .collect();
    if errors.is_empty() {
        return "- | -".to_owned();
    }
    let middle = errors.len() / 2;
    let median = *errors.select_nth_unstable_by(middle, f64::total_cmp).1;
    let covered: Vec<bool> = held.iter().filter_map(|h| h.covered).collect();
    format!(
        "{:.2} % | {}/{}",
        100.0 * median,
        covered.iter().filter(|c| **c).count(),
        covered.len()
    )
}

/// Mean number of explanations that the named one cannot be told from, where one is named.
fn class(rows: &[&Row]) -> String {
    let named: Vec<f64> = rows
        .iter()
        .filter(|r| r.class > 0)
        .map(|r| r.class as f64)
        .collect();
    match named.len() {
        0 => "-".to_owned(),
        n => format!("{:.1}", named.iter().sum::<f64>() / n as f64),
    }
}

fn render(rows: &[Row]) -> String {
    let mut text = String::from(
        "| hidden | right | first | class | seen in the log | error before | after | floor | parameter error | in the interval |\n|---|---|---|---|---|---|---|---|---|---|\n",
    );
    let mut names: Vec<&str> = rows.iter().map(|r| r.what.as_str()).collect();
    names.dedup();
    for name in names {
        let of: Vec<&Row> = rows.iter().filter(|r| r.what == name).collect();
        // A free run that left the measurements altogether has no error worth a mean.
        let mean = |f: &dyn Fn(&Row) -> f64| {
            let near: Vec<f64> = of.iter().map(|r| f(r)).filter(|e| *e < ASTRAY).collect();
            let mean = 100.0 * near.iter().sum::<f64>() / near.len() as f64;
            match of.len() - near.len() {
                0 => format!("{mean:.2} %"),
                gone => format!("{mean:.2} %, {gone} astray"),
            }
        };
        let _ = writeln!(
            text,
            "| {name} | {}/{} | {} | {} | {} | {} | {} | {} | {} |",
            of.iter().filter(|r| r.right).count(),
            of.len(),
            of.iter().filter(|r| r.first).count(),
            class(&of),
            of.iter().filter(|r| !r.hidden_well).count(),
            mean(&|r| r.before),
            mean(&|r| r.after),
            mean(&|r| r.floor),
            estimates(&of),
        );
    }
    let right: Vec<&Row> = rows.iter().filter(|r| r.right).collect();
    let _ = writeln!(
        text,
        "\nOver all: parameter error (median) and share of 95 % intervals that hold the truth: {}.",
        estimates(&right).replace(" | ", ", ")
    );
    let clean: Vec<&Row> = rows.iter().filter(|r| r.what == "clean").collect();
    let hidden: Vec<&Row> = rows.iter().filter(|r| r.what != "clean").collect();
    let seen: Vec<&&Row> = hidden.iter().filter(|r| !r.hidden_well).collect();
    let _ = writeln!(
        text,
        "\nRight effect or class: {} of {} where the log shows it; {} of {} in all, counting as right \
         that a log which cannot show an effect is said to show none. False alarms on clean \
         recordings: {} of {}. Where the log shows it, the effect itself is named first in {} of {}; \
         mean class {}, largest {}.",
        seen.iter().filter(|r| r.right).count(),
        seen.len(),
        hidden.iter().filter(|r| r.right).count(),
        hidden.len(),
        clean.iter().filter(|r| !r.right).count(),
        clean.len(),
        seen.iter().filter(|r| r.first).count(),
        seen.len(),
        class(&hidden),
        hidden.iter().map(|r| r.class).max().unwrap_or(0),
    );
    for row in rows.iter().filter(|r| !r.right) {
        let _ = writeln!(
            text,
            "\nWrong: {} of size {} under {} (seed {}): {}, error {:.2} %, floor {:.2} %.",
            row.what,
            row.size,
            row.experiment.name(),
            row.seed,
            row.found,
            100.0 * row.after,
            100.0 * row.floor
        );
    }
    text
}
