//! Quadrature counters: where a shaft is, in counts.

use core::fmt;

/// A counter of quadrature edges: a timer of a microcontroller, a counter of the kernel.
///
/// embedded-hal 1.0 has no such trait; this is the little that a driver needs. The position wraps
/// around after [`Quadrature::range`] counts; a driver takes differences of it, so that its start
/// does not matter as long as the shaft moves by less than half the range between two readings.
pub trait Quadrature {
    /// The counter's own error.
    type Error: fmt::Debug;
    /// Where the shaft is, in `[0, range)`.
    ///
    /// # Errors
    ///
    /// The counter cannot be read.
    fn position(&mut self) -> Result<u32, Self::Error>;
    /// After how many counts the position starts over: `2^32`, or `2^16` of a 16-bit timer.
    fn range(&self) -> u64 {
        1 << 32
    }
}

impl<Q: Quadrature + ?Sized> Quadrature for &mut Q {
    type Error = Q::Error;
    fn position(&mut self) -> Result<u32, Q::Error> {
        (**self).position()
    }
    fn range(&self) -> u64 {
        (**self).range()
    }
}

/// Counts from `before` to `now` on the shorter way round a counter that wraps after `range`.
///
/// ```
/// use loopsight_drivers::twil_motor::turned;
/// assert_eq!(turned(65_530, 4, 1 << 16), 10);
/// assert_eq!(turned(4, 65_530, 1 << 16), -10);
/// assert_eq!(turned(u32::MAX, 0, 1 << 32), 1);
/// ```
pub fn turned(before: u32, now: u32, range: u64) -> i32 {
    let (range, half) = (range as i64, (range / 2) as i64);
    let mut counts = i64::from(now) - i64::from(before);
    if counts >= half {
        counts -= range;
    } else if counts < -half {
        counts += range;
    }
    // Half of the widest counter fits; anything else is a counter that broke its own range.
    counts.clamp(i64::from(i32::MIN), i64::from(i32::MAX)) as i32
}

#[cfg(test)]
#[cfg(feature = "std")]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        /// Whatever the counter's range and start, moves of less than half of it are found again.
        #[test]
        fn every_move_is_found_again(bits in 4u32..=32, start in any::<u32>(), share in -0.499..0.499f64) {
            let range = 1u64 << bits;
            let start = u64::from(start) % range;
            let counts = (share * range as f64) as i64;
            let end = (start as i64 + counts).rem_euclid(range as i64);
            prop_assert_eq!(i64::from(turned(start as u32, end as u32, range)), counts);
        }
    }

    #[test]
    fn ranges_that_are_no_power_of_two() {
        // An encoder of 2048 pulses whose counter starts over with each turn of the shaft.
        assert_eq!(turned(8190, 3, 8192), 5);
        assert_eq!(turned(990, 5, 1000), 15);
        assert_eq!(turned(5, 990, 1000), -15);
    }
}
