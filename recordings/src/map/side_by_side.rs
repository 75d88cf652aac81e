//! Experiments in columns beside each other: each is mapped by itself, and is a run, or several.

use loopsight_core::Signal;
use loopsight_model::log_map::LogMap;

use super::{Mapped, one};
use crate::error::RecordingError;
use crate::fault::Fault;
use crate::plan::Plan;
use crate::source::Source;
use crate::table::{Table, TableRun};

/// The runs of all experiments, with the table and the plan of the first.
pub(super) fn all<'s>(
    source: &'s Source,
    inputs: &[Signal],
    signals: &[Signal],
    map: &LogMap,
) -> Result<Mapped<'s>, RecordingError> {
    if !map.names_experiments() {
        let count = map.side_by_side.names().len();
        return Err(RecordingError::NoExperiments { count });
    }
    let mut whole: Option<Mapped<'s>> = None;
    let mut faults: Vec<(String, Fault)> = Vec::new();
    for (label, map) in map.experiments() {
        let (recording, table, plan) = one(source, inputs, signals, &map, Some(label))?;
        let own = recording.faults.iter().cloned();
        faults.extend(own.map(|fault| (label.to_owned(), fault)));
        match &mut whole {
            Some((all, _, _)) => all.runs.extend(recording.runs),
            None => {
                let table = std::borrow::Cow::Owned(table.into_owned());
                whole = Some((recording, table, plan));
            }
        }
    }
    let count = map.side_by_side.names().len();
    let Some((mut recording, table, plan)) = whole else {
        return Err(RecordingError::NoExperiments { count });
    };
    recording.faults = together(faults, count);
    Ok((recording, table, plan))
}

/// What all experiments have is said once, of the log as a whole; else it is said of the experiment.
fn together(faults: Vec<(String, Fault)>, count: usize) -> Vec<Fault> {
    let mut out: Vec<Fault> = Vec::new();
    for (label, fault) in &faults {
        let same = |other: &&(String, Fault)| {
            (other.1.kind, &other.1.signal, &other.1.run) == (fault.kind, &fault.signal, &fault.run)
        };
        let mut fault = fault.clone();
        if fault.run.is_empty() {
            let alike: Vec<_> = faults.iter().filter(same).collect();
            if alike.len() < count {
                fault.run.clone_from(label);
            } else if alike.first().is_some_and(|(first, _)| first != label) {
                continue;
            } else if alike.iter().any(|(_, other)| other.detail != fault.detail) {
                fault
                    .detail
                    .push_str(&format!("; so it is in each of {count} experiments"));
            }
        }
        out.push(fault);
    }
    out
}

/// The runs of an experiment have its label, and begin and end where one of its columns has a value.
pub(super) fn cut(table: &Table, plan: &Plan, runs: &mut Vec<TableRun>, label: &str) {
    let measured = plan.measured.iter().map(|(link, _)| link.column);
    let columns: Vec<usize> = plan.input_columns().chain(measured).collect();
    let width = table.columns.len().max(1);
    for run in runs.iter_mut() {
        let there = |row: &[f64]| {
            let value = columns.iter().any(|column| !row[*column].is_nan());
            value && !row[plan.time.column].is_nan()
        };
        let first = table.rows(run).position(there).unwrap_or(0);
        let last = table.rows(run).rposition(there).map_or(first, |at| at + 1);
        *run = run.part(first..last, width);
        run.name = format!("{label} {}", run.name).trim().to_owned();
    }
    runs.retain(|run| !run.rows.is_empty());
}
