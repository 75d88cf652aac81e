//! Inputs of a table that were logged at times of their own: empty where another column has a value.

use crate::plan::Plan;
use crate::table::{Table, TableRun};

/// A column without a value in more than one row of so many has times of its own; with fewer, samples are lost.
const OWN_TIMES: usize = 3;
/// Values that such a column has at least.
const VALUES: usize = 3;

/// The columns of inputs and of the run's number that have times of their own.
pub(super) fn wanted(table: &Table, plan: &Plan) -> Vec<usize> {
    let mut columns: Vec<usize> = plan.input_columns().chain(plan.run).collect();
    columns.sort_unstable();
    columns.dedup();
    let all: usize = table.runs.iter().map(|run| table.rows(run).len()).sum();
    columns.retain(|column| {
        let rows = table.runs.iter().flat_map(|run| table.rows(run));
        let missing = rows.filter(|row| row[*column].is_nan()).count();
        missing + VALUES <= all && OWN_TIMES * missing > all
    });
    columns
}

/// Each of these columns has its last value where it has none.
pub(super) fn hold(table: &mut Table, columns: &[usize]) {
    let width = table.columns.len().max(1);
    for run in &mut table.runs {
        let mut now = vec![f64::NAN; columns.len()];
        for row in run.rows.chunks_exact_mut(width) {
            for (now, column) in now.iter_mut().zip(columns) {
                match row[*column].is_nan() {
                    true => row[*column] = *now,
                    false => *now = row[*column],
                }
            }
        }
    }
}

/// The rows from which on all of these columns have a value.
pub(super) fn without_unknown(
    table: &Table,
    runs: &[TableRun],
    columns: &[usize],
) -> Vec<TableRun> {
    let width = table.columns.len().max(1);
    let from_first = |run: &TableRun| {
        let known = |row: &[f64]| columns.iter().all(|column| !row[*column].is_nan());
        let count = run.rows.len() / width;
        let first = table.rows(run).position(known).unwrap_or(count);
        run.part(first..count, width)
    };
    runs.iter().map(from_first).collect()
}
