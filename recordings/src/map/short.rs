//! Runs that are too short to say anything.

use loopsight_model::run::Run;

use crate::fault::{Fault, FaultKind};
use crate::faults;
use crate::segment::SHORT_RUN;

/// Samples that say something of a run however short it is, where it is an experiment of its own and not what a gap left of
/// one: those of a second at 100 1/s. An arm that is driven at full voltage is at its other end in half a second.
const SAMPLES: usize = 100;

/// Samples with which a run is not short, whatever its duration: those of a second at 1000 1/s. Who samples faster has a machine that
/// is done sooner, as a converter of voltages is.
const FAST: usize = 1000;

/// Leaves out the short runs where the others are enough.
pub(super) fn without_short_runs(runs: Vec<Run>) -> (Vec<Run>, Option<Fault>) {
    let is_short = |run: &Run| run.duration() < SHORT_RUN && run.len() < FAST;
    let says_enough = |run: &Run| {
        let experiment = !run.name().is_empty() && !run.name().contains('#');
        experiment && run.len() >= SAMPLES
    };
    let list = |of: &dyn Fn(&Run) -> bool| {
        let listed = (runs.iter().enumerate()).filter(|(_, run)| is_short(run) && of(run));
        let shown = listed.map(|(i, run)| match run.name() {
            "" if runs.len() == 1 => format!("{:.2} s", run.duration()),
            "" => format!("run {} {:.2} s", i + 1, run.duration()),
            name => format!("`{name}` {:.2} s", run.duration()),
        });
        shown.collect::<Vec<_>>().join(", ")
    };
    let all = list(&|_| true);
    if all.is_empty() {
        return (runs, None);
    }
    let moves = |run: &Run| (0..run.n_measured()).any(|s| faults::moves(run, s));
    let enough = (runs.iter()).any(|run| (!is_short(run) || says_enough(run)) && moves(run));
    let keep = !enough && runs.iter().any(|run| is_short(run) && moves(run));
    let short = runs.iter().filter(|run| is_short(run));
    let names: Vec<&str> = short.map(Run::name).collect();
    let all_short = names.len() == runs.len();
    let shorter = format!("shorter than {SHORT_RUN} s");
    let detail = match (all_short, keep) {
        (true, _) => format!("every run is {shorter}: {all}"),
        (_, true) => format!("{shorter}: {all}; kept, since nothing moves in the longer runs"),
        _ => {
            let out = list(&|run| !says_enough(run));
            let kept = list(&says_enough);
            let of = |list: &str, what: &str| (!list.is_empty()).then(|| format!("{list}; {what}"));
            let parts = [
                of(&out, "left out"),
                of(&kept, &format!("kept for their {SAMPLES} samples and more")),
            ];
            let parts: Vec<String> = parts.into_iter().flatten().collect();
            format!("{shorter}: {}", parts.join("; "))
        }
    };
    let fault = Fault {
        kind: FaultKind::ShortRun,
        run: run_names(&names, runs.len()),
        signal: String::new(),
        detail,
    };
    let long = |run: &Run| all_short || keep || !is_short(run) || says_enough(run);
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
