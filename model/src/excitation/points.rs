//! Points in time and what runs between them.

use serde::{Deserialize, Serialize};

use super::sequence::EARLY;

/// What a signal does between two points.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Between {
    /// It keeps the value of the last point.
    Held,
    /// It goes in a straight line.
    #[default]
    Straight,
    /// It goes in a cubic that has one slope from both sides at each point, rests at the first and
    /// the last, and never leaves the values of its two points.
    Smooth,
}

/// A signal through points, ready to be sampled.
///
/// ```text
/// y = y_i + (y_(i+1) - y_i) s                                       straight
/// y = h00 y_i + h10 Δ d_i + h01 y_(i+1) + h11 Δ d_(i+1)             smooth
/// h00 = 2s³ - 3s² + 1,  h10 = s³ - 2s² + s,  h01 = -2s³ + 3s²,  h11 = s³ - s²
/// 1/d_i = α/δ_i + (1 - α)/δ_(i-1),  α = (Δ_(i-1) + 2Δ_i)/(3 (Δ_(i-1) + Δ_i));  0 where δ changes sign
/// ```
///
/// | symbol | what | unit |
/// |---|---|---|
/// | `t_i`, `y_i` | instants and values of the points | s, of the signal |
/// | `Δ_i`, `δ_i` | `t_(i+1) - t_i` and `(y_(i+1) - y_i)/Δ_i` | s, of the signal per s |
/// | `s` | `(t - t_i)/Δ_i`, from 0 to 1 | 1 |
/// | `d_i` | slope at a point | of the signal per s |
///
/// Before the first point it has the first value, after the last one the last.
///
/// Reference: F. N. Fritsch, J. Butland (1984), "A method for constructing local monotone piecewise
/// cubic interpolants", SIAM Journal on Scientific and Statistical Computing 5(2), 300–304, (5).
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Points {
    at: Vec<[f64; 2]>,
    /// Slope at each point; empty unless smooth.
    slope: Vec<f64>,
    between: Between,
}

impl Points {
    /// Through `at`, whose instants increase.
    pub(super) fn new(at: Vec<[f64; 2]>, between: Between) -> Self {
        let slope = match between {
            Between::Smooth => (0..at.len()).map(|i| slope(&at, i)).collect(),
            Between::Held | Between::Straight => Vec::new(),
        };
        Self { at, slope, between }
    }

    /// The value at `t` s.
    pub(super) fn sample(&self, t: f64) -> f64 {
        // Sampling instants are sums of rounded periods: a point is due a little early.
        let due = t + EARLY * t.abs().max(1.0);
        let come = self.at.partition_point(|[time, _]| *time <= due);
        let before = come.saturating_sub(1);
        let (Some([from, y]), next) = (self.at.get(before), self.at.get(come)) else {
            return 0.0;
        };
        match next {
            Some([to, end]) if come > 0 && self.between != Between::Held => {
                let span = to - from;
                let s = ((t - from) / span).clamp(0.0, 1.0);
                if self.between == Between::Straight {
                    return y + (end - y) * s;
                }
                let (s2, s3) = (s * s, s * s * s);
                (2.0 * s3 - 3.0 * s2 + 1.0) * y
                    + (s3 - 2.0 * s2 + s) * span * self.slope[before]
                    + (3.0 * s2 - 2.0 * s3) * end
                    + (s3 - s2) * span * self.slope[come]
            }
            _ => *y,
        }
    }
}

/// Slope at the `i`-th point; the first and the last are at rest.
fn slope(at: &[[f64; 2]], i: usize) -> f64 {
    let (Some(before), Some(here), Some(after)) = (
        i.checked_sub(1).and_then(|j| at.get(j)),
        at.get(i),
        at.get(i + 1),
    ) else {
        return 0.0;
    };
    let (h0, h1) = (here[0] - before[0], after[0] - here[0]);
    let (d0, d1) = ((here[1] - before[1]) / h0, (after[1] - here[1]) / h1);
    if d0 * d1 <= 0.0 {
        return 0.0;
    }
    let share = (h0 + 2.0 * h1) / (3.0 * (h0 + h1));
    d0 * d1 / (share * d0 + (1.0 - share) * d1)
}

/// What is wrong with points, if anything: each must be finite, their instants must increase.
pub(super) fn mistake(at: &[[f64; 2]]) -> Option<String> {
    if at.is_empty() {
        return Some("found no point, expected one [time, value] or more".to_owned());
    }
    at.iter().enumerate().find_map(|(i, [time, value])| {
        let before = i.checked_sub(1).map(|j| at[j][0]);
        let right = time.is_finite() && value.is_finite() && before.is_none_or(|b| *time > b);
        (!right).then(|| {
            format!(
                "entry {} is [{time}, {value}], expected [time, value] with times that increase",
                i + 1
            )
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const AT: [[f64; 2]; 5] = [[1.0, 0.0], [2.0, 1.0], [2.5, 4.0], [4.0, 4.0], [5.0, -1.0]];

    #[test]
    fn every_kind_goes_through_its_points_and_rests_outside() {
        for between in [Between::Held, Between::Straight, Between::Smooth] {
            let points = Points::new(AT.to_vec(), between);
            for [time, value] in AT {
                assert!((points.sample(time) - value).abs() < 1e-12, "{between:?}");
            }
            assert_eq!([points.sample(0.0), points.sample(9.0)], [0.0, -1.0]);
        }
        let straight = Points::new(AT.to_vec(), Between::Straight);
        assert_eq!(
            [1.5, 2.25, 4.5].map(|t| straight.sample(t)),
            [0.5, 2.5, 1.5]
        );
        let held = Points::new(AT.to_vec(), Between::Held);
        assert_eq!([1.99, 2.49, 3.0].map(|t| held.sample(t)), [0.0, 1.0, 4.0]);
    }

    #[test]
    fn smooth_has_one_slope_at_each_point_and_stays_between_its_points() {
        let smooth = Points::new(AT.to_vec(), Between::Smooth);
        let rate = |t: f64, h: f64| (smooth.sample(t + h) - smooth.sample(t)) / h;
        for (i, [time, _]) in AT.iter().enumerate() {
            let (left, right) = (rate(*time, -1e-6), rate(*time, 1e-6));
            assert!((left - right).abs() < 1e-3, "point {i}: {left} {right}");
        }
        // Rest at both ends.
        assert!(rate(1.0, 1e-6).abs() < 1e-3 && rate(5.0, -1e-6).abs() < 1e-3);
        for pair in AT.windows(2) {
            let (low, high) = (pair[0][1].min(pair[1][1]), pair[0][1].max(pair[1][1]));
            for k in 0..=100 {
                let t = pair[0][0] + (pair[1][0] - pair[0][0]) * f64::from(k) / 100.0;
                let value = smooth.sample(t);
                assert!(
                    (low - 1e-9..=high + 1e-9).contains(&value),
                    "{value} at {t} s"
                );
            }
        }
        // The harmonic mean of (5): slopes 1 over 1 s and 6 over 0.5 s.
        let share = (1.0 + 2.0 * 0.5) / (3.0 * 1.5);
        assert!((smooth.slope[1] - 6.0 / (share * 1.0 + (1.0 - share) * 6.0)).abs() < 1e-12);
    }

    #[test]
    fn points_out_of_order_are_named() {
        assert!(mistake(&AT).is_none());
        assert!(mistake(&[]).is_some());
        assert!(mistake(&[[1.0, 0.0], [1.0, 2.0]]).is_some_and(|m| m.contains("entry 2")));
        assert!(mistake(&[[f64::NAN, 0.0]]).is_some_and(|m| m.contains("entry 1")));
    }
}
