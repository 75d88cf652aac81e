//! What becomes of the blind table when a criterion is a fifth larger or smaller.
//!
//! `cargo run --release -p loopsight-tests --example criteria_sensitivity -- --help`
//!
//! The recordings are drawn from those of the blind table, always the same ones for the same `--recordings`.
//! Each is made once; it is then diagnosed by the default criteria, and once for each criterion and each
//! direction. Groups that decide nothing in a diagnosis are listed without counts.

use std::fmt::Write as _;
use std::path::PathBuf;

use clap::Parser;
use loopsight_diagnosis::{Criteria, Criterion, Reason};
use loopsight_hidden::{Experiment, Robot, catalogue};
use loopsight_plants as _;
use loopsight_tests::{Random, WINDINGS};
use rayon::prelude::*;

#[path = "blind/mod.rs"]
mod blind;

use blind::{Case, Recorded};

/// What becomes of the blind table when a criterion is a fifth larger or smaller
#[derive(Parser)]
struct Arguments {
    /// Recordings that hide an effect
    #[arg(long, default_value_t = 12)]
    recordings: u64,
    /// Recordings that hide nothing
    #[arg(long, default_value_t = 3)]
    clean: u64,
    /// The first seed
    #[arg(long, default_value_t = 31)]
    first: u64,
    /// Only these criteria, or groups of them: missing, choice.blur
    #[arg(long, value_delimiter = ',')]
    only: Vec<String>,
    /// Write the page here
    #[arg(long)]
    write: Option<PathBuf>,
}

/// How far each criterion is moved.
const FACTORS: [f64; 2] = [1.2, 0.8];

/// Groups that decide nothing in a diagnosis.
const ELSEWHERE: [(&str, &str); 4] = [
    ("improve", "decides in `improve` only"),
    ("fails", "decides which sentences are written"),
    ("force", "decides how a residual force is written"),
    ("experiment", "decides in `experiment` only"),
];

/// How a set of recordings was judged.
#[derive(Clone, Copy, Default, PartialEq)]
struct Count {
    right: usize,
    wrong: usize,
    /// Effects named in recordings that hide none.
    false_alarms: usize,
}

impl Count {
    fn of(recordings: &[Recorded], criteria: &Criteria) -> Self {
        let one = |recorded: &Recorded| {
            let found = recorded.diagnose(criteria);
            let right = found.as_ref().is_some_and(|d| recorded.right(d));
            let named = found.is_some_and(|d| d.missing.is_some());
            Self {
                right: usize::from(right),
                wrong: usize::from(!right),
                false_alarms: usize::from(recorded.case.effect.is_none() && named),
            }
        };
        recordings
            .par_iter()
            .map(one)
            .reduce(Self::default, |a, b| Self {
                right: a.right + b.right,
                wrong: a.wrong + b.wrong,
                false_alarms: a.false_alarms + b.false_alarms,
            })
    }

    fn text(self) -> String {
        format!("{} / {} / {}", self.right, self.wrong, self.false_alarms)
    }
}

fn main() {
    let Arguments {
        recordings,
        clean,
        first,
        only,
        write,
    } = Arguments::parse();
    let recordings = record(recordings, clean, first);
    let plain = Count::of(&recordings, &Criteria::DEFAULT);
    eprintln!("{} recordings: {}", recordings.len(), plain.text());

    let mut rows = String::new();
    for criterion in Criteria::LIST {
        let group = criterion.id.split('.').next().unwrap_or_default();
        let asked = |name: &str| name == group || name == criterion.id;
        let elsewhere = ELSEWHERE.iter().find(|(name, _)| *name == group);
        let effect = match elsewhere {
            Some((_, why)) => format!("{why} | "),
            None if !only.is_empty() && !only.iter().any(|name| asked(name)) => {
                "not measured | ".to_owned()
            }
            None => moved(criterion, &recordings, plain),
        };
        eprintln!("{}: {effect}", criterion.id);
        let _ = writeln!(rows, "{} {effect} |", row(criterion));
    }
    let page = page(&recordings, plain, &rows);
    match write {
        Some(file) => blind::write(&file, &page),
        None => println!("{page}"),
    }
}

/// A draw from the recordings of the blind table, and some that hide nothing.
fn record(some: u64, clean: u64, first: u64) -> Vec<Recorded> {
    let mut all: Vec<Case> = Vec::new();
    for (robot, effect) in catalogue() {
        for experiment in [Experiment::Prbs, Experiment::Mixed] {
            for size in [0.5, 1.0, 2.0] {
                for seed in [first, first + 1] {
                    all.push(Case {
                        robot,
                        effect: Some(effect),
                        experiment,
                        size,
                        seed,
                    });
                }
            }
        }
    }
    let mut random = Random::new(1);
    let mut drawn: Vec<Case> = (0..some.min(all.len() as u64))
        .map(|_| all.swap_remove(random.below(all.len())))
        .collect();
    drawn.extend((0..clean).map(|seed| Case {
        robot: Robot::Twil,
        effect: None,
        experiment: Experiment::Prbs,
        size: 0.0,
        seed: 100 * first + seed,
    }));
    drawn
        .into_par_iter()
        .filter_map(|case| case.record(WINDINGS))
        .collect()
}

/// The counts with the criterion larger and smaller; a dash where nothing changes.
fn moved(criterion: &Criterion, recordings: &[Recorded], plain: Count) -> String {
    let cells: Vec<String> = FACTORS
        .iter()
        .map(
            |factor| match Criteria::DEFAULT.scaled(criterion.id, *factor) {
                None => String::new(),
                Some(criteria) => match Count::of(recordings, &criteria) {
                    count if count == plain => "-".to_owned(),
                    count => count.text(),
                },
            },
        )
        .collect();
    cells.join(" | ")
}

/// Name, default, unit, what it decides, and the reason.
fn row(criterion: &Criterion) -> String {
    let reason = match criterion.reason {
        Reason::Derived => "derived",
        Reason::Convention => "convention",
        Reason::Judgement => "judgement",
    };
    format!(
        "| `{}` | {} | {} | {} | {reason}: {} |",
        criterion.id,
        criterion.default,
        criterion.unit,
        criterion.decides.trim(),
        criterion.because
    )
}

/// What stands below the table.
const LONG: &str = "
Three numbers decide what a diagnosis reads of a long log. They stand beside the code (`diagnosis/src/long.rs`, `diagnosis/src/excerpt.rs`), because they
decide what is searched, and the verdict is that on all samples:

| number | value | unit | decides | reason |
|---|---|---|---|---|
| `ENOUGH` | 131072 | samples | Longest log that is searched as a whole. | derived: a share of a sum over as many samples has a relative standard error of 0.3 % |
| `WINDOWS` × `LENGTH` | 8 × 8192 | samples | Windows that the search reads of a longer log, at first. | judgement: half of the longest log that is read as a whole, in enough pieces that most kinds of motion are among them |
| `WITHIN` | 0.5 | 1 | Least share of the variance of each measured signal within the windows; below it they become longer. | judgement: more of the signal must lie within the windows than between them |
";

fn page(recordings: &[Recorded], plain: Count, rows: &str) -> String {
    let clean = recordings
        .iter()
        .filter(|r| r.case.effect.is_none())
        .count();
    let mut text = format!(
        "\
# Criteria

Every threshold that decides a verdict: its default, its unit, what it decides and why it has that value. They
are the fields of `loopsight_diagnosis::Criteria`. A reason is *derived* from something that can be computed, a
*convention* of the field, or a *judgement*.

The last two columns say what a diagnosis of {} recordings does when the criterion is 20 % larger and 20 %
smaller (counts change by one at least): right / wrong / false alarms, a dash where these stay {}. {clean} of the
recordings hide nothing. They were drawn from those of the blind table (`examples/hidden-effect/BLIND.md`), and
are few: a dash says that no verdict hangs on the criterion by a hair, not that it does not matter. Remade by

    cargo run --release -p loopsight-tests --example criteria_sensitivity -- --write docs/criteria.md

| criterion | default | unit | decides | reason | 20 % larger | 20 % smaller |
|---|---|---|---|---|---|---|
",
        recordings.len(),
        plain.text(),
    );
    text.push_str(rows);
    text.push_str(LONG);
    let _ = writeln!(text, "\nMeasured on:\n");
    for Recorded { case, .. } in recordings {
        let what = case
            .effect
            .map_or_else(|| "nothing hidden".to_owned(), |e| case.robot.case(Some(e)));
        let _ = writeln!(
            text,
            "* {what}, size {}, {}, seed {}",
            case.size,
            case.experiment.name(),
            case.seed
        );
    }
    text
}
