//! Runs that are too short to say anything.

use loopsight_model::run::Run;

use crate::fault::{Fault, FaultKind};
use crate::faults;
use crate::segment::SHORT_RUN;

/// Samples that say something of a run however short it is, where it is an experiment of its own and not what a gap left of
/// one: those of a second at 100 1/s. An arm that is driven at full voltage is at its other end in half a second.
const SAMPLES: usize = 100;

/// Leaves out the short runs where the others are enough.
pub(super) fn without_short_runs(runs: Vec<Run>) -> (Vec<Run>, Option<Fault>) {
    let is_short = |run: &Run| {
        let experiment = !run.name().is_empty() && !run.name().contains('#');
        run.duration() < SHORT_RUN && !(experiment && run.len() >= SAMPLES)
    };
    let list = runs
        .iter()
        .enumerate()
        .filter(|(_, run)| is_short(run))
        .map(|(i, run)| match run.name() {
            "" if runs.len() == 1 => format!("{:.2} s", run.duration()),
            "" => format!("run {} {:.2} s", i + 1, run.duration()),
            name => format!("`{name}` {:.2} s", run.duration()),
        })
        .collect::<Vec<_>>();
    if list.is_empty() {
        return (runs, None);
    }
    let moves = |run: &Run| (0..run.n_measured()).any(|s| faults::moves(run, s));
    let enough = runs.iter().any(|run| !is_short(run) && moves(run));
    let keep = !enough && runs.iter().any(|run| is_short(run) && moves(run));
    let names: Vec<&str> = runs
        .iter()
        .filter(|run| is_short(run))
        .map(|run| run.name())
        .collect();
    let (what, all_short) = (list.join(", "), names.len() == runs.len());
    let shorter = format!("shorter than {SHORT_RUN} s: {what}");
    let detail = match (all_short, keep) {
        (true, _) => format!("every run is {shorter}"),
        (_, true) => format!("{shorter}; kept, since nothing moves in the longer runs"),
        _ => format!("{shorter}; left out"),
    };
    let fault = Fault {
        kind: FaultKind::ShortRun,
        run: run_names(&names, runs.len()),
        signal: String::new(),
        detail,
    };
    let long = |run: &Run| all_short || keep || !is_short(run);
    (runs.into_iter().filter(long).collect(), Some(fault))
}

/// Fault of a group of runs; the names are joined when they are not all of them.
pub(crate) fn run_names(names: &[&str], all: usize) -> String {
    if names.len() == all {
        return String::new();
    }
    let shown = |name: &&str| {
        if name.is_empty() {
            "#1".to_owned()
        } else {
            (*name).to_owned()
        }
    };
    names.iter().map(shown).collect::<Vec<_>>().join(", ")
}
