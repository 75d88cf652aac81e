//! What is enough of a long log, where every part of it is as good as any other.
//!
//! A log of an hour at 1 kHz has millions of samples. The size of a sensor's noise, the share of an error in one
//! direction or the state at the beginning are known as well from a part of them. How well follows from the number
//! of samples: a share of a sum over `n` samples has the relative standard error `1/√n`, 0.3 % for the least number
//! here. A log up to that length is used as a whole.

use std::ops::Range;

/// Samples that such questions are answered from: two minutes at 1 kHz.
pub(crate) const ENOUGH: usize = 1 << 17;
/// Pieces that are taken of a long series where neighbours matter.
const PIECES: usize = 16;

/// The rows of a series of `n` that tell what neighbours tell (its noise): all, or pieces spread over it.
pub(crate) fn pieces(n: usize) -> impl Iterator<Item = Range<usize>> {
    let (count, length) = if n <= ENOUGH {
        (1, n)
    } else {
        (PIECES, ENOUGH / PIECES)
    };
    (0..count).map(move |i| {
        let start = i * (n - length) / (count - 1).max(1);
        start..start + length
    })
}

/// The samples of several series that stand for all of them: one of every few, at a place among these that changes
/// from one to the next, so that no period of the log falls in step with them.
#[derive(Clone, Copy)]
pub(crate) struct Thinned {
    every: usize,
}

impl Thinned {
    /// Of `n` samples in all.
    pub(crate) fn of(n: usize) -> Self {
        Self {
            every: n.div_ceil(ENOUGH).max(1),
        }
    }

    /// Whether sample `k` of a series is one of them.
    pub(crate) fn takes(self, k: usize) -> bool {
        /// The golden ratio less one: its multiples fill an interval most evenly.
        const GOLDEN: f64 = 0.618_033_988_749_894_9;
        let place = ((k / self.every) as f64 * GOLDEN).fract() * self.every as f64;
        k % self.every == place as usize
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_short_log_is_used_as_a_whole() {
        let all: Vec<Range<usize>> = pieces(ENOUGH).collect();
        assert_eq!((all.len(), &all[0]), (1, &(0..ENOUGH)));
        let all = Thinned::of(ENOUGH);
        assert!((0..1000).all(|k| all.takes(k)));
    }

    #[test]
    fn a_long_one_from_end_to_end() {
        let n = 3_600_001;
        let found: Vec<_> = pieces(n).collect();
        assert_eq!((found[0].start, found[PIECES - 1].end), (0, n));
        assert_eq!(found.iter().map(Range::len).sum::<usize>(), ENOUGH);
        assert!(found.windows(2).all(|w| w[0].end <= w[1].start));
        // Also of what repeats itself every so many samples, each phase gets its share.
        let thinned = Thinned::of(n);
        let mut phases = [0usize; 28];
        for k in (0..n).filter(|k| thinned.takes(*k)) {
            phases[k % 28] += 1;
        }
        let share = (n / 28 / 28) as f64;
        assert!(
            phases
                .iter()
                .all(|p| (*p as f64 / share - 1.0).abs() < 0.05),
            "{phases:?}"
        );
    }
}
