//! The past of one channel, for effects that look back.

use crate::registry::HostReal;
use loopsight_core::Past;

/// Instants of the past that are kept per channel with memory.
pub(super) const CAPACITY: usize = 4096;

/// Spans below this are too short for a difference of integrals, s.
const SHORT: f64 = 1e-6;

/// How a signal runs between two instants.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Between {
    /// Constant: an input between samples.
    Held,
    /// Smooth: the integral is the cubic through its values and rates at both ends.
    Smooth,
}

/// The past of a signal, kept in a ring so that it never grows.
#[derive(Clone, Debug)]
pub(crate) struct History<S> {
    between: Between,
    /// At an entry the signal is what it is from then on, and not what it was until then.
    after: bool,
    entries: Vec<Entry<S>>,
    /// Index of the oldest entry once the ring is full.
    oldest: usize,
}

#[derive(Clone, Copy, Debug)]
struct Entry<S> {
    time: f64,
    value: S,
    /// Integral of the signal up to then.
    integral: S,
}

impl<S: HostReal> History<S> {
    pub(crate) fn new(between: Between) -> Self {
        Self {
            between,
            after: false,
            entries: Vec::with_capacity(CAPACITY),
            oldest: 0,
        }
    }

    /// The same for effects that look ahead: a lead of zero is differentiated to the side after an entry.
    pub(crate) fn ahead(between: Between) -> Self {
        Self {
            after: true,
            ..Self::new(between)
        }
    }

    pub(crate) fn clear(&mut self) {
        self.entries.clear();
        self.oldest = 0;
    }

    /// The `i`-th oldest entry.
    fn entry(&self, i: usize) -> &Entry<S> {
        let n = self.entries.len();
        &self.entries[if n < CAPACITY {
            i
        } else {
            (self.oldest + i) % CAPACITY
        }]
    }

    /// From `time` on the signal has the constant `value`.
    pub(crate) fn hold(&mut self, time: f64, value: S) {
        let n = self.entries.len();
        let integral = if n == 0 {
            S::zero()
        } else {
            let last = self.entry(n - 1);
            last.integral + last.value * S::of(time - last.time)
        };
        self.push(Entry {
            time,
            value,
            integral,
        });
    }

    /// To `time` the signal ran straight, and has `value` there. With this integral the cubic is that line.
    pub(crate) fn run_to(&mut self, time: f64, value: S) {
        let integral = match self.entries.len().checked_sub(1) {
            None => S::zero(),
            Some(newest) => {
                let last = self.entry(newest);
                last.integral + (last.value + value) * S::of(0.5 * (time - last.time))
            }
        };
        self.pass(time, value, integral);
    }

    /// At `time` the signal has `value`, and its integral is `integral`.
    pub(crate) fn pass(&mut self, time: f64, value: S, integral: S) {
        self.push(Entry {
            time,
            value,
            integral,
        });
    }

    fn push(&mut self, entry: Entry<S>) {
        if self.entries.len() < CAPACITY {
            self.entries.push(entry);
        } else {
            self.entries[self.oldest] = entry;
            self.oldest = (self.oldest + 1) % CAPACITY;
        }
    }

    /// The value at `time`. A constant one has its new value from the time of its entry on.
    fn instant(&self, time: S) -> S {
        if self.between == Between::Held
            && let Some(entry) = self.entries.iter().find(|e| e.time == time.value())
        {
            return entry.value;
        }
        self.at(time).1
    }

    /// Whether the `i`-th oldest entry is before `time`.
    fn is_before(&self, i: usize, time: f64) -> bool {
        let entry = self.entry(i).time;
        entry < time || self.after && entry == time
    }

    /// The value that the signal has all the time from `from` to `to`, where it is constant between its entries and none of
    /// them is there.
    fn constant(&self, from: f64, to: f64) -> Option<S> {
        if self.between != Between::Held || self.entries.is_empty() {
            return None;
        }
        let entry = self.newest_before(to);
        (entry == 0 || self.is_before(entry, from)).then(|| self.entry(entry).value)
    }

    /// The newest entry before `time`, or the oldest of all. What is looked for is mostly among the newest, so the search goes
    /// back from them in growing strides, and then halves the last one.
    fn newest_before(&self, time: f64) -> usize {
        let mut high = self.entries.len();
        let mut stride = 1;
        let mut low = high.saturating_sub(stride);
        while low > 0 && !self.is_before(low, time) {
            high = low;
            stride *= 2;
            low = high.saturating_sub(stride);
        }
        while high - low > 1 {
            let middle = usize::midpoint(low, high);
            if self.is_before(middle, time) {
                low = middle;
            } else {
                high = middle;
            }
        }
        low
    }

    /// Integral and value at `time`. At an entry the value is that from the side before it, to which a delay of
    /// zero is differentiated; a history for effects that look ahead takes the side after it. Before the first and after
    /// the last entry the signal is constant.
    fn at(&self, time: S) -> (S, S) {
        let n = self.entries.len();
        if n == 0 {
            return (S::zero(), S::zero());
        }
        let low = self.newest_before(time.value());
        let a = self.entry(low);
        let elapsed = time - S::of(a.time);
        if self.between == Between::Held || low + 1 == n || time.value() < a.time {
            return (a.integral + a.value * elapsed, a.value);
        }
        let b = self.entry(low + 1);
        let h = S::of(b.time - a.time);
        let s = elapsed / h;
        let (one, two, three) = (S::one(), S::of(2.0), S::of(3.0));
        // Cubic Hermite polynomial of the integral; its derivative is the value.
        let d = b.integral - a.integral;
        let integral = a.integral
            + d * s * s * (three - two * s)
            + h * s * (one - s) * (a.value * (one - s) - b.value * s);
        let value = d / h * S::of(6.0) * s * (one - s)
            + a.value * (one - s) * (one - three * s)
            + b.value * s * (three * s - two);
        (integral, value)
    }
}

impl<S: HostReal> Past<S> for History<S> {
    fn mean(&self, from: S, to: S) -> S {
        let span = to - from;
        if span.value() > SHORT {
            let moved = || (self.at(to).0 - self.at(from).0) / span;
            self.constant(from.value(), to.value())
                .unwrap_or_else(moved)
        } else {
            // The limit of the mean, with its derivatives by both bounds.
            (self.instant(from) + self.instant(to)) * S::of(0.5)
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::{Dual, derivative, variable};
    use loopsight_core::Real;

    use super::*;

    #[test]
    fn held_values_average_by_time() {
        let mut h = History::<f64>::new(Between::Held);
        h.hold(0.0, 1.0);
        h.hold(1.0, 3.0);
        assert_eq!(h.mean(0.5, 1.5), 2.0);
        assert_eq!(h.mean(-5.0, -1.0), 1.0);
        assert_eq!(h.mean(0.99, 0.99), 1.0);
        assert_eq!(h.mean(1.0, 1.0), 3.0);
    }

    #[test]
    fn smooth_values_are_those_of_a_cubic() {
        // y = 3 t², integral t³: the Hermite polynomial is exact.
        let mut h = History::<f64>::new(Between::Smooth);
        for k in 0..5 {
            let t = 0.4 * f64::from(k);
            h.pass(t, 3.0 * t * t, t * t * t);
        }
        for t in [0.1, 0.55, 0.8, 1.33] {
            assert!((h.mean(t, t) - 3.0 * t * t).abs() < 1e-12, "{t}");
        }
        assert!((h.mean(0.3, 1.1) - (1.1f64.powi(3) - 0.3f64.powi(3)) / 0.8).abs() < 1e-12);
    }

    #[test]
    fn a_delay_of_zero_has_its_one_sided_derivative() {
        let delay = variable(0.0, 0);
        let mut smooth = History::<Dual>::new(Between::Smooth);
        let mut held = History::<Dual>::new(Between::Held);
        for k in 0..4 {
            let t = 0.5 * f64::from(k);
            smooth.pass(t, Dual::of(3.0 * t * t), Dual::of(t * t * t));
            held.hold(t, Dual::of(f64::from(k)));
        }
        let now = Dual::of(1.5);
        let late = smooth.mean(now - delay, now - delay);
        assert!((derivative(&late, 0) + 9.0).abs() < 1e-12);
        let window = smooth.mean(now - delay, now);
        assert!((derivative(&window, 0) + 4.5).abs() < 1e-12);
        let step = held.mean(now - delay, Dual::of(2.0) - delay);
        assert!((derivative(&step, 0) + 2.0).abs() < 1e-12);
    }

    /// Between two entries nothing of a difference of large integrals is left.
    #[test]
    fn a_constant_is_its_own_mean() {
        let mut h = History::<Dual>::new(Between::Held);
        for k in 0..2000 {
            h.hold(0.1 * f64::from(k), Dual::of(0.3 * f64::from(k % 7)));
        }
        let delay = variable(0.052, 0);
        for k in 1..2000 {
            let to = 0.1 * f64::from(k);
            let mean = h.mean(Dual::of(to - 0.04) - delay, Dual::of(to) - delay);
            assert_eq!(mean.value(), 0.3 * f64::from((k - 1) % 7));
            assert_eq!(derivative(&mean, 0), 0.0);
        }
    }

    #[test]
    fn the_ring_forgets_the_oldest() {
        let mut h = History::<f64>::new(Between::Held);
        for k in 0..3 * CAPACITY {
            h.hold(k as f64, k as f64);
        }
        let last = (3 * CAPACITY - 1) as f64;
        assert_eq!(h.mean(last - 10.0, last - 10.0), last - 10.0);
        assert_eq!(h.entries.len(), CAPACITY);
    }
}
