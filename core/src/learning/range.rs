//! The admissible range of an estimate.

use crate::{Parameter, Real};

/// Admissible values of one parameter, and by how much it may be wrong.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range<S> {
    /// Least value.
    pub low: S,
    /// Greatest value.
    pub high: S,
    /// Size of a noticeable change, above 0.
    pub scale: S,
}

impl<S: Real> Range<S> {
    /// Scales that are far for a parameter: ten times the size of a noticeable change.
    pub const REACH: f64 = 10.0;

    /// Of this, what is no more than `reach` scales away from `start`.
    pub fn within_reach(self, start: S, reach: f64) -> Self {
        let away = S::of(reach) * self.scale;
        Self {
            low: self.low.max(start - away),
            high: self.high.min(start + away),
            ..self
        }
    }

    /// Whether there is a finite value within, and the scale is a finite number above 0.
    pub fn is_usable(&self) -> bool {
        let scaled = self.scale > S::zero() && self.scale.is_finite();
        let least = S::of(f64::NEG_INFINITY);
        let greatest = S::of(f64::INFINITY);
        scaled && self.low <= self.high && self.low < greatest && self.high > least
    }

    /// The range a plant or an effect declares, away from where its equations fail.
    ///
    /// An open bound, and zero for a parameter that the equations are divided by
    /// ([`Parameter::nonzero`]), are kept at a distance: `clearance` times that of the `start` value.
    /// A start beyond the declared range counts as the nearest value within. `size` multiplies the
    /// declared scale, see [`crate::Channel::size`].
    ///
    /// ```
    /// use loopsight_core::{Parameter, learning::Range};
    ///
    /// const GAIN: Parameter = Parameter::new("k", "k", "1", "a gain").scaled(0.1).nonzero();
    /// let range = Range::<f64>::of(&GAIN, 1.0, -0.5, 0.1);
    /// assert!(range.high == -0.05 && range.low == f64::NEG_INFINITY && range.scale == 0.1);
    /// ```
    pub fn of(parameter: &Parameter, size: f64, start: f64, clearance: f64) -> Self {
        let start = parameter.nearest(start);
        let (mut low, mut high) = parameter.bounds();
        if parameter.open {
            low = low.max(parameter.min + clearance * (start - parameter.min));
            high = high.min(parameter.max - clearance * (parameter.max - start));
        }
        if parameter.nonzero && start > 0.0 {
            low = low.max(clearance * start);
        } else if parameter.nonzero && start < 0.0 {
            high = high.min(clearance * start);
        }
        Self {
            low: S::of(if low.is_nan() { f64::NEG_INFINITY } else { low }),
            high: S::of(if high.is_nan() { f64::INFINITY } else { high }),
            scale: S::of(parameter.scale * size),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_keep_away_from_where_equations_fail() {
        let mass = Parameter::new("m", "m", "kg", "a mass").above(0.0);
        let range = Range::of(&mass, 1.0, 8.0, 0.25);
        assert_eq!((range.low, range.high), (2.0f64, f64::INFINITY));
        let damping = Parameter::new("a", "a", "1/s", "damping").within(f64::NEG_INFINITY, 0.0);
        let range = Range::of(&damping, 1.0, -8.0, 0.25);
        assert_eq!((range.low, range.high), (f64::NEG_INFINITY, 0.0f64));
        let gain = Parameter::new("k", "k", "1", "a gain").nonzero();
        assert_eq!(Range::<f64>::of(&gain, 1.0, 4.0, 0.25).low, 1.0);
        // At zero its sign is not known: it may have either.
        let range = Range::<f32>::of(&gain, 3.0, 0.0, 0.25);
        assert_eq!(
            (range.low, range.high, range.scale),
            (f32::NEG_INFINITY, f32::INFINITY, 3.0)
        );
    }
}
