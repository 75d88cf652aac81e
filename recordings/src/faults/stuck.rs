//! Sensors that die in the middle of a run.

use loopsight_model::run::Run;

use super::drive::Drive;
use super::{extent, large, moves};
use crate::fault::{Fault, FaultKind};
use crate::map::{Recording, run_names};

/// A value must stay the same this long, s, to be called stuck,
const LONG: f64 = 1.0;
/// while the drive changes by this share of its large values,
const DRIVE_CHANGE: f64 = 0.4;
/// and another signal by this share of its own.
const OTHER_CHANGE: f64 = 0.4;

pub(crate) fn check(recording: &Recording, inputs: &[&str]) -> Vec<Fault> {
    let runs = &recording.runs;
    let mut found = Vec::new();
    for (s, measured) in recording.measured.iter().enumerate() {
        let drive = Drive::of(measured, inputs);
        let full = large(
            runs.iter()
                .flat_map(|run| (0..run.len()).map(move |k| drive.at(run, k))),
        );
        let others: Vec<(usize, f64)> = (0..recording.measured.len())
            .filter(|o| *o != s)
            .map(|o| (o, large(runs.iter().flat_map(|run| super::signal(run, o)))))
            .collect();
        let mut names = Vec::new();
        let mut first = String::new();
        // A signal that never changes in a run is another fault.
        for run in runs.iter().filter(|run| moves(run, s)) {
            let Some((from, to)) = longest(run, s) else {
                continue;
            };
            let range = |values: &mut dyn Iterator<Item = f64>| {
                extent(values).map_or(0.0, |(low, high)| high - low)
            };
            let driven = range(&mut (from..to).map(|k| drive.at(run, k)));
            let others_move = others.iter().any(|(o, size)| {
                let moved = range(&mut (from..to).map(|k| run.sample(k)[*o]));
                *size > 0.0 && moved > OTHER_CHANGE * size
            });
            let lasts = run.time()[to - 1] - run.time()[from];
            if lasts >= LONG && full > 0.0 && driven > DRIVE_CHANGE * full && others_move {
                if names.is_empty() {
                    first = format!(
                        "stays at {} {} for {lasts:.2} s from t = {:.2} s on, while {} changes by \
                         {driven:.2} and other signals move",
                        run.sample(from)[s],
                        measured.unit,
                        run.time()[from],
                        drive.describe(inputs)
                    );
                }
                names.push(run.name());
            }
        }
        if !names.is_empty() {
            found.push(Fault {
                kind: FaultKind::ConstantSensor,
                run: run_names(&names, runs.len()),
                signal: measured.id.clone(),
                detail: first,
            });
        }
    }
    found
}

/// The longest stretch of one value, as samples `from..to`.
fn longest(run: &Run, s: usize) -> Option<(usize, usize)> {
    let mut best: Option<(usize, usize)> = None;
    let mut from = 0;
    for k in 1..=run.len() {
        if k == run.len() || run.sample(k)[s] != run.sample(from)[s] {
            if best.is_none_or(|(a, b)| {
                run.time()[k - 1] - run.time()[from] > run.time()[b - 1] - run.time()[a]
            }) {
                best = Some((from, k));
            }
            from = k;
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::super::fixture::{drive_log, kinds};
    use super::*;

    #[test]
    fn an_encoder_that_dies_halfway() {
        let log = drive_log(|run, [t, ur, ul, r, l]| {
            [t, ur, ul, r, if run == 0 && t > 2.0 { 0.125 } else { l }]
        });
        assert_eq!(
            kinds(&log),
            [(FaultKind::ConstantSensor, "track_speed_left")]
        );
        let fault = &log.faults[0];
        assert_eq!(fault.run, "a");
        assert!(
            fault.detail.starts_with("stays at 0.125 m/s for "),
            "{fault}"
        );
    }
}
