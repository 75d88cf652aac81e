//! How well a loop keeps real time.

use loopsight_core::TickRecord;
use loopsight_report::Timing;

/// Takes the ticks of a real-time loop.
///
/// ```text
/// jitter² = mean (Δt_k - T)²        Δt_k: from the beginning of tick k - 1 to that of tick k
/// ```
#[derive(Default)]
pub(super) struct Stopwatch {
    intervals: u64,
    squares: f64,
    last_late: f64,
    timing: Timing,
}

impl Stopwatch {
    /// Takes a tick.
    pub(super) fn take(&mut self, step: &TickRecord<'_, f64>) {
        if step.tick.index > 0 {
            // Ticks are due a period apart: what differs is how late they began.
            let off = step.late - self.last_late;
            self.squares += off * off;
            self.intervals += 1;
        }
        self.last_late = step.late;
        self.timing.latest_s = self.timing.latest_s.max(step.late);
        self.timing.missed += usize::from(step.late > step.tick.period);
        self.timing.longest_s = self.timing.longest_s.max(step.busy);
    }

    /// What was measured.
    pub(super) fn timing(&self) -> Timing {
        Timing {
            jitter_s: (self.squares / self.intervals.max(1) as f64).sqrt(),
            ..self.timing
        }
    }
}

#[cfg(test)]
mod tests {
    use loopsight_core::{Command, Sample, Tick};

    use super::*;

    #[test]
    fn jitter_is_that_of_the_periods() {
        let mut watch = Stopwatch::default();
        for (index, late) in [0.001, 0.001, 0.004, 0.012, 0.001].into_iter().enumerate() {
            let time = 0.01 * index as f64;
            watch.take(&TickRecord {
                tick: Tick {
                    index: index as u64,
                    time,
                    period: 0.01,
                },
                sample: Sample { time, fresh: true },
                reference: &[],
                measured: &[],
                command: &[],
                applied: &[],
                outcome: Command::default(),
                event: None,
                fallen: false,
                late,
                busy: 1e-4 * (5 - index) as f64,
            });
        }
        let timing = watch.timing();
        let expected = ((9.0 + 64.0 + 121.0) * 1e-6 / 4.0_f64).sqrt();
        assert!((timing.jitter_s - expected).abs() < 1e-12);
        assert_eq!((timing.latest_s, timing.missed), (0.012, 1));
        assert!((timing.longest_s - 5e-4).abs() < 1e-12);
    }
}
