//! Time stamps: which rows can be used, and where one run ends and the next begins.

use std::collections::BTreeMap;

use crate::median::median;
use crate::table::RunRows;

/// A jump back by more than this many periods is the start of another run, appended to the file.
pub(crate) const NEW_RUN_PERIODS: f64 = 10.0;
/// A step of more than this many periods, and of more than [`GAP_TIME`], is a gap; so is a shorter one across which
/// the inputs are [forgotten](Inputs::forgotten).
pub(crate) const GAP_PERIODS: f64 = 10.0;
/// See [`GAP_PERIODS`]; s.
pub(crate) const GAP_TIME: f64 = 0.5;
/// Runs shorter than this, s, are left out. Nothing is left out because of a gap that is shorter than [`GAP_TIME`]: the
/// parts on either side of it are no shorter.
pub(crate) const SHORT_RUN: f64 = 1.0;
/// Correlation of an input with itself across a gap, below which what it was before says less about it than its
/// mean does: `1 - ρ` of its variance is unknown at the end of the gap, more than half.
const FORGOTTEN: f64 = 0.5;

/// What was done about the time stamps of a run.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Segments {
    /// Rows to keep, part by part.
    pub(crate) parts: Vec<Vec<usize>>,
    /// Rows that repeat the time stamp before, or differ from it by less than a time since the
    /// part's beginning can tell.
    pub(crate) duplicates: Vec<usize>,
    /// Rows whose time stamp lies before the one before.
    pub(crate) backwards: Vec<usize>,
    /// First rows of runs that begin with a jump back.
    pub(crate) restarts: Vec<usize>,
    /// Rows behind a gap, and its length, s.
    pub(crate) gaps: Vec<(usize, f64)>,
}

/// The inputs of the rows of a run.
pub(crate) struct Inputs<'r> {
    rows: RunRows<'r>,
    columns: Vec<usize>,
}

impl<'r> Inputs<'r> {
    /// Those in some `columns`.
    pub(crate) fn new(rows: RunRows<'r>, columns: Vec<usize>) -> Self {
        Self { rows, columns }
    }

    /// Whether an input is another one after so many `rows`, by its autocorrelation
    /// `ρ = 1 - mean (u(k + rows) - u(k))²/(2 σ²)`. Where rows were lost for that long, nobody knows
    /// what the machine was told.
    fn forgotten(&self, rows: usize) -> bool {
        self.columns.iter().any(|column| {
            let values = self.rows.iter().map(|row| row[*column]);
            let n = self.rows.len() as f64;
            let mean = values.clone().sum::<f64>() / n;
            let variance = values.clone().map(|u| (u - mean).powi(2)).sum::<f64>() / n;
            let later = values.clone().skip(rows);
            let pairs = self.rows.len().saturating_sub(rows) as f64;
            let change = values.zip(later).map(|(u, v)| (v - u).powi(2)).sum::<f64>() / pairs;
            1.0 - 0.5 * change / variance < FORGOTTEN
        })
    }
}

/// Cuts the rows of a run, from `first` on, where their time stamps, in seconds, jump, and where so many rows are missing
/// that the `inputs` between them are not known.
pub(crate) fn segment(first: usize, times: &[f64], inputs: &Inputs<'_>) -> Segments {
    let mut steps: Vec<f64> = times
        .windows(2)
        .map(|w| w[1] - w[0])
        .filter(|step| *step > 0.0)
        .collect();
    let period = median(&mut steps);
    drop(steps);
    let gap = GAP_TIME.max(GAP_PERIODS * period);
    let mut out = Segments::default();
    let mut part: Vec<usize> = Vec::new();
    let (mut origin, mut last) = (f64::NAN, f64::NAN);
    let end = times.last().copied().unwrap_or(f64::NAN);
    // By the number of rows that are missing: there are no more such numbers than rows in `GAP_TIME`.
    let mut forgotten = BTreeMap::new();
    for (row, &time) in (first..).zip(times) {
        let step = time - last;
        if part.is_empty() {
            origin = time;
        } else {
            if step >= 0.0 && time - origin == last - origin {
                out.duplicates.push(row);
                continue;
            }
            let restart = step < -NEW_RUN_PERIODS * period;
            if step < 0.0 && !restart {
                out.backwards.push(row);
                continue;
            }
            let mut lost = || {
                let rows = (step / period) as usize;
                step > GAP_PERIODS * period
                    && (last - origin).min(end - time) >= SHORT_RUN
                    && *forgotten
                        .entry(rows)
                        .or_insert_with(|| inputs.forgotten(rows))
            };
            if restart || step > gap || lost() {
                if restart {
                    out.restarts.push(row);
                } else {
                    out.gaps.push((row, step));
                }
                out.parts.push(std::mem::take(&mut part));
                origin = time;
            }
        }
        part.push(row);
        last = time;
    }
    if !part.is_empty() {
        out.parts.push(part);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn with_input(times: &[f64], input: impl Fn(f64) -> f64) -> Segments {
        let rows: Vec<f64> = times.iter().map(|t| input(*t)).collect();
        segment(0, times, &Inputs::new(RunRows::new(&rows, 1), vec![0]))
    }

    fn of(times: &[f64]) -> Segments {
        with_input(times, |_| 0.0)
    }

    #[test]
    fn lost_rows_cut_where_the_inputs_are_not_known() {
        let lost = |time: &f64| !(2.0..2.3).contains(time);
        let times: Vec<f64> = (0..400).map(|k| 0.01 * f64::from(k)).filter(lost).collect();
        let lengths = |period: f64| -> Vec<usize> {
            let out = with_input(&times, |t| (t / period).floor() % 2.0);
            out.parts.iter().map(Vec::len).collect()
        };
        assert_eq!(lengths(0.2), [200, 170]);
        assert_eq!(lengths(2.0), [370], "an input that stays for longer");
    }

    fn every_tenth(from: f64, n: usize) -> Vec<f64> {
        (0..n).map(|k| from + 0.1 * k as f64).collect()
    }

    #[test]
    fn even_time_stamps_are_one_part() {
        let out = of(&every_tenth(5.0, 20));
        assert_eq!(out.parts, [(0..20).collect::<Vec<_>>()]);
        assert_eq!(of(&[]).parts, Vec::<Vec<usize>>::new());
    }

    #[test]
    fn duplicates_and_small_steps_back_are_dropped() {
        let mut times = every_tenth(0.0, 20);
        times[5] = times[4];
        times[10] = times[9] - 0.05;
        let out = of(&times);
        assert_eq!((out.duplicates, out.backwards), (vec![5], vec![10]));
        assert_eq!(out.parts.len(), 1);
        assert_eq!(out.parts[0].len(), 18);
    }

    #[test]
    fn stamps_that_are_one_once_the_first_is_subtracted_are_duplicates() {
        let out = of(&[0.0, -3e-81, -8e-213, -0.0, 0.1, 0.2]);
        assert_eq!(out.restarts, [] as [usize; 0]);
        let out = of(&[0.0, 1e-156, -3e-81, -8e-213, -0.0]);
        assert_eq!((out.restarts, out.duplicates), (vec![2], vec![4]));
        assert_eq!(out.parts, [vec![0, 1], vec![2, 3]]);
    }

    #[test]
    fn large_steps_start_a_new_part() {
        let mut times = every_tenth(0.0, 50);
        times.extend(every_tenth(0.0, 50));
        times.extend(every_tenth(7.0, 50));
        let out = of(&times);
        assert_eq!(out.restarts, [50]);
        assert_eq!(out.gaps.len(), 1);
        assert_eq!(out.gaps[0].0, 100);
        assert_eq!(
            out.parts.iter().map(Vec::len).collect::<Vec<_>>(),
            [50, 50, 50]
        );
    }
}
