//! Measurements of the signals of a model.

use std::ops::Range;
use std::sync::Arc;

use crate::simulate::StateObserver;

/// A table of numbers, row by row, one row per sample.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Rows {
    /// Numbers in a row; rows without any are possible.
    pub width: usize,
    /// All rows, one behind the other.
    pub values: Vec<f64>,
}

impl Rows {
    /// Rows of `width` numbers each.
    pub fn new(width: usize, values: Vec<f64>) -> Self {
        Self { width, values }
    }

    /// Row `k`; empty where there is none.
    pub fn row(&self, k: usize) -> &[f64] {
        let range = || Some(k.checked_mul(self.width)?..k.checked_add(1)?.checked_mul(self.width)?);
        range()
            .and_then(|range| self.values.get(range))
            .unwrap_or(&[])
    }

    /// Whether these are `n` whole rows.
    fn are(&self, n: usize) -> bool {
        n.checked_mul(self.width) == Some(self.values.len())
    }
}

/// Why measurements do not form a run.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RunError {
    /// A time stamp is NaN or infinite.
    #[error("the time of sample {sample} is {time} s, expected a finite number")]
    Time {
        /// Index of the sample.
        sample: usize,
        /// Its time stamp, s.
        time: f64,
    },
    /// A time stamp is not later than the one before.
    #[error("{before} s is followed by {time} s at sample {sample}, expected times that increase")]
    Order {
        /// Index of the sample.
        sample: usize,
        /// The time stamp before, s.
        before: f64,
        /// Its time stamp, s.
        time: f64,
    },
    /// The table of the inputs has not one row per sample.
    #[error("{found} values of inputs, expected {samples} samples of {width}")]
    Inputs {
        /// Samples by their time stamps.
        samples: usize,
        /// Number of inputs.
        width: usize,
        /// Values in the table.
        found: usize,
    },
    /// The table of the measured signals has not one row per sample.
    #[error("{found} measured values, expected {samples} samples of {width}")]
    Measured {
        /// Samples by their time stamps.
        samples: usize,
        /// Number of measured signals.
        width: usize,
        /// Values in the table.
        found: usize,
    },
}

/// One uninterrupted run: what was applied and what was measured, in SI units.
///
/// The `k`-th row of the measured signals was taken at the `k`-th time stamp. The `k`-th row of the
/// inputs was applied from there to the next time stamp, or, where the model's
/// [`LogMap`](crate::log_map::LogMap) says first-order hold, on a straight line to the next row. A
/// measured value that is missing is NaN.
///
/// A run is consistent: its time stamps are finite and increase strictly, and both tables have one row
/// per time stamp. Time stamps need not be equidistant.
///
/// ```
/// use loopsight_model::run::{Rows, Run, RunError};
///
/// let inputs = Rows::new(1, vec![6.0, 6.0, 0.0]);
/// let measured = Rows::new(2, vec![0.0, 0.0, 0.1, 0.0, 0.2, f64::NAN]);
/// let run = Run::new("slow", vec![0.0, 0.01, 0.02], inputs, measured)?;
/// assert_eq!(run.sample(1), [0.1, 0.0]);
///
/// let back = Run::new("", vec![0.0, -1.0], Rows::default(), Rows::default());
/// assert!(matches!(back, Err(RunError::Order { sample: 1, .. })));
/// # Ok::<(), RunError>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Run {
    name: String,
    time: Vec<f64>,
    inputs: Rows,
    measured: Rows,
    observer: Option<Arc<StateObserver>>,
}

impl Run {
    /// A run of these measurements; `name` is empty where a log holds one run only.
    ///
    /// # Errors
    ///
    /// Where a time stamp is not finite or not later than the one before, or where a table has not one
    /// row per time stamp.
    pub fn new(
        name: impl Into<String>,
        time: Vec<f64>,
        inputs: Rows,
        measured: Rows,
    ) -> Result<Self, RunError> {
        let mut before = None;
        for (sample, time) in time.iter().enumerate() {
            follows(before, sample, *time)?;
            before = Some(*time);
        }
        let samples = time.len();
        check_inputs(&inputs, samples)?;
        check_measured(&measured, samples)?;
        Ok(Self {
            name: name.into(),
            time,
            inputs,
            measured,
            observer: None,
        })
    }

    /// A run without samples, to be filled by [`Run::push`].
    pub fn empty(n_inputs: usize, n_measured: usize) -> Self {
        Self {
            inputs: Rows::new(n_inputs, Vec::new()),
            measured: Rows::new(n_measured, Vec::new()),
            ..Self::default()
        }
    }

    /// Adds a sample.
    ///
    /// # Errors
    ///
    /// Where `time` (s) is not finite or not later than the last one, or where a row has another number
    /// of values than those before. The run is then as it was.
    pub fn push(&mut self, time: f64, input: &[f64], measured: &[f64]) -> Result<(), RunError> {
        follows(self.time.last().copied(), self.time.len(), time)?;
        let row = |width: usize, values: &[f64]| Rows::new(width, values.to_vec());
        check_inputs(&row(self.inputs.width, input), 1)?;
        check_measured(&row(self.measured.width, measured), 1)?;
        self.time.push(time);
        self.inputs.values.extend_from_slice(input);
        self.measured.values.extend_from_slice(measured);
        Ok(())
    }

    /// The run under another name.
    #[must_use]
    pub fn named(mut self, name: impl Into<String>) -> Self {
        self.name = name.into();
        self
    }

    /// The run with other inputs, row by row.
    ///
    /// # Errors
    ///
    /// Where these are not as many values as before.
    pub fn with_inputs(mut self, inputs: Vec<f64>) -> Result<Self, RunError> {
        self.inputs.values = inputs;
        check_inputs(&self.inputs, self.time.len())?;
        Ok(self)
    }

    /// The run with other measured values, row by row.
    ///
    /// # Errors
    ///
    /// Where these are not as many values as before.
    pub fn with_measured(mut self, measured: Vec<f64>) -> Result<Self, RunError> {
        self.measured.values = measured;
        check_measured(&self.measured, self.time.len())?;
        Ok(self)
    }

    /// The run, whose free runs an observer corrects by what was measured.
    #[must_use]
    pub fn with_observer(mut self, observer: StateObserver) -> Self {
        self.observer = Some(Arc::new(observer));
        self
    }

    /// Name, e.g. `slow-forward`; empty where the log holds one run only.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Time stamps, s.
    pub fn time(&self) -> &[f64] {
        &self.time
    }

    /// Inputs, row by row, in the order of the model's inputs.
    pub fn inputs(&self) -> &[f64] {
        &self.inputs.values
    }

    /// Measured signals, row by row, in the order of the model's measured signals; NaN: missing.
    pub fn measured(&self) -> &[f64] {
        &self.measured.values
    }

    /// Number of inputs.
    pub fn n_inputs(&self) -> usize {
        self.inputs.width
    }

    /// Number of measured signals.
    pub fn n_measured(&self) -> usize {
        self.measured.width
    }

    /// What corrects free runs by the measurements, where the model needs it.
    pub fn observer(&self) -> Option<&StateObserver> {
        self.observer.as_deref()
    }

    /// Number of samples.
    pub fn len(&self) -> usize {
        self.time.len()
    }

    /// True without any sample.
    pub fn is_empty(&self) -> bool {
        self.time.is_empty()
    }

    /// From the first to the last time stamp, s.
    pub fn duration(&self) -> f64 {
        match (self.time.first(), self.time.last()) {
            (Some(first), Some(last)) => last - first,
            _ => 0.0,
        }
    }

    /// Inputs applied from the `k`-th time stamp on; empty beyond the last.
    pub fn input(&self, k: usize) -> &[f64] {
        self.inputs.row(k)
    }

    /// What was measured at the `k`-th time stamp; empty beyond the last.
    pub fn sample(&self, k: usize) -> &[f64] {
        self.measured.row(k)
    }

    /// The samples `range` that the run has, as a run of their own.
    pub fn part(&self, range: Range<usize>) -> Run {
        let end = range.end.min(self.len());
        let range = range.start.min(end)..end;
        let rows = |of: &Rows| {
            let values = &of.values[range.start * of.width..range.end * of.width];
            Rows::new(of.width, values.to_vec())
        };
        Run {
            name: self.name.clone(),
            time: self.time[range.clone()].to_vec(),
            inputs: rows(&self.inputs),
            measured: rows(&self.measured),
            observer: self
                .observer
                .as_ref()
                .map(|observer| Arc::new(observer.part(range))),
        }
    }

    /// Median distance of the time stamps, s; NaN with fewer than two samples.
    pub fn median_period(&self) -> f64 {
        let mut steps: Vec<f64> = self.time.windows(2).map(|w| w[1] - w[0]).collect();
        if steps.is_empty() {
            return f64::NAN;
        }
        let middle = steps.len() / 2;
        *steps.select_nth_unstable_by(middle, f64::total_cmp).1
    }
}

/// The shortest usual time between samples among some runs, s.
pub fn shortest_period(runs: &[Run]) -> f64 {
    let periods = runs.iter().map(Run::median_period);
    periods.fold(f64::INFINITY, f64::min)
}

/// Whether `time` can be the time stamp of a sample behind `before`.
fn follows(before: Option<f64>, sample: usize, time: f64) -> Result<(), RunError> {
    if !time.is_finite() {
        return Err(RunError::Time { sample, time });
    }
    match before {
        Some(before) if time <= before => Err(RunError::Order {
            sample,
            before,
            time,
        }),
        _ => Ok(()),
    }
}

fn check_inputs(rows: &Rows, samples: usize) -> Result<(), RunError> {
    let (width, found) = (rows.width, rows.values.len());
    let error = RunError::Inputs {
        samples,
        width,
        found,
    };
    if rows.are(samples) {
        Ok(())
    } else {
        Err(error)
    }
}

fn check_measured(rows: &Rows, samples: usize) -> Result<(), RunError> {
    let (width, found) = (rows.width, rows.values.len());
    let error = RunError::Measured {
        samples,
        width,
        found,
    };
    if rows.are(samples) {
        Ok(())
    } else {
        Err(error)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Numbers that a log may hold, those that no time stamp can be among them.
    fn number() -> impl Strategy<Value = f64> {
        prop_oneof![
            8 => -1e3..1e3f64,
            1 => Just(f64::NAN),
            1 => Just(f64::INFINITY),
        ]
    }

    fn rows() -> impl Strategy<Value = Rows> {
        (0..3usize, prop::collection::vec(number(), 0..8)).prop_map(|(w, v)| Rows::new(w, v))
    }

    fn consistent(run: &Run) -> bool {
        run.time.iter().all(|t| t.is_finite())
            && run.time.windows(2).all(|w| w[0] < w[1])
            && run.inputs().len() == run.len() * run.n_inputs()
            && run.measured().len() == run.len() * run.n_measured()
    }

    proptest! {
        #[test]
        fn a_run_that_exists_is_consistent(
            time in prop::collection::vec(number(), 0..5),
            sorted in any::<bool>(),
            inputs in rows(),
            measured in rows(),
        ) {
            let mut time = time;
            if sorted {
                time.sort_by(f64::total_cmp);
            }
            let expected = Run {
                name: "any".into(),
                time: time.clone(),
                inputs: inputs.clone(),
                measured: measured.clone(),
                observer: None,
            };
            match Run::new("any", time, inputs, measured) {
                Ok(run) => prop_assert!(consistent(&run) && run.name() == "any"),
                Err(_) => prop_assert!(!consistent(&expected)),
            }
        }

        #[test]
        fn a_part_is_what_the_run_has_there(
            n in 0..6usize,
            width in 0..3usize,
            start in any::<usize>().prop_map(|i| i % 9),
            end in prop_oneof![0..9usize, Just(usize::MAX)],
        ) {
            let mut run = Run::empty(width, 1);
            for k in 0..n {
                run.push(k as f64, &vec![k as f64; width], &[-(k as f64)]).unwrap();
            }
            let part = run.part(start..end);
            prop_assert!(consistent(&part));
            for k in 0..part.len() {
                prop_assert_eq!(part.input(k), run.input(start + k));
                prop_assert_eq!(part.sample(k), run.sample(start + k));
            }
            prop_assert_eq!(part.len(), n.min(end).saturating_sub(start));
            prop_assert!(run.sample(usize::MAX).is_empty() && run.input(n).is_empty());
        }

        #[test]
        fn pushing_makes_what_new_makes(
            samples in prop::collection::vec((number(), number()), 0..6),
        ) {
            let mut run = Run::empty(0, 1);
            let mut kept = Vec::new();
            for (time, value) in samples {
                let before = run.clone();
                match run.push(time, &[], &[value]) {
                    Ok(()) => kept.push((time, value)),
                    Err(_) => prop_assert_eq!(run.len(), before.len()),
                }
            }
            let (time, values): (Vec<f64>, Vec<f64>) = kept.into_iter().unzip();
            let at_once = Run::new("", time, Rows::default(), Rows::new(1, values)).unwrap();
            prop_assert_eq!(run.time(), at_once.time());
            prop_assert_eq!(run.measured().len(), at_once.measured().len());
        }
    }
}
