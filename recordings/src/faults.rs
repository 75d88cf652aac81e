//! Faults that show in the numbers themselves. Each check says what it saw, with figures; the
//! thresholds are constants beside it.

mod drive;
mod rate;
mod sign;
mod spikes;
mod still;
mod stuck;

use loopsight_model::run::Run;

use crate::fault::{Fault, FaultKind};
use crate::map::Recording;
use crate::plan::Plan;
use crate::table::Table;
pub(crate) use spikes::take_out as take_out_spikes;

/// All checks, on the mapped recording and on the columns of the file.
pub(crate) fn check(
    recording: &Recording,
    inputs: &[&str],
    table: &Table,
    plan: &Plan,
) -> Vec<Fault> {
    let mut found = Vec::new();
    found.extend(irregular_time(recording));
    let still = still::check(recording, inputs);
    let motionless = still
        .iter()
        .any(|f| f.kind == FaultKind::Motionless && f.run.is_empty());
    found.extend(still);
    if !motionless {
        found.extend(stuck::check(recording, inputs));
        found.extend(sign::check(recording, inputs));
    }
    found.extend(rate::check(table, plan));
    found
}

/// Jitter is reported from this spread of the time steps: between the 1 % and the 99 % quantile, relative to the
/// median.
const IRREGULAR: f64 = 0.1;

fn irregular_time(recording: &Recording) -> Option<Fault> {
    let mut steps: Vec<f64> = recording
        .runs
        .iter()
        .flat_map(|run| run.time().windows(2).map(|w| w[1] - w[0]))
        .collect();
    steps.sort_unstable_by(f64::total_cmp);
    let [min, low, median, high, max] = [0.0, 0.01, 0.5, 0.99, 1.0].map(|q| quantile(&steps, q));
    if (high - low) <= IRREGULAR * median || steps.is_empty() {
        return None;
    }
    let [min, low, median, high, max] = [min, low, median, high, max].map(|s| s * 1e3);
    Some(Fault {
        kind: FaultKind::IrregularTime,
        run: String::new(),
        signal: "time".into(),
        detail: format!(
            "the time steps are {median:.3} ms in the median, 98 % of them from {low:.3} to \
             {high:.3} ms, all from {min:.3} to {max:.3} ms; the time stamps are used as they are"
        ),
    })
}

/// Quantile of sorted values; 0 without any.
fn quantile(sorted: &[f64], q: f64) -> f64 {
    let last = sorted.len().saturating_sub(1) as f64;
    sorted
        .get((q * last).round() as usize)
        .copied()
        .unwrap_or(0.0)
}

/// The magnitude that 98 % of the values do not exceed: a maximum that ignores outliers.
pub(crate) fn large(values: impl Iterator<Item = f64>) -> f64 {
    let mut magnitudes: Vec<f64> = values.map(f64::abs).filter(|v| v.is_finite()).collect();
    magnitudes.sort_unstable_by(f64::total_cmp);
    quantile(&magnitudes, 0.98)
}

/// Smallest and largest of the values that are there.
fn extent(values: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    values
        .filter(|v| !v.is_nan())
        .fold(None, |extent, v| match extent {
            None => Some((v, v)),
            Some((low, high)) => Some((v.min(low), v.max(high))),
        })
}

/// One measured signal of a run.
fn signal(run: &Run, s: usize) -> impl Iterator<Item = f64> + '_ {
    (0..run.len()).map(move |k| run.sample(k)[s])
}

/// True when a measured signal of a run has two different values.
pub(crate) fn moves(run: &Run, s: usize) -> bool {
    extent(signal(run, s)).is_some_and(|(low, high)| high > low)
}

#[cfg(test)]
mod fixture;
