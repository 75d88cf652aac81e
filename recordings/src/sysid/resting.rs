//! The rest before the motion in a log of an arm or a lift.
//!
//! The slow runs of SysId begin at 0 V and rise slowly. Until the voltage lifts the weight, an arm lies on its stop and a lift
//! stands on its floor. No model of the motor alone can stand there, because its weight pulls it down. So a run of these begins
//! where the motion does, as SysId itself trims it.

use super::{SysIdLog, SysIdRun, TestKind};
use crate::fault::{Fault, FaultKind};

/// Columns of a row of an arm or a lift.
const TIME: usize = 0;
const VOLTAGE: usize = 1;
const POSITION: usize = 2;
/// Share of the largest travel within which a position is still that of the start,
const STAYS: f64 = 0.002;
/// and how many counts of the encoder: one may come and go at rest.
const COUNTS: f64 = 1.5;
/// What is kept of the rest, s: longer than most motor controllers report late, so that the motion has begun in no run.
const KEPT: f64 = 0.2;

impl SysIdLog {
    /// The log without the rest of its runs before they move; none where it has no weight, or nothing rests.
    pub(crate) fn without_rest(&self) -> Option<Self> {
        let first = self.first_rows();
        first.iter().any(|row| *row > 0).then(|| {
            let mut log = self.clone();
            for (run, first) in log.runs.iter_mut().zip(first) {
                run.rows.drain(..first * run.width);
            }
            log
        })
    }

    /// What [`without_rest`](Self::without_rest) leaves out.
    pub(crate) fn rest(&self) -> Option<Fault> {
        let runs = self.runs.iter().zip(self.first_rows());
        let rests: Vec<(&str, f64)> = runs
            .filter(|(_, first)| *first > 0)
            .filter_map(|(run, first)| {
                let (start, kept) = (run.rows().next()?, run.rows().nth(first)?);
                Some((run.name.as_str(), kept[TIME] - start[TIME]))
            })
            .collect();
        let names: Vec<&str> = rests.iter().map(|(name, _)| *name).collect();
        let seconds: Vec<String> = (rests.iter())
            .map(|(_, seconds)| format!("{seconds:.2} s"))
            .collect();
        (!rests.is_empty()).then(|| Fault {
            kind: FaultKind::RestingStart,
            run: names.join(", "),
            signal: String::new(),
            detail: format!(
                "it rests for {} before it moves, on a stop or held by friction: left out, because a weight without a stop would \
                 fall there",
                seconds.join(", ")
            ),
        })
    }

    /// How far the position of an arm or a lift goes in any run, in rotations.
    pub(crate) fn travel(&self) -> f64 {
        (self.runs.iter()).map(SysIdRun::travel).fold(0.0, f64::max)
    }

    /// The row with which each run begins.
    fn first_rows(&self) -> Vec<usize> {
        if !matches!(self.test, TestKind::Arm | TestKind::Elevator) {
            return vec![0; self.runs.len()];
        }
        let stays = STAYS * self.travel();
        (self.runs.iter())
            .map(|run| run.first_row(stays).unwrap_or(0))
            .collect()
    }
}

impl SysIdRun {
    /// How far the position goes.
    fn travel(&self) -> f64 {
        let positions = self.rows().map(|row| row[POSITION]);
        let (low, high) = positions
            .filter(|x| x.is_finite())
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| {
                (low.min(x), high.max(x))
            });
        (high - low).max(0.0)
    }

    /// The row from which a run is kept that has left its start when it is further away than `stays` and than a count; none where it
    /// never leaves it.
    fn first_row(&self, stays: f64) -> Option<usize> {
        let mut known = self.rows().map(|row| row[POSITION]);
        let start = known.find(|x| x.is_finite())?;
        let pairs = self.rows().zip(self.rows().skip(1));
        let count = pairs
            .map(|(before, now)| (now[POSITION] - before[POSITION]).abs())
            .filter(|step| *step > 0.0)
            .fold(f64::INFINITY, f64::min);
        let far = stays.max(COUNTS * count);
        let moves = self
            .rows()
            .position(|row| (row[POSITION] - start).abs() > far)?;
        let from = self.rows().nth(moves)?[TIME] - KEPT;
        // A step begins with the last row without voltage.
        self.rows()
            .take(moves)
            .rposition(|row| row[TIME] <= from || row[VOLTAGE] == 0.0)
    }
}

#[cfg(test)]
mod tests {
    use crate::{FaultKind, read_sysid};

    /// A run in which the position stays at 1 until `moves` s and grows by `per_s` then, under a voltage `of` time.
    fn rows(moves: f64, per_s: f64, of: impl Fn(f64) -> f64) -> String {
        let row = |k: i32| {
            let t = 0.01 * f64::from(k);
            format!("[{t},{},{},0]", of(t), 1.0 + per_s * (t - moves).max(0.0))
        };
        (0..300).map(row).collect::<Vec<_>>().join(",")
    }

    fn log(test: &str) -> crate::sysid::SysIdLog {
        let text = format!(
            r#"{{"test":"{test}","units":"Meters","unitsPerRotation":1,"slow-forward":[{}],"slow-backward":[{}],"fast-forward":[{}]}}"#,
            rows(2.0, 1.0, |t| 0.25 * t),
            rows(9.0, 0.0, |t| -0.25 * t),
            rows(0.1, 1.0, |t| if t > 0.05 { 4.0 } else { 0.0 }),
        );
        read_sysid(&text, "l").unwrap()
    }

    #[test]
    fn a_lift_begins_where_it_moves() {
        let whole = log("Elevator");
        let cut = whole.without_rest().unwrap();
        let first = |run: usize| cut.runs[run].rows[0];
        assert!((1.7..1.9).contains(&first(0)), "{}", first(0));
        // Nothing is left out of a run that never moves; a step begins with its last row without voltage.
        assert_eq!(cut.runs[1].rows, whole.runs[1].rows);
        assert!((0.04..0.06).contains(&first(2)), "{}", first(2));
        let fault = whole.rest().unwrap();
        assert_eq!(
            (fault.kind, fault.run.as_str()),
            (FaultKind::RestingStart, "slow-forward, fast-forward")
        );
    }

    #[test]
    fn friction_is_learnt_from_the_rest_of_what_has_no_weight() {
        let whole = log("Simple");
        assert_eq!((whole.without_rest(), whole.rest()), (None, None));
    }
}
