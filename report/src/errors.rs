//! Where a model's free run errs: by direction of motion, after changes of direction, by run.

use loopsight_diagnosis::{RunTrace, SignalTrace};

/// How long after a change of direction its effect is looked for, s.
pub(crate) const AFTER_CHANGE: f64 = 0.1;

/// Below this share of its root mean square, a speed counts as rest.
const REST: f64 = 0.05;

/// What tells the direction of motion of a signal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Motion {
    /// The sign of a speed.
    Speed,
    /// The sign of a position's rate of change.
    Position,
    /// The sign of some other quantity.
    Sign,
}

impl Motion {
    /// By the signal's unit.
    pub(crate) fn of(unit: &str) -> Self {
        match unit {
            "m" | "rad" | "deg" => Motion::Position,
            _ if unit.ends_with("/s") => Motion::Speed,
            _ => Motion::Sign,
        }
    }
}

/// Mean of the residuals of some samples.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Mean {
    pub(crate) count: usize,
    sum: f64,
}

impl Mean {
    fn add(&mut self, value: f64) {
        self.count += 1;
        self.sum += value;
    }

    pub(crate) fn value(&self) -> f64 {
        self.sum / self.count as f64
    }
}

/// The residuals (measured - free run) of one signal over all runs.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Errors {
    pub(crate) all: Mean,
    pub(crate) forwards: Mean,
    pub(crate) backwards: Mean,
    /// Changes of direction.
    pub(crate) changes: usize,
    /// Share of the squared error within [`AFTER_CHANGE`] after them, and of the samples.
    pub(crate) after_change: f64,
    pub(crate) samples_after_change: f64,
    /// Share of the squared error in each run.
    pub(crate) by_run: Vec<f64>,
}

/// Measured less free run.
pub(crate) fn residual(signal: &SignalTrace) -> Vec<f64> {
    signal
        .measured
        .iter()
        .zip(&signal.free_run)
        .map(|(y, p)| y - p)
        .collect()
}

/// Root mean square of the finite values.
pub(crate) fn rms(values: impl IntoIterator<Item = f64>) -> f64 {
    let (mut n, mut squares) = (0.0, 0.0);
    for value in values.into_iter().filter(|v| v.is_finite()) {
        n += 1.0;
        squares += value * value;
    }
    (squares / n).sqrt()
}

/// The signal `id` of a run.
pub(crate) fn signal<'a>(run: &'a RunTrace, id: &str) -> Option<&'a SignalTrace> {
    run.signals.iter().find(|s| s.id == id)
}

/// The errors of signal `id` over `runs`.
pub(crate) fn errors(runs: &[RunTrace], id: &str) -> Errors {
    let speeds: Vec<Vec<f64>> = runs
        .iter()
        .map(|run| signal(run, id).map_or_else(Vec::new, |s| speed(&run.time, s)))
        .collect();
    let rest = REST * rms(speeds.iter().flatten().copied());
    let mut found = Errors::default();
    let (mut total, mut after, mut samples_after) = (0.0, 0.0, 0.0);
    for (run, speed) in runs.iter().zip(&speeds) {
        let Some(signal) = signal(run, id) else {
            found.by_run.push(0.0);
            continue;
        };
        let changes = changes(speed, rest);
        let mut next = 0;
        let mut in_run = 0.0;
        for (k, (time, residual)) in run.time.iter().zip(residual(signal)).enumerate() {
            while changes.get(next).is_some_and(|c| *c <= k) {
                next += 1;
            }
            if !residual.is_finite() {
                continue;
            }
            found.all.add(residual);
            if speed[k] > rest {
                found.forwards.add(residual);
            } else if speed[k] < -rest {
                found.backwards.add(residual);
            }
            in_run += residual * residual;
            let since = next
                .checked_sub(1)
                .map(|last| time - run.time[changes[last]]);
            if since.is_some_and(|s| s < AFTER_CHANGE * (1.0 + 1e-9)) {
                after += residual * residual;
                samples_after += 1.0;
            }
        }
        found.changes += changes.len();
        found.by_run.push(in_run);
        total += in_run;
    }
    found.after_change = after / total;
    found.samples_after_change = samples_after / found.all.count as f64;
    found.by_run.iter_mut().for_each(|e| *e /= total);
    found
}

/// What tells the direction, sample by sample and as long as `time`.
fn speed(time: &[f64], signal: &SignalTrace) -> Vec<f64> {
    let value = |k: usize| signal.measured.get(k).copied().unwrap_or(f64::NAN);
    if Motion::of(&signal.unit) != Motion::Position {
        return (0..time.len()).map(value).collect();
    }
    // Over two samples to either side: quantised positions stand still in between.
    let last = time.len().saturating_sub(1);
    (0..time.len())
        .map(|k| {
            let (from, to) = (k.saturating_sub(2), (k + 2).min(last));
            (value(to) - value(from)) / (time[to] - time[from])
        })
        .collect()
}

/// The samples at which the direction turns out to have changed, without those that noise around
/// rest makes: a direction counts once `speed` leaves ±`rest`, from where it left zero.
fn changes(speed: &[f64], rest: f64) -> Vec<usize> {
    let mut changes = Vec::new();
    let mut direction = 0.0;
    for (k, value) in speed.iter().enumerate() {
        if value.abs() > rest && value.signum() != direction {
            if direction != 0.0 {
                let back = speed[..k]
                    .iter()
                    .rev()
                    .take_while(|v| **v * value > 0.0)
                    .count();
                changes.push(k - back);
            }
            direction = value.signum();
        }
    }
    changes
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(unit: &str, measured: &[f64], free_run: &[f64]) -> RunTrace {
        RunTrace {
            name: "r".into(),
            time: (0..measured.len()).map(|k| 0.05 * k as f64).collect(),
            inputs: Vec::new(),
            signals: vec![SignalTrace {
                id: "v".into(),
                unit: unit.into(),
                measured: measured.to_vec(),
                free_run: free_run.to_vec(),
                one_step: Vec::new(),
            }],
            initial_state: Vec::new(),
        }
    }

    #[test]
    fn friction_shows_by_direction() {
        let measured = [1.0, 1.0, f64::NAN, 1.0, 0.0, -1.0, -1.0, -1.0, -1.0];
        let free = [1.1, 1.1, 9.0, 1.1, 0.0, -1.2, -1.2, -1.2, -1.2];
        let e = errors(&[run("m/s", &measured, &free)], "v");
        assert_eq!(
            (e.all.count, e.forwards.count, e.backwards.count),
            (8, 3, 4)
        );
        assert!((e.forwards.value() + 0.1).abs() < 1e-12);
        assert!((e.backwards.value() - 0.2).abs() < 1e-12);
        // The change is at sample 5; samples 5 to 7 lie within 0.1 s of it.
        assert_eq!(e.changes, 1);
        assert!((e.after_change - 3.0 * 0.04 / (4.0 * 0.04 + 3.0 * 0.01)).abs() < 1e-9);
        assert!((e.samples_after_change - 3.0 / 8.0).abs() < 1e-12);
    }

    #[test]
    fn noise_around_rest_changes_no_direction() {
        assert_eq!(
            changes(&[1.0, 0.01, -0.01, 0.01, 1.0], 0.05),
            Vec::<usize>::new()
        );
        assert_eq!(
            changes(&[1.0, 0.01, -0.01, -0.02, -1.0, f64::NAN, 0.5], 0.05),
            [2, 6]
        );
        assert_eq!(changes(&[0.0, 0.0], 0.0), Vec::<usize>::new());
        assert_eq!(changes(&[], f64::NAN), Vec::<usize>::new());
    }

    #[test]
    fn a_position_turns_where_its_rate_changes_sign() {
        let up_and_down: Vec<f64> = (0..40).map(|k| 1.0 - (f64::from(k) - 20.0).abs()).collect();
        let e = errors(&[run("rad", &up_and_down, &[0.0; 40])], "v");
        assert_eq!(e.changes, 1);
        assert!(e.forwards.count >= 18 && e.backwards.count >= 17, "{e:?}");
    }

    #[test]
    fn runs_share_the_error() {
        let runs = [
            run("V", &[1.0, 1.0], &[0.0, 0.0]),
            run("V", &[1.0, 1.0], &[1.0, 0.0]),
        ];
        let e = errors(&runs, "v");
        assert!((e.by_run[0] - 2.0 / 3.0).abs() < 1e-12 && (e.by_run[1] - 1.0 / 3.0).abs() < 1e-12);
    }

    #[test]
    fn nothing_measured_is_no_panic() {
        assert_eq!(errors(&[], "v").all.count, 0);
        assert_eq!(errors(&[run("m", &[], &[])], "v").all.count, 0);
        let empty = errors(&[run("m/s", &[f64::NAN], &[])], "w");
        assert_eq!((empty.all.count, empty.changes), (0, 0));
    }
}
