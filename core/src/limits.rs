//! Limits of signals: how large they may be, and how fast they may change.

use crate::Real;

/// Clamps signals to a magnitude and a rate, sample by sample.
///
/// ```text
/// c = min(max(u, -m), m)          u_k = min(max(c, u_(k-1) - r T), u_(k-1) + r T)
/// ```
///
/// | symbol | what | unit |
/// |---|---|---|
/// | `u`, `u_k` | wanted value, clamped value | of the signal |
/// | `m` | largest magnitude | of the signal |
/// | `r` | largest rate | of the signal per s |
/// | `T` | period | s |
///
/// The signals begin at 0. `B` is the buffer type: `[S; N]` without an allocator, `Vec<S>` on a
/// host. Nothing is allocated after construction.
///
/// Reference: K. J. Åström, T. Hägglund (2006), "Advanced PID Control", ISA, section 3.5, on
/// actuators with limited position and rate.
///
/// ```
/// use loopsight_core::Limits;
/// let mut limits = Limits::new([12.0], [100.0], [0.0]); // ±12 V, 100 V/s
/// let mut voltage = [20.0];
/// assert!(limits.clamp(0.01, &mut voltage));
/// assert_eq!(voltage, [1.0]);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Limits<B> {
    magnitude: B,
    rate: B,
    last: B,
}

impl<B> Limits<B> {
    /// Largest magnitudes and rates (infinite: no limit), and where the signals begin.
    pub fn new(magnitude: B, rate: B, start: B) -> Self {
        Self {
            magnitude,
            rate,
            last: start,
        }
    }

    /// Clamps `values`, `period` s after the last ones; true when one of them was changed. NaN passes unchanged: the
    /// driver has to refuse it.
    pub fn clamp<S: Real>(&mut self, period: S, values: &mut [S]) -> bool
    where
        B: AsRef<[S]> + AsMut<[S]>,
    {
        let mut changed = false;
        let bounds = self.magnitude.as_ref().iter().zip(self.rate.as_ref());
        let signals = values.iter_mut().zip(self.last.as_mut());
        for ((magnitude, rate), (value, last)) in bounds.zip(signals) {
            if !value.is_finite() {
                continue;
            }
            let step = *rate * period;
            let within = value.clamp(-*magnitude, *magnitude);
            let held = within.clamp(*last - step, *last + step);
            changed |= held != *value;
            *value = held;
            *last = held;
        }
        changed
    }

    /// Sets where the signals are now.
    pub fn start<S: Real>(&mut self, values: &[S])
    where
        B: AsMut<[S]>,
    {
        for (last, value) in self.last.as_mut().iter_mut().zip(values) {
            *last = *value;
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        /// Magnitude and rate never exceed the limits, and values within them are unchanged.
        #[test]
        fn nothing_leaves_its_limits(
            wanted in proptest::collection::vec(-100.0..100.0f32, 1..60),
            magnitude in 0.1..50.0f32,
            rate in 0.1..5000.0f32,
        ) {
            let mut limits = Limits::new([magnitude], [rate], [0.0]);
            let mut before = 0.0;
            for want in wanted {
                let mut value = [want];
                let changed = limits.clamp(0.01, &mut value);
                let step = rate * 0.01 * (1.0 + 1e-5) + 1e-5;
                prop_assert!(value[0].abs() <= magnitude && (value[0] - before).abs() <= step);
                prop_assert_eq!(changed, value[0] != want);
                if want.abs() <= magnitude && (want - before).abs() <= rate * 0.0099 {
                    prop_assert_eq!(value[0], want);
                }
                before = value[0];
            }
        }
    }

    #[test]
    fn no_limit_and_no_number_pass() {
        let free = f64::INFINITY;
        let mut limits = Limits::new(vec![free, 2.0], vec![free, free], vec![0.0, 0.0]);
        let mut values = [1e300, f64::NAN];
        assert!(!limits.clamp(0.01, &mut values));
        assert!(values[0] == 1e300 && values[1].is_nan());
        limits.start(&[0.0, 1.0]);
        assert_eq!(
            limits,
            Limits::new(vec![free, 2.0], vec![free, free], vec![0.0, 1.0])
        );
    }
}
