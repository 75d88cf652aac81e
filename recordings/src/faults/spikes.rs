//! Single readings that no machine could have made.

use loopsight_model::run::Run;

use super::signal;
use crate::fault::{Fault, FaultKind};
use crate::map::Recording;
use crate::median::median;

/// How far a reading must be from the mean of its neighbours, over what is usual for that signal.
const FAR: f64 = 12.0;
/// How far its neighbours may be from each other, over that distance: one that is followed by others of
/// its kind is a motion.
const BETWEEN: f64 = 0.25;
/// Share of the readings from which they are no accident, but how the sensor is.
const ACCIDENTS: f64 = 0.05;

/// Readings that may be absurd side by side: where one reading in a hundred is, two are next to each other in every
/// log of some length; three in one of a million readings.
const TOGETHER: usize = 2;

/// Takes single absurd readings out of the measured signals: they count as missing, and one fault for each
/// signal says how many.
///
/// A reading `y(k)` is absurd where it stands alone: with `d(k) = y(k) - (y(k-1) + y(k+1))/2`, of which
/// the median magnitude over 0.6745 is the usual size `s`,
///
/// ```text
/// |d(k)| > 12 s   and   |y(k+1) - y(k-1)| < |d(k)|/4
/// ```
///
/// Two side by side are absurd where each is so far from the mean of those around them, over what is usual for two:
/// an oscillation of six samples has half a wave there.
///
/// The first reading of a run (and the last one likewise) has neighbours on one side only: it is held against
/// `2 y(1) - y(2)`, which it usually misses by `2 s`. A machine may as well have jumped there. So it is absurd only
/// where no other change between two neighbours is as large as that from it to the next.
///
/// (F. R. Hampel, 1974, "The influence curve and its role in robust estimation", for the scale.) With
/// Gaussian noise one reading in 10³² is. A signal that changes by steps of its resolution has one such step
/// as its usual size at least.
pub(crate) fn take_out(recording: &mut Recording, ids: &[&str]) -> Vec<Fault> {
    let mut found = Vec::new();
    for (s, id) in ids.iter().enumerate() {
        let least = 0.5 * usual_change(&recording.runs, s);
        let sizes: [f64; TOGETHER] =
            std::array::from_fn(|i| usual(&recording.runs, s, i + 1).max(least));
        let absurd = recording.runs.iter().map(|r| alone(r, s, sizes));
        let mut absurd: Vec<Vec<usize>> = absurd.collect();
        let largest = largest_change(&recording.runs, s, &absurd);
        for (run, absurd) in recording.runs.iter().zip(&mut absurd) {
            absurd.extend(ends(run, s, 2.0 * sizes[0], largest));
        }
        let count: usize = absurd.iter().map(Vec::len).sum();
        let readings: usize = recording.runs.iter().map(Run::len).sum();
        if count == 0 || count as f64 > ACCIDENTS * readings as f64 {
            continue;
        }
        let mut worst = (0.0f64, 0.0, 0.0);
        for (run, absurd) in recording.runs.iter_mut().zip(&absurd) {
            let mut measured = run.measured().to_vec();
            let width = run.n_measured();
            for k in absurd {
                let off = match beside(run, *k) {
                    Some(beside) => at_end(run, s, *k, beside).0,
                    None => apart(run, s, *k, 1).0,
                };
                if off > worst.0 {
                    worst = (off, run.sample(*k)[s], run.time()[*k]);
                }
                measured[k * width + s] = f64::NAN;
            }
            if !absurd.is_empty()
                && let Ok(without) = run.clone().with_measured(measured)
            {
                *run = without;
            }
        }
        let (off, value, time) = worst;
        found.push(Fault {
            kind: FaultKind::AbsurdValue,
            run: String::new(),
            signal: (*id).to_owned(),
            detail: format!(
                "{count} of {readings} readings stand alone, far from those before and after them (at \
                 {time:.3} s {value:.4}, off by {off:.4}); they count as missing"
            ),
        });
    }
    found
}

/// How far readings `k` to `k + together` are at least from the mean of those before and after them, and how far
/// these two are apart; NaN where one is missing.
fn apart(run: &Run, s: usize, k: usize, together: usize) -> (f64, f64) {
    let reading = |k: usize| run.sample(k)[s];
    let (before, after) = (reading(k - 1), reading(k + together));
    let off = |k: usize| (reading(k) - 0.5 * (before + after)).abs();
    let offs = (k..k + together).map(off);
    let least = offs.reduce(|a, b| if a <= b { a } else { b });
    (least.unwrap_or(f64::NAN), (after - before).abs())
}

/// Readings with which a group of so many may begin.
fn groups(run: &Run, together: usize) -> std::ops::Range<usize> {
    1..run.len().saturating_sub(together)
}

/// Usual size of that.
fn usual(runs: &[Run], s: usize, together: usize) -> f64 {
    let mut all: Vec<f64> = runs
        .iter()
        .flat_map(|run| groups(run, together).map(move |k| apart(run, s, k, together).0))
        .filter(|d| d.is_finite())
        .collect();
    match all.is_empty() {
        true => f64::INFINITY,
        false => median(&mut all) / 0.6745,
    }
}

/// Usual size of a change: of those that there are the one in the middle, because a coarse signal seldom changes.
fn usual_change(runs: &[Run], s: usize) -> f64 {
    let steps = runs.iter().flat_map(|run| {
        let values: Vec<f64> = signal(run, s).collect();
        values
            .windows(2)
            .map(|w| (w[1] - w[0]).abs())
            .collect::<Vec<_>>()
    });
    let mut steps: Vec<f64> = steps.filter(|d| *d > 0.0).collect();
    match steps.is_empty() {
        true => f64::INFINITY,
        false => median(&mut steps),
    }
}

/// Readings that stand alone, or two together.
fn alone(run: &Run, s: usize, sizes: [f64; TOGETHER]) -> Vec<usize> {
    let mut found = Vec::new();
    for (together, size) in (1..).zip(sizes) {
        for k in groups(run, together) {
            let (least, between) = apart(run, s, k, together);
            if least > FAR * size && between < BETWEEN * least {
                found.extend(k..k + together);
            }
        }
    }
    found.sort_unstable();
    found.dedup();
    found
}

/// The two neighbours of the first or the last reading of a run, the nearer one first.
fn beside(run: &Run, k: usize) -> Option<[usize; 2]> {
    match k {
        _ if run.len() < 4 => None,
        0 => Some([1, 2]),
        _ if k + 1 == run.len() => Some([k - 1, k - 2]),
        _ => None,
    }
}

/// How far a reading at an end is from the line through those `beside` it, and how far these two are apart; NaN
/// where one is missing.
fn at_end(run: &Run, s: usize, k: usize, beside: [usize; 2]) -> (f64, f64) {
    let [next, second] = beside.map(|k| run.sample(k)[s]);
    let off = run.sample(k)[s] - (2.0 * next - second);
    (off.abs(), (next - second).abs())
}

/// Absurd readings at the ends of a run, where a change from one reading to the next is at most `largest` elsewhere.
fn ends(run: &Run, s: usize, size: f64, largest: f64) -> Vec<usize> {
    let absurd = |k: &usize| {
        beside(run, *k).is_some_and(|beside| {
            let (off, between) = at_end(run, s, *k, beside);
            let change = (run.sample(*k)[s] - run.sample(beside[0])[s]).abs();
            off > FAR * size && between < BETWEEN * off && change > largest
        })
    };
    let last = run.len().saturating_sub(1);
    [0, last].into_iter().filter(absurd).collect()
}

/// The largest change between two readings side by side that are neither `absurd` nor at an end.
fn largest_change(runs: &[Run], s: usize, absurd: &[Vec<usize>]) -> f64 {
    let changes = runs.iter().zip(absurd).flat_map(|(run, absurd)| {
        let believed = |k: usize| absurd.binary_search(&k).is_err();
        (1..run.len().saturating_sub(2))
            .filter(move |k| believed(*k) && believed(*k + 1))
            .map(move |k| (run.sample(k + 1)[s] - run.sample(k)[s]).abs())
    });
    changes.filter(|d| d.is_finite()).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::super::fixture::drive_log;
    use super::*;

    fn spikes(of: impl Fn(usize, [f64; 5]) -> [f64; 5]) -> Vec<Fault> {
        let faults = drive_log(of).faults;
        let absurd = |f: &Fault| f.kind == FaultKind::AbsurdValue;
        faults.into_iter().filter(absurd).collect()
    }

    #[test]
    fn single_absurd_readings_count_as_missing() {
        let odd = |_: usize, mut row: [f64; 5]| {
            if (row[0] * 100.0).round() as usize % 100 == 37 {
                row[3] = 40.0;
            }
            row
        };
        let log = drive_log(odd);
        assert!(
            log.runs
                .iter()
                .all(|r| r.sample(37)[0].is_nan() && r.sample(36)[0].is_finite())
        );
        let found = spikes(odd);
        assert_eq!(found.len(), 1, "{found:?}");
        assert!(
            found[0].detail.starts_with("8 of 800 readings"),
            "{}",
            found[0].detail
        );
    }

    #[test]
    fn two_absurd_readings_side_by_side_count_as_missing() {
        let odd = |_: usize, mut row: [f64; 5]| {
            match (row[0] * 100.0).round() as usize % 100 {
                37 => row[3] = 40.0,
                38 => row[3] = -25.0,
                _ => {}
            }
            row
        };
        let found = spikes(odd);
        assert!(
            found[0].detail.starts_with("16 of 800 readings"),
            "{found:?}"
        );
    }

    #[test]
    fn an_absurd_reading_at_an_end_counts_as_missing() {
        let first = |_: usize, mut row: [f64; 5]| {
            row[3] += if row[0] == 0.0 { 40.0 } else { 0.0 };
            row
        };
        let log = drive_log(first);
        assert!(log.runs.iter().all(|r| r.sample(1)[0].is_finite()));
        assert!(log.runs[0].sample(0)[0].is_nan());
        // A machine that jumps at its start jumps elsewhere as well.
        let jumps = |_: usize, mut row: [f64; 5]| {
            row[3] += if row[0] > 0.005 && row[0] < 2.0 {
                3.0
            } else {
                0.0
            };
            row
        };
        assert_eq!(spikes(jumps), []);
    }

    #[test]
    fn motion_and_blows_are_no_spikes() {
        assert_eq!(spikes(|_, row| row), []);
        // A jump stays where it is, and a blow rings.
        assert_eq!(
            spikes(|_, mut row| {
                row[3] += if row[0] > 2.0 { 3.0 } else { 0.0 };
                row
            }),
            []
        );
        // What happens all the time is how the sensor is.
        assert_eq!(
            spikes(|_, mut row| {
                row[3] += if (row[0] * 100.0).round() as usize % 10 == 3 {
                    3.0
                } else {
                    0.0
                };
                row
            }),
            []
        );
    }
}
