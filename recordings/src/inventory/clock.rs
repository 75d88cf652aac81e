//! How time stamps run, in one pass.

use std::collections::BTreeMap;

use super::ClockFacts;
use crate::median::median;

/// A pause is longer than so many periods.
const GAP: f64 = 5.0;
/// Steps from stamp to stamp that are kept; of more, every second, every fourth and so on.
const KEPT: usize = 65_536;
/// Steps are counted in classes that are so much apart, as a ratio.
const CLASS: f64 = 1.01;

/// What is kept of a sequence of time stamps.
#[derive(Clone, Debug)]
pub(super) struct ClockCount {
    first: f64,
    end: f64,
    last: Option<f64>,
    pub(super) ticks: usize,
    backwards: usize,
    steps: Vec<f64>,
    every: usize,
    seen: usize,
    longest: f64,
    classes: BTreeMap<i32, usize>,
}

impl Default for ClockCount {
    fn default() -> Self {
        Self {
            first: f64::INFINITY,
            end: f64::NEG_INFINITY,
            last: None,
            ticks: 0,
            backwards: 0,
            steps: Vec::new(),
            every: 1,
            seen: 0,
            longest: 0.0,
            classes: BTreeMap::new(),
        }
    }
}

impl ClockCount {
    /// The last stamp.
    pub(super) fn now(&self) -> f64 {
        self.last.unwrap_or(f64::NAN)
    }

    /// What comes is another run.
    pub(super) fn restart(&mut self) {
        self.last = None;
    }

    pub(super) fn tick(&mut self, time: f64) {
        self.ticks += 1;
        if time.is_finite() {
            (self.first, self.end) = (self.first.min(time), self.end.max(time));
        }
        if let Some(last) = self.last.replace(time) {
            let step = time - last;
            if step < 0.0 {
                self.backwards += 1;
            } else if step.is_finite() {
                self.step(step);
            }
        }
    }

    fn step(&mut self, step: f64) {
        if self.seen.is_multiple_of(self.every) {
            if self.steps.len() == KEPT {
                self.every *= 2;
                let mut at = 0;
                self.steps.retain(|_| {
                    at += 1;
                    at % 2 == 1
                });
            }
            // The one that is due now may be one that is passed over from here on.
            if self.seen.is_multiple_of(self.every) {
                self.steps.push(step);
            }
        }
        self.seen += 1;
        if step > self.longest {
            self.longest = step;
        }
        *self.classes.entry(class(step)).or_insert(0) += 1;
    }

    /// All of it; none without a stamp. Up to 65 536 steps, exact; of more, period and jitter are those of a sample,
    /// and pauses are counted to 1 % of their length.
    pub(super) fn facts(&self) -> Option<ClockFacts> {
        if self.end < self.first {
            return None;
        }
        let period = median(&mut self.steps.clone());
        let mut deviations: Vec<f64> = self.steps.iter().map(|s| (s - period).abs()).collect();
        let pause = |step: f64| period > 0.0 && step > GAP * period;
        let gaps = match self.every {
            1 => self.steps.iter().filter(|s| pause(**s)).count(),
            _ => {
                let longer = self.classes.range(class(GAP * period)..);
                let counts = longer.map(|(_, count)| count);
                if period > 0.0 { counts.sum() } else { 0 }
            }
        };
        Some(ClockFacts {
            span: (self.first, self.end),
            period,
            jitter: median(&mut deviations),
            gaps,
            longest_gap: if pause(self.longest) {
                self.longest
            } else {
                0.0
            },
            backwards: self.backwards,
        })
    }
}

/// The class of a step: all classes together are few, whatever the steps are.
fn class(step: f64) -> i32 {
    if step > 0.0 {
        (step.ln() / CLASS.ln()).floor() as i32
    } else {
        i32::MIN
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn many_stamps_tell_the_same_as_few() {
        let of = |n: u32| {
            let mut clock = ClockCount::default();
            for k in 0..n {
                let late = if k % 3 == 0 { 1e-4 } else { 0.0 };
                let pauses = f64::from(k / (n / 4)) * 0.5;
                clock.tick(0.01 * f64::from(k) + late + pauses);
            }
            clock.facts().unwrap()
        };
        let (few, many) = (of(10_000), of(400_000));
        assert!((few.period - 0.01).abs() < 1e-9, "{few:?}");
        assert!((many.period - few.period).abs() < 1e-9, "{many:?}");
        assert!((many.jitter - few.jitter).abs() < 1e-9, "{many:?}");
        assert_eq!((few.gaps, many.gaps), (3, 3));
        assert!((many.longest_gap - 0.51).abs() < 1e-3, "{many:?}");
    }
}
